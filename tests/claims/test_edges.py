"""Launches at the edges of what is allowed are answered or refused: at ends of tracks, corners, nodes, and with odd
numbers.
"""

import math
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.errors import DeclarationError, GQMError, InputError, LaunchError, SolutionError
from gqm_sym.literals.numbers import read_number

Build = Callable[..., ModuleType]

G = mpf("9.81")
VEE = gqm.Curve.sampled([("0", "1"), ("1", "0"), ("2", "1")], kind="linear")
HALF_PIPE = gqm.Curve.piecewise(
    [gqm.arc(radius=1, angle="pi/2"), gqm.line(length=1), gqm.arc(radius=1, angle="pi/2")],
    start=(0, 1),
    heading="-pi/2",
)
BALL = gqm.Gravity() + gqm.Rolling(radius="1/20", beta="2/5")


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    "launch",
    [
        {"lam0": 0},
        {"lam0": "pi + 1"},
        {"lam0": math.pi + 1.0},
        {"point": (0, 1)},
        {"point": (3, 1)},
        {"lam0": "pi/2 + 1/2", "v0": "sqrt(2*981/100)"},
    ],
)
def test_from_end_to_end(launch: dict[str, Any], built: Build) -> None:
    """A body released at one end of a half pipe reaches the other end after two quarter swings and a metre at full
    speed.
    """
    motion = built("half_pipe", HALF_PIPE, gqm.Gravity()).solve(**launch)
    assert motion.kind == "libration"
    low, high = sorted(motion.turning_points)
    assert (low, high) == pytest.approx((0.0, math.pi + 1.0), abs=1e-15)
    # In extended precision the turn is a rounding (1.7e-54) beyond the end of the track, where the track has no value.
    assert 0.0 <= low < high <= motion.problem.high
    places = motion.lam(np.linspace(0.0, motion.period, 9))
    assert motion.problem.low <= places.min() < places.max() <= motion.problem.high
    half = 2 * mp.ellipk(mpf(1) / 2) / mp.sqrt(G) + 1 / mp.sqrt(2 * G)
    assert motion.half_period == pytest.approx(float(half), rel=1e-14)
    assert [event.kind for event in motion.events] == ["turn", "turn"]


@pytest.mark.parametrize("lam0", [0, "2*sqrt(2)"])
def test_from_end_to_end_of_planes(lam0: Any, built: Build) -> None:
    """On two planes the same takes four times the time down one of them."""
    motion = built("vee", VEE, gqm.Gravity()).solve(lam0)
    assert motion.kind == "libration"
    assert motion.half_period == pytest.approx(2 * math.sqrt(4 / 9.81), rel=1e-15)


@pytest.mark.extended
@pytest.mark.parametrize(
    ("name", "force"), [("rough", gqm.CoulombFriction(mu="1/10")), ("drag", gqm.QuadraticDrag(b="1/10"))]
)
def test_losses_keep_a_body_from_the_other_end(name: str, force: Any, built: Build) -> None:
    """With losses the body turns before the other end, at mirrored places from either side."""
    module = built(name, HALF_PIPE, gqm.Gravity() + force)
    left, right = (module.solve(lam0).turning_points[:2] for lam0 in (0, "pi + 1"))
    assert left[1] < math.pi + 1.0
    assert left[1] == pytest.approx(math.pi + 1.0 - right[1], abs=1e-14)


@pytest.mark.extended
def test_a_faster_body_leaves_over_the_end(built: Build) -> None:
    """A body with some speed at the end does not turn there; one that just reaches the end does."""
    module = built("half_pipe", HALF_PIPE, gqm.Gravity())
    assert module.solve(0, "1/1000").events[-1].kind == "domain-end"
    bowl = built("bowl", gqm.Curve.graph("x**2", parameter="x", domain=(-1, 1)), gqm.Gravity())
    for speed in ("sqrt(2*981/100)", "sqrt(2*981/100 - 1/10**30)"):
        assert bowl.solve(0, speed).kind == "libration"
    assert bowl.solve(0, "sqrt(2*981/100 + 1/1000000)").kind == "transit"


