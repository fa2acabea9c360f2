"""Sweeps over launches and parameters agree with closed forms, and with single motions."""

import math
import pickle
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import generated.circle_rotating as circle_rotating
import gqm_sym as gqm
from generated import cycloid, log_spiral
from gqm_sym.errors import InputError, ParameterError, SolutionError
from gqm_sym.runtime.compiled import threads
from gqm_sym.runtime.sweep.quantities import STATUS_SENTENCES

ModuleOf = Callable[[str], ModuleType]

# The tolerance of half periods away from barriers, in units in the last place.
ULPS = 4.0
# An extreme is flat, so that its value has the digits of V or N themselves, relative to the largest.
LOAD = 4e-15
# The tolerance of an arrival by panels against the exact reading.
ARRIVAL = 4e-15


def _pendulum(amplitude: float, length: float) -> mpf:
    """Return the half period of a pendulum in closed form."""
    with mp.workdps(40):
        k = mp.sin(mpf(amplitude) / 2)
        return 2 * mp.ellipk(k * k) * mp.sqrt(mpf(length) / mpf("9.81"))


def test_half_periods_of_pendulums(module_of: ModuleOf) -> None:
    """Released from rest anywhere away from the top, with any length, pendulums have half periods within a few last
    places of the closed form.
    """
    rng = np.random.default_rng(11)
    amplitude, length = np.append(rng.uniform(1e-6, 2.5, 150), [1e-8, 1e-3]), rng.uniform(0.1, 10.0, 152)
    got = module_of("circle").sweep("half_period", amplitude, L=length)
    assert not got.status.any()
    for value, a, el in zip(got.values, amplitude, length, strict=True):
        truth = _pendulum(float(a), float(el))
        assert abs(mpf(float(value)) - truth) <= ULPS * np.spacing(float(truth))


def test_launched_with_speed_it_is_the_orbit_that_counts(module_of: ModuleOf) -> None:
    """Launches at other phases of one swing have its period, both upwards and downwards."""
    top = 1.25
    places = np.linspace(-1.2, 1.2, 7)
    speeds = np.sqrt(2 * 9.81 * (np.cos(places) - np.cos(top)))
    got = module_of("circle").sweep("period", places[:, None], speeds[:, None], [1, -1], L=1)
    assert got.values.shape == got.status.shape == (7, 2)
    # Speeds are rounded, and the period is that of the amplitude that they mean.
    assert got.values == pytest.approx(2 * float(_pendulum(top, 1.0)), rel=1e-15)


# The launches are whole turns away, and speeds are in units of the one that just reaches the top.
LAUNCHES = [(turns, reach) for turns in (0, 1, -100) for reach in (1e-9, 1e-3, 0.4, 0.9)]


@pytest.mark.parametrize(("turns", "reach"), LAUNCHES)
def test_launched_anywhere_on_any_turn(turns: int, reach: float, module_of: ModuleOf) -> None:
    """A pendulum's half period is as accurate as the square of a speed and a place in doubles determine it."""
    rng = np.random.default_rng(5)
    lam0 = 2 * np.pi * turns + rng.uniform(-2.0, 2.0, 24)
    v0 = reach * np.sqrt(2 * 9.81 * (1 + np.cos(lam0)))
    swept = module_of("circle").sweep("half_period", lam0, v0, rng.choice([-1, 1], 24), L=1)
    assert not swept.status.any()
    with mp.workdps(40):
        for value, place, speed in zip(swept.values, map(float, lam0), map(float, v0), strict=True):

            def truth(w: mpf, place: float = place) -> mpf:
                square = mp.sin(mpf(place) / 2) ** 2 + w / (4 * mpf("9.81"))
                return mp.pi / mp.sqrt(mpf("9.81")) / mp.agm(1, mp.sqrt(1 - square))

            w = mpf(speed) ** 2
            # The tolerance is three roundings of V**2 from the lowest place to the top.
            rounding = abs(mp.diff(truth, w)) * 3 * mpf(2) ** -53 * 4 * mpf("9.81")
            assert abs(mpf(float(value)) - truth(w)) <= ULPS * np.spacing(float(value)) + rounding


