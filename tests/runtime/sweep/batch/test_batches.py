"""Batches answer the right orbits with the times of single motions, and no orbit jumps a barrier."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.runtime.compiled.strided import pointers
from gqm_sym.runtime.sweep import quantities
from gqm_sym.runtime.sweep.batch.batches import answer_batches
from gqm_sym.runtime.sweep.single.slow_places import NO_TAPE

ModuleOf = Callable[[str], ModuleType]

ULPS = 4.0


def answered(
    module: ModuleType,
    lam0: Any,
    v0: Any,
    ways: Any,
    p: list[float],
    domain: tuple[float, float, float],
    *,
    asked: int,
    mirrors: tuple[float, float] = (np.nan, 0.0),
    monotone: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Answer launches by batches alone; the symmetry is unknown unless ``mirrors`` gives it."""
    known = (*domain, mirrors[0], np.nan, mirrors[1], 0.0)
    columns = [np.asarray(v, dtype=float) for v in (lam0, v0, ways, 0.0, *known, *p)]
    n = max(column.size for column in columns)
    lines = [np.broadcast_to(column, n) for column in columns]
    out, status = np.full((n, 2), np.nan), np.full(n, quantities.UNDECIDED, dtype=np.int8)
    answers = quantities.Answers(out, status, np.zeros_like(status))
    each = module.MODEL.batch
    layout = (each.orbit_rows, each.integrand_rows, -1)
    answer_batches(each.addresses(), layout, pointers(lines), monotone, asked, False, NO_TAPE, answers)
    return out, status


CIRCLE = (-np.inf, np.inf, 2 * np.pi)
# The symmetry of a circle may be given in three ways: not at all, its axes, and that heights between them are monotone.
SAID: dict[str, dict[str, Any]] = {
    "nothing": {},
    "axes": {"mirrors": (0.0, np.pi)},
    "all": {"mirrors": (0.0, np.pi), "monotone": True},
}


@pytest.mark.parametrize("said", SAID)
@pytest.mark.parametrize("count", [1, 7, 8, 131])
def test_every_pendulum_away_from_the_top_is_answered(count: int, said: str, module_of: ModuleOf) -> None:
    """The half periods of any number of launches are answered within a few last places."""
    amplitude = np.linspace(0.01, 2.5, count)
    p = [1.0, 9.81, 1.0]
    out, status = answered(
        module_of("circle"), amplitude, 0.0, 1, p, CIRCLE, asked=quantities.HALF_PERIOD, **SAID[said]
    )
    assert (status == quantities.ANSWERED).all()
    for value, a in zip(out[:, 0], amplitude, strict=True):
        with mp.workdps(40):
            truth = 2 * mp.ellipk(mp.sin(mpf(float(a)) / 2) ** 2) / mp.sqrt(mpf("9.81"))
        assert abs(mpf(float(value)) - truth) <= ULPS * np.spacing(float(truth))


# So many of 300 launches are left to be solved singly if no symmetry is given: they go downhill and far up the other
# side, and bounds of the slope do not prove that nothing stops them before.
UNPROVED = {1: 30, -1: 23}

# From these amplitudes on, batches leave times of thrown bodies until the turning points have more digits.
NEAR_TOP = 2.0


@pytest.mark.parametrize("said", SAID)
@pytest.mark.parametrize("way", [1, -1])
def test_a_known_symmetry_changes_nothing(way: int, said: str, module_of: ModuleOf) -> None:
    """Launches with any speed from anywhere on any turn of the circle have the same turning points and times."""
    rng = np.random.default_rng(11)
    lowest = 2 * np.pi * rng.integers(-3, 4, 300)
    place, reach = rng.uniform(-1.5, 1.5, 300), rng.uniform(1.6, 2.8, 300)
    v0 = np.sqrt(2 * 9.81 * (np.cos(place) - np.cos(reach)))
    launch = (lowest + place, v0, way, [1.0, 9.81, 1.0], CIRCLE)
    ends, why = answered(module_of("circle"), *launch, asked=quantities.TURNING_POINTS, **SAID[said])
    done = why == quantities.ANSWERED
    left = UNPROVED[way] if said == "nothing" else 0
    assert np.count_nonzero(~done) == left
    assert (place[~done] * way < 0).all()
    assert ends[done] == pytest.approx(np.column_stack([lowest - reach, lowest + reach])[done], rel=4e-15, abs=4e-15)
    times, why = answered(module_of("circle"), *launch, asked=quantities.HALF_PERIOD, **SAID[said])
    timed, clear = why == quantities.ANSWERED, reach < NEAR_TOP
    assert (timed[clear] == done[clear]).all()
    assert done[timed].all()
    for value, a in zip(times[timed, 0], 0.5 * (ends[timed, 1] - ends[timed, 0]), strict=True):
        with mp.workdps(40):
            truth = 2 * mp.ellipk(mp.sin(mpf(float(a)) / 2) ** 2) / mp.sqrt(mpf("9.81"))
        assert value == pytest.approx(float(truth), rel=4e-15)