def test_nothing_lies_beyond_the_ends_of_a_track(built: Build) -> None:
    """pass1 gives NaN beyond the ends of a track; a curve with formulas continues, with the sign of V**2 that they
    have.
    """
    rough = gqm.Gravity() + gqm.CoulombFriction(mu="1/10")
    tracks = (("vee", VEE, gqm.Gravity()), ("half_pipe", HALF_PIPE, gqm.Gravity()), ("rough", HALF_PIPE, rough))
    for name, curve, force in tracks:
        module = built(name, curve, force)
        end = module.MODEL.domain(module.MODEL.numbers(tuple(module.PARAMETERS.values()))).high
        places = np.array([-1.0, np.nextafter(0.0, -1.0), 0.0, 0.5, end, np.nextafter(end, 9.0), 50.0])
        rows = np.array(module.pass1(places, lam0=0.25, v0=9))
        assert np.isnan(rows[:, [0, 1, 5, 6]]).all()
        assert np.isfinite(rows[:4, 2:5]).all()
        assert np.isnan(module.pass1(-1, lam0=0.25, v0=9).x)
    formula = built("line", gqm.Curve.graph("x", parameter="x", domain=(0, 1)), gqm.Gravity())
    assert formula.pass1(2.0, lam0=0).v2 == pytest.approx(-2 * 9.81 * 2)


def test_the_time_at_a_turning_point_given_exactly(built: Build) -> None:
    """The distance of a place from a turning point is that of the exact numbers; half of its digits determine the
    time.
    """
    swing = built("swing", gqm.Curve.parametric(x="sin(a)", z="-cos(a)", parameter="a", period="2*pi"), gqm.Gravity())
    motion = swing.solve(0, "sqrt(2*981/100)")
    quarter = motion.half_period / 2
    assert motion.time_at("pi/2") == quarter
    assert motion.time_at("-pi/2") == pytest.approx(3 * quarter, rel=1e-15)
    assert motion.time_at(motion.turning_points[0]) == quarter
    assert swing.solve(1).time_at("-1") == pytest.approx(swing.solve(1).half_period, rel=1e-15)
    for digits in (6, 12, 20, 29):
        before = quarter - motion.time_at(f"pi/2 - 1/10**{digits}")
        assert before == pytest.approx(math.sqrt(2 / 9.81 / 10.0**digits), rel=1e-4, abs=1e-15)
    with pytest.raises(SolutionError, match="never at"):
        motion.time_at("pi/2 + 1/10**25")
    thrown = built("upright", gqm.Curve.parametric(x="0*u", z="u", parameter="u"), gqm.Gravity()).solve(0, 1)
    assert thrown.time_at("50/981") == pytest.approx(100 / 981, rel=1e-15)


@pytest.mark.extended
def test_a_body_that_slips_at_launch_begins_to_slip_once(built: Build) -> None:
    """The event at launch occurs once; later ones follow after every half period."""
    circle = gqm.Curve.parametric(x="sin(a)", z="-cos(a)", parameter="a", period="2*pi")
    force = gqm.Gravity() + gqm.Rolling(beta="2/5", mu_static="1/10")
    motion = built("slipping", circle, force).solve("3/2")
    slips = [event.t for event in motion.events_between(0, 4 * motion.period) if event.kind == "slip"]
    assert slips[0] == 0.0
    assert len(slips) == 9
    steps = np.diff(slips[1:])
    assert steps == pytest.approx(motion.half_period, rel=1e-12)


def test_the_contact_force_before_a_node(built: Build) -> None:
    """N keeps its sign up to the node of a lemniscate, although the formula of the curvature is 0/0 there."""
    curve = gqm.Curve.implicit("(x**2 + z**2)**2 - x**2 + z**2", start=(1, 0))
    lemniscate = built("lemniscate", curve, gqm.Gravity())
    for contact, first in (("bilateral", ["singular-point"]), ("above", ["singular-point"])):
        motion = lemniscate.solve(0, 6, -1, contact=contact)
        assert [event.kind for event in motion.events] == first
    assert [event.kind for event in lemniscate.solve(0, 6).events] == ["contact-sign", "singular-point"]


