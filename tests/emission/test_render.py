"""Emitted text holds what it may and refuses the rest, and its numbers are those of the declaration."""

import ast
import dataclasses
import re
from collections.abc import Callable
from pathlib import Path

import pytest
import sympy as sp
from emitted import audit, check_numbers, declared, interpreted, oracle
from mpmath import mp, mpf
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.derivation import Model
from gqm_sym.emission import body_digests
from gqm_sym.emission.render import INTERFACE
from gqm_sym.errors import EmissionError, ExpressionError, GQMError, InputError
from gqm_sym.loading import load_text
from gqm_sym.runtime import interface

# Formulas are evaluated to 60 digits, with some more for rounding.
EXACT = mpf("1e-56")

# This inner function is curved, and has values in (0.1, 0.7) at the places below.
W = "(u/2 + u**2/9)"
HEADS = {
    **{name: f"{name}{W}" for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")},
    **{name: f"{name}{W}" for name in ("asinh", "atanh", "exp", "log", "sqrt", "abs", "cot", "sec", "csc", "coth")},
    "acosh": f"acosh(1 + {W})",
    "ln": f"ln{W}",
    "cbrt": f"cbrt{W}",
    "kink": "abs(u - 3/5)*u",
    **{f"power {n}": f"{W}**({n})" for n in (2, 3, 4, 7, -1, -2, -3)},
    **{f"power {n}": f"{W}**({n})" for n in ("1/2", "3/2", "5/2", "-1/2", "-3/2", "1/3", "-7/5", "sqrt(2)", "-pi")},
    "parameter as exponent": f"{W}**k",
    "parameter as base": "k**u",
    "both": "u**u",
    "product": "sin(u)*exp(-k*u)*u/(1 + u**2)",
    "nested": "sin(exp(u/2)*cos(k*u))",
    "many digits": "3.14159265358979323846*u**2 + u/3.0000000000000000000001",
    "large": "1e30*u**2 + 12345678901234567890123*u",
    "small": "1e-30*u**2",
    "constants": "pi*u**2 + e*u + exp(2)",
}
# Compiling a module takes some seconds, so the others are run by Python; the test is of the printed text.
COMPILED = ("sin", "acosh", "power -7/5", "kink", "parameter as exponent", "both", "nested", "product")

# These are all names that emitted functions use for something of their own.
TAKEN = (
    "a",
    "b",
    "d",
    "da",
    "db",
    "i",
    "n",
    "p",
    "v2",
    "w0",
    "level",
    "places",
    "speeds",
    "offsets",
    "left",
    "right",
    "lo",
    "hi",
)

TITLES = (
    "quotes \" and '",
    '""" + __import__("os").system("true") + """',
    "'''\nimport os\n'''",
    "a backslash \\",
    '\\"""\\',
    "\\N{BULLET} \\x41 \\u0041",
    "lines\nof\r\ntext\x0b\x0c\x1c\u2028\x85end",
    "# a comment, */ an end --> of one ?> %> {{ title }} {% for x in y %} {# #}",
    "bidi \u202e\u2066reversed\u2069 \u200f",
    "zero \x00 width \u200b and \x1b[31m",
    "alone \ud800",
    "Bahn \N{LATIN SMALL LETTER U WITH DIAERESIS}ber \u4e2d\u6587",
    "   ",
)


def refuses(name: str) -> Model:
    """Derive a motion with a run-time parameter of that name whose functions need helpers."""
    return declared(f"cos(u) + {name}*u", **{name: "1"})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder for the modules of this file."""
    return tmp_path_factory.mktemp("emitted")


def test_the_interface_is_the_runtimes() -> None:
    """The emitter does not import the runtime, but writes for its present version."""
    assert INTERFACE == interface.INTERFACE


@pytest.mark.sample(3)
@pytest.mark.parametrize("head", HEADS)
def test_numbers_of_every_head(head: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Values, differences and bounds are those of the declared text; exact forms to 60 digits.

    Corners and powers without a side are refused in a curve, but the printer can write them.
    """
    for check in ("check_corners", "check_powers"):
        monkeypatch.setattr(f"gqm_sym.derivation.pipeline.{check}", lambda *_, **__: None)
    text = HEADS[head]
    values = {"k": 1.6875} if "k" in re.findall(r"\w+", text) else {}
    model = declared(text, **{name: str(value) for name, value in values.items()})
    name = f"head{list(HEADS).index(head)}"
    emitted = gqm.emit(model, name=name)
    module = load_text("", emitted, name) if head in COMPILED else interpreted(emitted, name)
    audit(emitted)
    check_numbers(module, text, values, kink=0.6 if head == "kink" else None)
    exact, place = module.MODEL.exact, mpf("0.375")
    with mp.workdps(60):
        p = (*(mpf(v) for v in values.values()), mpf("9.75"), mpf(2))
        z, slope, bend = oracle(text, ("u", *values))(place, *(mpf(v) for v in values.values()))
        ds = mp.sqrt(1 + slope**2)
        size = abs(z) + abs(slope) + abs(bend)
        for name, truth, scale in (
            ("x", place, 1),
            ("z", z, size),
            ("ds", ds, ds),
            ("kappa", bend / ds**3, size / ds**3),
            ("static_normal_load", p[-2] / ds, p[-2] / ds),
            ("effective_potential", p[-2] * z, p[-2] * size),
            ("effective_potential_slope", p[-2] * slope, p[-2] * size),
        ):
            assert abs(getattr(exact, name)(mp, place, p) - truth) <= EXACT * scale, name
        assert module.MODEL.domain_of(mp, p) == (None, None, None)


def test_exact_domain(folder: Path) -> None:
    """Ends and period can be evaluated in any arithmetic, without rounding a rational number."""
    curve = gqm.Curve.parametric(x="cos(u)", z="sin(u)", parameter="u", domain=("-k/3", "e"), period="2*pi")
    module = gqm.build(gqm.derive(curve, gqm.Gravity(), parameters={"k": 1}), name="domain", folder=folder)
    with mp.workdps(60):
        low, high, period = module.MODEL.domain_of(mp, (mpf(1), mpf(1), mpf(1)))
        assert max(abs(low + mpf(1) / 3), abs(high - mp.e), abs(period - 2 * mp.pi)) <= EXACT


@pytest.mark.extended
def test_taken_names_as_parameters(folder: Path) -> None:
    """Run-time parameters may have all names of emitted code at once, and keep their meaning."""
    terms = (f"{name}*{f}" for name, f in zip(TAKEN, ("sin(u)", "exp(u)", "u**3", "cosh(u/2)") * 5, strict=False))
    values = {name: 0.5 + k / 8 for k, name in enumerate(TAKEN)}
    text = " + ".join(terms)
    model = declared(text, **{name: str(value) for name, value in values.items()})
    audit(gqm.emit(model, name="taken"))
    check_numbers(gqm.build(model, name="taken", folder=folder), text, values)


@pytest.mark.extended
def test_the_exponential_of_the_height_of_a_rolling_body(folder: Path) -> None:
    """The size of an exponential is itself: SymPy's absolute value wrote the exponent's real part, by atan2."""
    force = gqm.Potential("4*x**2 + exp(z)") + gqm.Rolling(radius="0.05", beta="0.4")
    module = gqm.build(gqm.derive(gqm.families.ellipse(a=2, b=1), force), name="exponential", folder=folder)
    start, places = -1.25, [-1.5, -1.75, -2.0]
    with mp.workdps(40):

        def height(theta: float) -> mpf:
            c, s = mp.cos(theta), mp.sin(theta)
            length = mp.sqrt(4 * s**2 + c**2)
            x, z = 2 * c - mpf("0.05") * c / length, s - mpf("0.05") * 2 * s / length
            return (4 * x**2 + mp.exp(z)) / mpf("1.4")

        for place, v2 in zip(places, module.pass1(places, start, 3.0).v2, strict=True):
            truth = 9 - 2 * (height(place) - height(start))
            assert abs(v2 - truth) <= 1e-14 * abs(height(place))


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["a", "b", "d", "da", "i", "n", "p", "w0", "v2", "places", "left", "lo", "lam", "x"])
def test_taken_names_as_the_curves_parameter(name: str) -> None:
    """The curve's parameter may have any of these names too."""
    text, values = f"k*cos({name}) + {name}**2/3", {"k": 1.5}
    emitted = gqm.emit(declared(text, parameter=name, k="1.5"), name="along")
    check_numbers(interpreted(emitted, "along"), text, values, name)


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    "name",
    [
        *("path_and_contact_force", "effective_potential", "potential_divdiff1", "potential_divdiff2", "bounds"),
        *("pass1", "solve", "op", "Any", "MODEL", "PARAMETERS", "BOUNDS", "carray", "compiled", "compiler", "range"),
        *("fabs", "place_from_ends", "Motion", "CompiledModel", "exact_z"),
        *("divdiff1_cos", "divdiff2_cos", "imul", "isin"),
    ],
)
def test_names_of_the_module_are_refused(name: str) -> None:
    """No parameter may have a name that the emitted module uses itself; the message gives the name."""
    with pytest.raises(EmissionError, match=rf"^{name}: "):
        gqm.emit(refuses(name), name="refused")


