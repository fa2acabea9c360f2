"""Motions that do not repeat are right: transits, open ends, one turning point, and the approach to an equilibrium."""

import math
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.errors import InputError, SolutionError

ModuleOf = Callable[[str], ModuleType]

G = mpf("9.81")
# The tolerance relative to the largest place, speed or time of the motion so far: quadrature, the table and the place's
# own rounding.
POSITION = 1e-14
TIME = 1e-14
# A time and its place determine each other to the rounding of both.
INVERSE = 1e-14

WELL_SPEED = "sqrt(2*9.81*({0}**2 - {0}**4))"  # to the barrier of the double well, by energy

LAUNCHES: dict[str, tuple[str, dict[str, Any]]] = {
    "falling": ("slope", {"lam0": 3, "angle": "1/2"}),
    "thrown up": ("slope", {"lam0": 3, "v0": 8, "angle": "1/2"}),
    "level": ("slope", {"lam0": -1, "v0": 2, "direction": -1, "angle": 0}),
    "cubic escaping": ("cubic", {"lam0": -1, "v0": 1, "direction": -1}),
    "cubic turning": ("cubic", {"lam0": -1, "v0": 3}),
    "cubic from rest": ("cubic", {"lam0": "1/2"}),
    "through the domain": ("frequency", {"lam0": -1, "v0": 9, "a": 1}),
    "out of the domain": ("frequency", {"lam0": -1, "v0": 9, "direction": -1, "a": 1}),
    "to the hilltop": ("circle", {"lam0": 0, "v0": "2*sqrt(9.81)", "L": 1}),
    "released level with a barrier": ("double_well", {"lam0": 1}),
    "to a barrier by a turn": ("double_well", {"lam0": "1/2", "v0": WELL_SPEED.format("(1/2)")}),
}


@pytest.fixture(scope="session")
def passage(generated_folder: Any, module_of: ModuleOf) -> Callable[..., Any]:
    """Return a motion of the table by its name, with further arguments."""
    curve = gqm.Curve.parametric(x="s*cos(angle)", z="s*sin(angle)", parameter="s")
    slope = gqm.build(gqm.derive(curve, gqm.Gravity()), name="slope", folder=generated_folder)

    def solve(name: str, **more: Any) -> Any:
        track, launch = LAUNCHES[name]
        return (slope if track == "slope" else module_of(track)).solve(**(launch | more))

    return solve


def off(actual: Any, truth: Any) -> float:
    """Return the absolute difference, formed at the working precision of the truth."""
    return float(abs(mpf(float(actual)) - truth))


@pytest.mark.parametrize("t", [0.0, 0.125, 1.0, 17.0, 1e3, 1e6])
def test_free_fall_on_a_line(t: float, passage: Callable[..., Any]) -> None:
    """Thrown up a slope or released on it, a body has s = s0 + v0 t - g sin t**2/2 and v = v0 - g sin t for ever."""
    with mp.workdps(40):
        pull = G * mp.sin(mpf("0.5"))
        for name, v0 in (("falling", 0), ("thrown up", 8)):
            motion, fallen = passage(name), pull * mpf(t) ** 2 / 2
            state = motion.state(t)
            assert motion.kind == "transit"
            assert motion.t_end == math.inf
            assert off(motion.lam(t), 3 + v0 * t - fallen) <= POSITION * float(3 + v0 * t + fallen)
            assert off(state.lam, 3 + v0 * t - fallen) <= POSITION * float(3 + v0 * t + fallen)
            assert off(state.s, v0 * t - fallen) <= POSITION * float(3 + v0 * t + fallen)
            assert off(state.v, v0 - pull * t) <= POSITION * float(v0 + pull * t)


