"""Units in curve files are converted exactly, checked against the required dimension, and never run or rounded."""

import re
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import pytest
import sympy as sp
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.errors import InputError, SpecFileError
from gqm_sym.kernels import KERNELS
from gqm_sym.literals.units import Unit, check_unit, read_unit
from gqm_sym.parameters import in_si
from gqm_sym.specfile.schema import _KERNEL_ARGUMENTS
from gqm_sym.specfile.units import KERNEL_UNITS

# These are values of the SI brochure and of the international yard and pound agreement of 1959.
EXACT = {
    "1": Fraction(1),
    "m": Fraction(1),
    "cm": Fraction(1, 100),
    "um": Fraction(1, 10**6),
    "inch": Fraction(254, 10_000),
    "ft": Fraction(3048, 10_000),
    "mile": Fraction(1_609_344, 1000),
    "g": Fraction(1, 1000),
    "lb": Fraction(45_359_237, 10**8),
    "min": Fraction(60),
    "km/h": Fraction(10, 36),
    "ft/s**2": Fraction(3048, 10_000),
    "1/(10*cm)": Fraction(10),
    "dyn/cm": Fraction(1, 1000),
    "lbf": Fraction(45_359_237 * 980_665, 10**13),
    "knot": Fraction(1852, 3600),
}
TURNS = {"deg": Fraction(1, 180), "rpm": Fraction(2, 60), "turn": Fraction(2), "arcsec": Fraction(1, 648_000)}


@pytest.mark.parametrize("text", EXACT)
def test_factors_are_exact(text: str) -> None:
    """A unit is the fraction by which it is defined."""
    unit = read_unit(text, where="unit")
    assert (unit.factor, unit.turns) == (EXACT[text], 0)


@pytest.mark.parametrize("text", TURNS)
def test_angles_keep_pi(text: str) -> None:
    """A degree is pi/180, whatever number of digits the library gives pi."""
    unit = read_unit(text, where="unit")
    assert (unit.factor, unit.turns) == (TURNS[text], 1)
    assert sp.sympify(in_si("90", text)) == 90 * sp.pi * sp.Rational(TURNS[text].numerator, TURNS[text].denominator)


def test_numbers_stay_as_they_are_written() -> None:
    """SI values keep their text; others are the same number, as a decimal where it ends."""
    assert in_si("0.70", "1/m") == "0.70"
    assert in_si("0.70", "") == "0.70"
    assert in_si("30", "cm") == "0.3"
    assert in_si("50", "km/h") == "125/9"
    assert in_si("-sqrt(2)", "km") == "-1000*sqrt(2)"
    assert in_si("90", "deg") == "pi/2"
    assert in_si("1e-7", "mm") == "0.0000000001"


def test_names_in_si() -> None:
    """The name of a unit is that of the SI unit to which values are converted."""
    names = {text: read_unit(text, where="unit").name for text in ("mm", "km/h", "lbf", "1/ft", "deg/min", "percent")}
    assert names == {"mm": "m", "km/h": "m/s", "lbf": "kg*m/s**2", "1/ft": "1/m", "deg/min": "rad/s", "percent": ""}
    assert Unit(kilogram=-1, second=-2).name == "1/kg/s**2"


