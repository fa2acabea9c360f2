"""Motions under every conservative force agree with the reference tables and with laws that have closed forms."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf
from naive import error, ulps
from paths import DATA
from problems import DIGITS, number

import gqm_sym as gqm

# Half periods and periods are the doubles nearest to the true values. Worst measured: 0.49.
NEAREST = 0.51
# The tolerance relative to the motion's extent or its largest speed, up to thousands of periods. Worst measured:
# 1.7e-15 (speeds), otherwise 1.0e-15.
POSITION = 2e-15
# The tolerance of V**2, N and so on relative to the largest of their kind. Worst measured: 2.5e-16.
SAMPLE = 1e-15
# The tolerance of turning points relative to the extent, and of the time to the first. Worst measured: 8e-17 and 5e-17.
TURNING = 2.3e-16
TIME = 2.3e-16

# The tolerance of a planet's place, which after thousands of turns is a large angle, and of V**2 and N relative to the
# largest. Worst measured: 3.4e-16 and 5.5e-16.
KEPLER_POSITION = 1e-15
KEPLER_FIELD = 2e-15

ModuleNamed = Callable[[str], ModuleType]


def circle() -> gqm.Curve:
    """Return the circle of the tables, whose angle is measured from the downward vertical."""
    return gqm.families.circle(parameter="lam")


def kepler_ellipse() -> gqm.Curve:
    """Return an orbit about the origin in terms of the eccentric anomaly E from the nearest point (e is Euler's
    number).
    """
    return gqm.Curve.parametric(x="a*(cos(E) - ecc)", z="a*sqrt(1 - ecc**2)*sin(E)", parameter="E", period="2*pi")


SLOPING_LINE = "3*x/4 + 2"

MODELS: dict[str, Callable[[], gqm.Model]] = {
    "table2_2a_rolling_circle": lambda: gqm.derive(circle(), gqm.Gravity() + gqm.Rolling()),
    "table2_2b_rolling_ellipse": lambda: gqm.derive(gqm.families.ellipse(), gqm.Gravity() + gqm.Rolling()),
    "table2_6a_rotating_circle": lambda: gqm.derive(circle(), gqm.Gravity() + gqm.RotatingFrame()),
    "table2_6b_rotating_parabola": lambda: gqm.derive(gqm.families.parabola(), gqm.Gravity() + gqm.RotatingFrame()),
    "table3_5_logspiral": lambda: gqm.derive(gqm.families.log_spiral(), gqm.Gravity()),
    "kepler": lambda: gqm.derive(kepler_ellipse(), gqm.CentralForce()),
    "kepler_off_centre": lambda: gqm.derive(
        gqm.families.ellipse(parameter="E"), gqm.CentralForce(centre=("sqrt(f2)", 0), k="k_sun")
    ),
    "harmonic_line": lambda: gqm.derive(gqm.Curve.graph(SLOPING_LINE), gqm.Potential("w**2*(x**2 + z**2)/2")),
    "sum_of_forces": lambda: gqm.derive(
        gqm.families.ellipse(), gqm.Gravity() + gqm.RotatingFrame() + gqm.CentralForce(centre=(0, 3))
    ),
    "written_out": lambda: gqm.derive(gqm.families.ellipse(), gqm.Potential(WRITTEN_OUT)),
    "rolling_written_out": lambda: gqm.derive(gqm.families.ellipse(), gqm.Potential(WRITTEN_OUT) + gqm.Rolling()),
    "rolling_sum": lambda: gqm.derive(
        gqm.families.ellipse(),
        gqm.CentralForce(centre=(0, 3)) + gqm.Rolling() + gqm.RotatingFrame() + gqm.Gravity(),
    ),
}

WRITTEN_OUT = "g*z - Omega**2*x**2/2 - k/sqrt(x**2 + (z - 3)**2)"


@pytest.fixture(scope="session")
def module_named(generated_folder: Path) -> ModuleNamed:
    """Return the generated module of a row of MODELS."""
    built: dict[str, ModuleType] = {}

    def module(name: str) -> ModuleType:
        if name not in built:
            built[name] = gqm.build(MODELS[name](), name=f"kernel_{name}", folder=generated_folder)
        return built[name]

    return module


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperCase:
    """A case of the paper's tables."""

    slug: str
    launch: dict[str, Any]
    expected: dict[str, Any]


