"""These tests check what the commands print and write, and how they end."""

import io
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import mpmath
import pytest

from gqm_sym.cli import exits, gen, tool
from gqm_sym.declare.families import names
from gqm_sym.kernels import KERNELS

PENDULUM = """\
name: swing
title: Pendulum
curve:
  family: {name: circle, L: L}
kernel:
  gravity: {}
parameters:
  L: {value: 1, unit: m, description: length}
launch: {lam0: 1.2}
"""
PARABOLA = """\
name: bowl
curve:
  graph: {z: a*x**2}
kernel:
  gravity: {}
parameters: {a: null}
"""


class Outcome(NamedTuple):
    """The exit code and the output of a command."""

    code: int
    out: str
    err: str


class Commands:
    """A folder in which commands run, within this process."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.folder = folder
        self._capsys = capsys

    def gen(self, *arguments: str) -> Outcome:
        """Run `gqm-gen`."""
        return self._run(gen.main, arguments)

    def gqm(self, *arguments: str) -> Outcome:
        """Run `gqm`."""
        return self._run(tool.main, arguments)

    def _run(self, main: Callable[[list[str]], int], arguments: tuple[str, ...]) -> Outcome:
        self._capsys.readouterr()
        code = main(list(arguments))
        said = self._capsys.readouterr()
        assert "Traceback" not in said.err
        return Outcome(code, said.out, said.err)

    def files(self) -> list[str]:
        """Return all files in the folder, hidden ones included."""
        found = (path for path in self.folder.rglob("*") if path.is_file())
        return sorted(path.relative_to(self.folder).as_posix() for path in found)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Commands:
    """Return a folder with two right curve files in which commands run."""
    monkeypatch.chdir(tmp_path)
    Path("swing.yaml").write_text(PENDULUM)
    Path("bowl.yaml").write_text(PARABOLA)
    return Commands(tmp_path, capsys)


# -- gqm-gen ---------------------------------------------------------------------------------


def test_closed_forms_and_the_file_are_named(here: Commands) -> None:
    """The output has the closed forms, the parameters with what is known of them, and the file written."""
    code, out, err = here.gen("swing.yaml")
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert (code, err) == (0, "")
    assert lines[0] == "swing: Pendulum"
    assert "ds/dtheta = L" in lines
    assert "kappa = 1/L" in lines
    assert "L = 1 m length" in lines
    assert "g = 9.81" in lines
    assert lines[-1] == f"wrote generated{os.sep}swing.py"
    assert here.files() == ["bowl.yaml", "generated/swing.py", "swing.yaml"]


def test_a_parameter_without_a_value_is_shown_so(here: Commands) -> None:
    """A null among the parameters is shown as a value that is required at run time."""
    lines = [" ".join(line.split()) for line in here.gen("bowl.yaml").out.splitlines()]
    assert "a to be given at run time" in lines


def test_a_second_run_writes_nothing(here: Commands) -> None:
    """A current file is left as it is, including its time of change."""
    here.gen("swing.yaml")
    before = Path("generated/swing.py").stat().st_mtime_ns
    assert here.gen("swing.yaml").out.endswith(f"generated{os.sep}swing.py is current\n")
    assert Path("generated/swing.py").stat().st_mtime_ns == before


def test_stdout_is_what_would_be_written(here: Commands) -> None:
    """--stdout prints the module and nothing else, and writes no file."""
    printed = here.gen("--stdout", "swing.yaml")
    assert here.files() == ["bowl.yaml", "swing.yaml"]
    here.gen("--quiet", "swing.yaml")
    assert printed == (0, Path("generated/swing.py").read_text(), "")


def test_another_folder(here: Commands) -> None:
    """-o names the folder, which is created if it is missing."""
    assert here.gen("-q", "-o", "deep/er", "swing.yaml", "bowl.yaml") == (0, "", "")
    assert here.files() == ["bowl.yaml", "deep/er/bowl.py", "deep/er/swing.py", "swing.yaml"]


def test_check_goes_through_all_states(here: Commands) -> None:
    """--check is right for a file that is missing, written, changed at its source, generated again, edited, and
    forced.
    """
    module = Path("generated/swing.py")
    missing = here.gen("--check", "swing.yaml")
    assert missing.code == 1
    assert "is missing" in missing.err
    assert not module.exists()
    assert here.gen("-q", "swing.yaml").code == 0
    assert here.gen("--check", "swing.yaml") == (0, f"{module} is current\n", "")
    assert here.gen("--check", "-q", "swing.yaml") == (0, "", "")

    Path("swing.yaml").write_text(PENDULUM.replace("value: 1,", "value: 2,"))
    before = module.read_text()
    outdated = here.gen("--check", "--diff", "swing.yaml")
    assert outdated.code == 1
    assert outdated.err == (
        f"{module}: differs from what swing.yaml gives; write it with gqm-gen -o generated swing.yaml\n"
    )
    assert outdated.out.startswith("--- ")
    assert "'2'" in outdated.out
    assert module.read_text() == before
    assert here.gen("--check", "swing.yaml").out == ""
    assert here.gen("-q", "swing.yaml").code == 0
    assert here.gen("--check", "swing.yaml").code == 0

    edited = module.read_text().replace("sin(", "cos(", 1)
    module.write_text(edited)
    assert here.gen("--check", "swing.yaml").code == 1
    refused = here.gen("-q", "swing.yaml")
    assert refused.code == 2
    assert "--force" in refused.err
    assert module.read_text() == edited
    assert here.gen("-q", "--force", "swing.yaml") == (0, "", "")
    assert here.gen("--check", "swing.yaml").code == 0


def test_check_looks_at_every_file(here: Commands) -> None:
    """One outdated file of several fails the check, and the others are named too."""
    here.gen("-q", "swing.yaml")
    checked = here.gen("--check", "swing.yaml", "bowl.yaml")
    assert checked.code == 1
    assert "swing.py is current" in checked.out
    assert "bowl.py: is missing" in checked.err


def test_latex(here: Commands) -> None:
    """--latex writes the closed forms beside the module, with balanced braces."""
    told = here.gen("--latex", "out/swing.tex", "swing.yaml").out
    assert "wrote out/swing.tex\n" in told
    text = Path("out/swing.tex").read_text()
    assert text.startswith("% Made by gqm-gen for swing; needs amsmath.\n\\[\n")
    assert text.endswith("\\]\n")
    assert text.count("{") == text.count("}")
    assert r"\frac{ds}{d\theta} &= L" in text


def test_solve_prints_the_table(here: Commands) -> None:
    """--solve runs the launch of the file: its kind, times, legs and events, with error bounds."""
    code, out, err = here.gen("--solve", "--quiet", "swing.yaml")
    assert (code, err) == (0, "")
    rows = [line.split() for line in out.splitlines()]
    with mpmath.workdps(30):
        modulus = mpmath.sin(mpmath.mpf("0.6"))
        half = 2 * mpmath.sqrt(1 / mpmath.mpf("9.81")) * mpmath.ellipk(modulus**2)
    assert ["kind", "libration"] in rows
    (printed,) = (row[2] for row in rows if row[:2] == ["half", "period"])
    assert float(printed) == pytest.approx(float(half), rel=2.3e-16)
    (titles,) = (row for row in rows if row[:1] == ["event"])
    assert titles == ["event", "t", "theta", "x", "z", "v", "N", "error", "bound"]
    events = [row for row in rows[rows.index(titles) :] if row[:1] == ["turn"]]
    assert [len(row) for row in events] == [8, 8]
    assert float(events[0][1]) == pytest.approx(float(half), rel=1e-15)
    assert float(events[0][2]) == pytest.approx(-1.2, rel=1e-15)


CURVE = "  family: {name: circle, L: L}"
REFUSED: dict[str, tuple[str, tuple[str, ...]]] = {
    "unknown key": (PENDULUM + "colour: red\n", ("swing.yaml:10:1: ",)),
    "undefined symbol": (PENDULUM.replace("L: L", "L: R"), ("swing.yaml:4:29: ", "swing.yaml:8:3")),
    "unused symbol": (PENDULUM.replace("launch", "  q: 3\nlaunch"), ("swing.yaml:9:3: ",)),
    "keyword": (PENDULUM.replace("swing", "import"), ("swing.yaml:1:7: ",)),
    "no launch": (PENDULUM.partition("launch")[0], ("swing.yaml:1:1: launch is missing",)),
    "no value": (PENDULUM.replace("value: 1,", "value: null,"), ("swing.yaml:8:3: parameters.L",)),
    "outside the domain": (
        PENDULUM.replace(CURVE, "  graph: {z: L*sin(x), domain: [0, 1]}"),
        ("swing.yaml:9:16: launch.lam0: 1.2 is outside the curve's domain",),
    ),
    "negative speed": (
        PENDULUM.replace("lam0: 1.2", "lam0: 1.2, v0: -1"),
        ("swing.yaml:9:25: launch.v0: must not be negative",),
    ),
    "NaN": (PENDULUM.replace("1.2", ".nan"), ("swing.yaml:9:16: ",)),
    "infinity": (PENDULUM.replace("1.2", "-.inf"), ("swing.yaml:9:16: ",)),
    "text for a number": (PENDULUM.replace("value: 1,", "value: long,"), ("swing.yaml:8:14: ",)),
    "negative length": (PENDULUM.replace("value: 1,", "value: -1,"), ("swing.yaml:8:3: ",)),
    "duplicate key": (PENDULUM + "name: other\n", ("swing.yaml:10:1: ",)),
    "empty": ("", ("swing.yaml:1:1: the file is empty",)),
    "binary": ("\0\1\2", ("swing.yaml:1:1: the file is binary",)),
    "two at once": (
        PENDULUM.replace("lam0: 1.2", "lam0: here") + "colour: red\n",
        ("swing.yaml:9:16: ", "swing.yaml:10:1: "),
    ),
}


@pytest.mark.parametrize("case", REFUSED.values(), ids=REFUSED.keys())
def test_bad_input_ends_with_2_and_writes_nothing(case: tuple[str, tuple[str, ...]], here: Commands) -> None:
    """Each mistake is one line on stderr, and no file is touched."""
    text, beginnings = case
    Path("swing.yaml").write_text(text)
    code, out, err = here.gen("--solve", "swing.yaml")
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == len(beginnings)
    for line, beginning in zip(err.splitlines(), beginnings, strict=True):
        assert line.startswith(beginning)
    assert here.files() == ["bowl.yaml", "swing.yaml"]


def test_mistakes_of_all_files_come_together(here: Commands) -> None:
    """All mistakes of several files are reported, also missing files, and right files are not written."""
    Path("one.yaml").write_text(PENDULUM.replace("swing", "1"))
    Path("two.yaml").write_text(PENDULUM.replace("gravity", "levity"))
    code, _, err = here.gen("one.yaml", "missing.yaml", ".", "swing.yaml", "two.yaml")
    assert code == 2
    assert [line.split(":")[0] for line in err.splitlines()] == [*("one.yaml", "missing.yaml", ".", "two.yaml")]
    assert not Path("generated").exists()


def test_two_files_of_one_name(here: Commands) -> None:
    """Two files that would give the same module are refused, and both are named."""
    Path("copy.yaml").write_text(PENDULUM)
    code, _, err = here.gen("swing.yaml", "copy.yaml")
    assert code == 2
    assert err.startswith("copy.yaml:1:7: name: swing is also the name in swing.yaml")
    assert not Path("generated").exists()


def test_a_title_runs_nothing(here: Commands) -> None:
    """A title that would end the docstring is only text in the module."""
    title = '"""; import os; os.mkdir("hacked") #\\'
    Path("swing.yaml").write_text(PENDULUM.replace("Pendulum", f"'{title}'"))
    module = here.gen("--stdout", "swing.yaml").out
    compiled = compile(module, "swing.py", "exec")
    assert "hacked" in (compiled.co_consts[0] or "")
    assert "os" not in compiled.co_names


