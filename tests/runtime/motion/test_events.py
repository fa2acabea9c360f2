"""Bodies leave a track that can only push at the places of textbooks, and the force of one that holds changes its
sign.
"""

import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm

ModuleOf = Callable[[str], ModuleType]

G = mpf("9.81")
# The tolerance of the angle: the zero of N is found within N's own rounding, about 1e-15 of m g.
ANGLE = 4e-15
# The tolerance of the time.
TIME = 1e-14


@pytest.fixture
def circle(module_of: ModuleOf) -> ModuleType:
    """Return a circle of radius L, counter-clockwise with its angle from the horizontal; the normal points inwards."""
    return module_of("pendulum")


def left_at(motion: Any) -> float:
    """Return the place at which the motion leaves the track; the leg, the event and the end of the motion must
    agree.
    """
    leg, event = motion.legs[-1], motion.events[-1]
    assert leg.end == event.kind == "liftoff"
    assert motion.kind == "transit"
    assert leg.t_end == event.t == motion.t_end
    assert leg.lam_end == event.lam
    with pytest.raises(gqm.GQMError, match="liftoff"):
        motion.lam(math.nextafter(motion.t_end, math.inf))
    return float(leg.lam_end)


@pytest.mark.parametrize("v0", ["0.01", "1", "2", "3"])
@pytest.mark.parametrize("direction", [1, -1])
def test_a_body_slides_off_a_cylinder(v0: str, direction: int, circle: ModuleType) -> None:
    """Sliding down from the top a body leaves at 2/3 of the radius plus v0**2/(3 g) in height."""
    motion = circle.solve(lam0="pi/2", v0=v0, direction=direction, contact="below", L=1)
    place = left_at(motion)
    with mp.workdps(40):
        height = mpf(2) / 3 + mpf(v0) ** 2 / (3 * G)
        truth = mp.pi / 2 + direction * mp.acos(height)
        # N is flat near the top, so that its rounding is a larger angle.
        assert abs(mpf(place) - truth) <= ANGLE * float(truth) / float(mp.sqrt(1 - height**2))
        rate = lambda a: 1 / mp.sqrt(mpf(v0) ** 2 + 2 * G * (1 - mp.cos(a)))  # noqa: E731
        time = mp.quad(rate, [0, 0.001, 0.01, 0.1, 0.3, mp.acos(height)] if v0 == "0.01" else [0, mp.acos(height)])
        assert abs(mpf(motion.t_end) - time) <= 10 * TIME * float(time)
    state = motion.state(motion.t_end)
    assert abs(state.normal_force) <= 1e-13
    assert state.z == pytest.approx(float(height), rel=1e-14)


def test_released_on_a_cylinder(circle: ModuleType) -> None:
    """Released at height h the body leaves at two thirds of it."""
    for lam0 in ("pi/2 - 1/100", "pi/4", "1/10"):
        motion = circle.solve(lam0=lam0, contact="below", L=2)
        with mp.workdps(40):
            released = {"pi/2 - 1/100": mp.pi / 2 - mpf("0.01"), "pi/4": mp.pi / 4, "1/10": mpf("0.1")}[lam0]
            assert abs(mpf(left_at(motion)) - mp.asin(2 * mp.sin(released) / 3)) <= ANGLE


@pytest.mark.parametrize("share", ["2.01", "2.5", "3", "3.5", "4", "4.5", "4.9", "4.999"])
def test_a_slow_loop_the_loop_falls_off(share: str, circle: ModuleType) -> None:
    """From the bottom with 2 g L < v0**2 < 5 g L the body leaves at sin(angle) = (v0**2/(g L) - 2)/3."""
    motion = circle.solve(lam0="-pi/2", v0=f"sqrt({share}*9.81*2)", contact="above", L=2)
    with mp.workdps(40):
        truth = mp.asin((mpf(share) - 2) / 3)
        assert abs(mpf(left_at(motion)) - truth) <= 4 * ANGLE / float(mp.cos(truth))
    assert (motion.state(np.linspace(0, motion.t_end, 50)).normal_force > -1e-12).all()


@pytest.mark.parametrize(("share", "kind"), [("0.5", "libration"), ("1.999", "libration"), ("5.001", "circulation")])
def test_a_loop_the_loop_that_never_falls_off(share: str, kind: str, circle: ModuleType) -> None:
    """If a body is too slow to pass the height of the centre, or fast enough for the top, contact is never lost."""
    launch = {"lam0": "-pi/2", "v0": f"sqrt({share}*9.81*2)", "L": 2}
    motion, held = circle.solve(**launch, contact="above"), circle.solve(**launch)
    assert motion.kind == held.kind == kind
    assert motion.t_end == math.inf
    assert not [event for event in motion.events if event.kind == "liftoff"]
    assert motion.lam(12.5) == held.lam(12.5)


def test_just_fast_enough_for_the_top(circle: ModuleType) -> None:
    """At exactly v0**2 = 5 g L the force touches zero at the top, and contact holds."""
    motion = circle.solve(lam0="-pi/2", v0="sqrt(5*9.81)", contact="above", L=1)
    assert motion.kind == "circulation"