def _read() -> dict[str, PaperCase]:
    cases = {}
    for case in json.loads((DATA / "paper_cases.json").read_text(encoding="ascii"))["cases"]:
        if case["id"] in MODELS:
            initial = case["initial"]
            speed = initial["V0"]
            launch = {
                "lam0": initial["lam0"],
                "v0": speed.removeprefix("-"),
                "direction": -1 if speed.startswith("-") else 1,
                **{name: case[name] for name in ("m", "g")},
                **case["curve"]["params"],
                **case["kernel"]["params"],
            }
            cases[case["id"]] = PaperCase(slug=case["id"], launch=launch, expected=case["expected"])
    return cases


CASES = _read()
EVERY_CASE = pytest.mark.parametrize("case", CASES.values(), ids=CASES)


def extent(rows: list[dict[str, str]], *names: str) -> float:
    """Return the largest range of some coordinates among rows."""
    return max(max(float(r[n]) for r in rows) - min(float(r[n]) for r in rows) for n in names)


def places(case: PaperCase) -> list[dict[str, str]]:
    """Return all places on the orbit that the table names."""
    rows = case.expected
    return [*rows["turning_points"], *rows["positions"], *rows["pass1"]]


def test_the_cases_are_all_here() -> None:
    """The tables contain cases of rolling, of the rotating frame and of the spiral."""
    assert len(CASES) == 5


@pytest.mark.sample(2)
@EVERY_CASE
def test_turning_points_and_half_period(case: PaperCase, module_named: ModuleNamed) -> None:
    """The kind, the turning points, the half period and the time of the first turn agree with the tables."""
    motion = module_named(case.slug).solve(**case.launch)
    expected = case.expected
    assert motion.kind == "libration"
    points = expected["turning_points"]
    lam = max(*(abs(float(row["lam"])) for row in points), extent(points, "lam"))
    for actual, row in zip(sorted(motion.turning_points), points, strict=True):
        assert error(actual, row["lam"]) <= TURNING * lam
    assert ulps(motion.half_period, expected["half_period"]) <= NEAREST
    first = expected["time_to_first_turning_point"]
    assert error(motion.legs[0].t_end, first) <= TIME * float(first)


@pytest.mark.extended
@EVERY_CASE
def test_positions(case: PaperCase, module_named: ModuleNamed) -> None:
    """lam, x, z and v agree with the tables, early and after thousands of periods."""
    motion = module_named(case.slug).solve(**case.launch)
    rows = places(case)
    lam = max(*(abs(float(row["lam"])) for row in rows), extent(rows, "lam"))
    place = extent(rows, "x", "z")
    speed = max(float(row["V2"]) for row in case.expected["pass1"]) ** 0.5
    for row in case.expected["positions"]:
        state = motion.state(row["t"])
        assert error(motion.lam(row["t"]), row["lam"]) <= POSITION * lam
        assert error(state.x, row["x"]) <= POSITION * place
        assert error(state.z, row["z"]) <= POSITION * place
        assert error(state.v, row["V"]) <= POSITION * speed
        assert error(motion.lam(row["t"]), row["lam"]) <= motion.error_bound(row["t"])


@pytest.mark.sample(3)
@EVERY_CASE
def test_speed_field(case: PaperCase, module_named: ModuleNamed) -> None:
    """V**2, N and kappa agree with the tables at the sampled places, relative to the largest value."""
    rows = case.expected["pass1"]
    field = module_named(case.slug).pass1([row["lam"] for row in rows], **case.launch)
    for ours, theirs in (("v2", "V2"), ("normal_force", "N"), ("kappa", "kappa"), ("x", "x"), ("z", "z")):
        largest = max(abs(float(row[theirs])) for row in rows)
        for actual, row in zip(getattr(field, ours), rows, strict=True):
            assert error(actual, row[theirs]) <= SAMPLE * largest


# A planet on its own orbit -----------------------------------------------------------------------

ATTRACTION, HALF_AXIS = "7/2", "3/2"
ECCENTRICITIES = pytest.mark.parametrize("e", ["1/10", "3/5"])


def orbital(e: str) -> dict[str, Any]:
    """Launch from the nearest point at the orbital speed."""
    speed = f"sqrt(({ATTRACTION})/({HALF_AXIS})*(1 + {e})/(1 - {e}))"
    return {"lam0": "0", "v0": speed, "ecc": e, "a": HALF_AXIS, "k": ATTRACTION}


def orbital_period() -> mpf:
    """Return the period by Kepler's third law."""
    with mp.workdps(DIGITS):
        return 2 * mp.pi * mp.sqrt(number(HALF_AXIS) ** 3 / number(ATTRACTION))


