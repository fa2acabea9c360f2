"""Motions that lose energy end at the right places and are followed far enough: falls, singular points, tops and
rest.
"""

import math
from collections.abc import Callable
from fractions import Fraction
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import generated.circle_coulomb
import generated.circle_droplet
import gqm_sym as gqm
from gqm_sym.errors import BudgetError, InputError, LaunchError, SolutionError
from gqm_sym.runtime.legs import answers, leg_record
from gqm_sym.runtime.legs.runs import ends

G = 9.81
# The relative tolerances of places and times just after a release, which follow from the slope of a polynomial at its
# beginning, and of arc lengths, which follow from its curvature. Worst measured: 1.4e-14 and 3.7e-13.
RELEASED, RELEASED_LENGTH = 3e-14, 7e-13
Build = Callable[..., ModuleType]


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Return a module, built once."""
    folder, built = tmp_path_factory.mktemp("ends"), {}

    def module(name: str, curve: Any, force: Any) -> ModuleType:
        if name not in built:
            built[name] = gqm.build(gqm.derive(curve, gqm.Gravity() + force), name=name, folder=folder)
        return built[name]

    return module


@pytest.fixture(scope="module")
def slope(build: Build) -> ModuleType:
    """Return a line that falls by 45 degrees, with friction."""
    return build("slope", gqm.Curve.graph("-x"), gqm.CoulombFriction(mu="mu"))


@pytest.mark.parametrize("t", [1.0, 1e3, 1e8, 1e20])
def test_a_fall_with_friction(t: float, slope: ModuleType) -> None:
    """On the slope x is g (1 - mu) t**2/4 for any time, and a fast body whose speed grows slowly is not taken for one
    at rest.
    """
    motion = slope.solve(lam0=0, mu=0.1)
    with mp.workdps(30):
        exact = mpf("9.81") * (1 - mpf("0.1")) * mpf(t) ** 2 / 4
    assert motion.lam(t) == pytest.approx(float(exact), rel=2e-15)
    assert [leg.end for leg in motion.legs] == ["horizon"]
    assert slope.solve(lam0=0, mu=0.1).time_at(float(exact)) == pytest.approx(t, rel=2e-15)


@pytest.mark.parametrize("t", [1e-9, 1e-7, 1e-5, 1e-3])
def test_just_after_a_release(t: float, slope: ModuleType) -> None:
    """Just after a release places and times on the slope have their digits, however they are asked for."""
    with mp.workdps(30):
        fall = mpf("9.81") * (1 - mpf("0.1")) * mpf(t) ** 2 / 4
        place, way = float(fall), float(fall * mp.sqrt(2))
    motion = slope.solve(lam0=0, mu=0.1, t_max=1)
    assert motion.time_at(place) == pytest.approx(t, rel=RELEASED, abs=0.0)
    for states in (motion.state(t), motion.state(Fraction(t)), motion.state(np.array([t, 0.5]))):
        assert np.atleast_1d(states.lam)[0] == pytest.approx(place, rel=RELEASED, abs=0.0)
        assert np.atleast_1d(states.s)[0] == pytest.approx(way, rel=RELEASED_LENGTH, abs=0.0)
    assert slope.solve(lam0=0, mu=0.1, t_max=t).legs[-1].lam_end == pytest.approx(place, rel=RELEASED, abs=0.0)


def test_a_fall_leaves_the_range_of_doubles(slope: ModuleType) -> None:
    """A fall ends well before its numbers leave the range of doubles; a place above the launch is never reached."""
    motion = slope.solve(lam0=0, mu=0.1)
    for question in (lambda: motion.lam(1e60), lambda: motion.time_at(-1.0)):
        with pytest.raises(SolutionError, match="the motion leaves the range of doubles at x = "):
            question()


def test_rest_and_what_comes_after(slope: ModuleType) -> None:
    """Uphill the body moves for v0/(g (1 + mu) sin 45); with mu > 1 it stays there, and no later time is part of the
    motion.
    """
    motion = slope.solve(lam0=0, v0=1, direction=-1, mu=2)
    end = math.sqrt(2.0) / (3.0 * G)
    assert motion.t_end == pytest.approx(end, rel=1e-14)
    there = -math.sqrt(0.5) * 0.5 * end
    assert motion.lam(motion.t_end) == pytest.approx(there, rel=1e-14)
    assert motion.events_between(0, end / 2) == ()
    assert [event.kind for event in motion.events_between(end / 2, 1)] == ["rest"]
    with pytest.raises(InputError, match=r"the motion ends at 0\.048.* s \(rest at x = -0\.01.*\), got 1\.0"):
        motion.lam(1.0)


@pytest.mark.parametrize("v0", ["1e-140", "1e-20", "1e-9", "1e-7", "1e-5", "1e-3", "1"])
def test_however_slow_a_launch_uphill(v0: str, slope: ModuleType) -> None:
    """Distance and time to the turn have all digits, also if the turn is the same double as the launch."""
    for mu, end in (("2", "rest"), ("0.5", "turn")):
        motion = slope.solve(lam0="0.0124357887", v0=v0, direction=-1, mu=mu, t_max=10)
        leg = motion.legs[0]
        with mp.workdps(40):
            time = mp.sqrt(2) * mpf(v0) / (mpf("9.81") * (1 + mpf(mu)))
            whole = mpf(v0) * time / 2
            there = mpf("0.0124357887") - mpf("0.75") * whole / mp.sqrt(2)
        assert (leg.end, leg.t_end) == (end, pytest.approx(float(time), rel=1e-15, abs=0.0))
        half = motion.state(float(time / 2))
        assert half.s == pytest.approx(float(-whole * 3 / 4), rel=2e-15, abs=0.0)
        assert half.v == pytest.approx(-0.5 * float(v0), rel=2e-15, abs=0.0)
        assert abs(half.lam - there) <= half.error <= 2e-17 + 5e-14 * whole


def test_a_stop_within_the_last_places_of_the_launch() -> None:
    """A bend is straight over 1e-18 m, so that the distance is v0**2/(2 a) and the time v0/a."""
    from generated import cubic_coulomb

    x, v0, mu, g = 0.012435788765528737, 1.284446461162977e-09, 0.11597631838334235, 6.389439513099816
    motion = cubic_coulomb.solve(lam0=x, v0=v0, direction=1, t_max=10.0, mu=mu, g=g, m=1.0)
    with mp.workdps(40):
        slope = 3 * mpf(x) ** 2
        a = mpf(g) * (slope + mpf(mu)) / mp.sqrt(1 + slope**2)
        time, whole = mpf(v0) / a, mpf(v0) ** 2 / (2 * a)
    (leg,) = motion.legs
    assert (leg.end, leg.lam_end) == ("rest", float(x + whole))
    assert leg.t_end == pytest.approx(float(time), rel=1e-15)
    assert motion.state(0.5 * leg.t_end).s == pytest.approx(float(0.75 * whole), rel=2e-15)
    assert motion.time_at(leg.lam_end) == pytest.approx(float(time), rel=1e-15)


def test_a_horizon_ends_it(slope: ModuleType) -> None:
    """Times after the horizon are no part of the motion."""
    with pytest.raises(InputError, match=r"the motion ends at 1\.0 s \(the horizon t_max\), got 2\.0"):
        slope.solve(lam0=0, mu=0.1, t_max=1).lam(2.0)


def test_what_a_sweep_has_no_number_for(slope: ModuleType) -> None:
    """The largest speed of an endless fall, turning points of a fall, and a launch that leaves at once have no
    number.
    """
    for quantity in ("v_max", "turning_points"):
        swept = slope.sweep(quantity, lam0=[0.0, 1.0], mu=0.1)
        assert np.isnan(swept.values).all()
        assert list(swept.status_counts()) == ["the motion is not of a kind that has this quantity"]


def test_pass1_of_a_body_at_rest(slope: ModuleType) -> None:
    """A body at rest has a speed at its place and is nowhere else."""
    v2 = slope.pass1(np.array([-1.0, 0.0, 1.0]), lam0=0, v0=0, mu=2).v2
    assert np.isnan(v2).tolist() == [True, False, True]
    assert v2[1] == 0.0


def test_out_of_the_domain_at_once(build: Build) -> None:
    """A launch outwards at the end of the domain ends at once."""
    module = build("bounded", gqm.Curve.graph("x**2", domain=(0, 1)), gqm.QuadraticDrag(b="1"))
    with pytest.raises(LaunchError, match=r"1\.0 is the end of the domain itself, .* launch with direction=-1"):
        module.solve(lam0=1, v0=1)
    assert module.sweep("t_end", lam0=[1.0], v0=1.0).status_counts() == {"the launch is refused; solve says why": 1}


def test_out_of_the_domain_after_a_turn(build: Build) -> None:
    """Thrown up an incline, a body with drag turns after vt/a atan(v0/vt), and from there falls the distance d to the
    lower end in vt/a acosh(exp(b d)); without a horizon it was said to swing for ever.
    """
    incline = build("incline", gqm.Curve.graph("x", domain=(-1, None)), gqm.QuadraticDrag(b="1/10"))
    motion, a, b, v0 = incline.solve(0, 3), G / math.sqrt(2.0), 0.1, 3.0
    vt = math.sqrt(a / b)
    d = math.log1p((v0 / vt) ** 2) / (2.0 * b) + math.sqrt(2.0)
    expected = vt / a * (math.atan(v0 / vt) + math.acosh(math.exp(b * d)))
    assert motion.t_end == pytest.approx(expected, rel=1e-15)
    assert [event.kind for event in motion.events] == ["turn", "domain-end"]
    assert incline.sweep("t_end", [0.0], 3.0).values == pytest.approx([expected], rel=1e-15)


@pytest.mark.extended
def test_contact_that_is_lost_after_two_turns(build: Build) -> None:
    """Inside a loop between two slopes a body swings over the top until drag has made it too slow: there N vanishes.
    One that never comes near the top swings for ever.
    """
    track = gqm.Curve.parametric(x="u + 2*sin(u)", z="-2*cos(u) + 3*(u - pi)**2/20", parameter="u")
    loop = build("loop", track, gqm.QuadraticDrag(b="1/100"))
    motion = loop.solve(-1.9, contact="above")
    assert [leg.end for leg in motion.legs] == ["turn", "turn", "liftoff"]
    end = motion.state(motion.t_end)
    assert abs(end.normal_force) <= 1e-13 * G
    assert loop.solve(-1.9, contact="above", t_max=20).t_end == motion.t_end
    swept = loop.sweep("t_end", [-1.9, 0.5], contact="above").values
    assert swept[0] == pytest.approx(motion.t_end, rel=1e-15)
    assert np.isnan(swept[1])
    assert loop.solve(0.5, contact="above").t_end == math.inf


@pytest.mark.extended
def test_an_end_after_many_turns() -> None:
    """A pendulum with so little friction that it turns 33 000 times rests when its mean loss says so, give or take one
    turn, in a sweep too. It was said to swing for ever. One that would turn 3e8 times is refused, and one whose loss
    does not show has no end.

    A swing of amplitude a loses the energy mu m g L (6 sin a - 4 a cos a), and rests below the angle of static
    friction.
    """
    pendulum, mu, mu_static = generated.circle_coulomb, 1e-5, 0.2
    with mp.workdps(20):
        expected = mp.quad(
            lambda a: 2 * mp.ellipk(mp.sin(a / 2) ** 2) * mp.sin(a) / (6 * mp.sin(a) - 4 * a * mp.cos(a)),
            [mp.atan(mu_static), 1],
        ) / (mu * mp.sqrt(G))
    motion = pendulum.solve(1, mu=mu, mu_static=mu_static)
    assert abs(motion.t_end - expected) <= 1.1
    assert 0.0 <= math.atan(mu_static) - abs(motion.rest_position) <= 4.0 * mu
    assert [leg.end for leg in motion.legs] == ["turn"]
    with pytest.raises(SolutionError, match="too many turns to follow its derivatives"):
        motion.gradient("t_end")
    for quantity in ("t_end", "rest_position"):
        found = pendulum.sweep(quantity, [1.0], mu=[mu, 1e-9, 1e-17], mu_static=mu_static)
        assert found.values[0] == getattr(motion, quantity)
        assert np.isnan(found.values[1:]).all()
        assert found.status.tolist() == [0, 6, 2]
    with pytest.raises(BudgetError, match=r"after 20\d\d\d turns, .* for some 2\.9e\+08 turns; give a horizon, t_max"):
        pendulum.solve(1, mu=1e-9).rest_position  # noqa: B018
    assert pendulum.solve(1, mu=1e-17).t_end == math.inf


@pytest.fixture(scope="module")
def root(build: Build) -> ModuleType:
    """Return the graph of x**(3/2), whose curvature is infinite at 0, where the curve ends."""
    return build("root", gqm.Curve.graph("x*sqrt(x)"), gqm.QuadraticDrag(b="0.1"))


@pytest.mark.extended
def test_a_singular_point_is_reached(root: ModuleType) -> None:
    """From rest at 1, W is 2 g times the integral of z' exp(-2 b (s(u) - s(x))), and the time is that of ds/sqrt(W)."""
    (event,) = root.solve(lam0=1).events
    assert event.kind == "singular-point"
    assert abs(event.lam) <= 1e-14
    with mp.workdps(20):
        b, g = mpf("0.1"), mpf("9.81")

        def length(x: mpf) -> mpf:
            return 8 * ((1 + mpf("2.25") * x) ** mpf("1.5") - 1) / 27

        def w_over_way(y: mpf) -> mpf:  # the distance is y**2
            x = 1 - y * y
            place = lambda v: x + y * y * v  # noqa: E731
            return (
                3 * g * mp.quad(lambda v: mp.sqrt(place(v)) * mp.exp(-2 * b * (length(place(v)) - length(x))), [0, 1])
            )

        time = mp.quad(lambda y: 2 * mp.sqrt((1 + mpf("2.25") * (1 - y * y)) / w_over_way(y)), [0, 1])
    assert event.t == pytest.approx(float(time), rel=1e-13)