def test_loop_times_of_whirling_pendulums(module_of: ModuleOf) -> None:
    """From the bottom loop times are 4 K/v0, and there are no half periods and no turning points."""
    v0 = np.linspace(7.0, 30.0, 20)
    circle = module_of("circle")
    got = circle.sweep("period", 0.0, v0, L=1)
    for value, v in zip(got.values, v0, strict=True):
        with mp.workdps(40):
            truth = 4 * mp.ellipk(4 * mpf("9.81") / mpf(float(v)) ** 2) / mpf(float(v))
        assert abs(mpf(float(value)) - truth) <= ULPS * np.spacing(float(truth))
    for quantity in ("half_period", "turning_points"):
        none = circle.sweep(quantity, 0.0, v0, L=1)
        assert np.isnan(none.values).all()
        assert none.status_counts() == {STATUS_SENTENCES[2]: 20}


def test_next_to_a_barrier_the_exact_problem_answers(module_of: ModuleOf) -> None:
    """Orbits that doubles cannot time have all digits too."""
    amplitude = np.pi - np.array([1e-2, 1e-4, 1e-8])
    got = module_of("circle").sweep("half_period", amplitude, L=1)
    for value, a in zip(got.values, amplitude, strict=True):
        truth = _pendulum(float(a), 1.0)
        assert abs(mpf(float(value)) - truth) <= np.spacing(float(truth))


def test_the_tautochrone_is_one(module_of: ModuleOf) -> None:
    """Every amplitude takes 2 pi sqrt(R/g)."""
    radius = np.array([[0.5], [2.0]])
    got = module_of("cycloid_plus").sweep("half_period", np.linspace(0.1, 3.0, 9), R=radius)
    assert got.values == pytest.approx(2 * np.pi * np.sqrt(np.broadcast_to(radius, (2, 9)) / 9.81), rel=6e-16)


@pytest.mark.parametrize("v0", [0.0, 1.5, 9.0])
def test_turning_points_and_loads_as_of_one_motion(v0: float, module_of: ModuleOf) -> None:
    """Speeds and contact forces of a pendulum are extreme at the bottom, and at the turns or the top."""
    circle = module_of("circle")
    lam0 = np.array([0.4, 0.9])
    bottom = np.sqrt(v0**2 + 2 * 9.81 * (1 - np.cos(lam0)))
    climbed = np.maximum(v0**2 - 2 * 9.81 * (1 + np.cos(lam0)), 0.0)
    height = np.cos(lam0) - v0**2 / (2 * 9.81) if v0 < 9 else np.full(2, -1.0)
    for quantity, truth, scale in (
        ("v_max", bottom, bottom),
        ("v_min", np.sqrt(climbed), bottom),
        ("normal_force_max", bottom**2 + 9.81, bottom**2 + 9.81),
        ("normal_force_min", climbed + 9.81 * height, bottom**2 + 9.81),
    ):
        got = circle.sweep(quantity, lam0, v0, L=1)
        assert (np.abs(got.values - truth) <= LOAD * scale).all(), quantity
    if v0 < 9.0:
        got = circle.sweep("turning_points", lam0, v0, L=1)
        for pair, start in zip(got.values, lam0, strict=True):
            assert list(pair) == pytest.approx(sorted(circle.solve(start, v0, L=1).turning_points), rel=5e-16)