def test_a_ball_does_not_roll_over_corners(built: Build) -> None:
    """The centre of a ball has no path beside a corner."""
    with pytest.raises(LaunchError, match=r"radius: the track has a corner at s = 1\.414.*round the corners off"):
        built("ball_on_planes", VEE, BALL).solve("1/10")


@pytest.mark.extended
def test_a_body_that_falls_into_a_centre_of_force(built: Build) -> None:
    """Its motion ends there, although the curve goes on and is symmetric about the centre; so do sweeps say."""
    curve = gqm.Curve.graph("-cos(2*x)/3", parameter="x")
    module = built("into_the_centre", curve, gqm.CentralForce(centre=(0, "-1/3"), k=4))
    for lam0 in (1.1437806281064022, 0.7):
        motion, sweep = module.solve(lam0), module.sweep("half_period", [lam0])
        assert (motion.kind, motion.events[-1].kind) == ("transit", "singular-point")
        assert motion.events[-1].lam == pytest.approx(0.0, abs=1e-14)
        assert np.isnan(sweep.values).all()
        assert list(sweep.status_counts()) == ["the motion is not of a kind that has this quantity"]
        assert module.sweep("t_end", [lam0]).values == pytest.approx([motion.t_end], rel=1e-15)
        with pytest.raises(SolutionError, match="only a libration has one"):
            assert motion.half_period


@pytest.mark.extended
@pytest.mark.parametrize("loss", [None, gqm.QuadraticDrag(b="1/100")], ids=["free", "drag"])
def test_a_vertical_end_of_a_graph(loss: Any, built: Build) -> None:
    """Motions to it are refused with a remedy (there was a ZeroDivisionError, or times were wrong by 1e-9); what
    happens before it is answered.
    """
    law = gqm.Gravity() if loss is None else gqm.Gravity() + loss
    for name, height, domain, lam0, v0 in (
        ("root", "sqrt(x)", None, 0.9, 0.0),
        ("root_in_a_domain", "sqrt(x)", (0, None), 0.9, 0.0),
        ("semicircle", "-sqrt(1 - x**2)", None, 0.3, 6.0),
    ):
        curve = gqm.Curve.graph(height, **({} if domain is None else {"domain": domain}))
        module = built(f"{name}_{'free' if loss is None else 'drag'}", curve, law)
        with pytest.raises(SolutionError, match=r"next to which ds/dx has no bound.*declare the curve by another"):
            assert module.solve(lam0, v0, -1).t_end
        motion = module.solve(lam0, v0, -1, t_max=0.1)
        assert motion.t_end == 0.1
        assert motion.kind == ("transit" if loss is None else "dissipative")
    if loss is None:
        with pytest.raises(SolutionError, match=r"comes to x = 1\.0, next to which ds/dx has no bound"):
            module.solve(1, 0, -1)


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("height", "domain", "lam0", "t"),
    [("log(x)", None, 0.9, 2.0), ("-1/x", None, 0.9, 2.0), ("x**(9/10)", (0, None), 1.0, None)],
)
def test_a_fall_beside_a_vertical_line(height: str, domain: Any, lam0: float, t: float | None, built: Build) -> None:
    """The integral of ds/V up to the place of a time is that time, also at the end of the domain."""
    curve = gqm.Curve.graph(height, **({} if domain is None else {"domain": domain}))
    motion = built(f"beside_{len(height)}", curve, gqm.Gravity()).solve(lam0, 0, -1, t_max=t)
    with mp.workdps(20):
        z = {
            "log(x)": (mp.log, lambda x: 1 / x),
            "-1/x": (lambda x: -1 / x, lambda x: 1 / x**2),
            "x**(9/10)": (lambda x: x ** mpf("0.9"), lambda x: mpf("0.9") * x ** mpf("-0.1")),
        }[height]
        begin, end = mpf(lam0), mpf(0) if t is None else mpf(float(motion.lam(t)))
        width = begin - end

        def rate(y: Any) -> Any:  # x = begin - width*y**2, so that the rate is finite at the turn
            x = begin - width * y * y
            return 2 * width * y * mp.sqrt((1 + z[1](x) ** 2) / (2 * mpf("9.81") * (z[0](begin) - z[0](x))))

        steps = [0, 0.5, 0.75, *(1 - mpf(4) ** -k for k in range(2, 14)), 1]
        time = mp.quad(rate, steps, method="gauss-legendre")
    if t is None:
        assert [event.kind for event in motion.events] == ["contact-sign", "domain-end"]
    assert motion.t_end == pytest.approx(float(time), rel=1e-13)