def test_a_throw_turns_where_and_when_the_textbook_says(passage: Callable[..., Any]) -> None:
    """The body turns after v0/(g sin) at v0**2/(2 g sin), and returns to the launch with its speed reversed."""
    motion = passage("thrown up")
    with mp.workdps(40):
        pull = G * mp.sin(mpf("0.5"))
        (turn,) = motion.turning_points
        assert off(turn, 3 + 32 / pull) <= POSITION * float(turn)
        assert off(motion.legs[0].t_end, 8 / pull) <= TIME * motion.legs[0].t_end
        assert off(motion.time_at(-100), (8 + mp.sqrt(64 + 206 * pull)) / pull) <= TIME * 30
        assert off(motion.state(16 / pull).v, mpf(-8)) <= POSITION * 8
    assert motion.turning_points == (motion.legs[0].lam_end,)


@pytest.mark.parametrize("place", ["-1.001", "-1.5", "-4", "-100"])
def test_down_a_cubic(place: str, passage: Callable[..., Any]) -> None:
    """The time to a place is the integral of ds/V, with or without a turn before, and the body is there at that
    time.
    """
    with mp.workdps(30):

        def time(start: mpf, stop: mpf, w0: mpf) -> mpf:
            def rate(u: mpf) -> mpf:  # the substitution for the root is right from a turn, and harmless elsewhere
                x = start + (stop - start) * u**2
                return mp.sqrt((1 + 9 * x**4) / abs(w0 + 2 * G * (-1 - x**3))) * 2 * abs(stop - start) * u

            return mp.quad(rate, [0, 0.01, 0.05, 0.2, 0.5, 1])

        there = mpf(place)
        escaping = time(mpf(-1), there, mpf(1))
        top = -mp.cbrt(1 - 9 / (2 * G))
        turning = time(top, mpf(-1), mpf(9)) + time(top, there, mpf(9))
        for name, truth in (("cubic escaping", escaping), ("cubic turning", turning)):
            motion = passage(name)
            assert off(motion.time_at(place), truth) <= TIME * float(truth)
            speed = mp.sqrt({"cubic escaping": 1, "cubic turning": 9}[name] + 2 * G * (-1 - there**3))
            pace = speed / mp.sqrt(1 + 9 * there**4)
            t = float(truth)
            allowed = POSITION * float(abs(there)) + float(pace) * math.ulp(t)
            assert off(motion.lam(t), there) <= allowed
            assert off(motion.state(t).v, -speed) <= POSITION * float(speed) * 10


@pytest.mark.parametrize("t", [0.0, 0.25, 1.0, 4.0, 11.0, 40.0, 200.0])
def test_the_separatrix_of_the_pendulum(t: float, passage: Callable[..., Any]) -> None:
    """Launched to the hilltop, the body has the angle pi - 4 atan(exp(-w t)) and the speed 2 w L/cosh(w t), as long as
    doubles hold it.

    The speed keeps its relative accuracy when the angle has long been pi to rounding; its limit is w t times the last
    place of the time.
    """
    motion = passage("to the hilltop")
    state = motion.state(t)
    with mp.workdps(150):
        w = mp.sqrt(G)
        speed = 2 * w / mp.cosh(w * t)
        assert off(state.lam, mp.pi - 4 * mp.atan(mp.exp(-w * t))) <= POSITION * math.pi
        assert off(state.v, speed) <= POSITION * float(speed) * max(1.0, float(w) * t)
    assert motion.kind == "asymptotic"
    assert motion.t_end == math.inf
    assert state.lam <= math.pi


@pytest.mark.parametrize("gap", ["2", "0.1", "1e-3", "1e-6"])
def test_from_one_hilltop_to_the_other(gap: str, module_of: ModuleOf) -> None:
    """Launched ever closer to the hilltop behind, at the speed of the separatrix, the motion keeps its digits.

    Relative to the hilltop ahead, V**2 is a small difference of large numbers there: positions were once off by 1e-4.
    """
    motion = module_of("circle").solve(lam0=f"-pi + {gap}", v0=f"2*sqrt(9.81)*sin({gap}/2)", L=1)
    assert motion.kind == "asymptotic"
    with mp.workdps(40):
        w = mp.sqrt(G)
        begun = mp.log(mp.tan(mpf(gap) / 4)) / w
        for t in np.linspace(0.0, 8.0, 33):
            clock = w * (mpf(float(t)) + begun)
            state = motion.state(float(t))
            assert off(state.lam, 4 * mp.atan(mp.exp(clock)) - mp.pi) <= POSITION * math.pi
            assert off(state.v, 2 * w / mp.cosh(clock)) <= POSITION * 2 * float(w)


