"""V**2 with friction along tracks in space past places where the contact force vanishes, to rounding."""

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm

Build = Callable[..., ModuleType]

G, RADIUS, STEEPEST, START, STOP = 9.81, 20.0, 1.3, 0.6, -0.7
# The largest error of V**2 and of the time, as a share. Worst measured: 2e-15.
ERROR = 8e-15
# The same of derivatives of the time.
DERIVATIVE_ERROR = 5e-14


def over_the_hill(speed: str | mpf, mu: str | mpf, length: float, cars: int) -> tuple[mpf, mpf, int]:
    """Return V**2 of a train at the end of the hill, the time to there, and how often N changes its sign on a car.

    Against the angle of climb, which decreases, V**2 is an exponential and a harmonic function as long as N has one
    sign on each car.
    """
    angle, stop, w, time, changes = mpf(START), mpf(STOP), mpf(speed) ** 2, mpf(0), 0
    g, radius, share = mpf(G), mpf(RADIUS), 2 * mpf(mu) / cars
    half = mpf(length) / (2 * radius)
    ahead = [half * (2 * mpf(car) + 1 - cars) / cars for car in range(cars)]

    def loads(at: mpf, v2: mpf) -> list[mpf]:
        return [g * mp.cos(at - shift) - v2 / radius for shift in ahead]

    signs = [mp.sign(load) for load in loads(angle, w)]
    while angle > stop:
        k = share * sum(signs)
        of_sine = 2 * g * radius * mp.sinc(half) + share * g * radius * mp.fdot(signs, map(mp.sin, ahead))
        of_cosine = share * g * radius * mp.fdot(signs, map(mp.cos, ahead))
        a = (of_cosine + k * of_sine) / (1 + k * k)
        b = k * a - of_sine
        c = (w - a * mp.sin(angle) - b * mp.cos(angle)) * mp.exp(k * angle)

        def v2(at: mpf, a: mpf = a, b: mpf = b, c: mpf = c, k: mpf = k) -> mpf:
            return a * mp.sin(at) + b * mp.cos(at) + c * mp.exp(-k * at)

        end, of_car = stop, -1
        for step in mp.linspace(angle, stop, 100)[1:]:
            turned = [j for j, load in enumerate(loads(step, v2(step))) if load * signs[j] < 0]
            if turned:
                zeros = {j: mp.findroot(lambda at, j=j, v2=v2: loads(at, v2(at))[j], step) for j in turned}
                of_car = max(zeros, key=lambda j: zeros[j])
                end = zeros[of_car]
                break
        time += mp.quad(lambda at, v2=v2: radius / mp.sqrt(v2(at)), [end, angle])
        if of_car >= 0:
            changes, signs[of_car] = changes + 1, -signs[of_car]
        angle, w = end, v2(end)
    return w, time, changes


@pytest.mark.parametrize(("cars", "changes"), [(1, 2), (3, 6)])
def test_friction_past_places_where_the_contact_force_vanishes(build: Build, cars: int, changes: int) -> None:
    """On a hill in a vertical plane, on a track that goes on in space, a body that the track holds back from above and
    from below passes places where N vanishes, beside which |N| has a kink; of a train each car does.
    """
    hill = gqm.arc(radius="20", angle="-2.6")
    track = gqm.Curve.piecewise([hill, gqm.transition(length=5, yaw="0.01")], start=(0, 0, 0), heading=(0, "1.3"))
    train = gqm.CoulombFriction() if cars == 1 else gqm.CoulombFriction() + gqm.Train(length=6, cars=cars)
    module = build(f"hill_in_space_{cars}", track, train)
    with mp.workdps(30):
        w, time, found = over_the_hill("13.2", "0.05", 0.0 if cars == 1 else 6.0, cars)
    assert found == changes
    begin, end = RADIUS * (STEEPEST - START), RADIUS * (STEEPEST - STOP)
    assert abs(module.pass1(np.array([end]), lam0=begin, v0="13.2", mu="0.05").v2[0] - w) <= ERROR * w
    swept = module.sweep("time_at", begin, 13.2, lam=end, mu=0.05)
    assert abs(float(swept.values) - time) <= ERROR * time