@pytest.mark.parametrize("said", SAID)
@pytest.mark.parametrize("way", [1, -1])
def test_laps(way: int, said: str, module_of: ModuleOf) -> None:
    """Loop times of fast launches are right in both directions, and there are no turning points."""
    places = np.linspace(-3.0, 3.0, 13)
    v0 = np.sqrt(8.0**2 - 2 * 9.81 * (1 - np.cos(places)))
    p = [1.0, 9.81, 1.0]
    out, status = answered(module_of("circle"), places, v0, way, p, CIRCLE, asked=quantities.PERIOD, **SAID[said])
    assert (status == quantities.ANSWERED).all()
    with mp.workdps(40):
        truth = float(4 * mp.ellipk(4 * mpf("9.81") / 64) / 8)
    # Speeds are rounded, and the loop time is that of the energy that they mean.
    assert out[:, 0] == pytest.approx(truth, rel=2e-15)
    ends = answered(module_of("circle"), places, v0, way, p, CIRCLE, asked=quantities.TURNING_POINTS, **SAID[said])
    assert (ends[1] == quantities.NOT_PERIODIC).all()
    halves = answered(module_of("circle"), places, v0, way, p, CIRCLE, asked=quantities.HALF_PERIOD, **SAID[said])
    assert (halves[1] == quantities.NOT_PERIODIC).all()


@pytest.mark.parametrize("turns", [0, 1, -2, 50])
def test_small_swings_on_any_turn(turns: int, module_of: ModuleOf) -> None:
    """Near any axis the place of release is known to more digits than a double has, or is found."""
    amplitude = 10.0 ** np.linspace(-4.0, 0.4, 40)
    lam0 = 2 * np.pi * turns + amplitude
    swept = module_of("circle").sweep("half_period", lam0, L=1).values
    for value, place in zip(swept, lam0, strict=True):
        with mp.workdps(40):
            away = mpf(float(place)) - 2 * mp.pi * turns
            truth = 2 * mp.ellipk(mp.sin(away / 2) ** 2) / mp.sqrt(mpf(9.81))
        assert abs(mpf(float(value)) - truth) <= ULPS * np.spacing(float(truth))


@pytest.mark.extended
def test_barriers_are_not_jumped(tmp_path: Path) -> None:
    """On a track of hills every orbit stays in its own valley, however narrow the next hill."""
    curve = gqm.Curve.graph("x**2/4 + 3*exp(-(x - 1)**2/w**2)", parameter="x", parameters={"w": 1})
    hills = gqm.build(gqm.derive(curve, gqm.Gravity()), name="hills_in_batches", folder=tmp_path)
    rng = np.random.default_rng(5)
    lam0, v0 = rng.uniform(-4, 4, 200), rng.uniform(0, 6, 200) * (rng.random(200) < 0.7)
    width, ways = 10.0 ** rng.uniform(-3, 0, 200), rng.choice([1, -1], 200)
    swept = hills.sweep("turning_points", lam0, v0, ways, w=width)
    for k in range(60):
        motion = hills.solve(float(lam0[k]), float(v0[k]), int(ways[k]), w=float(width[k]))
        assert swept.values[k] == pytest.approx(sorted(motion.turning_points), rel=1e-14)
    x, w = sp.symbols("x w")
    height = sp.lambdify((x, w), x**2 / 4 + 3 * sp.exp(-((x - 1) ** 2) / w**2))
    for k in range(200):
        low, high = swept.values[k]
        top = min(max(1.0, low + 0.001 * (high - low)), high - 0.001 * (high - low))
        places = np.append(np.linspace(low, high, 500)[1:-1], top)
        left = v0[k] ** 2 + 2 * 9.81 * (height(lam0[k], width[k]) - height(places, width[k]))
        assert (left > 0).all()


