"""The file to start from generates and solves as it is, and so do the lines in it that are comments."""

import re
from pathlib import Path

import pytest
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.cli import gen, tool
from gqm_sym.specfile import starter


def test_it_generates_and_solves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two commands lead from no file to digits."""
    monkeypatch.chdir(tmp_path)
    assert gen.main(["--init", "first"]) == 0
    assert capsys.readouterr().out == "wrote first.yaml\n"
    assert gen.main(["first.yaml", "--solve"]) == 0
    said = capsys.readouterr().out
    assert "a = 1.4 m (140 cm) size of the bowl" in " ".join(said.split())
    assert "kind            libration" in said


def test_nothing_is_overwritten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file of that name stays as it is, and a name that no module can have creates none."""
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text("mine")
    assert gen.main(["--init", "mine"]) == 2
    assert Path("mine.yaml").read_text() == "mine"
    assert gen.main(["--init", "../up"]) == 2
    assert "cannot be a name" in capsys.readouterr().err
    assert gen.main(["--init", "other", "mine.yaml"]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["mine.yaml"]


KEYS = ("parametric", "polar", "family", "rotating_frame", "rolling", "direction", "t_max", "contact")
COMMENTED = re.findall(rf"^ +# ((?:{'|'.join(KEYS)}): .*)$", starter("a"), re.MULTILINE)


@pytest.mark.parametrize("line", COMMENTED)
def test_what_is_commented_out_is_right(line: str, tmp_path: Path) -> None:
    """Each commented line may replace the line beside it, or be added to it."""
    text = starter("a").replace(f"# {line}", line)
    if line.startswith(("parametric", "polar", "family")):
        text = "\n".join(row for row in text.split("\n") if not row.startswith("  graph:"))
    path = tmp_path / "a.yaml"
    path.write_text(text)
    spec = gqm.read_spec(path)
    spec.check_solvable(spec.derive())


def test_all_of_them_are_found() -> None:
    """The pattern above finds all commented lines."""
    assert len(COMMENTED) == len(KEYS)


@pytest.mark.extended
def test_the_path_of_a_first_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each step of the documentation's first page works in its order: file, module, figure, report, sweep."""
    page = (ROOT / "docs" / "start.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    for language, block in re.findall(r"^```(sh|yaml)\n(.*?)^```", page, re.MULTILINE | re.DOTALL):
        if language == "yaml":
            Path("periods.yaml").write_text(block, encoding="utf-8")
            continue
        for program, *arguments in map(str.split, block.splitlines()):
            assert {"gqm": tool.main, "gqm-gen": gen.main}[program](arguments) == 0
    assert capsys.readouterr().err == ""
    made = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.suffix != ".pyc"}
    assert made >= {"bowl.yaml", "generated/bowl.py", "bowl.svg", "bowl.html", "periods.nc"}


def test_the_commands_of_the_readme(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each command of the README runs in its order, with the file that is shown above them."""
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    (shown,) = re.findall(r"^```yaml\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    monkeypatch.chdir(tmp_path)
    Path("curves").mkdir()
    Path("curves/parabola.yaml").write_text(shown, encoding="utf-8")
    Path("periods.yaml").write_text("curve: curves/parabola.yaml\nquantities: [period]\ngrid: {a: [0.5, 1]}\n")
    Path("stairwell.yaml").write_text("curve: curves/parabola.yaml\ndata: swings.csv\nfree: {a: null}\n")
    Path("swings.csv").write_text("t,lam\n0.1,-0.0167\n0.2,0.2633\n0.3,0.5138\n")
    for program, *arguments in (line.split("#")[0].split() for line in re.findall(r"^gqm.*", page, re.MULTILINE)):
        assert {"gqm": tool.main, "gqm-gen": gen.main}[program](arguments) == 0
    assert capsys.readouterr().err == ""
    assert {path.name for path in tmp_path.iterdir()} >= {"mine.yaml", "bowl.svg", "parabola.html", "periods.nc"}