@pytest.mark.extended
def test_the_end_of_a_long_domain_is_not_vertical(built: Build) -> None:
    """On the last millionth of the domain a wave becomes steeper by a factor of 2, and is regular all the same."""
    wave = built("long_wave", gqm.Curve.graph("3*sin(x)", domain=(0, 1000000)), gqm.Gravity())
    assert wave.solve(999990, 30).events[-1].kind == "domain-end"


def test_a_climb_beside_a_pole(built: Build) -> None:
    """The turn of a body that climbs z = 1/x is where its energy says (V**2 was searched beyond the pole)."""
    motion = built("hyperbola", gqm.Curve.graph("1/x"), gqm.Gravity()).solve("0.3", 6, -1, t_max=2)
    turn = next(event for event in motion.events if event.kind == "turn")
    assert turn.lam == pytest.approx(1 / (1 / 0.3 + 18 / 9.81), rel=4e-16)


@pytest.mark.extended
def test_speeds_at_a_pole_are_infinite(built: Build) -> None:
    """The largest speed and contact force were those at the last double before the pole."""
    bowl = gqm.Curve.graph("x**2")
    motion = built("bowl_with_a_centre", bowl, gqm.CentralForce(centre=(0, 0), k=4)).solve("0.9")
    assert (motion.kind, motion.v_max.value, motion.v_min.value) == ("transit", math.inf, 0.0)
    assert motion.normal_force_max.value == math.inf
    assert motion.v_max.t == motion.t_end
    assert math.isfinite(motion.normal_force_min.value)
    line, law = gqm.Curve.graph("0*x"), gqm.Potential("k*log(x**2 + z**2)", parameters={"k": 1})
    motion = built("log_on_a_line", line, law).solve("0.9")
    assert (motion.v_max.value, motion.normal_force_max.value) == (math.inf, 0.0)


ACROSS = np.linspace(-3.0, 3.0, 30)


@pytest.mark.extended
@pytest.mark.parametrize("slope", [0.0, 0.5, None])
def test_a_body_that_falls_into_a_centre_along_a_chart(slope: float | None, built: Build) -> None:
    """On a straight line of points or of a rail it falls from a distance d in the time pi*sqrt(d**3/(8 k)), and does
    not pass the centre, whatever the speed.
    """
    if slope is None:
        curve, scale = gqm.Curve.piecewise([gqm.line(length=6)], start=(-3, 0)), 1.0
    else:
        points = np.column_stack([ACROSS, *([slope * ACROSS] if slope else []), 0.0 * ACROSS])
        curve, scale = gqm.Curve.sampled(points), np.sqrt(1.0 + slope**2)
    name = "rail" if slope is None else "points_in_space" if slope else "points"
    module = built(f"{name}_to_a_centre", curve, gqm.CentralForce(k=1))
    motion = module.solve(4.0 * scale)
    assert (motion.kind, [event.kind for event in motion.events]) == ("transit", ["singular-point"])
    assert motion.t_end == pytest.approx(np.pi * np.sqrt(scale**3 / 8.0), rel=1e-15)
    assert motion.events[0].lam == pytest.approx(3.0 * scale, rel=1e-14)
    assert module.sweep("t_end", [4.0 * scale]).values == pytest.approx([motion.t_end], rel=1e-15)
    assert np.isnan(module.sweep("half_period", [4.0 * scale]).values).all()
    assert module.solve(4.0 * scale, 3.0, -1).events[-1].kind == "singular-point"