@pytest.mark.extended
def test_wells_within_wells(module_of: ModuleOf) -> None:
    """In a double well the outer orbits are their own mirror images, and the inner ones are not; both may be in one
    batch.
    """
    well = module_of("double_well")
    height = np.random.default_rng(3).uniform(-0.24, 1.0, 300)  # of lam**4 - lam**2
    height = height[np.abs(height) > 0.02]
    far = np.sqrt(0.5 * (1 + np.sqrt(1 + 4 * height)))
    near = np.where(height < 0, np.sqrt(np.abs(0.5 * (1 - np.sqrt(1 + 4 * height)))), -far)
    swept = well.sweep("turning_points", far)
    assert swept.values == pytest.approx(np.column_stack([near, far]), rel=1e-13)
    times = well.sweep("half_period", far).values
    for k in range(0, far.size, 10):
        assert times[k] == pytest.approx(well.solve(float(far[k])).half_period, rel=2e-15)


@pytest.mark.parametrize("strength", [1e-8, 1e8])
def test_units_decide_nothing(strength: float, module_of: ModuleOf) -> None:
    """Under another gravity the same swings are answered, and the same are left, those next to the top."""
    lam0 = np.linspace(0.1, np.pi - 0.01, 40)
    one, other = (
        answered(module_of("circle"), lam0, 0.0, 1, [1.0, g, 1.0], CIRCLE, asked=quantities.HALF_PERIOD)
        for g in (1.0, strength)
    )
    assert set(one[1]) == {quantities.ANSWERED, quantities.UNDECIDED}
    assert (other[1] == one[1]).all()
    assert other[0][:, 0] * np.sqrt(strength) == pytest.approx(one[0][:, 0], rel=2e-15, nan_ok=True)


@pytest.mark.parametrize("said", SAID)
def test_what_cannot_be_proved_is_left(said: str, module_of: ModuleOf) -> None:
    """Launches at the top, next to it, and with NaN are left."""
    lam0 = [np.pi, np.pi - 1e-9, np.nan, 0.3]
    p = [1.0, 9.81, 1.0]
    out, status = answered(module_of("circle"), lam0, 0.0, 1, p, CIRCLE, asked=quantities.HALF_PERIOD, **SAID[said])
    assert list(status) == [quantities.UNDECIDED, quantities.UNDECIDED, quantities.UNDECIDED, quantities.ANSWERED]
    assert np.isnan(out[:3, 0]).all()


@pytest.mark.extended
def test_released_beside_the_top(module_of: ModuleOf) -> None:
    """A body released beside the top swings nearly all the way round and back, and does not go round."""
    beside = 10.0 ** -np.arange(1.0, 13.0)
    swept = module_of("circle").sweep("half_period", np.pi - beside, L=1)
    with mp.workdps(40):
        for lam0, value in zip(np.pi - beside, swept.values, strict=True):
            k = mp.sin(mpf(float(lam0)) / 2)
            truth = 2 * mp.ellipk(k * k) / mp.sqrt(mpf("9.81"))
            assert abs(mpf(float(value)) - truth) <= ULPS * np.spacing(float(truth))


# The tolerance of half periods of batches is twice the distance from 1 to the next double, relative.
TWO_ULPS = 2.0 * 2.0**-52


