"""Launches that nearly reach a hilltop, or nearly stop there, have the same answers in sweeps as in `solve`."""

import random
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.errors import GQMError
from gqm_sym.runtime.sweep.quantities import SINGLE, SOLVE

# A row has a curve with hills: its heights as formulas, an estimate of a hilltop, and the launch place.
HILLS: dict[str, tuple[Any, Any, float, tuple[float, float]]] = {
    "two_wells": (gqm.Curve.graph("x**4/4 - x**2/2", parameter="x"), lambda x: x**4 / 4 - x**2 / 2, 0.0, (-1.3, 1.3)),
    "uneven_wells": (
        gqm.Curve.graph("x**4/4 - x**2/2 + x/10", parameter="x"),
        lambda x: x**4 / 4 - x**2 / 2 + x / 10,
        0.1,
        (-1.3, 1.2),
    ),
    "pendulum": (
        gqm.Curve.parametric(x="sin(u)", z="-cos(u)", parameter="u", period="2*pi"),
        lambda u: -mp.cos(u),
        3.14,
        (-2.5, 2.5),
    ),
    "waves": (gqm.Curve.graph("sin(x)", parameter="x"), mp.sin, 1.57, (-4.0, 1.0)),
}
G = mpf("9.81")
COUNT = 5


def launches(name: str) -> tuple[list[float], list[float], list[int], float, Any]:
    """Return places, speeds and directions whose energies differ from the hilltop's by shares of 1e-8 to 1e-15, and the
    hilltop.
    """
    _, height, near, (low, high) = HILLS[name]
    draw = random.Random(name)
    with mp.workdps(40):
        top = mp.findroot(lambda x: mp.diff(height, x), near)
        places = [draw.uniform(low, high) for _ in range(COUNT)]
        gaps = [draw.choice((1, -1)) * mpf(10) ** -draw.uniform(8, 15) for _ in places]
        speeds = [
            float(mp.sqrt(2 * G * (height(top) - height(mpf(lam0))) * (1 + gap)))
            for lam0, gap in zip(places, gaps, strict=True)
        ]
    return places, speeds, [draw.choice((1, -1)) for _ in places], float(top) - 0.01, top


@pytest.fixture(scope="module")
def modules(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ModuleType]:
    """Return the module of each curve."""
    folder: Path = tmp_path_factory.mktemp("hills")
    return {
        name: gqm.build(gqm.derive(curve, gqm.Gravity()), name=f"hills_{name}", folder=folder)
        for name, (curve, *_) in HILLS.items()
    }


def asked(motion: Any, quantity: str, place: float) -> Any:
    """Return the quantity of a solved motion, or None if it has none."""
    if quantity == "turning_points":
        return tuple(sorted(motion.turning_points)) if motion.kind == "libration" else None
    if quantity in ("v_min", "v_max"):
        return getattr(motion, quantity).value if motion.kind in ("libration", "circulation") else None
    try:
        found = motion.time_at(place) if quantity == "time_at" else getattr(motion, quantity)
    except GQMError:
        return None
    return found if np.isfinite(found) else None


@pytest.mark.extended
@pytest.mark.parametrize("name", HILLS)
def test_a_sweep_next_to_a_separatrix(name: str, modules: dict[str, ModuleType]) -> None:
    """A sweep gives the same kinds of motion, and values that differ by roundings times the condition number."""
    places, speeds, directions, target, top = launches(name)
    module, height = modules[name], HILLS[name][1]
    motions = [module.solve(*launch) for launch in zip(places, speeds, directions, strict=True)]
    conditions = np.array([max(motion.condition_number, 1.0) for motion in motions])
    for quantity in ("turning_points", "half_period", "period", "time_at", "v_max", "v_min"):
        lam = {"lam": target} if quantity == "time_at" else {}
        swept = module.sweep(quantity, np.array(places), np.array(speeds), np.array(directions), **lam)
        for k, motion in enumerate(motions):
            told, value = asked(motion, quantity, target), np.asarray(swept.values[k])
            assert (told is None) == (not np.isfinite(value).all()), (quantity, places[k], speeds[k], told, value)
            if told is None:
                continue
            size = speeds[k] if quantity == "v_min" else np.max(np.abs(told))
            error = np.max(np.abs(value - told)) / size
            assert error <= 2e-15 * conditions[k], (quantity, places[k], speeds[k], told, value)
        if quantity == "v_min":
            for k in (k for k, motion in enumerate(motions) if motion.kind == "circulation"):
                with mp.workdps(40):
                    slowest = mp.sqrt(mpf(speeds[k]) ** 2 - 2 * G * (height(top) - height(mpf(places[k]))))
                    rounding = mpf(2e-15) * mpf(speeds[k]) ** 2 / slowest
                    assert abs(mpf(float(swept.values[k])) - slowest) <= rounding
                    assert abs(mpf(motions[k].v_min.value) - slowest) <= rounding


