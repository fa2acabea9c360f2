"""Files and texts meant to do harm run no code, read nothing outside their folder, and take little time and memory."""

import ast
import contextlib
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from confined import confined
from emitted import audit, declared
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from selection import examples

import gqm_sym as gqm
from gqm_sym.building import write_module, write_text
from gqm_sym.cli import gen, tool
from gqm_sym.errors import BudgetError, DeclarationError, EmissionError, GQMError, InputError, SpecFileError
from gqm_sym.expressions import read_expression

FILE = """\
name: track
title: {title}
curve:
  graph: {{z: {z}, parameter: x}}
kernel: {{{kernel}}}
parameters: {{h: {{value: {value}, unit: {unit}, description: {description}}}}}
launch: {{lam0: {lam0}}}
"""
PLAIN = {
    "title": "t",
    "z": "h*x**2",
    "kernel": "gravity: {}",
    "value": "1",
    "unit": "1/m",
    "description": "d",
    "lam0": "1/2",
}


def quoted(text: str) -> str:
    """Write text as YAML that means exactly it."""
    escapes = (c if c.isascii() and c.isprintable() and c not in '"\\' else f"\\U{ord(c):08X}" for c in text)
    return f'"{"".join(escapes)}"'


def file(**changes: str) -> str:
    """Write a curve file, some of whose entries are replaced by a text."""
    return FILE.format(**PLAIN | {key: quoted(text) for key, text in changes.items()})


@pytest.fixture
def yaml(tmp_path: Path) -> Callable[[str | bytes], Path]:
    """Write a curve file."""

    def write(text: str | bytes) -> Path:
        path = tmp_path / "a.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