@pytest.mark.sample(2)
@pytest.mark.parametrize("start", ["0.25", "0.5", "0.9", "0.999", "0.999999"])
def test_back_to_the_barrier_by_a_turn(start: str, module_of: ModuleOf) -> None:
    """In z = x**4 - x**2 with the energy of its barrier the body turns at 1 and comes back, ever slower, to 0."""
    motion = module_of("double_well").solve(lam0=start, v0=WELL_SPEED.format(start))
    with mp.workdps(30):

        def time(angle: mpf) -> mpf:  # from the turn at 1 to the place x = cos(angle)
            def rate(a: mpf) -> mpf:
                x = mp.cos(a)
                return mp.sqrt((1 + (4 * x**3 - 2 * x) ** 2) / (2 * G)) / x

            return mp.quad(rate, mp.linspace(0, angle, 9))

        out = time(mp.acos(mpf(start)))
        assert motion.kind == "asymptotic"
        assert [leg.end for leg in motion.legs] == ["turn", "asymptote"]
        assert off(motion.turning_points[0], mpf(1)) <= 2.0**-52
        # A passage starts at the double nearest to the launch place; close to the turn the difference takes time.
        slowest = mp.sqrt(2 * G * (mpf(start) ** 2 - mpf(start) ** 4))
        rounding = float(mp.sqrt(5) / slowest) * math.ulp(float(start))
        assert off(motion.legs[0].t_end, out) <= TIME * float(out) + rounding
        for place in ("0.2", "0.01", "1e-6"):
            truth = out + time(mp.acos(mpf(place)))
            assert off(motion.time_at(place), truth) <= TIME * float(truth) + rounding


def test_closer_to_an_equilibrium_than_doubles_can_tell(passage: Callable[..., Any]) -> None:
    """When the distance leaves the range of doubles, an error says so, and earlier times are still answered."""
    motion = passage("to the hilltop")
    with pytest.raises(gqm.GQMError, match="closer to the equilibrium"):
        motion.lam(1000.0)
    assert motion.lam(200.0) == pytest.approx(math.pi, rel=0, abs=POSITION)


@pytest.mark.parametrize("name", LAUNCHES)
def test_legs_are_joined(name: str, passage: Callable[..., Any]) -> None:
    """Legs follow each other in time and place from the launch on, each has the place of its ends, and events are in
    order.
    """
    motion = passage(name, t_max="2.5")
    legs, events = motion.legs, motion.events
    assert (legs[0].t_start, legs[0].lam_start) == (0.0, motion.lam(0))
    assert legs[-1].t_end == motion.t_end <= 2.5
    for before, after in pairwise(legs):
        assert (before.t_end, before.lam_end) == (after.t_start, after.lam_start)
        assert before.end == "turn"
        assert before.direction == -after.direction
    for leg in legs:
        assert leg.t_start < leg.t_end
        assert (leg.lam_end - leg.lam_start) * leg.direction > 0
        for t, lam in ((leg.t_start, leg.lam_start), (leg.t_end, leg.lam_end)):
            assert motion.lam(t) == pytest.approx(lam, rel=POSITION, abs=POSITION)
    assert [event.t for event in events] == sorted(event.t for event in events)
    assert [e.kind for e in events if e.kind != "contact-sign"] == [leg.end for leg in legs]
    for event in events:
        state = motion.state(event.t)
        place = (state.lam, state.x, state.z)
        assert (event.lam, event.x, event.z) == pytest.approx(place, rel=POSITION, abs=20 * POSITION)