def eccentric_anomaly(e: str, t: float) -> mpf:
    """Solve Kepler's equation E - e*sin(E) = 2*pi*t/T."""
    with mp.workdps(DIGITS):
        mean = 2 * mp.pi * mpf(t) / orbital_period()
        return mp.findroot(lambda E: E - number(e) * mp.sin(E) - mean, mean)


@pytest.mark.extended
@ECCENTRICITIES
def test_a_planet_needs_no_track(e: str, module_named: ModuleNamed) -> None:
    """V**2 is k*(2/r - 1/a) all round, and N is zero to rounding."""
    lams = np.linspace(-3.0, 3.0, 61)
    field = module_named("kepler").pass1(lams, **orbital(e))
    with mp.workdps(DIGITS):
        a, k, ecc = number(HALF_AXIS), number(ATTRACTION), number(e)
        radii = [a * (1 - ecc * mp.cos(mpf(float(lam)))) for lam in lams]
        speeds = [k * (2 / r - 1 / a) for r in radii]
    for actual, truth in zip(field.v2, speeds, strict=True):
        assert error(actual, truth) <= KEPLER_FIELD * float(max(speeds))
    assert np.abs(field.normal_force).max() <= KEPLER_FIELD * np.abs(field.kappa * field.v2).max()


@pytest.mark.sample(1)
@ECCENTRICITIES
def test_a_planet_keeps_kepler_s_laws(e: str, module_named: ModuleNamed) -> None:
    """A planet obeys the third law, and Kepler's equation gives its place at any time."""
    motion = module_named("kepler").solve(**orbital(e))
    period = orbital_period()
    assert motion.kind == "circulation"
    assert ulps(motion.period, period) <= NEAREST
    for t in (*np.linspace(0.05, float(period), 25).tolist(), 20.0, 1000.0, 123456.75):
        truth = eccentric_anomaly(e, t)
        assert error(motion.lam(t), truth) <= KEPLER_POSITION * float(max(truth, 2 * mp.pi))


@pytest.mark.extended
@ECCENTRICITIES
def test_the_centre_may_be_anywhere(e: str, module_named: ModuleNamed) -> None:
    """If the centre is an expression in a parameter, the period is the same and the track is still not needed."""
    launch = orbital(e) | {"b": f"({HALF_AXIS})*sqrt(1 - ({e})**2)", "f2": f"(({HALF_AXIS})*{e})**2"}
    del launch["ecc"]
    launch["k_sun"] = launch.pop("k")
    module = module_named("kepler_off_centre")
    assert ulps(module.solve(**launch).period, orbital_period()) <= NEAREST
    field = module.pass1(np.linspace(-3.0, 3.0, 13), **launch)
    assert np.abs(field.normal_force).max() <= KEPLER_FIELD * np.abs(field.kappa * field.v2).max()


# Harmonic motion on a line -----------------------------------------------------------------------


@pytest.mark.parametrize(("lam0", "v0"), [("3", "0"), ("-1.2", "0.001"), ("0", "25"), ("-0.96", "1e-6")])
def test_a_harmonic_well_is_isochronous(lam0: str, v0: str, module_named: ModuleNamed) -> None:
    """On any line the half period is pi/w and x(t) is a sine, whatever the amplitude and the launch."""
    w, lowest = number("1.3"), number("-24/25")
    motion = module_named("harmonic_line").solve(lam0, v0, w="1.3")
    with mp.workdps(DIGITS):
        assert ulps(motion.half_period, mp.pi / w) <= NEAREST
        # ds = 5/4 dx
        away, speed = number(lam0) - lowest, number(v0) * 4 / 5
        amplitude = mp.hypot(away, speed / w)
        reach = max(abs(lowest - amplitude), abs(lowest + amplitude), 2 * amplitude)
        for t in (0.125, 1.0, 3.5, 1000.0):
            truth = lowest + away * mp.cos(w * t) + speed / w * mp.sin(w * t)
            assert error(motion.lam(t), truth) <= POSITION * float(reach)


def test_a_harmonic_well_at_its_bottom_is_rest(module_named: ModuleNamed) -> None:
    """A body rests where the line is nearest to the centre."""
    assert module_named("harmonic_line").solve("-24/25", w="1.3").kind == "rest"


# Sums --------------------------------------------------------------------------------------------

SUM_LAUNCH = {"lam0": "-0.3", "v0": "1.1", "a": "2", "b": "1", "Omega": "0.8", "k": "5", "g": "9.81"}