@pytest.mark.extended
def test_the_contact_force_before_a_pole(built: Build) -> None:
    """On a parabola through the centre of a force the only change of the sign of N is one that is no rounding.

    N/m is kappa V**2 + n0, in terms of x; kappa V**2 grows as 2 kappa k/r, and n0 as kappa k/(2 r), so that N keeps its
    sign near the centre.
    """
    curve = gqm.Curve.implicit("z - x**2/4", start=(-3, "9/4"), tangent=-1)
    module = built("parabola_to_a_centre", curve, gqm.CentralForce(k=1))
    motion = module.solve(2)
    x, end = np.linspace(motion.state(0.0).x, -1e-3, 100001)[1:], motion.state(0.0)
    size, r = np.sqrt(1.0 + x * x / 4.0), np.hypot(x, x * x / 4.0)
    w = 2.0 * (1.0 / r - 1.0 / np.hypot(end.x, end.z))
    force = w / (2.0 * size**3) - (x * x / 4.0) / (r**3 * size)
    assert [event.kind for event in motion.events] == ["contact-sign"] * (np.diff(np.sign(force)) != 0).sum() + [
        "singular-point"
    ]
    assert module.solve(2, 3, contact="above").events[-1].kind == "singular-point"


@pytest.mark.extended
def test_a_fall_into_a_centre_with_drag(built: Build) -> None:
    """It is followed to the end where the distance from the centre is a coordinate; where it is a difference of rounded
    ones, the motion is had up to a time that the error names (it was said to end 4e-10 s before, or that terms cancel).
    """
    force = gqm.Gravity() + gqm.CentralForce(k=5, centre=("c", "c**2/4")) + gqm.QuadraticDrag(b="1/20")
    module = built("dragged_to_a_centre", gqm.Curve.graph("x**2/4", parameter="x"), force)
    motion = module.solve(2, "1/2", c=0)
    assert motion.t_end < 1.0
    assert motion.events[-1].kind == "singular-point"
    assert motion.v_max.value == motion.normal_force_max.value == np.inf
    assert motion.lam(motion.t_end) == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(SolutionError, match=r"a centre of force at x = 1\.0.*give t_max=0\.4997.* or less") as told:
        _ = module.solve(2, "1/2", c=1).t_end
    t_max = float(str(told.value).partition("t_max=")[2].split()[0])
    assert module.solve(2, "1/2", c=1, t_max=t_max).v_max.value > 50.0
    x = np.linspace(-3.0, 3.0, 25)
    points = built("points_dragged_to_a_centre", gqm.Curve.sampled(np.column_stack([x, x * x / 4])), force)
    with pytest.raises(SolutionError, match=r"falls into a centre of force at s = 3\.898926"):
        _ = points.solve(6, "1/2", c=0).t_end


def test_a_force_without_a_bound_that_is_no_pole(built: Build) -> None:
    """Where a logarithm has its pole the motion ends, after sqrt(pi/2) d/sqrt(a); a body that passes by a centre at a
    small distance turns on the other side.
    """
    line = gqm.Curve.graph("c + 0*x", parameter="x")
    log = built("into_a_logarithm", line, gqm.Potential("a*log(x**2)/2"))
    motion = log.solve(0.7, a=1.0, c=0.0)
    assert (motion.kind, motion.events[-1].kind) == ("transit", "singular-point")
    assert motion.t_end == pytest.approx(0.7 * np.sqrt(np.pi / 2), rel=1e-15)
    near = built("past_a_centre", line, gqm.CentralForce(k=1)).solve(0.7, c=1e-5)
    assert near.turning_points == pytest.approx((0.7, -0.7), rel=1e-15)


