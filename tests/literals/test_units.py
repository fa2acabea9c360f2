"""Quantities of pint and texts with units are converted to numbers exactly, or refused with the remedy."""

import pickle
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pint
import pytest
from mpmath import mp

import gqm_sym as gqm
from gqm_sym.derivation import Model
from gqm_sym.errors import DeclarationError, InputError, NumberError
from gqm_sym.literals.numbers import read_number, read_numbers
from gqm_sym.literals.units import read_unit
from gqm_sym.parameters import Measured, read_value

u = pint.UnitRegistry()


@pytest.mark.parametrize(
    ("given", "unit", "exact"),
    [
        (50 * u.cm, "m", Fraction(1, 2)),
        (0.1 * u.km, "m", Fraction(0.1) * 1000),
        (Fraction(1, 3) * u.ft, "m", Fraction(127, 1250)),
        (36 * u.km / u.hour, "m/s", Fraction(10)),
        (500 * u.ms, "s", Fraction(1, 2)),
        (2 * u.dimensionless, "1", Fraction(2)),
        (40 * u.percent, "1", Fraction(2, 5)),
        (1 * u.rad, "1", Fraction(1)),
        (3 * u.tonne, "kg", Fraction(3000)),
        ("50 cm", "m", Fraction(1, 2)),
        ("1/3 ft", "m", Fraction(127, 1250)),
        ("36 km/h", "m/s", Fraction(10)),
        (" 9.81  m / s**2 ", "m/s**2", Fraction(981, 100)),
        ("2 min", "s", Fraction(120)),
        ("50cm", "m", Fraction(1, 2)),
        ("1.5e3ms", "s", Fraction(3, 2)),
        ("(1/3)ft", "m", Fraction(127, 1250)),
        (np.array(2), "1", Fraction(2)),
    ],
)
def test_conversions_are_exact(given: object, unit: str, exact: Fraction) -> None:
    """A float means its binary value, and any other input exactly what it says."""
    assert read_number(given, where="it", unit=unit).fraction == exact


@pytest.mark.parametrize(
    "given", [30 * u.deg, 30.0 * u.deg, "30 deg", "30 \u00b0", "30\u00b0", "30deg", 1800 * u.arcmin]
)
def test_degrees(given: object) -> None:
    """Degrees become numbers with a factor pi, known to any number of digits."""
    number = read_number(given, where="it", unit="1")
    with mp.workdps(50):
        assert abs(number.at(mp) - mp.pi / 6) < mp.mpf(10) ** -48


@pytest.mark.parametrize(
    ("given", "unit", "text"),
    [
        ("50 cm", "m", "0.5"),
        ("-60 deg", "1", "-pi/3"),
        (180 * u.deg, "1", "pi"),
        (210 * u.deg, "1", "7*pi/6"),
        ("720 deg", "1", "4*pi"),
        ("1/3 cm", "m", "1/300"),
        ("3 m/s", "m/s", "3"),
        ("sqrt(2) cm", "m", "(sqrt(2))*(1/100)"),
        ("2 rpm", "1/s", "pi/15"),
    ],
)
def test_numbers_are_shown_as_a_person_would_write_them(given: object, unit: str, text: str) -> None:
    """Numbers are shown in SI units, and the text reads back as the same number."""
    number = read_number(given, where="it", unit=unit)
    assert number.text == str(number) == text
    again = read_number(text, where="it")
    assert (again.value, again.low) == (number.value, number.low)


def test_arrays_are_converted_at_once() -> None:
    """Arrays are converted to two doubles for each number; shapes are kept, and lists of quantities are read one by
    one.
    """
    high, low, shape = read_numbers(np.array([[10.0, 20.0], [30.0, 45.0]]) * u.deg, where="t", unit="1")
    assert shape == (2, 2)
    with mp.workdps(40):
        for value, rest, degrees in zip(high, low, (10, 20, 30, 45), strict=True):
            exact = mp.mpf(degrees) * mp.pi / 180
            assert value == float(exact)
            assert abs(mp.mpf(value) + mp.mpf(rest) - exact) < 1e-18
    high, _, shape = read_numbers([1 * u.s, 500 * u.ms, 2.0], where="t", unit="s")
    assert (high.tolist(), shape) == ([1.0, 0.5, 2.0], (3,))
    assert read_numbers(np.arange(3) * u.s, where="t", unit="s")[0].tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize("given", [3 * u.kg, "3 kg", np.array([1.0, 2.0]) * u.kg, [3 * u.kg]])