@pytest.fixture
def witness(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the file that code in the input would create, in the folder in which it would run."""
    monkeypatch.chdir(tmp_path)
    return tmp_path / "pwned"


RUNS = "open('pwned', 'w')"
# These texts would run code, or reach further than arithmetic.
CODE = {
    "import": "__import__('os').system('touch pwned')",
    "attributes": "().__class__.__base__.__subclasses__()",
    "attributes of a name": "x.__class__.__mro__",
    "attributes of a number": "(1).real",
    "a lambda": f"(lambda: {RUNS})()",
    "an f-string": f"f'{{{RUNS}}}'",
    "a call": RUNS,
    "a walrus": f"(x := {RUNS})",
    "a comprehension": f"[{RUNS} for _ in (1,)][0]",
    "builtins": "__builtins__['open']('pwned', 'w')",
    "eval": f'eval("{RUNS}")',
    "a subscript": "x[0]",
    "a decorator": "@x",
    "a statement": f"x; {RUNS}",
    "a line": f"x\n{RUNS}",
    "a comment": f"x # {RUNS}",
    "a template": "{{ x.__class__ }}{% for i in x %}",
    "a name of SymPy's": "Symbol('x').func",
    "a private name": "_x + __class__",
}
# These texts would take all time or memory.
GIANTS = {
    "a tower": "9**9**9**9",
    "a tower of names": "x**9**9**9**9",
    "a tower by functions": "exp(exp(exp(exp(9))))",
    "a power of a power": "(9**999)**999",
    "a power of a sum": "((x + h)**32)**32*h",
    "many digits": "9" * 100_000,
    "a long exponent": "1e" + "9" * 100_000,
    "parentheses": "(" * 100_000,
    "signs": "-" * 100_000 + "x",
    "powers": "x**" * 1000 + "x",
    "functions": "sin(" * 800 + "x" + ")" * 800,
    "roots of large numbers": "*".join(f"sqrt({10**380 + 2 * k + 1})" for k in range(9)),
    "functions and their inverses": "h*x + " + "+".join(f"asin(sin({k}))" for k in range(250)),
    "angles": "h*x + " + "+".join(f"cos({k}*pi/9973)" for k in range(200)),
    "signs of sums": "h*x + " + "+".join(f"abs(sqrt(2)-{k}/7)" for k in range(200)),
}
# These texts are not what they look like.
LOOKS = {
    "Cyrillic": "\u0445**2",
    "Greek": "\u03c7*h",
    "full width": "\uff58**2",
    "a wide digit": "x**\uff12",
    "another minus": "h\u2212x",
    "bidirectional": "x\u202e2**\u202c",
    "isolates": "\u2066x\u2069*h",
    "an invisible letter": "x\u200b",
    "a combining mark": "x\u0301",
    "a soft hyphen": "x\u00ad",
    "a script letter": "\U0001d465**2",
    "an escape": "x\x1b[31m",
    "a null": "x\0",
}
ATTACKS = {**CODE, **GIANTS, **LOOKS}


@pytest.mark.sample(24)
@pytest.mark.parametrize("key", ["z", "value", "lam0"])
@pytest.mark.parametrize("attack", ATTACKS)
def test_no_expression_does_harm(
    attack: str, key: str, yaml: Callable[[str | bytes], Path], witness: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """An attack in place of any expression is read as arithmetic or refused at once; the command then exits with 2."""
    path = yaml(file(**{key: ATTACKS[attack]}))
    refused = ""
    with confined():
        try:
            gqm.read_spec(path)
        except SpecFileError as error:
            refused = str(error)
    assert refused or attack in GIANTS
    assert not witness.exists()
    # A text that took too long may take less time when repeated, because SymPy caches results.
    if refused and "not done after" not in refused:
        assert gen.main(["-o", str(path.parent / "out"), str(path)]) == 2
        assert [entry.name for entry in path.parent.iterdir()] == ["a.yaml"]
        printed = capsys.readouterr()
        assert printed.out == ""
        assert printed.err.replace("\n", "").isprintable()


@pytest.mark.sample(5)
@pytest.mark.parametrize("attack", ATTACKS)
def test_no_expression_does_harm_in_python(attack: str, witness: Path) -> None:
    """In Python too, a curve, a potential and an argument of a family are read as arithmetic only."""
    text = ATTACKS[attack]
    for declare in (
        lambda: gqm.Curve.graph(text, parameter="x"),
        lambda: gqm.Potential(text),
        lambda: gqm.families.ellipse(a=text, b=1),
        lambda: gqm.CentralForce(k=text, centre=(text, 0)),
        lambda: read_expression(text, where="t"),
    ):
        refused = False
        with confined():
            try:
                declare()
            except (InputError, BudgetError):
                refused = True
        assert refused or attack in GIANTS
    assert not witness.exists()


DEEP = "".join(f"l{n}: &l{n} [{', '.join([f'*l{n - 1}'] * 9)}]\n" for n in range(1, 10))
TAGS = (
    "!!python/object/apply:os.system ['touch pwned']",
    "!!python/object/new:os.system ['touch pwned']",
    "!!python/name:os.system ''",
    "!!python/module:os ''",
    "!<tag:yaml.org,2002:python/object/apply:os.system> ['touch pwned']",
    "!!binary dG91Y2g=",
    "!!set {a, b}",
    "!!timestamp 2001-01-01",
    "!!float 1",
    "!include /etc/passwd",
    "!ENV HOME",
    "! x",
)
NAMES = [f"p{n}" for n in range(480)]
TREES = {
    "laughs": "l0: &l0 [a, b]\n" + DEEP + file(),
    "a tree within itself": "a: &a [*a]\n" + file(),
    "a merge": "a: &a {b: 1}\n<<: *a\n" + file(),
    **{f"tag {tag}": f"name: {tag}\n" for tag in TAGS},
    "a tag of one's own": "%TAG !e! tag:yaml.org,2002:python/\n---\nname: !e!name:os.system x\n",
    "nesting": "a:\n" + " [[[[[\n" * 5000,
    "nesting of keys": "".join(" " * n + "b:\n" for n in range(300)),
    "keys of keys": "? " * 3000,
    "lists": "- " * 3000,
    "a quote without end": "a: '" + "x\n" * 30_000,
    "a long line": "a: " + "x" * 60_000,
    "a text of many lines": "a: |\n" + "  x\n" * 15_000,
    "empty lines": "\n" * 65_000,
    "comments": "#\n" * 32_000,
    "documents": "---\n" * 16_000,
    "directives": "".join(f"%TAG !{n}! tag:x,2000:\n" for n in range(2500)) + "---\na: 1\n",
    "anchors": "".join(f"k{n}: &a{n} 1\n" for n in range(4000)),
    "one key": "a: 1\n" * 10_000,
    "keys": "".join(f"k{n}: 1\n" for n in range(6000)),
    "names without a value": FILE.format(**PLAIN | {"z": "+".join(NAMES)}),
    "names without a use": FILE.format(**PLAIN).replace("h: {", "".join(f"q{n}: 1, " for n in range(900)) + "h: {"),
    "names without either": FILE.format(**PLAIN | {"z": "+".join(NAMES)}).replace(
        "h: {", "".join(f"q{n}: 1, " for n in range(450)) + "h: {"
    ),
    "numbers that take time": FILE.format(**PLAIN).replace(
        "h: {", "".join(f"\n q{n}: {'+'.join(['atan(tan(7))'] * 300)}," for n in range(15)) + "h: {"
    ),
    "bytes": bytes(range(256)) * 100,
    "a compressed file": b"\x1f\x8b\x08\x00" + bytes(1000),
    "UTF-32": FILE.format(**PLAIN).encode("utf-32"),
    "half a character": b"name: \xf0\x9f\x98",
    "overlong": b"name: \xc0\xae",
    "a surrogate": b"name: \xed\xa0\x80",
}


@pytest.mark.sample(20)
@pytest.mark.parametrize("attack", TREES)
def test_no_tree_does_harm(
    attack: str, yaml: Callable[[str | bytes], Path], witness: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """YAML that would construct, repeat or nest objects is refused at once, with a message in printable text."""
    path = yaml(TREES[attack])
    with confined(), pytest.raises(SpecFileError):
        gqm.read_spec(path)
    assert gen.main([str(path)]) == 2
    assert capsys.readouterr().err.replace("\n", "").isprintable()
    assert not witness.exists()


NOT_NAMES = (
    *('x"', "x'", "x\n", "x #", "x*/", "x)", "x: Any = exit()", "x=1", "x, y", "x\\", "{{x}}", "{%x%}", "", " x"),
    *("__class__", "_x", "\u0445", "\u00e9", "x\u202e", "x\u200b", "\ufb01", "x\0", "x" * 3 + "\x1b[0m", "1x"),
    *("class", "lambda", "None", "sin", "pi", "lam0", "t_max", "point"),
)


@pytest.mark.parametrize("name", NOT_NAMES)
def test_names_are_identifiers(name: str, yaml: Callable[[str | bytes], Path]) -> None:
    """Text that is not a name is refused wherever a name can stand, so that nothing else gets into emitted code."""
    key = quoted(name)
    for text in (
        file().replace("h: {", f"{key}: 1, h: {{"),
        file().replace("name: track", f"name: {key}") if name not in {"sin", "pi", "lam0"} else "",
        file().replace("parameter: x", f"parameter: {key}"),
        file().replace("gravity: {}", f"gravity: {{}}, rolling: {{beta: {key}}}") if name != "pi" else "",
        file().replace("gravity: {}", f"{key}: {{}}"),
    ):
        with confined(), pytest.raises(SpecFileError):
            gqm.read_spec(yaml(text))


ESCAPES = (
    '"""\nimport os\n"""',
    "'''; import os; '''",
    "*/ --> ?> %> #} {{ 7*7 }} {% raw %}",
    "# no comment\\",
    "\\N{BULLET}\\x00\\",
    "$(touch pwned) `touch pwned` %(x)s {x} {0.__class__}",
    "\\input{pwned}\\write18{touch pwned}$^_&~%",
)


@pytest.mark.sample(3)
@pytest.mark.parametrize("text", ESCAPES, ids=range(len(ESCAPES)))
def test_text_for_people_stays_text(
    text: str, yaml: Callable[[str | bytes], Path], witness: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Title and description of one printable line change the docstring alone; others are refused."""
    spelled = {"title": text, "description": text}
    path = yaml(file(**spelled))
    if not text.isprintable():
        with pytest.raises(SpecFileError, match="printable"):
            gqm.read_spec(path)
        return
    out = path.parent / "out"
    assert gen.main(["-o", str(out), "--latex", str(path.parent / "t.tex"), str(path)]) == 0
    capsys.readouterr()
    hostile = audit((out / "track.py").read_text(encoding="utf-8"))
    plain = audit(gqm.emit(gqm.read_spec(yaml(file())).derive(), name="track"))
    assert [ast.dump(node) for node in hostile.body[1:]] == [ast.dump(node) for node in plain.body[1:]]
    compile(hostile, "track.py", "exec")
    assert "write18" not in (path.parent / "t.tex").read_text(encoding="utf-8")
    assert not witness.exists()


@cache
def _model() -> gqm.Model:
    return declared("k*u**2")


@cache
def _body_under(title: str) -> list[str]:
    """Return the syntax trees of what is in a module of that title, without its docstring."""
    tree = audit(gqm.emit(replace(_model(), title=title), name="hostile"))
    return [ast.dump(node) for node in tree.body[1:]]


@examples(25, otherwise=2)
@given(title=st.text(max_size=60))
def test_any_title_is_text(title: str) -> None:
    """A module has the same syntax tree under any title."""
    assert _body_under(title) == _body_under("plain")


FRAGMENTS = (
    *(
        "sin(",
        "asin(",
        "acosh(",
        "cbrt(",
        "exp(",
        "abs(",
        "sqrt(",
        ")",
        "))",
        ")**9",
        ")**32",
        "**-",
        "**",
        "/",
        "*",
        "-",
    ),
    *(
        "x",
        "h",
        "pi",
        "e",
        "9",
        "1/3",
        "1e300",
        "1e-300",
        "0",
        "7" * 380,
        "+",
        " ",
        "9**999",
        "(1/7)**",
        ": ",
        ", ",
        "}",
    ),
    *("{", "[", "]", "\n", "\n  ", "- ", "? ", "&a ", "*a", "!!x ", "|", "'", '"', "#", "null", "\u202e", "\u0445"),
)
fragments = st.lists(st.one_of(st.sampled_from(FRAGMENTS), st.text(max_size=3)), max_size=120).map("".join)


@examples(150)
@given(text=fragments)
def test_no_expression_takes_long(text: str) -> None:
    """Any text is read within a second and 200 MB, or refused."""
    with confined(), contextlib.suppress(GQMError):
        read_expression(text, where="t")


@settings(examples(100), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=fragments, start=st.integers(0, 200), cut=st.integers(0, 60))
def test_no_file_takes_long(text: str, start: int, cut: int, yaml: Callable[[str | bytes], Path]) -> None:
    """A file in which any part is replaced by anything is read within a second and 200 MB, or refused."""
    plain = FILE.format(**PLAIN)
    path = yaml((plain[:start] + text + plain[start + cut :]).encode("utf-8", "surrogatepass"))
    with confined(), contextlib.suppress(GQMError):
        gqm.read_spec(path)


# These expressions are short when read, and grow when they are derived or emitted.
GROWING = {
    "a chain": "sin(" * 24 + "x" + ")" * 24,
    "kinks": "abs(" * 20 + "x" + ")-1" * 20,
    "a quotient": "/".join(f"(x+{n})" for n in range(64)),
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("attack", GROWING)
def test_what_grows_is_given_up(attack: str) -> None:
    """A curve with formulas too large for memory is refused by a message that says where and what to do."""
    refused = (EmissionError, BudgetError, DeclarationError)
    with confined(30.0), pytest.raises(refused, match=r"by shorter expressions|a corner"):
        gqm.emit(gqm.derive(gqm.Curve.graph(GROWING[attack], parameter="x"), gqm.Gravity()), name="grown")


@pytest.mark.parametrize(
    "name", ["../up", "a/b", "/elsewhere/up", "..", ".", "a\\b", "C:up", "~", "$HOME", "con.", "a b"]
)
def test_no_name_leaves_its_folder(name: str, yaml: Callable[[str | bytes], Path]) -> None:
    """A module's file name is its name alone, which no path can enter."""
    path = yaml(file().replace("name: track", f"name: {quoted(name)}"))
    assert gen.main(["-q", "-o", str(path.parent / "in"), str(path)]) == 2
    assert [entry.name for entry in path.parent.iterdir()] == ["a.yaml"]


def test_links_in_the_output_folder(yaml: Callable[[str | bytes], Path], tmp_path: Path) -> None:
    """The target of a link is neither read into the output nor written, not even with force."""
    precious, out = tmp_path / "precious", tmp_path / "out"
    precious.write_text("precious\n", encoding="utf-8")
    out.mkdir()
    (out / "track.py").symlink_to(precious)
    path = yaml(file())
    assert gen.main(["-q", "-o", str(out), str(path)]) == 2
    assert gen.main(["-q", "--force", "-o", str(out), str(path)]) == 0
    assert precious.read_text(encoding="utf-8") == "precious\n"
    assert not (out / "track.py").is_symlink()
    (out / "track.py").unlink()
    (out / "track.py").symlink_to(tmp_path / "nowhere")
    assert gen.main(["-q", "-o", str(out), str(path)]) == 0
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/full", "/dev/null", "/dev", "/proc/self/mem", "a\0b"])
def test_devices_are_no_curve_files(device: str) -> None:
    """An endless file, or a device that is not a file, is refused after a bounded read."""
    with confined(), pytest.raises(SpecFileError):
        gqm.read_spec(device)
    with confined():
        assert gen.main(["-q", device]) == 2
        assert tool.main(["solve", device]) == 2


@pytest.mark.parametrize("device", ["/dev/full", "/dev/null"])
def test_devices_are_no_modules(device: str) -> None:
    """A module is not written to a device, and the device stays as it is."""
    for force in (False, True):
        with confined(), pytest.raises(InputError, match=rf"{device}: .*device"):
            write_module("x = 1\n", device, force=force)
    assert Path(device).is_char_device()


def test_a_link_to_what_has_no_end(yaml: Callable[[str | bytes], Path], tmp_path: Path) -> None:
    """A link in the output folder to a device or a pipe is not read; with force it is replaced."""
    os.mkfifo(tmp_path / "pipe")
    path = yaml(file())
    for end in ("/dev/zero", tmp_path / "pipe"):
        link = tmp_path / "out" / "track.py"
        link.parent.mkdir(exist_ok=True)
        link.symlink_to(end)
        arguments = ["-q", "-o", str(link.parent), str(path)]
        with confined():
            assert gen.main(["--check", *arguments]) == 1
            assert gen.main(arguments) == 2
            assert gen.main(["--force", *arguments]) == 0
        assert link.is_file()
        assert not link.is_symlink()
        link.unlink()


def test_a_write_to_a_folder_fails(tmp_path: Path) -> None:
    """If there is a folder in the place of the file, an error is raised, the folder stays, and no other files
    remain.
    """
    (tmp_path / "track.py").mkdir()
    with pytest.raises(OSError, match=r"track\.py"):
        write_text("x", tmp_path / "track.py")
    assert [entry.name for entry in tmp_path.iterdir()] == ["track.py"]


def test_the_recursion_limit_is_left_alone() -> None:
    """None of the tests above raises the limit that protects Python's stack."""
    assert sys.getrecursionlimit() <= 10_000