@pytest.mark.extended
def test_a_ball_that_will_not_fit_is_told_at_once(built: Build) -> None:
    """In waves that become ever narrower, a ball that fits at its launch but not at places that it reaches is refused
    at once.
    """
    waves = built("narrower", gqm.Curve.graph("-x + sin(x**2/20)", parameter="x"), BALL)
    with pytest.raises(SolutionError, match=r"does not fit into the track at x = 45\.9.* where it comes after 6\.46"):
        waves.solve(0, 1)
    assert waves.solve(0, 1, radius="1/1000000").state(1.0).v > 0.0


def test_floats_of_points_mean_their_binary_values() -> None:
    """Every digit of a float is kept, so that the track passes through the given point; text stays as it is written."""
    floats = gqm.Curve.sampled([(k / 10, (k / 10) ** 2) for k in range(-7, 8)])
    for given, kept in zip(range(-7, 8), floats.definition.points.splitlines(), strict=True):
        for value, text in zip((given / 10, (given / 10) ** 2), kept.split(), strict=True):
            assert read_number(text, where="point").fraction == Fraction(value)
    texts = gqm.Curve.sampled([(str(k / 10), str(Decimal(k * k) / 100)) for k in range(-7, 8)])
    assert texts.definition.points.splitlines()[0] == "-0.7 0.49"
    assert gqm.Curve.sampled([(2**60, 0), (0, 2**60 + 1)], kind="linear").definition.points.endswith(str(2**60 + 1))


# These values are given for numbers: extreme ones, and some that are no numbers.
ODD: tuple[Any, ...] = (
    *(5e-324, 1e-320, 1e17, -1e17, 1e155, 1e300, math.nan, math.inf, -math.inf, True, np.bool_(True), 10**400, 1j),
    *("", "x", "1e400", "nan", "1/0", "(-1)**(1/2)", "0.25 ", b"1", Fraction(1, 3), Decimal("0.1"), Decimal("NaN")),
    *(Decimal("1e1000"), np.float32(0.25), np.int8(1), np.longdouble("0.3"), np.float64("nan"), None, {}, [], [0.25]),
    *(np.array(0.25), np.array([0.25]), np.array([0.25, 0.5]), np.array(["a"]), np.array([None]), object(), math.sin),
    *(np.timedelta64(5, "ms"), np.datetime64("2020-01-01")),
)


def calls(module: ModuleType, odd: Any) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Yield calls with an odd number for one argument, by the argument's name."""
    given = {name: 1 for name, default in module.PARAMETERS.items() if default is None}
    yield "lam0", lambda: module.solve(odd, **given).state(1e-3)
    for name in ("v0", "direction", "t_max", "g"):
        yield name, lambda name=name: module.solve(**{"lam0": 0.3, "t_max": 1.0, **given, name: odd}).state(1e-3)
    yield "lam", lambda: module.pass1(odd, lam0=0.3, **given)
    motion = module.solve(0.3, **given, t_max=10.0)
    for name in ("lam", "state", "error_bound"):
        yield "t", lambda name=name: getattr(motion, name)(odd)
    yield "lam", lambda: motion.time_at(odd)
    yield "t1", lambda: motion.events_between(odd, 0.1)
    yield "digits", lambda: motion.period_to(odd)


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["circle", "circle_coulomb", "track"])
def test_odd_numbers_are_answered_or_refused(name: str) -> None:
    """Odd values for a number give an answer, or an error of this package that names the argument."""
    module = __import__(f"generated.{name}", fromlist=[name])
    for odd in ODD:
        for argument, call in calls(module, odd):
            try:
                call()
            except GQMError:
                continue
            except TypeError as error:
                assert argument in str(error), (odd, argument)


def test_one_element_is_an_array_and_none_is_a_number() -> None:
    """Arrays of no dimension are numbers, and arrays of one element stay arrays in every answer."""
    from generated import circle, circle_coulomb, kepler

    for module in (circle, circle_coulomb, kepler):
        motion = module.solve("1/3")

        def answers(given: Any, module: Any = module, motion: Any = motion) -> tuple[Any, ...]:
            return (motion.lam(given), motion.error_bound(given), *motion.state(given), *module.pass1(given, lam0=0.3))

        for number in (0.1, np.float64(0.1), np.array(0.1), "1/10"):
            assert {np.shape(answer) for answer in answers(number)} == {()}
        for column in ([0.1], np.array([0.1]), ("1/10",)):
            assert {np.shape(answer) for answer in answers(column)} == {(1,)}
        assert {type(motion.lam(t)) for t in (0.1, np.array(0.1), "1/10", np.float32(0.1))} == {float}