def test_another_dimension_is_refused(given: object) -> None:
    """The message names the argument, what it must be and what was given."""
    with pytest.raises(NumberError, match=r"t: must be in s .*kilo|t: must be in s .*kg"):
        read_numbers(given, where="t", unit="s")


def test_units_of_absurd_size_are_refused() -> None:
    """A unit may be a number, but not one whose conversion takes more digits than a number may have."""
    with pytest.raises(InputError, match="must be a unit of ordinary size"):
        read_unit("9" * 399, where="unit")
    assert read_unit("1e-100*m", where="unit").factor == Fraction(1, 10**100)


def test_where_no_dimension_is_known() -> None:
    """If no dimension is known, the remedy is a plain number."""
    with pytest.raises(NumberError, match=r"k: a unit is not known for it, got meter; give a plain number"):
        read_number(3 * u.m, where="k")
    with pytest.raises(NumberError, match="not a finite number"):
        read_numbers(np.array([1.0, np.nan]) * u.ms, where="t", unit="s")
    with pytest.raises(NumberError, match="not a unit of mechanics"):
        read_number(3 * u.kelvin, where="t", unit="s")


@pytest.fixture(scope="module")
def pendulum() -> Model:
    """Return a circle."""
    return gqm.derive(gqm.families.circle(L=50 * u.cm), gqm.Gravity(g="981 cm/s**2"))


@pytest.fixture(scope="module")
def swing(pendulum: Model, tmp_path_factory: pytest.TempPathFactory) -> object:
    """Return the circle's module."""
    return gqm.build(pendulum, name="swing", folder=tmp_path_factory.mktemp("units"))


def test_defaults(pendulum: Model) -> None:
    """Defaults are converted to SI exactly; the units of all parameters are known."""
    assert dict(pendulum.defaults) == {"L": "0.5", "g": "9.81", "m": "1"}
    assert pendulum.units == {"theta": "1", "L": "m", "g": "m/s**2", "m": "kg"}
    twin = pickle.loads(pickle.dumps(read_value(30 * u.deg, where="it")))
    assert isinstance(twin, Measured)
    assert (twin, twin.unit) == ("pi/6", "degree")


def test_launch_and_motion(swing: object) -> None:
    """`solve`, times, places and parameters accept units, and the answers are those of plain numbers."""
    measured = swing.solve(30 * u.deg, "36 km/h", t_max=1 * u.min, L=50 * u.cm, m="200 g")  # type: ignore[attr-defined]
    plain = swing.solve("pi/6", 10, t_max=60, L="1/2", m="1/5")  # type: ignore[attr-defined]
    assert measured.lam(500 * u.ms) == plain.lam("1/2")
    assert np.array_equal(measured.lam([1, 2] * u.s), plain.lam([1, 2]))
    assert measured.state("500 ms").x == plain.state(0.5).x
    assert measured.time_at("60 deg") == plain.time_at("pi/3")
    assert measured.events_between(0 * u.s, 1 * u.min) == plain.events_between(0, 60)
    assert measured.energy(1 * u.s) == plain.energy(1)