@pytest.mark.extended
def test_largest_loads_where_one_maximum_becomes_two(module_of: ModuleOf) -> None:
    """On the ellipse with axes 2 and 1 the load is largest at the bottom, and beside it for releases higher than -1/3.

    As a function of the height z it is g*(4*(z0 - z)/(1 + 3*z**2)**(3/2) - 2*z/sqrt(1 + 3*z**2)), with a stationary
    place at z = z0 - sqrt(z0**2 + 1/3). At the boundary the maximum is of the fourth order.
    """
    lam0 = -np.arcsin(np.concatenate([np.linspace(0.3, 0.36, 300), 1 / 3 + np.geomspace(1e-9, 1e-3, 60)]))
    lam0 = np.concatenate([lam0, -np.arcsin(1 / 3 - np.geomspace(1e-9, 1e-3, 60))])
    z0 = np.sin(lam0)
    z = np.maximum(z0 - np.sqrt(z0**2 + 1 / 3), -1.0)
    truth = 9.81 * (4 * (z0 - z) / (1 + 3 * z**2) ** 1.5 - 2 * z / np.sqrt(1 + 3 * z**2))
    got = module_of("ellipse").sweep("normal_force_max", lam0, a=2, b=1)
    assert got.values == pytest.approx(truth, rel=LOAD, abs=0.0)
    assert got.route_counts() == {"single": lam0.size}  # none is slow


def test_loads_next_to_a_barrier(module_of: ModuleOf) -> None:
    """An orbit that is left to the exact problem has its largest load at the bottom too."""
    top = np.pi - 1e-5
    got = module_of("circle").sweep("normal_force_max", top, L=1)
    assert got.values == pytest.approx(9.81 * (1 + 2 * (1 - np.cos(top))), rel=LOAD)


def test_arrivals(module_of: ModuleOf) -> None:
    """First times at places ahead, behind, beyond the turn and laps away are those of one motion, and NaN if there is
    none.
    """
    circle = module_of("circle")
    for lam0, v0, way in ((0.5, 1.0, 1), (0.5, 1.0, -1), (0.5, 0.0, 1), (0.0, 9.0, 1), (0.0, 9.0, -1)):
        motion = circle.solve(lam0, v0, way, L=1)
        places = np.array([-0.4, 0.2, 0.5, 0.52, 4.0, -9.0])
        got = circle.sweep("time_at", lam0, v0, way, lam=places, L=1)
        for value, place, reason in zip(got.values, places, got.status, strict=True):
            if reason:
                assert STATUS_SENTENCES[reason] == "the motion is never at the place asked for"
                assert np.isnan(value)
                assert motion.kind == "libration" or (place - lam0) * way < 0
            else:
                # Both are differences of times since the turn of up to half a period, and have errors in its last
                # place.
                last = np.spacing(0.5 * motion.period)
                assert value == pytest.approx(motion.time_at(float(place)), rel=ARRIVAL, abs=last)