def test_an_interval_of_too_many_events_is_refused() -> None:
    """An interval of too many events is refused rather than listed for hours."""
    from generated import circle

    with pytest.raises(InputError, match=r"events_between: .* ask for a shorter interval"):
        circle.solve("1/3").events_between(0, 1e9)


def test_what_is_no_model_is_refused_by_name() -> None:
    """An argument that is no model is named, and the message says what it must be."""
    for given in (None, "circle", gqm.Gravity()):
        with pytest.raises((GQMError, TypeError), match="model"):
            gqm.emit(given, name="none")
    assert issubclass(DeclarationError, GQMError)


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "force"), [("vee", gqm.Gravity()), ("rough_vee", gqm.Gravity() + gqm.CoulombFriction(mu="1/10"))]
)
def test_a_corner_is_an_event_with_friction_and_without(name: str, force: Any, built: Build) -> None:
    """A moving body keeps its speed at each corner between two turns, and a leg ends there; a body at rest on a corner
    stays.
    """
    motion = built(name, VEE, force).solve(1)
    first = [(event.kind, event.lam) for event in motion.events[:4] if event.kind == "corner"]
    assert first == [("corner", pytest.approx(math.sqrt(2), rel=1e-15))] * 2
    assert [leg.end for leg in motion.legs[:4]] == ["corner", "turn", "corner", "turn"]
    before, after = motion.legs[:2]
    assert (before.lam_end, before.t_end) == (after.lam_start, after.t_start)
    assert motion.events[0].t == before.t_end
    resting = built(name, VEE, force).solve("sqrt(2)")
    assert (resting.kind, [event.kind for event in resting.events]) == ("rest", ["rest"])


def test_at_rest_at_a_cusp(built: Build) -> None:
    """A body stays at a cusp with a level tangent, because no force moves it, and falls from any other cusp."""
    deltoid = gqm.Curve.parametric(x="2*cos(t) + cos(2*t)", z="2*sin(t) - sin(2*t)", parameter="t", period="2*pi")
    nephroid = gqm.Curve.parametric(x="3*cos(t) - cos(3*t)", z="3*sin(t) - sin(3*t)", parameter="t", period="2*pi")
    for name, curve, level in (("deltoid", deltoid, ("0",)), ("nephroid", nephroid, ("0", "pi"))):
        for lam0 in level:
            assert built(name, curve, gqm.Gravity()).solve(lam0).kind == "rest"
    motion = built("deltoid", deltoid, gqm.Gravity()).solve("2*pi/3")
    assert [event.kind for event in motion.events] == ["contact-sign", "cusp"]
    # Down the arc to the lowest cusp: dt = ds/V, with V**2 = 2 g (z0 - z).
    with mp.workdps(40):
        top = mpf(3) * mp.sqrt(3) / 2
        speed = lambda t: mp.sqrt(2 * mpf("9.81") * (top - 2 * mp.sin(t) + mp.sin(2 * t)))  # noqa: E731
        edges = mp.linspace(2 * mp.pi / 3, 4 * mp.pi / 3, 9)
        fall = mp.quad(lambda t: 4 * mp.sin(3 * t / 2) / speed(t), edges, method="gauss-legendre")
    assert motion.t_end == pytest.approx(float(abs(fall)), rel=1e-14)