# The error of the time of a body that passes a hilltop, in units in the last place. In doubles alone, measured from the
# launch, it is the inverse of the share of V**2 at the hilltop.
MAX_PASSING_ULPS = 6.0


def ulps(value: float, truth: Any) -> float:
    """Return the error of a value in units in its last place."""
    return abs(float((mpf(value) - truth) / mpf(float(np.spacing(value)))))


@pytest.mark.extended
def test_bodies_that_pass_a_hilltop_closely_on_a_closed_curve(modules: dict[str, ModuleType]) -> None:
    """Lap times and arrivals agree with elliptic integrals, and no launch is solved singly."""
    gaps = 10.0 ** -np.array([2.1, 3.2, 4.3, 6.4, 8.5])
    speeds, module = np.sqrt(4.0 * 9.81 * (1.0 + gaps)), modules["pendulum"]
    laps, arrivals = module.sweep("period", 0.0, speeds), module.sweep("time_at", 0.0, speeds, -1, lam=-9.0)
    assert (laps.route == SINGLE).all()
    assert (arrivals.route == SINGLE).all()
    with mp.workdps(40):
        for speed, lap, arrival in zip(speeds.tolist(), laps.values, arrivals.values, strict=True):
            m = 4 * mpf("9.81") / mpf(speed) ** 2
            assert ulps(float(lap), 4 / mpf(speed) * mp.ellipk(m)) <= MAX_PASSING_ULPS
            assert ulps(float(arrival), 2 / mpf(speed) * mp.ellipf(mpf(9) / 2, m)) <= MAX_PASSING_ULPS


def test_arrivals_of_bodies_that_start_at_rest_beside_a_hilltop(modules: dict[str, ModuleType]) -> None:
    """Times at places on a swing that begins beside the top, and at ones beside where it turns, are answered by
    compiled code to the last place of their closed form, an incomplete elliptic integral.
    """
    pendulum = modules["pendulum"]
    lam0, lam = np.pi - np.array([1e-2, 1e-3, 1e-4, 1e-5]), np.array([[1.0], [-2.0], [-3.0], [-3.125]])
    swept = pendulum.sweep("time_at", lam0, 0.0, -1, lam=lam)
    assert (swept.route == SINGLE).all()
    with mp.workdps(40):
        for (k, j), value in np.ndenumerate(swept.values):
            modulus = mp.sin(mpf(lam0[j]) / 2)
            phase = mp.asin(mp.sin(mpf(lam[k, 0]) / 2) / modulus)
            truth = (mp.ellipk(modulus**2) - mp.ellipf(phase, modulus**2)) / mp.sqrt(mpf(9.81))
            assert ulps(float(value), truth) <= 2


@pytest.mark.extended
def test_bodies_that_pass_a_hilltop_closely_and_leave(tmp_path: Path) -> None:
    """The time until bodies leave is that of the integral, whether they turn before or not."""
    curve = gqm.Curve.graph("a*(x**4 - 2*x**2)", parameter="x", domain=(-2, "3/2"))
    model = gqm.derive(curve, gqm.Gravity(), parameters={"a": "1/3"})
    module = gqm.build(model, name="hill_to_leave", folder=tmp_path)

    for lam0, direction, gap in (
        (0.75, 1, 1e-5),
        (-1.25, 1, 1e-3),
        (-1.25, -1, 1e-3),
        (-1.0, -1, 1e-6),
        (1.4375, 1, 1e-2),
    ):
        with mp.workdps(30):
            g, end, start = mpf("9.81"), mpf(3) / 2, mpf(lam0)
            # Bodies just reach the end at 3/2, which is as high as -3/2 and higher than the hilltop at 0.
            speed = float(mp.sqrt(2 * g * (mpf(3) / 16 - (start**4 - 2 * start**2) / 3) * (1 + mpf(gap))))
            root = mp.sqrt((1 - start**2) ** 2 + 3 * mpf(speed) ** 2 / (2 * g))
            turn = -mp.sqrt(1 + root)

            def after_turn(u: Any, turn: Any = turn, root: Any = root, g: Any = g) -> Any:
                """Return dt/du for x = turn + u**2; V**2 is a polynomial with known zeros."""
                x = turn + u**2
                slope = 4 * (x**3 - x) / 3
                return mp.sqrt(6 * (1 + slope**2) / (g * (-2 * turn - u**2) * (x**2 - 1 + root)))

            begin, last = mp.sqrt(start - turn), mp.sqrt(end - turn)
            truth = mp.quad(after_turn, [last - (last - begin) * mpf(2) ** -k for k in range(24)] + [last])
            if direction < 0:
                truth += 2 * mp.quad(after_turn, [begin * k / 4 for k in range(5)])
        found = module.sweep("t_end", lam0, np.array([speed]), direction)
        assert found.route[0] == SINGLE
        assert ulps(float(found.values[0]), truth) <= MAX_PASSING_ULPS, (lam0, direction)