def _falls(places: int) -> tuple[np.ndarray, np.ndarray]:
    """Return distances of launches from an axis, and places on the way through it, many of them a moment later."""
    rng = np.random.default_rng(3)
    start = rng.uniform(0.1, 2.6, places)
    share = np.append(rng.uniform(0.0, 1.0, places - places // 4), 10.0 ** rng.uniform(-12, -1, places // 4))
    return start, start - 2.0 * share * start


def test_arrivals_of_released_pendulums(module_of: ModuleOf) -> None:
    """Arrivals have all digits, in the first moments too."""
    start, places = _falls(40)
    swept = module_of("circle").sweep("time_at", start, lam=places, L=1)
    assert not swept.status.any()
    for value, a, x in zip(swept.values, map(float, start), map(float, places), strict=True):
        with mp.workdps(40):
            k = mp.sin(mpf(a) / 2)
            fallen = mp.ellipk(k * k) - mp.ellipf(mp.asin(mp.sin(mpf(x) / 2) / k), k * k)
        assert value == pytest.approx(float(fallen / mp.sqrt(mpf("9.81"))), rel=ARRIVAL)


@pytest.mark.parametrize("speed", [0.0, 1e-6, 1.0])
def test_arrivals_on_ellipses(speed: float, module_of: ModuleOf) -> None:
    """Arrivals agree with single motions, however many terms the series needs."""
    start, places = (distances - np.pi / 2 for distances in _falls(24))
    ellipse = module_of("ellipse")
    swept = ellipse.sweep("time_at", start, speed, -1, lam=places, a=2, b=1)
    assert not swept.status.any()
    for value, a, x in zip(swept.values, map(float, start), map(float, places), strict=True):
        motion = ellipse.solve(a, speed, -1, a=2, b=1)
        # A single motion reads times off places that are rounded, as differences of times since the turn.
        once = motion.time_at(x)
        rounding = np.spacing(abs(x)) * 2 / abs(motion.state(once).v) + 2 * np.spacing(0.5 * motion.period)
        assert value == pytest.approx(once, rel=ARRIVAL, abs=rounding)


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("track", "v0", "size"),
    [
        ("ellipse", 0.0, {"a": 2, "b": 1}),
        ("ellipse", 7.5, {"a": 2, "b": 1}),
        ("circle", 0.3, {"L": 1}),
        ("quartic", 1.0, {}),
        ("double_well", 0.5, {}),
    ],
)
def test_extremes_beat_all_states(track: str, v0: float, size: dict[str, Any], module_of: ModuleOf) -> None:
    """Of many states none has a larger or a smaller load, and the most extreme of them comes near."""
    module = module_of(track)
    for lam0 in (0.3, 1.1):
        motion = module.solve(lam0, v0, **size)
        state = motion.state(np.linspace(0.0, motion.period, 20_001))
        for name, values in (("v", np.abs(state.v)), ("normal_force", state.normal_force)):
            sweeps = (module.sweep(f"{name}_{which}", lam0, v0, **size) for which in ("max", "min"))
            most, least = (float(swept.values) for swept in sweeps)
            scale = np.abs(values).max()
            assert values.max() - LOAD * scale <= most <= values.max() + 1e-3 * scale
            assert values.min() + LOAD * scale >= least >= values.min() - 1e-3 * scale


def test_what_has_no_answer_says_why(module_of: ModuleOf) -> None:
    """NaN as input, a place outside the domain and a motion that leaves give codes, not exceptions."""
    got = module_of("cycloid_arch").sweep("period", [np.nan, 99.0, 3.5], R=1)
    assert np.isnan(got.values).all()
    assert [STATUS_SENTENCES[code] for code in got.status] == [
        "the launch or a parameter is not a finite number",
        "the launch place lies outside the domain",
        "the motion is not of a kind that has this quantity",
    ]
    assert sum(got.status_counts().values()) == 3


def test_a_long_sweep_is_cut_and_joined(module_of: ModuleOf) -> None:
    """Threads and chunks change nothing, and broadcast columns need not be copied in memory."""
    amplitude = np.linspace(0.1, 1.0, 300)
    length = np.linspace(0.5, 2.0, 120)[:, None]
    circle = module_of("circle")
    whole = circle.sweep("half_period", amplitude, L=length)
    assert whole.values.shape == (120, 300)
    assert (whole.values[77] == circle.sweep("half_period", amplitude, L=float(length[77, 0])).values).all()


@pytest.mark.extended
def test_extremes_of_a_motion_that_ends(generated_folder: Path) -> None:
    """None of many states exceeds the extremes, and the most extreme of these comes near."""
    model = gqm.derive(gqm.families.circle(L=1), gqm.Gravity() + gqm.CoulombFriction(mu="0.1"))
    ring = gqm.build(model, name="rough_ring", folder=generated_folder)
    for v0 in (2.0, 9.0):
        motion = ring.solve(0.5, v0)
        state = motion.state(np.linspace(0.0, motion.t_end, 100_000))
        for name, values in (("v", np.abs(state.v)), ("normal_force", state.normal_force)):
            most, least = (float(ring.sweep(f"{name}_{which}", 0.5, v0).values) for which in ("max", "min"))
            scale = np.abs(values).max()
            assert values.max() - LOAD * scale <= most <= values.max() + 1e-7 * scale
            assert values.min() + LOAD * scale >= least >= values.min() - 1e-7 * scale


def test_a_force_may_be_infinite() -> None:
    """The force is infinite at a cusp that the body passes, and at the pole into which a spiral winds."""
    assert cycloid.sweep("normal_force_min", [0.5, 0.6]).values.tolist() == [-math.inf] * 2
    assert not log_spiral.sweep("normal_force_max", [1.9, 2.0], 2.5).status.any()


def test_columns_may_be_read_only(module_of: ModuleOf) -> None:
    """Arrays that must not be written to, such as a memory map's, may be columns too."""
    amplitude = np.linspace(0.1, 1.0, 5)
    amplitude.flags.writeable = False
    assert not module_of("circle").sweep("half_period", amplitude, L=1).status.any()


def test_mistakes_are_named(module_of: ModuleOf) -> None:
    """An unknown quantity, a missing place, a negative speed, shapes that do not fit and a length below zero are
    named.
    """
    sweep = module_of("circle").sweep
    with pytest.raises(InputError, match="quantity: must be one of half_period"):
        sweep("frequency", 0.1, L=1)
    with pytest.raises(InputError, match="lam: must be given with"):
        sweep("time_at", 0.1, L=1)
    with pytest.raises(InputError, match="v0: is a speed"):
        sweep("period", 0.1, [1.0, -1.0], L=1)
    with pytest.raises(InputError, match="direction: must be"):
        sweep("period", 0.1, 1.0, 0, L=1)
    with pytest.raises(InputError, match=r"lam0 \(2,\), v0 \(3,\)"):
        sweep("period", [0.1, 0.2], [1, 2, 3], L=1)
    with pytest.raises(ParameterError, match="L: must be positive"):
        sweep("period", 0.1, L=[1.0, -1.0])
    with pytest.raises(ParameterError, match="L: has no default"):
        sweep("period", 0.1)


def test_loads_of_a_swing_next_to_the_top(module_of: ModuleOf) -> None:
    """On orbits that are solved singly N is m g (3 - 2 cos A) at the bottom, and m g cos(A) at the turn."""
    amplitude = np.pi - np.array([1e-7, 1e-9])
    circle = module_of("circle")
    most, least = (circle.sweep(f"normal_force_{end}", amplitude, L=1).values for end in ("max", "min"))
    assert most == pytest.approx(9.81 * (3 - 2 * np.cos(amplitude)), rel=LOAD)
    assert least == pytest.approx(9.81 * np.cos(amplitude), rel=LOAD)
    assert circle.sweep("v_max", amplitude, L=1).values == pytest.approx(np.sqrt(4 * 9.81), rel=LOAD)


def test_cores_where_the_system_tells_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without an affinity all cores of the machine count as this process's, and at least one."""
    monkeypatch.delattr(threads.os, "sched_getaffinity")
    for count, cores in ((6, 6), (None, 1)):
        threads.cores.cache_clear()
        monkeypatch.setattr(threads.os, "cpu_count", lambda count=count: count)
        assert threads.cores() == cores
    threads.cores.cache_clear()


def test_a_sweep_is_an_array_of_its_values(module_of: ModuleOf) -> None:
    """NumPy reads the values of a sweep; statuses, routes and pickles have the same shape."""
    swept = module_of("circle").sweep("half_period", [0.1, 0.2, np.nan], L=1)
    assert np.array_equal(np.asarray(swept), swept.values, equal_nan=True)
    assert np.asarray(swept, dtype=np.float32).dtype == np.float32
    assert (swept.status == [0, 0, 3]).all()
    assert swept.status_counts() == {STATUS_SENTENCES[3]: 1}
    again = pickle.loads(pickle.dumps(swept))
    assert type(again) is type(swept)
    assert all(np.array_equal(one, other, equal_nan=True) for one, other in zip(again, swept, strict=True))


def test_the_route_of_each_launch(module_of: ModuleOf) -> None:
    """Batches answer ordinary orbits, a loop answers extremes, and `solve` what doubles do not decide."""
    circle = module_of("circle")
    places = np.linspace(-1.0, 1.0, 40)
    assert circle.sweep("half_period", places, L=1).route_counts() == {"batch": 40}
    assert circle.sweep("v_max", places, L=1).route_counts() == {"single": 40}
    assert circle.sweep("t_end", places, L=1, t_max=2).route_counts() == {"single": 40}
    assert circle.sweep("rest_position", places, L=1).route_counts() == {"solve": 40}


def test_actions_and_their_gradients(module_of: ModuleOf) -> None:
    """For a pendulum the action is 16 sqrt(g L**3) (E(m) - (1 - m) K(m)), and its derivative by the energy is the
    period.
    """
    circle, places = module_of("circle"), np.array([0.5, 1.5, 3.0])
    swept = circle.sweep("action", places, L=1, g=9.81, gradient="lam0")
    for place, value in zip(places.tolist(), swept.values.tolist(), strict=True):
        m = mp.sin(mpf(place) / 2) ** 2
        true = 16 * mp.sqrt(mpf(9.81)) * (mp.ellipe(m) - (1 - m) * mp.ellipk(m))
        assert value == pytest.approx(float(true), rel=1e-14)
    periods = circle.sweep("period", places, L=1, g=9.81).values
    assert swept.gradient[:, 0] == pytest.approx(periods * 9.81 * np.sin(places), rel=1e-13)
    assert circle.sweep("action", 3.0, 9.0, L=1, t_max=0.5).status == 0
    resting = circle.solve(0, L=1)
    assert (resting.rest_position, circle.sweep("rest_position", 0, L=1).values) == (0.0, 0.0)
    with pytest.raises(SolutionError, match="goes on for ever and does not come to rest"):
        circle.solve(1, L=1).rest_position  # noqa: B018
    assert circle.solve(1, L=1, t_max=2).gradient("t_end", "L") == {"L": 0.0}
    with pytest.raises(SolutionError, match="goes on for ever and has no t_end"):
        circle.solve(1, L=1).gradient("t_end", "L")


@pytest.mark.parametrize(("old", "new"), [("reasons", "status"), ("why", "status_counts")])
def test_old_names_of_a_sweep(old: str, new: str, module_of: ModuleOf) -> None:
    """An earlier name is refused with the present one."""
    with pytest.raises(AttributeError, match=f"{old}.* {new}"):
        getattr(module_of("circle").sweep("period", 0.5, L=1), old)


def test_bodies_leave_an_endless_hill(module_of: ModuleOf) -> None:
    """From the top of a quartic hill (a bowl whose gravity pulls upwards), no body is followed to where it would
    fall.
    """
    speeds, g = np.array([0.5, 1.0, 2.5]), mpf(9.81)
    swept = module_of("quartic").sweep("t_end", 0.0, speeds, contact="below", g=-9.81)
    assert swept.route_counts() == {"single": speeds.size}

    def time_of_flight(v0: mpf) -> mpf:
        place = mp.findroot(lambda x: 12 * v0**2 * x**2 + 8 * g * x**6 - g, 0.5)
        return mp.quad(lambda x: mp.sqrt((1 + 16 * x**6) / (v0**2 + 2 * g * x**4)), mp.linspace(0, place, 5))

    for v0, value in zip(speeds.tolist(), swept.values.tolist(), strict=True):
        with mp.workdps(30):
            assert value == pytest.approx(float(time_of_flight(mpf(v0))), rel=1e-13)


@pytest.mark.sample(1)
@pytest.mark.parametrize("omega", [0.7, 2.0, 3.0, 4.0])
def test_a_hoop_that_turns(omega: float) -> None:
    """Above sqrt(g/L) the lowest place is a hilltop between two wells; batches answer below and above it."""
    v0, g, square = np.array([1.0, 2.0, 4.0]), mpf(9.81), mpf(omega) ** 2
    swept = {name: circle_rotating.sweep(name, 0.0, v0, Omega=omega) for name in ("turning_points", "half_period")}
    assert swept["half_period"].route_counts() == {"batch": v0.size}
    for k, speed in enumerate(map(mpf, v0.tolist())):
        with mp.workdps(40):
            cosine = (g - mp.sqrt((g - square) ** 2 + square * speed**2)) / square
            top = mp.acos(cosine)

            def rate(u: mpf, top: mpf = top, speed: mpf = speed) -> mpf:
                angle = top * mp.sin(u)
                v2 = speed**2 - 2 * g * (1 - mp.cos(angle)) + square * mp.sin(angle) ** 2
                return top * mp.cos(u) / mp.sqrt(v2)

            truth = 2 * mp.quad(rate, mp.linspace(0, mp.pi / 2, 9), method="gauss-legendre")
            assert abs(swept["half_period"].values[k] / truth - 1) < 1e-15
            assert abs(swept["turning_points"].values[k] / np.array([-top, top]) - 1).max() < 4e-16


# These graphs z(x), with their derivatives, are swept more widely than closed forms of second divided differences hold:
# over one turn of a wave, or a narrow range of hyperbolic functions, from places about the last number.
WIDE = {
    "wave": ("x**2/2 + sin(3*x)/10", lambda x: x**2 / 2 + mp.sin(3 * x) / 10, lambda x: x + 3 * mp.cos(3 * x) / 10, 0),
    "chain": ("cosh(x) + x/3", lambda x: mp.cosh(x) + x / 3, lambda x: mp.sinh(x) + mpf(1) / 3, 0),
    "far": ("cosh(x-31) + x/3", lambda x: mp.cosh(x - 31) + x / 3, lambda x: mp.sinh(x - 31) + mpf(1) / 3, 31),
}


@pytest.mark.extended
@pytest.mark.parametrize("name", WIDE)
def test_wide_orbits_stay_in_batches(name: str, generated_folder: Path) -> None:
    """Half periods of orbits as wide as possible have all digits."""
    text, z, slope, about = WIDE[name]
    module = gqm.build(
        gqm.derive(gqm.Curve.graph(text, parameter="x"), gqm.Gravity()), name=f"wide_{name}", folder=generated_folder
    )
    places = about + np.array([1.2, 1.9, 2.3] if about else [1.2, 1.9])
    swept = module.sweep("half_period", places)
    assert swept.route_counts() == {"batch": places.size}
    for place, value in zip(places.tolist(), swept.values.tolist(), strict=True):
        with mp.workdps(25):
            high = mpf(place)
            below = 2 * about - high - 1, about - mpf("0.2")
            low = mp.findroot(lambda x, top=high: z(x) - z(top), below, solver="anderson")
            half, middle = (high - low) / 2, (high + low) / 2

            def rate(u: mpf, middle: mpf = middle, half: mpf = half, top: mpf = high) -> mpf:
                x = middle + half * mp.sin(u)
                return half * mp.cos(u) * mp.sqrt((1 + slope(x) ** 2) / (2 * mpf("9.81") * (z(top) - z(x))))

            truth = mp.quad(rate, mp.linspace(-mp.pi / 2, mp.pi / 2, 9), method="gauss-legendre")
            assert abs(value / truth - 1) < 4.5e-16


@pytest.fixture(scope="module")
def incline(generated_folder: Path) -> ModuleType:
    """Return a straight line from x = -1 to x = 2, down a slope of 3 in 4, with the acceleration g*3/5 along it."""
    line = gqm.Curve.graph("-3*x/4", parameter="x", domain=(-1, 2))
    return gqm.build(gqm.derive(line, gqm.Gravity()), name="incline", folder=generated_folder)


# A row has launch place, speed and direction: from rest; down; up to a turning point and back; up and out; from the end
# inwards.
LEAVING = np.array([[0.5, 0, 1], [-1, 1, 1], [0.3, 2, -1], [1.5, 0.01, -1], [0.5, 9, -1], [2, 3, -1]], dtype=float)


def test_bodies_leave_through_the_ends_of_a_line(incline: ModuleType) -> None:
    """With constant acceleration everything has a closed form, and nothing is solved singly."""
    (lam0, v0, direction), pull = LEAVING.T, 0.6 * 9.81
    out_below = v0**2 > 2 * pull * 1.25 * (lam0 + 1)
    out_below &= direction < 0
    way = 1.25 * np.where(out_below, lam0 + 1, 2 - lam0)
    v_end = np.sqrt(v0**2 + 2 * pull * np.where(out_below, -way, way))
    expected = {
        "t_end": np.where(out_below, v0 - v_end, v_end - direction * v0) / pull,
        "v_max": np.maximum(v0, v_end),
        "v_min": np.where(direction > 0, v0, np.where(out_below, v_end, 0.0)),
        "normal_force_max": np.full(lam0.size, 0.8 * 9.81),
    }
    for quantity, values in expected.items():
        swept = incline.sweep(quantity, lam0, v0, direction)
        assert swept.route_counts() == {"single": lam0.size}
        assert swept.values == pytest.approx(values, rel=2e-14, abs=1e-15)
    assert incline.sweep("half_period", lam0, v0, direction).status_counts() == {STATUS_SENTENCES[2]: lam0.size}


@pytest.mark.extended
def test_bodies_that_leave_come_to_places(incline: ModuleType) -> None:
    """Bodies reach places before and behind the turning point, but none beyond it or against the direction of
    motion.
    """
    lam0, v0, direction = LEAVING.T
    pull, top = 0.6 * 9.81 / 1.25, np.where(direction < 0, lam0 - (v0 / 1.25) ** 2 / (2 * 0.6 * 9.81 / 1.25), lam0)
    for place in (-0.9, 0.1, 0.4, 1.0, 1.9):
        swept = incline.sweep("time_at", lam0, v0, direction, lam=place)
        assert swept.route_counts() == {"single": lam0.size}
        speed = np.sqrt(np.maximum((v0 / 1.25) ** 2 + 2 * pull * (place - lam0), 0.0))
        ahead, down, out = direction * (place - lam0) > 0, direction > 0, top < -1
        first = np.where(ahead & ~down, v0 / 1.25 - speed, speed - direction * v0 / 1.25) / pull
        never = (place < top) | (~ahead & (down | out))
        assert swept.values == pytest.approx(np.where(never, np.nan, first), rel=1e-13, nan_ok=True)


@pytest.mark.extended
def test_a_narrow_peak_of_the_load(generated_folder: Path) -> None:
    """Where r = 1/sin(theta) - 2 turns round the origin, the grid of an orbit is much coarser than the peak."""
    curve = gqm.Curve.polar("1/sin(theta) - 2", parameter="theta", domain=("0.1", "3.04"))
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="conchoid", folder=generated_folder)
    lam0, v0 = np.array([1.15546, 0.6]), np.array([7.866, 5.0])
    swept = module.sweep("normal_force_max", lam0, v0, 1)
    for k, value in enumerate(swept.values.tolist()):
        motion = module.solve(lam0[k], v0[k])
        places = np.linspace(lam0[k], motion.legs[-1].lam_end, 40_001)
        loads = module.pass1(places, lam0[k], v0[k]).normal_force
        assert loads.max() * (1 - 1e-13) <= value <= loads.max() * (1 + 1e-5)


def test_small_swings_keep_contact(module_of: ModuleOf) -> None:
    """Next to the bottom a panel of a table resolves less than the orbit, but no launch is solved singly for that."""
    swept = module_of("circle").sweep("t_end", 10.0 ** np.linspace(-9, -1, 9), contact="above", t_max=5.0, L=1)
    assert swept.values.tolist() == [5.0] * 9
    assert swept.route_counts() == {"single": 9}


@pytest.mark.extended
@pytest.mark.parametrize("quantity", ["half_period", "period", "turning_points"])
def test_motions_that_end_at_cusps_are_not_solved_one_by_one(quantity: str) -> None:
    """On the hump of a cycloid bodies slide down to the cusp at either end, and none of their motions repeats."""
    places, speeds = np.linspace(0.3, 6.0, 50), np.linspace(0.0, 2.0, 3)[:, np.newaxis]
    found = cycloid.sweep(quantity, places, speeds)
    assert found.route_counts() == {"single": found.status.size}
    assert np.isnan(found.values).all()
    assert found.status_counts() == {STATUS_SENTENCES[2]: found.status.size}
    assert cycloid.solve(1.0, 0.5).kind == "transit"