@pytest.mark.parametrize("name", LAUNCHES)
def test_velocity_and_arc_length_follow_the_legs(name: str, passage: Callable[..., Any]) -> None:
    """The sign of v is the leg's direction; s is 0 at launch, grows with lam, and changes as v says."""
    motion = passage(name, t_max="2.5")
    assert motion.state(0).s == 0.0
    for leg in motion.legs:
        t = np.linspace(leg.t_start, leg.t_end, 41)[1:-1]
        state = motion.state(t)
        assert (np.sign(state.v) == leg.direction).all()
        assert (np.diff(state.lam) * leg.direction > 0).all()
        assert (np.diff(state.s) * leg.direction > 0).all()
        # Simpson's rule for the speed has an error of fourth order in the share of a leg.
        rule = (t[2] - t[0]) / 6 * (state.v[:-2:2] + 4 * state.v[1:-1:2] + state.v[2::2])
        assert np.diff(state.s[::2]) == pytest.approx(rule, rel=1e-3)


@pytest.mark.parametrize("name", LAUNCHES)
def test_places_and_times_invert_each_other(name: str, passage: Callable[..., Any]) -> None:
    """The body is first at a place at the time for it, if it was not there before."""
    motion = passage(name, t_max="2.5")
    leg = motion.legs[0]
    for t in np.linspace(leg.t_start, leg.t_end, 13)[1:-1]:
        lam = motion.lam(t)
        rate = abs(motion.lam(t * (1 + 1e-6)) - lam) / (1e-6 * t)
        assert motion.time_at(lam) == pytest.approx(t, rel=INVERSE, abs=4 * math.ulp(lam) / rate)
    assert motion.time_at(motion.problem.launch.lam0.text) == 0.0


@pytest.mark.parametrize("name", LAUNCHES)
def test_questions_out_of_time_are_refused(name: str, passage: Callable[..., Any]) -> None:
    """Times before the launch and after the end, and NaN, are refused; the end itself has an answer."""
    motion = passage(name, t_max="2.5")
    assert math.isfinite(motion.lam(motion.t_end))
    for t in (-1e-9, [0.5, -1.0], math.nextafter(motion.t_end, math.inf), [0.0, 3.0], math.nan):
        for ask in (motion.lam, motion.state, motion.error_bound):
            with pytest.raises(gqm.GQMError, match=r"^t: "):
                ask(t)
    for ask in (lambda: motion.period, lambda: motion.half_period, lambda: motion.period_to(5)):
        with pytest.raises(gqm.GQMError, match=motion.kind):
            ask()


def test_a_place_never_reached_has_no_time(passage: Callable[..., Any]) -> None:
    """A place above the turn, behind the launch or beyond the horizon gives an error that says where the motion
    goes.
    """
    for name, place in (("thrown up", 20), ("falling", 4), ("to the hilltop", 4), ("cubic from rest", 1)):
        with pytest.raises(gqm.GQMError, match="never at"):
            passage(name, t_max=2).time_at(place)


def test_the_horizon_ends_a_motion_and_changes_nothing_before(passage: Callable[..., Any]) -> None:
    """With t_max, positions before it are those without it, and the last leg and event say "horizon"."""
    for name in ("falling", "cubic turning", "to the hilltop"):
        free, bound = passage(name), passage(name, t_max="3/2")
        t = np.linspace(0.0, 1.5, 31)
        assert bound.lam(t) == pytest.approx(free.lam(t), rel=POSITION, abs=POSITION)
        assert bound.t_end == 1.5
        assert bound.legs[-1].end == bound.events[-1].kind == "horizon"
        assert bound.events[-1].t == bound.legs[-1].t_end == 1.5