@pytest.mark.extended
@pytest.mark.parametrize(
    ("summed", "written", "more"),
    [
        pytest.param("sum_of_forces", "written_out", {}, id="forces"),
        pytest.param("rolling_sum", "rolling_written_out", {"beta": "2/5"}, id="rolling"),
    ],
)
def test_a_sum_of_forces_is_the_potential_written_out(
    summed: str, written: str, more: dict[str, str], module_named: ModuleNamed
) -> None:
    """A sum of forces and its potential written out have the same closed forms, field and motion."""
    ours, theirs = MODELS[summed](), MODELS[written]()
    for form in ("speed_squared", "normal_force", "tangential_acceleration", "kappa"):
        difference = getattr(ours, form) - getattr(theirs, form)
        for k in (1, 2, 3):  # Such forms are equal if they are equal at places where no term is special.
            values = {
                symbol: sp.Rational(7 + 3 * i, 11 + k)
                for i, symbol in enumerate(sorted(difference.free_symbols, key=str))
            }
            assert abs(difference.xreplace(values).evalf(60, chop=False)) < 1e-50
    first, second = (module_named(name) for name in (summed, written))
    launch = SUM_LAUNCH | more
    lams = np.linspace(-2.5, -0.5, 9)
    for name in ("v2", "normal_force"):
        values = [getattr(module.pass1(lams, **launch), name) for module in (first, second)]
        assert np.abs(values[0] - values[1]).max() <= SAMPLE * np.abs(values[0]).max()
    motions = [module.solve(**launch) for module in (first, second)]
    assert motions[0].kind == motions[1].kind == "libration"
    assert motions[0].half_period == motions[1].half_period
    assert motions[0].lam(777) == motions[1].lam(777)


# Off its own orbit -------------------------------------------------------------------------------


@pytest.mark.sample(2)
@ECCENTRICITIES
@pytest.mark.parametrize("contact", ["bilateral", "above", "below"])
def test_a_planet_never_changes_sides(e: str, contact: str, module_named: ModuleNamed) -> None:
    """If N is 0 all round, N does not change its sign and contact is not lost."""
    motion = module_named("kepler").solve(**orbital(e), contact=contact)
    assert motion.kind == "circulation"
    assert motion.events == ()


@pytest.mark.parametrize("factor", ["4/5", "6/5"])
def test_off_speed_the_track_carries_what_is_missing(factor: str, module_named: ModuleNamed) -> None:
    """A body launched at f times the orbital speed has N = m κ (f² - 1) v0², because W differs by a constant."""
    e = "3/5"
    launch = orbital(e)
    speed = number(launch["v0"])
    launch["v0"] = f"({factor})*{launch['v0']}"
    launch["m"] = "3/2"
    lams = np.linspace(-1.5, 1.5, 13)
    field = module_named("kepler").pass1(lams, **launch)
    with mp.workdps(DIGITS):
        a, ecc = number(HALF_AXIS), number(e)
        b = a * mp.sqrt(1 - ecc**2)
        for actual, lam in zip(field.normal_force, lams, strict=True):
            kappa = a * b / mp.sqrt((a * mp.sin(lam)) ** 2 + (b * mp.cos(lam)) ** 2) ** 3
            truth = mpf("1.5") * kappa * (number(factor) ** 2 - 1) * speed**2
            assert error(actual, truth) <= KEPLER_FIELD * float(mpf("1.5") * kappa * speed**2)


@pytest.mark.extended
def test_through_the_centre_nothing_is_nan(generated_folder: Path) -> None:
    """On a line through the centre of attraction the fall ends at the centre, and a launch from there is refused."""
    model = gqm.derive(gqm.Curve.graph("x/2"), gqm.CentralForce())
    module = gqm.build(model, name="through_the_centre", folder=generated_folder)
    motion = module.solve("1", k="2")
    assert motion.kind == "transit"
    assert motion.direction == -1
    # From rest at r0 = sqrt(5)/2, r'' = -k/r**2 takes pi/2*sqrt(r0**3/(2*k)).
    with mp.workdps(DIGITS):
        fall = mp.pi / 2 * mp.sqrt((mp.sqrt(5) / 2) ** 3 / 4)
        half = motion.state(float(fall) / 2)
        assert np.isfinite([half.lam, half.v, half.normal_force]).all()
    with pytest.raises(gqm.GQMError):
        module.solve("0", "1", k="2")