@pytest.mark.extended
def test_half_periods_on_a_curve_of_several_waves(tmp_path: Path) -> None:
    """Also far from zero, half periods agree to the last places with `solve`, which rounds correctly, and most are in
    batches.
    """
    curve = gqm.Curve.polar("cos(4*t)", parameter="t", period="2*pi")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="several_waves", folder=tmp_path)
    wells = [(4.1, 4.6), (-2.2, -1.7), (0.3, 0.6)]
    lam0 = np.concatenate([np.random.default_rng(5).uniform(*well, 8) for well in wells])
    swept = module.sweep("half_period", lam0)
    truth = np.array([module.solve(place).half_period for place in lam0.tolist()])
    assert (swept.route == quantities.BATCH).mean() > 0.7
    assert swept.values == pytest.approx(truth, rel=TWO_ULPS, abs=0.0)


@pytest.mark.extended
def test_wells_about_neighbouring_axes_differ(tmp_path: Path) -> None:
    """Swings about both poles of a circle, also of a rolling body's centre, have the time of their own well."""
    law = gqm.Potential("G*z - k*z**2") + gqm.Rolling(radius="rho")
    module = gqm.build(gqm.derive(gqm.families.circle(L="1"), law), name="two_poles", folder=tmp_path)
    size, reach = 0.75, np.array([0.05, 0.4, 0.9])
    given = {"G": 3.0, "k": 8.0, "rho": 1.0 - size, "beta": 0.5}

    def half_period(start: mpf, pole: int) -> mpf:
        def height(angle: mpf) -> mpf:
            return -3 * size * mp.cos(angle) - 8 * (size * mp.cos(angle)) ** 2

        half = start - mp.pi * pole

        def rate(u: mpf) -> mpf:
            drop = height(start) - height(mp.pi * pole + half * mp.sin(u))
            return half * mp.cos(u) * size * mp.sqrt(mpf(3) / 4 / drop)

        return 2 * mp.quad(rate, [0, mp.pi / 4, mp.pi / 2], method="gauss-legendre")

    for pole in (0, 1, -1, 3, 100):
        swept = module.sweep("half_period", np.pi * pole + reach, **given)
        assert swept.route_counts() == {"batch": reach.size}
        for start, value in zip(np.pi * pole + reach, swept.values.tolist(), strict=True):
            with mp.workdps(30):
                assert value == pytest.approx(float(half_period(mpf(start), pole)), rel=4e-15)
    # A body that is larger than the circle does not fit into it.
    refused = module.sweep("turning_points", reach, **{**given, "rho": [0.25, 1.25, 1.25]})
    assert refused.status.tolist() == [quantities.ANSWERED, quantities.REFUSED, quantities.REFUSED]


@pytest.mark.extended
def test_pieces_of_a_proof_are_small_beside_a_pole(tmp_path: Path) -> None:
    """Bounds of the slope of this potential are too wide next to 0, where its terms have poles that cancel; equal
    pieces of an orbit that reaches this place would have to be too many. V**2 does not lose the digits that cancel.
    """
    curve = gqm.Curve.graph("-x*cos(x)/sin(x) - x/2", parameter="x", domain=("0.04", 3))
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="pole_beside", folder=tmp_path)
    starts = np.linspace(0.12, 0.35, 9)
    swept, times = module.sweep("turning_points", starts), module.sweep("half_period", starts)
    assert swept.route_counts() == times.route_counts() == {"batch": starts.size}
    nodes = 100
    for start, (low, high), time in zip(starts.tolist(), swept.values.tolist(), times.values.tolist(), strict=True):
        with mp.workdps(25):
            level = start * mp.cot(start) + mpf(start) / 2
            top = mp.findroot(lambda x, level=level: x * mp.cot(x) + x / 2 - level, high)
            assert low == start
            assert abs(high - top) <= ULPS * np.spacing(high)
            rates = []
            for k in range(nodes):
                sine, cosine = mp.sin((k + mpf(1) / 2) * mp.pi / nodes), mp.cos((k + mpf(1) / 2) * mp.pi / nodes)
                x = (start + top - (top - start) * cosine) / 2
                ds2 = 1 + (mp.cot(x) - x / mp.sin(x) ** 2 + mpf(0.5)) ** 2
                rates.append(sine * mp.sqrt(ds2 / (2 * mpf("9.81") * (x * mp.cot(x) + x / 2 - level))))
            assert abs(time - mp.fsum(rates) * (top - start) / 2 * mp.pi / nodes) <= 2 * np.spacing(time)