def test_the_end_of_the_domain_ends_a_motion(passage: Callable[..., Any]) -> None:
    """The motion ends at the last place of the curve, at the time that follows from its energy."""

    def rate(x: mpf) -> mpf:
        depth, start = (mp.sqrt(2 * mp.pi) * mp.exp(-(mpf(u) ** 2) / 2) for u in (x, -1))
        return mp.sqrt((1 + (x * depth) ** 2) / (81 + 2 * G * (depth - start)))

    for name, stop in (("through the domain", 5), ("out of the domain", -5)):
        motion = passage(name)
        with mp.workdps(30):
            truth = abs(mp.quad(rate, mp.linspace(-1, stop, 9)))
        assert motion.kind == "transit"
        assert motion.legs[-1].end == motion.events[-1].kind == "domain-end"
        assert motion.legs[-1].lam_end == motion.lam(motion.t_end) == stop
        assert off(motion.t_end, truth) <= TIME * motion.t_end


def test_the_end_of_the_domain_is_a_place(generated_folder: Any) -> None:
    """The body arrives at the end of the domain also where that is a number whose double is less than it is."""
    plane = gqm.Curve.graph("-x", domain=(0, "pi"))
    motion = gqm.build(gqm.derive(plane, gqm.Gravity()), name="inclined", folder=generated_folder).solve(0, g="9.81")
    with mp.workdps(30):
        truth = mp.sqrt(4 * mp.pi / G)
    assert off(motion.time_at("pi"), truth) <= TIME * float(truth)
    assert motion.time_at("pi") == motion.t_end
    with pytest.raises(SolutionError, match="never at x = "):
        motion.time_at("pi + 1e-9")


@pytest.fixture(scope="module")
def brink(generated_folder: Any) -> ModuleType:
    """Return a curve with an endless fall at x = 0, a hilltop at 1, a well at 2, and an endless rise."""
    curve = gqm.Curve.graph("log(x) - 3*x/2 + x**2/4", domain=(0, None))
    return gqm.build(gqm.derive(curve, gqm.Gravity()), name="brink", folder=generated_folder)


def test_released_a_hair_beside_a_hilltop(brink: ModuleType) -> None:
    """The body turns at the height of the hilltop, which it leaves because of its exact place, and not farther away."""
    with mp.workdps(40):
        level = mp.findroot(lambda x: mp.log(x) - 3 * x / 2 + x**2 / 4 + mpf("1.25"), 3)
        motion = brink.solve("1 + 1e-14")
        assert motion.kind == "libration"
        assert off(max(motion.turning_points), level) <= math.ulp(3.0)
        assert off(min(motion.turning_points), 1 + mpf("1e-14")) <= math.ulp(1.0)


def test_a_fall_towards_a_pole(brink: ModuleType) -> None:
    """From 1/2, where the pole is nearer than a step, the time to a place is the integral of ds/V."""
    with mp.workdps(30):

        def height(x: mpf) -> mpf:
            return mp.log(x) - 3 * x / 2 + x**2 / 4

        def rate(u: mpf) -> mpf:
            x = mpf("0.5") - mpf("0.4") * u**2
            slope = 1 / x - mpf("1.5") + x / 2
            lost = height(mpf("0.5")) - height(x)
            return mp.sqrt((1 + slope**2) / (2 * G * lost)) * mpf("0.8") * u if u else mpf(0)

        truth = mp.quad(rate, [mpf("1e-12"), 0.25, 0.5, 0.75, 1]) + rate(mpf("1e-6")) * mpf("1e-12")
        motion = brink.solve("1/2")
        assert motion.kind == "transit"
        assert off(motion.time_at("0.1"), truth) <= TIME * float(truth)


def test_the_launch_is_the_number_given_and_not_its_double(passage: Callable[..., Any]) -> None:
    """Beside 1/10, which is not a double, places are reached at the times of the exact launch."""
    motion = passage("level", lam0="1/10", v0=4, direction=1)
    for steps in (1, 3, 1000):
        place = 0.1 + steps * 2.0**-54
        assert motion.time_at(place) == pytest.approx(float((Fraction(place) - Fraction(1, 10)) / 4), abs=5e-19)