@pytest.mark.parametrize("by_formulas", [False, True])
def test_derivatives_behind_places_where_the_contact_force_vanishes(build: Build, *, by_formulas: bool) -> None:
    """The derivative of friction with respect to V**2 jumps there; that of the time of arrival behind them has all
    digits nevertheless, along a chart and along formulas that leave the plane by next to nothing.
    """
    begin, end = RADIUS * (STEEPEST - START), RADIUS * (STEEPEST - STOP)
    if by_formulas:
        track = gqm.Curve.space(x="20*sin(u)", y="1e-15*sin(3*u)", z="20*cos(u)", parameter="u", domain=("-1.3", "1.3"))
        module, begin, end = build("hill_by_formulas", track, gqm.CoulombFriction()), -START, -STOP
    else:
        hill = gqm.arc(radius="20", angle="-2.6")
        track = gqm.Curve.piecewise([hill, gqm.transition(length=5, yaw="0.01")], start=(0, 0, 0), heading=(0, "1.3"))
        module = build("hill_in_space_1", track, gqm.CoulombFriction())
    found = module.solve(begin, "13.2", mu="0.05").gradient("time_at", lam=end)
    step = mpf(10) ** -10
    with mp.workdps(30):
        for name, change in (("v0", (step, 0)), ("mu", (0, step))):
            after, before = (
                over_the_hill(mpf("13.2") + sign * change[0], mpf("0.05") + sign * change[1], 0.0, 1)[1]
                for sign in (1, -1)
            )
            truth = (after - before) / (2 * step)
            assert abs(found[name] - truth) <= DERIVATIVE_ERROR * abs(truth)


def test_friction_in_a_vertical_loop_in_space(build: Build) -> None:
    """Where the track is vertical a body at rest needs no contact force, so that |N| at rest has a kink there; moving
    bodies pass such places as any others.
    """
    loop = gqm.arc(radius="2", angle="6.25")
    track = gqm.Curve.piecewise([loop, gqm.transition(length=1, yaw="0.1")], start=(0, 0, 0))
    motion = build("loop_in_space", track, gqm.CoulombFriction()).solve(0, 14, mu="0.1", g="9.81")
    with mp.workdps(30):
        g, radius, mu, angle = mpf("9.81"), mpf(2), mpf("0.1"), mpf("6.25")
        a = -6 * mu * g * radius / (1 + 4 * mu * mu)
        b = 2 * g * radius + 2 * mu * a

        def v2(at: mpf) -> mpf:
            return a * mp.sin(at) + b * mp.cos(at) + (196 - b) * mp.exp(-2 * mu * at)

        time = mp.quad(lambda at: radius / mp.sqrt(v2(at)), [0, angle / 2, angle])
        w = v2(angle)
    assert abs(motion.time_at(12.5) - time) <= ERROR * time
    assert abs(motion.state(float(time)).v2 - w) <= ERROR * w


def test_a_train_of_one_car_past_a_place_without_contact_force(build: Build) -> None:
    """On a hill in the plane, the contact force of the only car has nothing else that it is small against."""
    hill = gqm.Curve.piecewise([gqm.arc(radius="20", angle="-2.6")], start=(0, 0), heading="1.3")
    module = build("hill_for_one_car", hill, gqm.CoulombFriction() + gqm.Train(length=6, cars=1))
    with mp.workdps(30):
        w, time, found = over_the_hill("13.2", "0.05", 6.0, 1)
    assert found == 2
    begin, end = RADIUS * (STEEPEST - START), RADIUS * (STEEPEST - STOP)
    motion = module.solve(begin, "13.2", mu="0.05")
    assert abs(motion.time_at(end) - time) <= ERROR * time
    assert abs(motion.state(float(time)).v2 - w) <= 1e-12 * w


def test_a_law_that_depends_on_speed_alone(build: Build) -> None:
    """Up a straight track with friction and a resistance c v, the deceleration is a + c v, so that the body rests after
    the time log(1 + c v0/a)/c. The force does not depend on the place, but is not constant.
    """
    force = gqm.CoulombFriction() + gqm.Kernel.law("-c*direction*sqrt(W)")
    module = build("rubbing_up_a_line", gqm.Curve.graph("3*x/4"), force)
    motion = module.solve(0, "1.1", mu="4/5", c="0.3", g="9.81")
    rate = mpf("9.81") * (mpf(3) / 5 + mpf(4) / 5 * mpf(4) / 5)
    with mp.workdps(30):
        time = mp.log(1 + mpf("0.3") * mpf("1.1") / rate) / mpf("0.3")
        place = (mpf("1.1") - rate * time) / mpf("0.3") * mpf(4) / 5
    assert (len(motion.legs), motion.legs[0].end) == (1, "rest")
    assert abs(motion.t_end - float(time)) <= ERROR * float(time)
    assert abs(motion.legs[0].lam_end - float(place)) <= ERROR * float(place)