MISUSE = {
    "nothing": (),
    "an unknown option": ("--colour", "swing.yaml"),
    "--diff alone": ("--diff", "swing.yaml"),
    "--check and --stdout": ("--check", "--stdout", "swing.yaml"),
    "--check and --solve": ("--check", "--solve", "swing.yaml"),
    "--check and --latex": ("--check", "--latex", "a.tex", "swing.yaml"),
    "--stdout of two": ("--stdout", "swing.yaml", "bowl.yaml"),
    "--latex of two": ("--latex", "a.tex", "swing.yaml", "bowl.yaml"),
}


@pytest.mark.parametrize("arguments", MISUSE.values(), ids=MISUSE.keys())
def test_misuse_ends_with_2(arguments: tuple[str, ...], here: Commands) -> None:
    """Options that make no sense together are refused before anything is read."""
    code, out, err = here.gen(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith("usage: gqm-gen")
    assert here.files() == ["bowl.yaml", "swing.yaml"]


def test_a_folder_that_cannot_be(here: Commands) -> None:
    """If nothing can be written to the folder, one line says so."""
    Path("taken").write_text("a file")
    code, _, err = here.gen("-q", "-o", "taken", "swing.yaml")
    assert code == 2
    assert err.startswith("gqm-gen: taken")
    assert Path("taken").read_text() == "a file"


def test_an_interruption_ends_with_130(here: Commands, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C is not an error of the input, and shows no traceback."""

    def interrupted(options: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(gen, "_run", interrupted)
    assert here.gen("swing.yaml") == (130, "", "gqm-gen: interrupted\n")


def test_an_unforeseen_error_is_one_line_too(here: Commands, monkeypatch: pytest.MonkeyPatch) -> None:
    """An unforeseen error ends with exit code 3 and says where to look."""

    def broken(options: object) -> int:
        return 1 // 0

    monkeypatch.setattr(gen, "_run", broken)
    code, out, err = here.gen("swing.yaml")
    assert (code, out) == (3, "")
    assert err.startswith("gqm-gen: internal error (test_cli.py:")


# -- gqm -------------------------------------------------------------------------------------


def test_gqm_solve_replaces_and_asks(here: Commands) -> None:
    """The options replace launch and parameters and request states; nothing is written."""
    code, out, err = here.gqm(*("solve", "bowl.yaml", "--set", "a=1/2", "--lam0=-1/4", "--v0", "0.5", "--at", "0"))
    assert (code, err) == (0, "")
    rows = [line.split() for line in out.splitlines()]
    assert ["kind", "libration"] in rows
    (state,) = (row for row in rows if row[:1] == ["at"])
    assert [float(cell) for cell in state[1:5]] == pytest.approx([0, -0.25, -0.25, 0.03125])
    assert float(state[5]) == pytest.approx(0.5, rel=1e-14)
    assert here.files() == ["bowl.yaml", "swing.yaml"]


WRONG_SOLVES = {
    "no launch": (("bowl.yaml",), "bowl.yaml:1:1: launch is missing"),
    "no place": (("bowl.yaml", "--set", "a=1"), "gqm: lam0: not given"),
    "no such parameter": (("swing.yaml", "--set", "R=1"), "gqm: --set R=1: must be NAME=NUMBER"),
    "no number": (("swing.yaml", "--set", "L"), "gqm: --set L: must be NAME=NUMBER"),
    "negative speed": (("swing.yaml", "--v0=-1"), "gqm: v0: "),
    "no expression": (("swing.yaml", "--lam0=1+"), "gqm: lam0: "),
}


@pytest.mark.parametrize("case", WRONG_SOLVES.values(), ids=WRONG_SOLVES.keys())
def test_gqm_solve_refuses(case: tuple[tuple[str, ...], str], here: Commands) -> None:
    """An impossible launch ends with 2 and one line or two."""
    arguments, beginning = case
    code, out, err = here.gqm("solve", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(beginning)


def test_gqm_schema_is_json(here: Commands) -> None:
    """The schema can be read back, and knows the sections."""
    code, out, err = here.gqm("schema")
    assert (code, err) == (0, "")
    assert set(json.loads(out)["properties"]) == {*("name", "title", "curve", "kernel", "parameters", "launch")}


def test_gqm_lists_what_there_is(here: Commands) -> None:
    """Every family and every kernel of the tables is listed, by the name to write."""
    families = here.gqm("families").out
    assert [line.partition("(")[0] for line in families.splitlines()[::3]] == list(names())
    kernels = here.gqm("kernels").out
    assert [line.split(":")[0].strip() for line in kernels.splitlines()[1:]] == list(KERNELS)


def test_gqm_without_a_command(here: Commands) -> None:
    """A command is required."""
    code, out, err = here.gqm()
    assert (code, out) == (2, "")
    assert err.startswith("usage: gqm")


# -- as programs -----------------------------------------------------------------------------


def test_help_loads_nothing_heavy() -> None:
    """--help answers without SymPy, numba or pydantic."""
    script = (
        "import sys\n"
        "from gqm_sym.cli import gen, tool\n"
        "codes = [gen.main(['--help']), tool.main(['solve', '--help'])]\n"
        "heavy = {'sympy', 'numba', 'numpy', 'pydantic', 'ruamel'} & set(sys.modules)\n"
        "sys.exit(str((codes, heavy)) if any(codes) or heavy else 0)\n"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert "usage: gqm-gen" in run.stdout


def test_a_reader_that_leaves_is_no_error() -> None:
    """When the reader of the output is gone, the command ends quietly."""
    script = "import sys\nfrom gqm_sym.cli import tool\nsys.exit(tool.main(['schema']))\n"
    reader, writer = os.pipe()
    os.close(reader)
    run = subprocess.run([sys.executable, "-c", script], stdout=writer, stderr=subprocess.PIPE, check=False)
    os.close(writer)
    assert run.returncode == 141
    assert run.stderr == b""


# -- pictures --------------------------------------------------------------------------------


@pytest.mark.extended
@pytest.mark.parametrize(("ending", "begins"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")])
def test_a_figure_in_each_format(here: Commands, ending: str, begins: bytes) -> None:
    """Both commands write the same figure, and the same bytes when repeated."""
    assert here.gen("-q", "--plot", f"one.{ending}", "swing.yaml") == (0, "", "")
    assert Path(f"one.{ending}").read_bytes().startswith(begins)
    drawn = here.gqm("plot", "swing.yaml", f"two.{ending}", "--what", "speed_and_force", "--v0", "1")
    assert drawn == (0, f"wrote two.{ending}\n", "")
    assert Path(f"two.{ending}").read_bytes().startswith(begins)
    if ending != "svg":  # whose identifiers differ
        here.gqm("plot", "swing.yaml", f"three.{ending}")
        assert Path(f"three.{ending}").read_bytes() == Path(f"one.{ending}").read_bytes()


def test_a_figure_of_no_known_format(here: Commands) -> None:
    """The message lists the known endings, and nothing is drawn."""
    code, _, err = here.gqm("plot", "swing.yaml", "swing.gif")
    assert (code, err) == (
        2,
        "gqm: swing.gif: the format of the figure is unknown; use a name that ends in .png, .svg, .pdf\n",
    )
    assert not Path("swing.gif").exists()
    assert here.gqm("plot", "bowl.yaml", "bowl.png").code == 2


def test_what_a_figure_goes_with(here: Commands) -> None:
    """A figure of a motion needs the module that is written and a possible launch; otherwise no motion is drawn."""
    for option in ("--check", "--stdout"):
        code, _, err = here.gen("--plot", "one.png", option, "swing.yaml")
        assert (code, err.splitlines()[-1]) == (
            2,
            "gqm-gen: error: --plot: runs the module that is written; leave out --check and --stdout",
        )
    assert here.gen("--plot", "one.png", "swing.yaml").out.endswith("wrote one.png\n")
    Path("arch.yaml").write_text(
        "name: arch\ncurve: {family: {name: cycloid, R: 1}}\nkernel: {gravity: {}}\n"
        "launch: {lam0: 0, v0: 1, direction: -1}\n"
    )
    code, _, err = here.gen("-q", "--solve", "arch.yaml")
    assert code == 2
    assert err.startswith("arch.yaml:4:16: launch.lam0: 0.0 is the cusp itself, and the motion would leave through it")


def test_what_ends_a_command(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """An expression that is nested too deeply or too large for memory ends the command with one line."""
    monkeypatch.setattr("sys.stdout", io.StringIO())  # the message cannot say how to write what is missing
    for error, what in ((RecursionError(), "nested too deeply"), (MemoryError(), "too large")):

        def work(error: BaseException = error) -> int:
            raise error

        assert exits.guarded("gqm", work) == exits.FAILED
        assert capsys.readouterr().err == f"gqm: an expression is {what}; write it in a simpler form\n"