@pytest.mark.parametrize("v0", [1e-2, 1e-3, 1e-5, 1e-7, 1e-8, 1.76e-12])
def test_a_slow_launch_uphill_takes_its_time(v0: float, module_of: ModuleOf) -> None:
    """The body turns next to the launch, so near that doubles do not give the time; ``make soak`` found this.

    From the top of a cycloid's arch the arc length obeys sigma'' = k**2 sigma with k**2 = g/(4R).
    """
    arch = module_of("cycloid_arch")
    start = 1.6958207696593393
    motion = arch.solve(start, v0, R="1/2", g="9.81")
    with mp.workdps(40):
        rate, top = mp.sqrt(G / 2), 2 * mp.cos(mpf(start) / 2)
        turn = mp.atanh(mpf(v0) / (rate * top)) / rate
        assert off(motion.legs[0].t_end, turn) <= TIME * turn
        assert [leg.direction for leg in motion.legs] == [1, -1]
        for t in (float(turn), 0.1, 0.2, 0.3, 0.4):
            state = motion.state(t)
            sigma = top * mp.cosh(rate * mpf(t)) - mpf(v0) / rate * mp.sinh(rate * mpf(t))
            assert off(state.lam, 2 * mp.acos(sigma / 2)) <= state.error <= POSITION


@pytest.mark.extended
def test_a_spiral_ends_at_its_centre(generated_folder: Any) -> None:
    """A spiral winds for ever over a finite length; the motion ends, and says when (``make soak`` found that it took
    for ever).
    """
    spiral = gqm.derive(gqm.families.log_spiral(), gqm.CentralForce())
    drawn = gqm.build(spiral, name="drawn_in", folder=generated_folder)
    motion = drawn.solve(0, 1, -1, r0=1, b="3/20", k=2)
    with pytest.raises(InputError, match="singular-point"):
        motion.lam(5.0)
    with mp.workdps(30):
        # ds = r sqrt(1 + 1/b**2) dr/r, and V**2 = 1 + 2k(1/r - 1).
        stretched = mp.sqrt(1 + 1 / mpf("0.15") ** 2)
        fall = mp.quad(lambda r: stretched / mp.sqrt(1 + 4 * (1 / r - 1)), [0, mpf(1) / 4, 1])
    assert off(motion.t_end, fall) <= TIME * fall
    assert motion.events[-1].kind == "singular-point"


def test_contact_lost_at_launch_ends_a_fall(generated_folder: Any) -> None:
    """A body under the arm of a spiral loses contact at once, though the spiral would lead to its centre."""
    drawn = gqm.build(gqm.derive(gqm.families.log_spiral(), gqm.CentralForce()), name="let_go", folder=generated_folder)
    for contact in ("above", "below"):
        motion = drawn.solve(2, 0, -1, r0=1, b="1/5", k=1, contact=contact)
        held = motion.state(0.0).normal_force * (1 if contact == "above" else -1) > 0.0
        assert held == (motion.t_end > 0.0)
        assert (motion.events[-1].kind, motion.t_end) == ("liftoff", 0.0) or held