@pytest.mark.parametrize(
    ("lam0", "v0", "direction", "contact"),
    [
        ("pi/2", "1", 1, "above"),  # on the outside of a track that exists on the inside only
        ("-pi/2", "1", 1, "below"),  # under the ball
        ("pi/2", "4", -1, "below"),  # over the crest faster than sqrt(g L)
        ("pi/4", "0", 1, "above"),  # at rest on the ceiling
    ],
)
def test_launched_out_of_contact(lam0: str, v0: str, direction: int, contact: str, circle: ModuleType) -> None:
    """If the track would have to pull at once, the motion ends at the launch."""
    motion = circle.solve(lam0=lam0, v0=v0, direction=direction, contact=contact, L=1)
    assert left_at(motion) == motion.problem.lam0
    assert motion.t_end == 0.0
    assert motion.state(0).v == float(v0) * motion.direction


def test_launched_without_force(circle: ModuleType) -> None:
    """If N is zero at launch, the motion decides: inside a loop the body leaves upwards and stays downwards.

    N = m (v**2/L - g sin(angle)), and both terms are exact here.
    """
    launch = {"v0": 3, "g": 9, "L": 1, "contact": "above"}
    for direction in (1, -1):  # down from the top, either side
        motion = circle.solve(lam0="pi/2", direction=direction, **launch)
        assert motion.kind == "circulation"
        assert motion.events == ()
    motion = circle.solve(lam0="pi/2", v0=3, g=9, L=1, contact="below")
    assert left_at(motion) == pytest.approx(math.pi / 2, rel=0, abs=0)
    assert motion.t_end == 0.0


def test_launched_without_force_on_a_slope_of_the_loop(circle: ModuleType) -> None:
    """Half-way up, at v**2 = g L sin(angle), the body leaves at once upwards, and keeps to the track downwards."""
    launch = {"lam0": "pi/6", "v0": "sqrt(9.81/2)", "L": 1, "contact": "above"}
    upwards, downwards = (circle.solve(direction=d, **launch) for d in (1, -1))
    assert left_at(upwards) == pytest.approx(math.pi / 6, rel=0, abs=ANGLE)
    assert upwards.t_end <= 1e-14
    # Down, through the bottom and up the other side, to the same height.
    with mp.workdps(40):
        assert abs(mpf(left_at(downwards)) + 7 * mp.pi / 6) <= 10 * ANGLE


def test_a_held_body_never_leaves(circle: ModuleType) -> None:
    """The force on a bead on a wire changes its sign twice on the way up and twice down, and the motion has no end."""
    motion = circle.solve(lam0="-pi/2", v0="sqrt(3*9.81*2)", L=2)
    changes = sorted(event.lam for event in motion.events if event.kind == "contact-sign")
    with mp.workdps(40):
        angle = mp.asin(mpf(1) / 3)
        expected = [-mp.pi - angle, -mp.pi - angle, angle, angle]
        for lam, truth in zip(changes, expected, strict=True):
            assert abs(mpf(lam) - truth) <= 4 * ANGLE
    assert motion.kind == "libration"
    assert motion.t_end == math.inf
    for event in motion.events:
        if event.kind == "contact-sign":
            before, after = motion.state(np.array([event.t - 1e-6, event.t + 1e-6])).normal_force
            assert before * after < 0
            assert motion.lam(event.t) == pytest.approx(event.lam, rel=0, abs=1e-14)


def test_a_free_flight_parabola_carries_nothing(module_of: ModuleOf) -> None:
    """Over z = -a x**2 the force has one sign: contact holds for v0**2 below g/(2 a) at the crest, and not above."""
    parabola = module_of("parabola")
    slow = parabola.solve(lam0="1e-3", v0="2.2", a=-1, contact="above", t_max=3)
    fast = parabola.solve(lam0="1e-3", v0="2.3", a=-1, contact="above", t_max=3)
    assert slow.legs[-1].end == "horizon"
    assert slow.t_end == 3.0
    assert left_at(fast) == 1e-3
    assert fast.t_end == 0.0


def test_a_jump_off_a_hill_on_a_passage(module_of: ModuleOf) -> None:
    """On a cubic the body leaves where g + z'' V**2/(1 + z'**2) = 0; on the other side there is no contact at
    launch.
    """
    cubic = module_of("cubic")
    motion = cubic.solve(lam0="-1/2", v0="1/2", direction=-1, contact="above")
    with mp.workdps(40):

        def force(x: mpf) -> mpf:
            v2 = mpf("0.25") + 2 * G * (mpf("-0.125") - x**3)
            return G + 6 * x * v2 / (1 + 9 * x**4)

        truth = mp.findroot(force, (mpf("-0.5"), mpf("-1")), solver="anderson")
        assert abs(mpf(left_at(motion)) - truth) <= 4 * ANGLE
    assert cubic.solve(lam0="-1/2", v0="1/2", direction=-1, contact="below").t_end == 0.0