def test_a_launch_at_a_singular_point(root: ModuleType) -> None:
    """No panel of V**2 can begin at a singular point; the message asks for the place that is not smooth."""
    with pytest.raises(
        SolutionError, match=r"V\*\*2 beyond x = 0\.0 could not be followed; are the curve and the force"
    ):
        root.solve(lam0=0, v0=1).lam(0.1)


def test_an_approach_has_a_last_digit(build: Build) -> None:
    """A body that approaches the top of a circle with drag has a place after a minute, and no more digits of it after
    an hour.
    """
    module = build("drop", gqm.families.circle(L=1), gqm.QuadraticDrag(b="0.1"))
    with mp.workdps(40):
        k, g = mpf("0.2"), mpf("9.81")
        loss = lambda a: mp.exp(k * a) * (k * mp.sin(a) - mp.cos(a))  # noqa: E731
        v0 = mp.sqrt(2 * g / (1 + k**2) * (loss(mp.pi) - loss(0)))
    motion = module.solve(lam0=0, v0=float(v0))
    assert motion.lam(60.0) == pytest.approx(math.pi, abs=4e-15)
    # The speed on the way is that of the closed form, which near the top is a small difference.
    state = motion.state(np.array([0.5, 1.0, 2.0]))
    with mp.workdps(40):
        for place, v in zip(state.lam, state.v, strict=True):
            w = (v0**2 - 2 * g / (1 + k**2) * (loss(mpf(float(place))) - loss(0))) / mp.exp(k * mpf(float(place)))
            assert v == pytest.approx(float(mp.sqrt(w)), rel=1e-10)
    with pytest.raises(SolutionError, match=r"closer to the equilibrium at theta = 3\.14.* than doubles can tell"):
        motion.lam(3600.0)