@pytest.mark.parametrize("name", ["lam", "lam0", "v0", "t_max", "contact", "quantity", "x", "z", "class", "sin", "pi"])
def test_reserved_names_never_come_so_far(name: str) -> None:
    """Names with another meaning are refused when they are declared."""
    with pytest.raises(GQMError, match=name):
        refuses(name)


@pytest.mark.sample(2)
@pytest.mark.parametrize("title", TITLES, ids=range(len(TITLES)))
def test_a_title_changes_the_docstring_alone(title: str) -> None:
    """Any title is text of one line within the docstring, and nothing else changes."""
    text = gqm.emit(declared("k*u**2", title=title), name="hostile")
    tree, plain = audit(text), audit(gqm.emit(declared("k*u**2", title="plain"), name="hostile"))
    line, rest = ast.get_docstring(tree, clean=False).split("\n", 1)
    assert rest == ast.get_docstring(plain, clean=False).split("\n", 1)[1]
    assert line == "".join(c if c.isprintable() else " " for c in title).replace('"', "'").rstrip()
    assert [ast.dump(node) for node in tree.body[1:]] == [ast.dump(node) for node in plain.body[1:]]
    assert all(c.isprintable() or c == "\n" for c in text)
    assert text.encode().decode() == text


@pytest.mark.parametrize(
    "name", ["", "1st", "a-b", "a b", 'x"\nimport os', "../up", "a.b", "class", "\u00e9t\u00e9", None, 3]
)
def test_a_modules_name_is_an_identifier(name: str) -> None:
    """A module's name is an identifier, so that nothing else gets into the header or into a file's name."""
    with pytest.raises(InputError, match="name: "):
        gqm.emit(declared("u**2"), name=name)