def test_load_maps_and_sweeps(swing: object) -> None:
    """Arrays of quantities, a list of texts and the places of an arrival are accepted."""
    given = swing.pass1([10, 20] * u.deg, 30 * u.deg)  # type: ignore[attr-defined]
    plain = swing.pass1(["pi/18", "pi/9"], "pi/6")  # type: ignore[attr-defined]
    assert all(np.array_equal(*both) for both in zip(given, plain, strict=True))
    angles, lengths = [30, 60] * u.deg, [[50], [60]] * u.cm
    swept = swing.sweep("period", angles, L=lengths)  # type: ignore[attr-defined]
    assert swept.values == pytest.approx(
        swing.sweep("period", [np.pi / 6, np.pi / 3], L=[[0.5], [0.6]]).values,  # type: ignore[attr-defined]
        rel=1e-15,
    )
    assert swept.to_pandas()["L"].tolist() == [0.5, 0.5, 0.6, 0.6]
    texts = swing.sweep("time_at", ["30 deg", "60 deg"], lam="10 deg")  # type: ignore[attr-defined]
    assert texts.values == pytest.approx(
        swing.sweep("time_at", [np.pi / 6, np.pi / 3], lam=np.pi / 18).values,  # type: ignore[attr-defined]
        rel=1e-14,
    )


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda m: m.solve(3 * u.m), "lam0: must be a plain number or an angle, got meter"),
        (lambda m: m.solve(1, 3 * u.m), "v0: must be in m/s or a multiple of it, got meter"),
        (lambda m: m.solve(1, t_max=3 * u.m), "t_max: must be in s"),
        (lambda m: m.solve(1, L=3 * u.kg), "L: must be in m"),
        (lambda m: m.solve(1).lam(3 * u.kg), "t: must be in s"),
        (lambda m: m.solve(1).lam([3 * u.kg]), "t: must be in s"),
        (lambda m: m.solve(1).time_at(3 * u.kg), "theta: must be a plain number"),
        (lambda m: m.pass1([1, 2] * u.kg, 1), "theta: must be a plain number"),
        (lambda m: m.sweep("period", [1, 2] * u.kg), "lam0: must be a plain number"),
        (lambda m: m.sweep("period", 1, L=["3 s"]), "L: must be in m"),
        (lambda m: m.solve("3 parsnips"), "unknown|unexpected|expected|column"),
    ],
)
def test_wrong_units_are_refused_everywhere(swing: object, call: object, said: str) -> None:
    """A wrong unit is refused everywhere, and never just removed."""
    with pytest.raises(InputError, match=said):
        call(swing)  # type: ignore[operator]


def test_declarations_are_checked() -> None:
    """Declarations are checked by the dimensions of the formulas; open ones are refused when a model is derived."""
    with pytest.raises(DeclarationError, match="L: must be in m"):
        gqm.families.circle(L=3 * u.kg)
    with pytest.raises(DeclarationError, match="mu: must be a plain number"):
        gqm.CoulombFriction(mu="3 m")
    with pytest.raises(DeclarationError, match="b: must be in kg/m"):
        gqm.derive(gqm.families.circle(), gqm.Gravity() + gqm.QuadraticDrag(b="1 kg/s"), parameters={"L": "1 m"})
    curve = gqm.Curve.graph("a*x**2 + sin(c*x)*d", parameters={"c": "2 rad/m", "d": 3 * u.mm})
    assert dict(curve.defaults)["d"] == "0.003"
    with pytest.raises(DeclarationError, match="c: must be"):
        gqm.Curve.graph("sin(c*x)*d", parameters={"c": "2 kg"})


def test_points() -> None:
    """Points may be arrays of quantities, pairs of them, or two arrays."""
    plain = gqm.Curve.sampled([(0, 1), (1, 0), (2, 1)], kind="linear")
    for given in (
        gqm.Curve.sampled(np.array([[0, 100], [100, 0], [200, 100]]) * u.cm, kind="linear"),
        gqm.Curve.sampled([(0 * u.m, 1 * u.m), (100 * u.cm, 0 * u.m), (2 * u.m, 1 * u.m)], kind="linear"),
        gqm.Curve.sampled([0, 1, 2] * u.m, [1000, 0, 1000] * u.mm, kind="linear"),
    ):
        numbers = [[float(text) for text in line.split()] for line in given.definition.points.splitlines()]
        assert numbers == [[float(t) for t in line.split()] for line in plain.definition.points.splitlines()]
    with pytest.raises(InputError, match="must be in m"):
        gqm.Curve.sampled([0, 1, 2] * u.s, [1, 0, 1], kind="linear")


def test_a_pint_that_is_not_needed_is_not_imported() -> None:
    """Reading plain numbers and SI units does not import pint."""
    code = (
        "import sys; from gqm_sym.literals.numbers import read_number as r; r(1.5, where='a', unit='s'); "
        "r('3/4', where='a', unit='s'); r('3 m', where='a', unit='m'); assert 'pint' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