def test_a_leg_that_cannot_be_followed(slope: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error names the place up to which it was followed."""

    def lost(*arguments: Any) -> int:
        arguments[-1][:], arguments[-1][:, leg_record.END] = 0.0, 0.5
        return ends.END_TOO_MANY_PANELS

    motion = slope.solve(lam0=0, mu=0.1)
    monkeypatch.setattr(answers, "drive", lost)
    with pytest.raises(SolutionError, match=r"V\*\*2 beyond x = 0\.5 could not be followed"):
        motion.lam(10.0)


@pytest.mark.extended
def test_over_a_joint_and_back(build: Build) -> None:
    """Along a level line, up an arc to its turn, down again and to rest, each part agrees with its closed form.

    On the arc W' + 2 mu W = -2 g R (sin + mu cos) upwards, with -mu downwards; on the line W' = -2 mu g.
    """
    rail = gqm.Curve.piecewise([gqm.line(length=2), gqm.arc(radius=1, angle="pi/2")])
    motion = build("ramp", rail, gqm.CoulombFriction(mu="mu")).solve(lam0=0, v0=4, mu="0.25")
    with mp.workdps(30):
        mu, g, flat = mpf("0.25"), mpf("9.81"), mpf(2)

        def wave(angle: mpf, mu: mpf) -> mpf:
            return 2 * g / (1 + 4 * mu**2) * ((1 - 2 * mu**2) * mp.cos(angle) - 3 * mu * mp.sin(angle))

        def up(angle: mpf) -> mpf:
            return wave(angle, mu) + (16 - 2 * mu * g * flat - wave(mpf(0), mu)) * mp.exp(-2 * mu * angle)

        top = mp.findroot(up, mpf("0.5"))

        def down(angle: mpf) -> mpf:
            return wave(angle, -mu) - wave(top, -mu) * mp.exp(2 * mu * (angle - top))

        below = mp.sqrt(down(mpf(0)))
        there = [flat + top, flat - below**2 / (2 * mu * g)]
        joined = mp.sqrt(16 - 2 * mu * g * flat)
        # Gauss-Legendre nodes do not come too near to the turn, where W is a small difference.
        rise, fall = (
            mp.quad(lambda y, w=w: 2 * y / mp.sqrt(w(top - y * y)), [0, mp.sqrt(top)], method="gauss-legendre")
            for w in (up, down)
        )
        times = [(4 - joined) / (mu * g) + rise, (4 - joined) / (mu * g) + rise + fall + below / (mu * g)]
    assert [event.kind for event in motion.events] == ["turn", "rest"]
    for event, place, time in zip(motion.events, there, times, strict=True):
        assert event.lam == pytest.approx(float(place), rel=1e-14)
        assert event.t == pytest.approx(float(time), rel=1e-14)


@pytest.mark.extended
def test_where_the_contact_force_begins_as_nothing(build: Build) -> None:
    """On a parabola of free fall N is zero at the launch, and the track then carries the body that drag has slowed
    down.

    W = exp(-2 b s) (g + 2 g times the integral of x exp(2 b s)).
    """
    module = build("flight", gqm.Curve.graph("-x**2/2"), gqm.QuadraticDrag(b="0.5"))
    motion = module.solve(lam0=0, v0="sqrt(9.81)")
    with mp.workdps(20):
        b, g = mpf("0.5"), mpf("9.81")

        def length(x: mpf) -> mpf:
            return (x * mp.sqrt(1 + x * x) + mp.asinh(x)) / 2

        def w(x: mpf) -> mpf:
            fed = mp.quad(lambda u: u * mp.exp(2 * b * length(u)), [0, x])
            return mp.exp(-2 * b * length(x)) * (g + 2 * g * fed)

        time = mp.quad(lambda x: mp.sqrt((1 + x * x) / w(x)), [0, 1])
    assert motion.time_at(1) == pytest.approx(float(time), rel=1e-14)
    state = motion.state(motion.time_at(1))
    assert state.v2 == pytest.approx(float(w(mpf(1))), rel=1e-14)
    assert state.normal_force == pytest.approx(float(g - w(mpf(1)) / 2) / math.sqrt(2.0), rel=1e-13)
    assert [event.kind for event in motion.events if event.kind == "contact-sign"] == []


@pytest.mark.parametrize(
    ("lam0", "v0"),
    [
        # Time is counted back from the turn to the place where N changes its sign, and no farther.
        (0.7483964034543935, 5.818989927693156),
        (0.5492047797152688, 6.863503323397249),
        (1.4219101233586642, 4.690743520201464),
        # On the way back from the turn, the distance to that place is a rounding longer than the distance run.
        (0.9646260788927759, 6.440001136948692),
    ],
)
def test_where_the_contact_force_changes_sign_on_a_ring(lam0: float, v0: float) -> None:
    """On a rough ring up to N = 0, W' + 2 mu W = -2 g (sin + mu cos) has a closed form, and the time agrees with
    quadrature.
    """
    motion = generated.circle_coulomb.solve(lam0, v0, t_max=3.0)
    with mp.workdps(30):
        mu, g, start = mpf("0.15"), mpf("9.81"), mpf(lam0)

        def wave(angle: mpf) -> mpf:
            return 2 * g / (1 + 4 * mu**2) * ((1 - 2 * mu**2) * mp.cos(angle) - 3 * mu * mp.sin(angle))

        def w(angle: mpf) -> mpf:
            return wave(angle) + (mpf(v0) ** 2 - wave(start)) * mp.exp(-2 * mu * (angle - start))

        place = mp.findroot(lambda angle: w(angle) + g * mp.cos(angle), mpf("2.1"))
        time = mp.quad(lambda angle: 1 / mp.sqrt(w(angle)), [start, (start + place) / 2, place])
    event = motion.events[0]
    assert event.kind == "contact-sign"
    assert event.lam == pytest.approx(float(place), rel=2e-15)
    assert event.t == pytest.approx(float(time), rel=1e-14)
    assert float(motion.state(event.t).lam) == pytest.approx(float(place), rel=1e-14)


@pytest.mark.parametrize(
    ("lam0", "v0", "direction", "given"),
    [
        (-2.0291116600710657, 0.6709674081797035, -1, {"gamma": 0.07927237116812622, "m": 4.717807289149854e-06}),
        (-0.7386383579964759, 2.0805894804934875, 1, {}),
        (-1.2150320125272465, 0.6091206453020498, 1, {"gamma": 0.06250398026312583, "m": 4.414315099269242e-06}),
    ],
)
def test_each_change_of_contact_is_an_event(lam0: float, v0: float, direction: int, given: dict[str, float]) -> None:
    """Each change of contact is reported, also within a rounding of the end of a run of panels (some were lost)."""
    motion = generated.circle_droplet.solve(lam0, v0, direction, **given)
    end = min(motion.t_end, 16.0)
    times = np.array([0.0, *(event.t for event in motion.events_between(0, end) if event.kind == "contact-sign")])
    force = motion.state(0.5 * (times[:-1] + times[1:])).normal_force
    assert len(times) > 20
    assert np.all(force[:-1] * force[1:] < 0.0)


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("lam0", "v0", "b", "end"),
    [
        (0.39480152205872354, 7.336874044988307, 0.003694168211493829, "liftoff"),
        (0.39480152205872354, 7.336874044988307, 0.004, "contact-sign"),
        (0.39480152205872354, 7.336874044988307, 0.003, "liftoff"),
        (-1.0646594884473632, 9.060303191787575, 0.0967765559180089, "contact-sign"),
    ],
)
def test_laps_of_a_loop_until_contact_is_lost(lam0: float, v0: float, b: float, end: str, build: Build) -> None:
    """The time of several laps with drag is the integral of the closed form of V**2.

    A lap after which the body becomes slow was followed up to a lap after its slow part, when it was followed again for
    its panels: contact was lost too early, or the leg was refused.
    """
    rim = gqm.Curve.implicit("x**2 + z**2 - 1", start=(0, -1))
    module = build("rim", rim, gqm.CoulombFriction(mu="mu") + gqm.QuadraticDrag(b="b"))
    contact = "above" if end == "liftoff" else "bilateral"
    leg = module.solve(lam0, v0, 1, mu=0.0, b=b, t_max=20.0, contact=contact).legs[0]
    with mp.workdps(25):
        g, c, start, stop = mpf(G), mpf(b), mpf(lam0), mpf(leg.lam_end)
        a = 2 * g / (1 + 4 * c**2)

        def forced(s: Any) -> Any:
            return a * (mp.cos(s) - 2 * c * mp.sin(s))

        def speed(s: Any) -> Any:
            return forced(s) + (mpf(v0) ** 2 - forced(start)) * mp.exp(-2 * c * (s - start))

        time = mp.quad(lambda s: 1 / mp.sqrt(speed(s)), mp.linspace(start, stop, 41))
        assert abs(speed(stop) + g * mp.cos(stop)) < 2e-15 * v0**2  # roundings of the largest V**2
    assert leg.end == end
    assert leg.lam_end - leg.lam_start > 2.0 * math.pi
    assert leg.t_end == pytest.approx(float(time), rel=1e-15)