# The tolerance of half periods is twice the distance from 1 to the next double, relative.
TWO_ULPS = 2.0 * 2.0**-52

# The distances of an energy from that of a hilltop, as shares of the well's depth.
GAPS = np.geomspace(0.3, 1e-7, 40)


def test_half_periods_beside_a_hilltop_have_all_digits(modules: dict[str, ModuleType]) -> None:
    """For a pendulum thrown nearly to the top, half periods agree with the complete elliptic integral."""
    lam0 = np.linspace(-1.5, 2.0, GAPS.size)
    with mp.workdps(40):
        g = mpf("9.81")
        v0 = [float(mp.sqrt(2 * g * (mp.cos(x) + 1 - 2 * gap))) for x, gap in zip(lam0, GAPS, strict=True)]
        moduli = [(mpf(v) ** 2 / (2 * g) + 1 - mp.cos(x)) / 2 for x, v in zip(lam0, v0, strict=True)]
        truth = np.array([float(2 * mp.ellipk(m) / mp.sqrt(g)) for m in moduli])
    swept = modules["pendulum"].sweep("half_period", lam0, v0, np.resize([1, -1], GAPS.size))
    assert (swept.route < SOLVE).all()
    assert swept.values == pytest.approx(truth, rel=TWO_ULPS, abs=0.0)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", ["uneven_wells", "two_wells", "waves"])
def test_times_beside_a_hilltop_are_those_of_solving(name: str, modules: dict[str, ModuleType]) -> None:
    """Compiled code finds correctly rounded half periods and lap times without solving."""
    _, height, near, (low, high) = HILLS[name]
    lam0 = np.linspace(low, high, 12)
    with mp.workdps(40):
        top = height(mp.findroot(lambda x: mp.diff(height, x), near))
        v0 = [
            float(mp.sqrt(max(0, 2 * G * (top - height(mpf(x)) - gap * mpf("0.1")))))
            for x, gap in zip(lam0, GAPS[4:], strict=False)
        ]
    swept = modules[name].sweep("half_period", lam0, v0)
    assert (swept.route < SOLVE).all()
    motions = [modules[name].solve(*launch) for launch in zip(lam0, v0, strict=True)]
    times = [motion.half_period if motion.kind == "libration" else np.nan for motion in motions]
    assert swept.values == pytest.approx(np.array(times), rel=TWO_ULPS, abs=0.0, nan_ok=True)


@pytest.mark.extended
def test_wells_with_cusps(tmp_path: Path) -> None:
    """A body that falls along an inverted arch of a cycloid ends at its cusp, after 2 arcosh(1/cos(u/2))/sqrt(g).

    With p = cos(u/2), ds is 4 dp and V**2 is 4 g (p**2 - p0**2), where p0 is that of the launch.
    """
    curve = gqm.Curve.parametric(x="u - sin(u)", z="-cos(u)", parameter="u")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="hills_with_cusps", folder=tmp_path)
    lam0 = np.concatenate([np.linspace(-2.9, -0.1, 40), np.linspace(0.1, 2.9, 40)])
    with mp.workdps(30):
        truth = np.array([float(2 * mp.acosh(1 / mp.cos(mpf(u) / 2)) / mp.sqrt(G)) for u in lam0.tolist()])
    np.testing.assert_allclose(module.sweep("t_end", lam0).values, truth, rtol=4e-15)
    for quantity in ("half_period", "period", "turning_points"):
        swept = module.sweep(quantity, lam0, 0.3)
        assert np.isnan(swept.values).all()
        assert swept.status.all()
    for u in lam0[::13].tolist():
        assert module.solve(u).kind == "transit"