def test_the_same_model_gives_the_same_text() -> None:
    """Derived and emitted anew, a declaration gives the same bytes."""
    assert gqm.emit(declared("k*sin(u)/u"), name="again") == gqm.emit(declared("k*sin(u)/u"), name="again")


def test_the_body_digest() -> None:
    """The header states the digest of the text after it, which detects a changed character."""
    text = gqm.emit(declared("u**2"), name="digest")
    stated, actual = body_digests(text)
    assert stated == actual
    stated, actual = body_digests(text.replace("range(n)", "range( n)"))
    assert stated != actual
    assert body_digests("") is None
    assert body_digests("# Made by gqm-gen\n# nothing\n") is None


def test_the_input_digest() -> None:
    """The digest changes with every input of the module."""
    inputs = [
        gqm.emit(declared("k*u**2", k="1"), name="digest"),
        gqm.emit(declared("k*u**2", k="1"), name="other"),
        gqm.emit(declared("k*u**2", k="2"), name="digest"),
        gqm.emit(declared("k*u**2", k="1", title="A title"), name="digest"),
        gqm.emit(declared("k*u**2 + 1", k="1"), name="digest"),
        gqm.emit(declared("k*v**2", k="1", parameter="v"), name="digest"),
    ]
    digests = [re.search(r"input ([0-9a-f]{12}),", text).group(1) for text in inputs]
    assert len(set(digests)) == len(inputs)


@pytest.mark.sample(12)
@pytest.mark.parametrize(
    ("form", "name"),
    [
        (sp.I, "I"),
        (sp.zoo, "zoo"),
        (sp.nan, "nan"),
        (sp.oo, "oo"),
        (sp.Float("0.125"), "2.125000"),
        (sp.Catalan, "Catalan"),
        (sp.Function("f")(sp.Symbol("u", real=True)), "f"),
        (sp.Function("sin")(sp.Symbol("u", real=True)), "sin"),
        (sp.gamma(sp.Symbol("u", real=True)), "gamma"),
        (sp.Max(1, sp.Symbol("u", real=True)), "Max"),
        (sp.Piecewise((1, sp.Symbol("u", real=True) > 0), (2, True)), "Piecewise"),
        (sp.Symbol("stray", real=True), "stray"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
@pytest.mark.parametrize("where", ["x", "effective_potential_slope", "kappa"])
def test_a_model_without_text_is_refused_by_name(form: sp.Expr, name: str, where: str) -> None:
    """A model made by hand is refused by name where a derived one would have been."""
    with pytest.raises(EmissionError, match=rf"^{where}: {re.escape(name)}"):
        gqm.emit(dataclasses.replace(declared("u**2"), **{where: 2 + form}), name="refused")


@pytest.mark.parametrize("form", [sp.Function("f"), sp.gamma, sp.Heaviside, lambda u: u * sp.I, lambda u: u + sp.zoo])
def test_sympy_expressions_are_refused_where_they_are_declared(form: Callable[[sp.Symbol], sp.Expr]) -> None:
    """Undefined, complex and infinite expressions are refused before anything is derived."""
    with pytest.raises(ExpressionError, match="graph: z: "):
        gqm.Curve.graph(form(sp.Symbol("u")), parameter="u")


@pytest.mark.parametrize("text", ["1e400*u", "1e-400*u"])
def test_numbers_beyond_doubles_are_refused(text: str) -> None:
    """Compiled code cannot hold numbers beyond doubles; the message says how large such a number is."""
    with pytest.raises(EmissionError, match=r"10\*\*\d+ is beyond the range of doubles"):
        gqm.emit(declared(text), name="beyond")


@pytest.mark.parametrize("name", ["kepler", "pendulum"])
def test_each_loop_can_be_vectorised(name: str) -> None:
    """Loops are so short that LLVM, which compares at most 128 pairs of rows for overlap, can vectorise them."""
    text = (ROOT / "generated" / f"{name}.py").read_text(encoding="utf-8")
    for loop in re.findall(r"for i in range\(n\):\n((?: {8}.*\n)+)", text):
        writes = len(re.findall(r"^ +out\[", loop, re.MULTILINE))
        reads = len(re.findall(r"\w+\[(?:\d+, )?i\]", loop)) - writes
        assert writes * reads + writes * (writes - 1) // 2 <= 128