@pytest.mark.extended
def test_a_fall_into_a_spiral_is_tabulated(generated_folder: Any) -> None:
    """The last turns take less time than two doubles resolve (``make soak`` found panels without end)."""
    spiral = gqm.build(gqm.derive(gqm.families.log_spiral(), gqm.Gravity()), name="wound_up", folder=generated_folder)
    launch = {"lam0": 1.3490766955876934, "v0": 3.2020412377682295, "r0": 0.23362934079070044}
    launch |= {"b": 0.16404457011909193, "g": 12.030635764538687}
    motion = spiral.solve(**launch)
    assert len(motion._trajectory(0.0).segments[1].segment.table[0]) < 1000
    with mp.workdps(30):
        r0, b, v0, lam0, g = (mpf(launch[name]) for name in ("r0", "b", "v0", "lam0", "g"))

        def squared(u: Any) -> Any:
            return v0**2 + 2 * g * r0 * (mp.exp(b * lam0) * mp.sin(lam0) - mp.exp(b * u) * mp.sin(u))

        def slowness(u: Any) -> Any:
            return r0 * mp.sqrt(1 + b * b) * mp.exp(b * u) / mp.sqrt(squared(u))

        turn = mp.findroot(squared, motion.turning_points[0])
        down = mp.quad(slowness, [lam0 - 2 * k for k in range(200, -1, -1)])
        up = mp.quad(lambda q: 2 * q * slowness(turn - q * q), [0, mp.sqrt(turn - lam0)]).real
        assert off(motion.legs[0].t_end, up) <= TIME * up
        assert off(motion.t_end, 2 * up + down) <= TIME * down


def answers(motion: Any) -> list[Any]:
    """Return the answers of a motion that do not depend on a time."""
    return [motion.kind, motion.t_end, motion.turning_points, *motion.legs, *motion.events, motion.condition_number]


@pytest.mark.extended
@pytest.mark.parametrize("contact", ["bilateral", "above", "below"])
@pytest.mark.parametrize(
    ("track", "launch"),
    [
        ("waves", {"lam0": 0, "v0": 8, "direction": -1}),
        ("waves", {"lam0": "pi/2", "v0": 2}),
        ("waves", {"lam0": "pi/2", "v0": 0}),
        ("waves", {"lam0": 0, "v0": "sqrt(2*981/100)"}),
        ("waves", {"lam0": 0, "v0": 30, "t_max": 7}),
        ("cubic", {"lam0": -1, "v0": 3}),
        ("fall", {"lam0": 1}),
        ("fall", {"lam0": 1, "v0": 1, "t_max": 10}),
        ("fall", {"lam0": 1, "v0": 2}),
    ],
)
def test_no_answer_depends_on_what_was_asked_before(
    track: str, launch: dict[str, Any], contact: str, open_tracks: dict[str, ModuleType]
) -> None:
    """A motion gives the same answers before and after it was followed far, and the same as one followed at once."""
    asked, fresh = (open_tracks[track].solve(**launch, contact=contact) for _ in range(2))
    before = answers(asked)
    end = min(asked.t_end, 80.0)
    if end > 0.0:
        assert asked.state(end).t == end
        if math.isinf(asked.t_end) and track == "waves" and asked.kind == "transit":
            assert asked.time_at(asked.lam(end / 2)) == pytest.approx(end / 2, rel=1e-12)
    assert answers(asked) == before
    if end > 0.0:
        fresh.state(end)
    assert answers(fresh) == before
    early, late = (
        motion.events_between(0, min(end, 20.0))
        for motion in (asked, open_tracks[track].solve(**launch, contact=contact))
    )
    assert early == late
    assert (
        early[: len(asked.events)] == tuple(event for event in asked.events if event.t <= min(end, 20.0))[: len(early)]
    )


@pytest.fixture(scope="module")
def open_tracks(generated_folder: Any, module_of: ModuleOf) -> dict[str, ModuleType]:
    """Return tracks without ends: waves, a cubic, and a line through the centre of an attraction."""
    waves = gqm.derive(gqm.Curve.graph("sin(x)", parameter="x"), gqm.Gravity())
    fall = gqm.derive(gqm.Curve.graph("0*x", parameter="x"), gqm.CentralForce(k=1))
    return {
        "waves": gqm.build(waves, name="waves", folder=generated_folder),
        "fall": gqm.build(fall, name="fall", folder=generated_folder),
        "cubic": module_of("cubic"),
    }