@pytest.mark.parametrize("height", ["1/1000", "1/100"])
def test_a_very_flat_bowl(height: str, built: Build) -> None:
    """On z = x**20 a body takes up to 10**26 s to the other side, as the beta function says."""
    motion = built("flat_bowl", gqm.Curve.graph("x**20", parameter="x"), gqm.Gravity()).solve(height)
    a, power = mpf(1) / int(height.split("/")[1]), mpf(1) / 20
    half = 2 * a**-9 * mp.sqrt(mp.pi / (2 * G)) * mp.gamma(1 + power) / mp.gamma(mpf(1) / 2 + power)
    assert motion.turning_points == (float(a), -float(a))
    assert motion.half_period == pytest.approx(float(half), rel=1e-15)


SLOPE = gqm.Curve.parametric(x="u*cos(alpha)", z="u*sin(alpha)", parameter="u", parameters={"alpha": "1/5"})
ANGLES = ("pi", "-3*pi", "pi/2", "-pi/2", "pi/3", "2*pi/3", "5*pi/6", "pi/7", "1/5", 3.141592653589793)


@pytest.mark.parametrize("alpha", ANGLES)
def test_an_inclination_means_what_its_text_says(alpha: Any, built: Build) -> None:
    """Bodies thrown up an incline turn after v0/(g sin(alpha)), and never if the text says that it is level.

    The sine of the double nearest to pi is 1.2e-16, and that of pi is 0.
    """
    module = built("slope", SLOPE, gqm.Gravity())
    with mp.workdps(300):
        sine = mp.sin(read_number(alpha, where="alpha").at(mp))
        rise = mpf(0) if abs(sine) < mpf(10) ** -200 else sine * G
    direction = 1 if rise >= 0 else -1
    motion = module.solve(0, 2, direction, alpha=alpha)
    swept = module.sweep("turning_points", [0.0, 0.0], 2, direction, alpha=alpha)
    assert len(motion.turning_points) == (rise != 0)
    if rise:
        assert motion.turning_points[0] == pytest.approx(float(2 / rise), rel=4e-16)
    else:
        assert motion.lam("1e12") == 2e12
        assert motion.time_at("1e12") == 5e11
        assert np.isnan(swept.values).all()


@pytest.mark.parametrize("tilt", ["pi/6", "1/2", 0.5])
def test_a_single_sine_of_a_parameter(tilt: Any, built: Build) -> None:
    """A bead on a ring whose plane is tilted by an angle is a pendulum with g sin(tilt)."""
    force = gqm.Potential("g*sin(tilt)*z", parameters={"g": "9.81", "tilt": "1/2"})
    module = built("tilted_ring", gqm.families.circle(L=1), force)
    plain = built("plain_ring", gqm.families.circle(L=1), gqm.Gravity())
    with mp.workdps(30):
        ratio = mp.sqrt(mp.sin(read_number(tilt, where="tilt").at(mp)))
        wanted = float(mpf(plain.solve("6/5").period_to(25)) / ratio)
    assert module.solve("6/5", tilt=tilt).period == wanted
    swept = module.sweep("period", [1.2, 1.2], tilt=[float(read_number(tilt, where="tilt").value)] * 2)
    assert swept.values == pytest.approx(wanted, rel=1e-15)


@pytest.mark.parametrize("alpha", ANGLES)
def test_an_inclination_means_the_same_to_friction(alpha: Any, built: Build) -> None:
    """On a level line only friction stops a body, and the way up an incline has a closed form."""
    module = built("rough_slope", SLOPE, gqm.Gravity() + gqm.CoulombFriction(mu="1/10"))
    with mp.workdps(50):
        angle = read_number(alpha, where="alpha").at(mp)
        up = 1 if mp.sin(angle) >= 0 else -1
        deceleration = G * (abs(mp.sin(angle)) + abs(mp.cos(angle)) / 10)
        stop = up * 2 / deceleration
    motion = module.solve(0, 2, up, alpha=alpha)
    assert motion.legs[0].lam_end == pytest.approx(float(stop), rel=1e-15)
    swept = module.sweep("rest_position", [0.0], 2, up, alpha=alpha).values
    rests = abs(math.sin(float(angle))) < abs(math.cos(float(angle))) / 10
    assert swept == pytest.approx(float(stop), rel=1e-15) if rests else np.isnan(swept).all()