REFUSED = {
    "metre": None,
    "metres_": "column 1: there is no unit 'metres_'",
    "m^2": "column 2: unexpected '^'; write ** for a power",
    "m + s": "column 3: units cannot be added",
    "-m": "a unit has no sign",
    "m**0.5": "an exponent must be a whole number",
    "m**m": "an exponent must be a whole number",
    "sin(m)": "sin cannot be part of a unit",
    "ampere": "'ampere' is not a unit of mechanics",
    "degC": "'degC' is not a unit of mechanics",
    "dB": "there is no unit 'dB'",
    "0*m": "0*m is zero",
    "m/0": "division by zero",
    "9**9**9**9": "exponent",
    "e": "not a unit of mechanics",
    "__import__": "",
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_no_unit(text: str) -> None:
    """A text that is no unit is refused with the reason; it is not evaluated and takes little time."""
    if REFUSED[text] is None:
        assert read_unit(text, where="unit") == Unit(metre=1)
        return
    with pytest.raises(InputError) as caught:
        read_unit(text, where="unit")
    assert REFUSED[text] in str(caught.value)


def test_dimensions() -> None:
    """A unit fits if its dimension is the required one; an angle is a number."""
    for text, wanted in (("cm", "m"), ("rpm", "1/s"), ("deg", "1"), ("N", None), ("slug", "kg")):
        check_unit(text, wanted)
    with pytest.raises(InputError, match=r"must be in m/s\*\*2 or a multiple of it, got cm"):
        check_unit("cm", "m/s**2")
    with pytest.raises(InputError, match="must be a plain number or an angle, got kg"):
        check_unit("kg", "1")


def test_every_kernel_argument_has_its_unit() -> None:
    """The dimension of every argument of a force is known."""
    arguments = {argument for row in KERNELS.values() for argument in row.arguments}
    assert arguments - _KERNEL_ARGUMENTS.keys() <= KERNEL_UNITS.keys()


FILE = """\
name: swing
curve:
  family: {name: circle, L: rod}
kernel:
  gravity: {g: g_moon}
parameters:
  rod: {value: 140, unit: cm, description: length}
  g_moon: {value: 162, unit: cm/s**2}
  m: {value: 250, unit: g}
launch: {lam0: {value: 90, unit: deg}, v0: {value: 1.8, unit: km/h}, t_max: {value: 2, unit: min}}
"""


def read(folder: Path, text: str) -> gqm.specfile.Spec:
    """Read a file with this content."""
    (folder / "a.yaml").write_text(text)
    return gqm.read_spec(folder / "a.yaml")


def test_a_file_with_units(tmp_path: Path) -> None:
    """Parameters and launch are converted to SI, and the text as written is kept for messages."""
    spec = read(tmp_path, FILE)
    assert dict(spec.parameters) == {"rod": "1.4", "g_moon": "1.62", "m": "0.25"}
    assert dict(spec.launch or {}) == {"lam0": "pi/2", "v0": "0.5", "t_max": "120"}
    note = spec.notes["rod"]
    assert (note.unit, note.given, note.description) == ("m", "140 cm", "length")


WRONG = {
    "a length for a mass": ("unit: g}", "unit: cm}", "9:25: parameters.m.unit: must be in kg or a multiple"),
    "a renamed gravity": ("cm/s**2", "cm/s", "8:30: parameters.g_moon.unit: must be in m/s**2 or a multiple"),
    "a length of a family": ("unit: cm,", "unit: rad,", "7:27: parameters.rod.unit: must be in m or a multiple"),
    "a speed": ("km/h", "km", "10:63: launch.v0.unit: must be in m/s or a multiple"),
    "no unit": ("unit: deg", "unit: grad1", "10:34: launch.lam0.unit: there is no unit 'grad1'"),
    "an unknown key": ("unit: min", "units: min", "10:88: launch.t_max: unknown key 'units'; did you mean unit?"),
    "no value": ("value: 1.8, ", "", "10:40: launch.v0: value is missing; add value: 9.81"),
}


@pytest.mark.parametrize("case", WRONG.values(), ids=WRONG)
def test_wrong_units_are_placed(case: tuple[str, str, str], tmp_path: Path) -> None:
    """A wrong unit is reported with line, column, and what would be right."""
    before, after, said = case
    with pytest.raises(SpecFileError) as caught:
        read(tmp_path, FILE.replace(before, after))
    assert said in str(caught.value)


def test_si_needs_no_library() -> None:
    """The examples are read without pint, whose import takes longer than all the rest."""
    code = "import sys, gqm_sym as g; g.read_spec(sys.argv[1]); sys.exit('pint' in sys.modules)"
    pendulum = ROOT / "curves" / "pendulum.yaml"
    assert subprocess.run([sys.executable, "-c", code, str(pendulum)], timeout=60, check=False).returncode == 0


@pytest.mark.extended
def test_loading_the_library_is_not_reading(tmp_path: Path) -> None:
    """Importing the library at the first unit by name does not count as reading, because it may exceed a file's
    budget.
    """
    code = (
        "import sys, gqm_sym as g; from gqm_sym.specfile import reader; reader.SECONDS = 0.2; "
        "g.read_spec(sys.argv[1]); "
        "sys.exit('pint' not in sys.modules)"
    )
    path = tmp_path / "a.yaml"
    path.write_text(FILE.replace("km/h", "furlong/day"))
    done = subprocess.run([sys.executable, "-c", code, str(path)], timeout=120, check=False, capture_output=True)
    assert done.returncode == 0, done.stderr.decode()


WRONG = """\
name: wrong
curve:
  CURVE
kernel: {gravity: {}}
parameters: {PARAMETERS}
launch: {lam0: 0.5}
"""


@pytest.mark.parametrize(
    ("curve", "parameters", "wanted"),
    [
        ("graph: {z: a*x**2}", "a: {value: 1, unit: kg}", "in 1/m or a multiple"),
        ("graph: {z: A*cos(k*x)}", "A: {value: 1, unit: m}, k: {value: 1, unit: m}", "in 1/m or a multiple"),
        ("parametric: {x: a*cos(u), z: a*sin(u), parameter: u}", "a: {value: 140, unit: kg}", "in m or a multiple"),
        (
            "parametric: {x: a*u, z: b*u**2, parameter: u}",
            "a: {value: 1, unit: m/s}, b: {value: 1, unit: m/s}",
            "in m/s**2",
        ),
        ("polar: {r: p/(1 + ecc*cos(theta))}", "p: {value: 1, unit: m}, ecc: {value: 0, unit: m}", "a plain number"),
        ("family: {name: ellipse, a: 1}", "b: {value: 1, unit: deg}", "in m or a multiple"),
        ("implicit: {F: x**2 + z**2 - R**2, start: [R, 0]}", "R: {value: 1, unit: s}", "in m or a multiple"),
        (
            "pieces: [{line: {length: 2}}, {arc: {radius: R, angle: phi}}]",
            "R: 1, phi: {value: 1, unit: m}",
            "a plain number",
        ),
        ("graph: {z: a*x**2, domain: [c, null]}", "a: 1, c: {value: 0, unit: deg}", "in m or a multiple"),
    ],
)
def test_units_of_a_curve_s_parameters_are_checked(curve: str, parameters: str, wanted: str, tmp_path: Path) -> None:
    """Units of a curve's parameters are checked by the dimensions of its coordinates."""
    text = WRONG.replace("CURVE", curve).replace("PARAMETERS", parameters)
    with pytest.raises(InputError, match=rf"a.yaml:5:\d+: parameters.\w+.unit: must be {re.escape(wanted)}.*, got "):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("curve", "parameters"),
    [
        ("graph: {z: h*(x**4 - 2*x**2)}", "h: {value: 1, unit: m}"),
        ("graph: {z: h*(x**4 - 2*x**2)}", "h: {value: 1, unit: 1/m**3}"),
        ("graph: {z: A*cos(k*x)}", "A: {value: 1, unit: ft}, k: {value: 1, unit: deg/m}"),
        ("parametric: {x: a*u, z: b*u**2, parameter: u}", "a: {value: 1, unit: km/h}, b: {value: 1, unit: m/s**2}"),
        ("parametric: {x: R*(u - sin(u)), z: R*cos(u), parameter: u}", "R: {value: 1, unit: cm}"),
    ],
)
def test_units_that_fit_are_let_pass(curve: str, parameters: str, tmp_path: Path) -> None:
    """Units that fit are accepted, also if a number hides one."""
    read(tmp_path, WRONG.replace("CURVE", curve).replace("PARAMETERS", parameters))


def test_wrong_units_are_reported_with_everything_else(tmp_path: Path) -> None:
    """Wrong units are reported with all other mistakes: in the kernel, in the curve, in the launch."""
    text = WRONG.replace("CURVE", "graph: {z: a*x**2}").replace("PARAMETERS", "a: {value: 1, unit: kg}, q: 1")
    for old, new in (("{gravity: {}}", "{gravity: {h: 1}}"), ("lam0: 0.5", "lam0: 0.5, v0: {value: 1, unit: kg}")):
        text = text.replace(old, new)
    with pytest.raises(SpecFileError) as caught:
        read(tmp_path, text)
    message = str(caught.value)
    for part in ("kernel.gravity", "parameters.a.unit: must be in 1/m", "launch.v0.unit: must be in m/s"):
        assert part in message
    broken = (
        text.replace("a*x**2", "a*x**").replace("{h: 1}", "{g: g_moon}").replace("q: 1", "g_moon: {value: 1, unit: m}")
    )
    with pytest.raises(SpecFileError) as caught:
        read(tmp_path, broken)
    for part in ("curve.graph.z", "parameters.g_moon.unit: must be in m/s**2", "launch.v0.unit: must be in m/s"):
        assert part in str(caught.value)