@pytest.mark.extended
def test_contact_lost_on_waves(open_tracks: dict[str, ModuleType]) -> None:
    """Thrown along z = sin(x) at 8 m/s a body leaves at N = 0, before it is asked for anything."""
    motion = open_tracks["waves"].solve("0", 8, -1, contact="above")
    with mp.workdps(40):
        n = lambda x: (64 - 2 * G * mp.sin(x)) * -mp.sin(x) + G * (1 + mp.cos(x) ** 2)  # noqa: E731
        place = mp.findroot(n, (-3.5, -3.4))
        assert off(motion.legs[-1].lam_end, place) <= 1e-13
        rate = lambda x: mp.sqrt((1 + mp.cos(x) ** 2) / (64 - 2 * G * mp.sin(x)))  # noqa: E731
        assert off(motion.t_end, mp.quad(rate, [place, -2, -1, 0])) <= TIME
    assert [event.kind for event in motion.events] == ["liftoff"]
    bilateral = open_tracks["waves"].solve("0", 8, -1)
    assert len(bilateral.events_between(0, 5)) == 10
    assert {event.kind for event in bilateral.events} == {"contact-sign"}


@pytest.mark.extended
def test_a_fall_into_a_centre_ends(open_tracks: dict[str, ModuleType]) -> None:
    """From rest at distance 1 the fall takes pi/2**(3/2), which is known without following the body first."""
    for launch in ({}, {"t_max": 10}):
        motion = open_tracks["fall"].solve(1, **launch)
        assert off(motion.t_end, mp.pi / mp.sqrt(8)) <= TIME * 2
        assert [event.kind for event in motion.events] == ["singular-point"]


@pytest.mark.parametrize(("place", "side"), [("pi/2", "below"), ("3*pi/2", "below"), ("-pi/2", "below")])
def test_rest_on_the_wrong_side(place: str, side: str, open_tracks: dict[str, ModuleType]) -> None:
    """A body released at an equilibrium under a track that cannot hold it falls off at once, as it does beside it."""
    for lam0 in (place, f"{place} + 1/1000"):
        motion = open_tracks["waves"].solve(lam0, contact=side)
        assert (motion.kind, motion.t_end, motion.state(0).v) == ("transit", 0.0, 0.0)
        assert [event.kind for event in motion.events] == [leg.end for leg in motion.legs] == ["liftoff"]
        with pytest.raises(InputError, match="liftoff"):
            motion.lam(1e-300)
    assert open_tracks["waves"].solve(place, contact="above").kind == "rest"


def test_rest_with_friction_on_the_wrong_side() -> None:
    """Static friction does not hold a body that the track cannot hold."""
    from generated import circle_coulomb

    held = {"lam0": 0, "mu": "1/10"}
    assert circle_coulomb.solve(**held, contact="above").kind == "rest"
    motion = circle_coulomb.solve(**held, contact="below")
    assert (motion.t_end, motion.events[0].kind) == (0.0, "liftoff")


@pytest.mark.extended
@pytest.mark.parametrize("lam0", ["-1", "1", -1.0])
def test_a_ridge_as_high_as_the_launch(lam0: Any, generated_folder: Any) -> None:
    """A ridge as high as the launch is never reached, from either side; one unit away the potential is that of the
    launch.
    """
    module = gqm.build(gqm.derive(gqm.Curve.graph("x**4 - x**2"), gqm.Gravity()), name="ridge", folder=generated_folder)
    motion = module.solve(lam0)
    assert (motion.kind, motion.t_end, motion.turning_points) == ("asymptotic", math.inf, (float(lam0),))
    assert motion.legs[-1].end == "asymptote"
    assert abs(float(motion.lam(10.0))) <= 1e-15
    swept = module.sweep("time_at", lam0=float(lam0), lam=0.5 * float(lam0))
    assert swept.values == pytest.approx(module.solve(lam0).time_at(0.5 * float(lam0)), rel=1e-14)
    assert np.isnan(module.sweep("period", lam0=float(lam0)).values)
