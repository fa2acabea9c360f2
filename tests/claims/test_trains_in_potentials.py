"""Trains under potentials and in rotating frames agree with closed forms and with means in 30 digits."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

import gqm_sym as gqm
from gqm_sym.errors import DeclarationError, ParameterError

# Coordinates of a chart are right to some units in the last place, and so are potentials.
ROUNDING = 2e-15
# Forces are a few operations on such numbers; the tolerance is a share of the weight.
SHARE = 1e-14

Build = Callable[..., ModuleType]


@pytest.fixture(scope="module")
def hoop(build_train: Build) -> ModuleType:
    """Return a train on a circle that rotates about the vertical through its centre, with a spring."""
    return build_train(
        "train_on_hoop", gqm.families.circle(), gqm.Gravity() + gqm.RotatingFrame() + gqm.Potential("k*x**2/2")
    )


def sinc(length: Any, radius: Any) -> Any:
    """Return the ratio of the mean of cos(2*s/R) over a train to its value at the middle."""
    return mp.sinc(mpf(length) / mpf(radius))


@pytest.mark.extended
@pytest.mark.parametrize(
    ("radius", "length", "place"), [(1, 1, 1.2), (2, 1.5, -0.7), (3, 2, 2.0), (1, 1e-6, 1.0), (1, 2.0**-40, 0.01)]
)
def test_spring_on_a_circle(hoop: ModuleType, radius: float, length: float, place: float) -> None:
    """The mean of x**2 is that of a body times sinc(l/R) but for a constant, so that twice the angle is a pendulum."""
    with mp.workdps(30):
        stiffness = 3 * sinc(length, radius)
        truth = 2 * mp.ellipk(mp.sin(mpf(place) / radius) ** 2) / mp.sqrt(stiffness)
        constants = {"L": radius, "length": length, "g": 0, "Omega": 0, "k": 3}
        motion = hoop.solve(place, **constants)
        # A place has the rounding of the length of a lap, and so has the part of the potential that depends on it.
        tolerance = ROUNDING + 2.0**-53 * 2 * mp.pi * radius / abs(place)
        assert abs(motion.half_period / truth - 1) <= tolerance
        assert abs(hoop.sweep("half_period", [place], **constants).values[0] / truth - 1) <= tolerance
    assert sorted(motion.turning_points) == pytest.approx([-abs(place), abs(place)], rel=ROUNDING)


@pytest.mark.extended
def test_where_a_train_rests_on_a_rotating_hoop(hoop: ModuleType) -> None:
    """A bead rests where cos(angle) = g/(R*Omega**2); both sides of this have their own mean over a train."""
    radius, length, rate = 2.0, 1.5, 4.0
    with mp.workdps(30):
        ratio = mpf("9.81") * mp.sinc(mpf(length) / (2 * radius)) / (radius * mpf(rate) ** 2 * sinc(length, radius))
        place = radius * mp.acos(ratio)
        # Half the second derivative of the potential by arc length, per radius squared.
        stiffness = mpf(rate) ** 2 * sinc(length, radius) * (1 - ratio**2)
        found = [e for e in hoop.equilibria(L=radius, length=length, Omega=rate, k=0) if 0 < e.lam < radius * 3]
        (stable,) = (e for e in found if e.stable)
        assert abs(stable.lam / place - 1) <= ROUNDING
        assert abs(stable.frequency / mp.sqrt(stiffness) - 1) <= 4 * ROUNDING


def test_forces_on_cars_of_a_rotating_hoop(hoop: ModuleType) -> None:
    """Each car is pressed by the forces at its own place, and couplings carry what their mean does not balance."""
    radius, length, rate, mass, cars = 2.0, 1.5, 4.0, 900.0, 3
    motion = hoop.solve(1.0, 0.5, L=radius, length=length, Omega=rate, k="0.25", m=mass)
    found, state = motion.cars(0.4), motion.state(0.4)

    def push(s: Any) -> Any:
        return 9.81 * np.sin(s / radius) + (0.25 - rate**2) * radius * np.sin(s / radius) * np.cos(s / radius)

    shares = (np.arange(cars) + 0.5) / cars - 0.5
    angles = (state.lam + length * shares) / radius
    inwards = state.v2 / radius + 9.81 * np.cos(angles) - (0.25 - rate**2) * radius * np.sin(angles) ** 2
    np.testing.assert_allclose(found.normal_force, mass / cars * inwards, rtol=0, atol=SHARE * mass * 9.81)
    # The acceleration is the mean of the push, by Gauss's rule on each car.
    nodes, weights = np.polynomial.legendre.leggauss(20)
    pulls = [float(push(state.lam + length * (share + nodes / (2 * cars))) @ weights) / 2 for share in shares]
    lacking = np.cumsum(np.array(pulls) - np.mean(pulls)) * mass / cars
    np.testing.assert_allclose(found.coupling_force, lacking[:-1], rtol=0, atol=2 * SHARE * mass * 9.81)


def test_around_a_centre(build_train: Build) -> None:
    """Under the attraction of a centre that parameters place V**2 is that of the mean potential, which mpmath has in 30
    digits; a short train is a body.
    """
    curve = gqm.Curve.graph("c*x**2", parameter="x", domain=(-2, 2), parameters={"c": "0.25"})
    law = gqm.CentralForce(centre=("a", "b"), k=5)
    module = build_train("train_around_centre", curve, law + gqm.Gravity())
    length, launch, v0 = mpf(3) / 2, mpf(1), mpf(1)
    where = {"a": "0.25", "b": "0.5", "length": "3/2"}
    with mp.workdps(30):

        def arc(x: Any) -> Any:  # from x = 0
            return x * mp.sqrt(1 + x * x / 4) / 2 + mp.asinh(x / 2)

        half = arc(mpf(2))

        def energy(x: Any, gravity: Any) -> Any:
            z = x * x / 4
            return gravity * z - 5 / mp.hypot(x - mpf(1) / 4, z - mpf(1) / 2)

        def place(s: Any) -> Any:
            return mp.findroot(lambda x: arc(x) - (s - half), (s - half) / 2)

        def mean(s: Any, gravity: Any) -> Any:
            low, high = place(s - length / 2), place(s + length / 2)
            inner = [x for x in (mpf(0), mpf(1) / 4, mpf(1) / 2) if low < x < high]
            whole = mp.quad(lambda x: energy(x, gravity) * mp.sqrt(1 + x * x / 4), [low, *inner, high])
            return whole / length

        for gravity in ("9.81", "0"):
            places = np.array([0.9, 1.7, 2.3, 2.95, 3.7])
            found = module.pass1(places, launch, v0, g=gravity, **where).v2
            levels = [mean(mpf(s), mpf(gravity)) for s in (float(launch), *places)]
            truth = [v0**2 - 2 * (level - levels[0]) for level in levels[1:]]
            assert max(abs(a - b) for a, b in zip(found, truth, strict=True)) <= 1e-14
    short = module.solve(1, "1/2", length="1e-9", a="0.25", b="0.5")
    rail = gqm.Curve.piecewise([curve])
    body = build_train("body_around_centre", rail, law + gqm.Gravity(), cars=0).solve(1, "1/2", a="0.25", b="0.5")
    assert short.kind == body.kind
    assert short.period == pytest.approx(body.period, rel=2 * ROUNDING)
    with pytest.raises(ParameterError, match="potential"):
        module.solve(1, a="1", b="0.25", length=1)


def test_helix_in_a_rotating_frame(build_train: Build) -> None:
    """On a helix about the axis a train falls as a body does, and each car is pressed by the Coriolis force too."""
    radius, rise, length, cars, rate = 2.0, 0.75, 3.0, 5, 0.6
    helix = gqm.families.helix(R="2", c="3/4", domain=(0, 12))
    module = build_train("train_on_rotating_helix", helix, gqm.Gravity() + gqm.RotatingFrame(), cars=cars)
    size, launch, v0 = float(np.hypot(radius, rise)), 12.0, 9.0
    slope = rise / size
    motion = module.solve(launch, v0, length=length, Omega=rate)
    shares = (np.arange(cars) + 0.5) / cars - 0.5
    for time in (0.5, 3.0):  # on the way up and down
        found = motion.cars(time)
        v = v0 - 9.81 * slope * time
        middle = launch + v0 * time - 9.81 * slope * time**2 / 2
        angles = (middle + length * shares) / size
        outwards = np.array([np.cos(angles), np.sin(angles), 0 * angles])
        ahead = np.array([-radius * np.sin(angles), radius * np.cos(angles), rise + 0 * angles]) / size
        still = np.array([[0.0], [0.0], [9.81]]) - 9.81 * slope * ahead
        aside = 2 * rate * v * np.cross([0, 0, 1], ahead.T).T
        force = (-(v**2) * radius / size**2 - rate**2 * radius) * outwards + still + aside
        np.testing.assert_allclose(found.lam, middle + length * shares, rtol=1e-13)
        wanted = np.stack([found.normal_x, found.normal_y, found.normal_z]) * cars
        np.testing.assert_allclose(wanted, force, rtol=0, atol=4 * SHARE * 9.81)
        np.testing.assert_allclose(cars * found.normal_force, np.linalg.norm(force, axis=0), rtol=4 * SHARE)
        np.testing.assert_allclose(found.coupling_force, 0, rtol=0, atol=4 * SHARE * 9.81)


@pytest.mark.extended
def test_drag_under_a_potential(build_train: Build) -> None:
    """With drag V**2 is linear in a known solution on a circle, which says where the train turns."""
    module = build_train(
        "train_on_spring_with_drag", gqm.families.circle(), gqm.Potential("k*x**2/2") + gqm.QuadraticDrag()
    )
    radius, length, drag, place = 1.0, 1.5, 0.05, 1.2
    legs = module.solve(place, L=radius, length=length, b=drag, k=3, t_max=4).legs
    with mp.workdps(30):
        pull, rate = 3 * sinc(length, radius), 2 * mpf(drag)

        def rest(s: Any) -> Any:
            # A solution of W' = rate*W - pull*sin(2*s), for motion backwards.
            return pull * (rate * mp.sin(2 * s) + 2 * mp.cos(2 * s)) / (rate**2 + 4)

        start = mpf(place)
        turn = mp.findroot(lambda s: rest(s) - rest(start) * mp.exp(rate * (s - start)), -start * mpf("0.9"))
        assert abs(legs[0].lam_end / turn - 1) <= 2 * ROUNDING


@pytest.mark.extended
def test_friction_about_a_centre(build_train: Build) -> None:
    """On a circle about a centre of attraction all cars press alike, so that V**2 approaches that of a circular orbit
    exponentially in arc length, or moves away from it until the train rests.
    """
    module = build_train("rubbing_train", gqm.families.circle(), gqm.CentralForce() + gqm.CoulombFriction(), 4)
    radius, strength, mu, start = 2.0, 20.0, 0.2, 3.0
    constants = {"L": radius, "mu": mu, "length": 1}
    for k in (strength, 2.0):
        motion, orbit = module.solve(0, start, k=k, **constants, t_max=4), k / radius
        state = motion.state(np.array([0.5, 1.5, 3.0]))
        growth = np.exp((2 if start**2 < orbit else -2) * mu * state.lam / radius)
        assert state.v2 == pytest.approx(orbit + (start**2 - orbit) * growth, rel=1e-13)
        force = (state.v2[1] - orbit) / radius / 4
        cars = motion.cars(1.5)
        assert cars.normal_force == pytest.approx(np.full(4, force), rel=1e-12)
        assert np.abs(cars.coupling_force).max() < 1e-13
    # The charts of the load belong to a strength.
    places = module.sweep("rest_position", 0, start, k=[strength, 24.0], **constants).values
    wanted = [radius / (2 * mu) * np.log(1 / (1 - start**2 * radius / k)) for k in (strength, 24.0)]
    assert places == pytest.approx(wanted, rel=1e-13)


def test_without_a_potential() -> None:
    """A train without a potential is refused."""
    with pytest.raises(DeclarationError, match="no potential acts on it"):
        gqm.derive(gqm.families.circle(), gqm.Train(length=1) + gqm.QuadraticDrag())


@pytest.mark.extended
def test_friction_on_a_rotating_hoop(build_train: Build) -> None:
    """The Coriolis force presses the cars against the side of the hoop, which DOP853 integrates in time."""
    law = gqm.Gravity() + gqm.RotatingFrame() + gqm.CoulombFriction()
    module = build_train("rubbing_train_on_rotating_hoop", gqm.families.circle(), law, 3)
    radius, length, rate, mu, cars = 2.0, 1.5, 1.75, 0.1, 3
    shares = (np.arange(cars) + 0.5) / cars - 0.5
    lesser, least = (float(sinc(length, size)) for size in (2 * radius, radius))

    def loads(s: float, v: float) -> tuple[Any, Any]:
        angles = (s + length * shares) / radius
        inwards = v**2 / radius + 9.81 * np.cos(angles) + rate**2 * radius * np.sin(angles) ** 2
        return inwards, 2 * rate * v * np.cos(angles)

    def law_of_motion(_: float, y: Any) -> list[float]:
        s, v = y
        pull = -9.81 * lesser * np.sin(s / radius) + rate**2 * radius * least * np.sin(2 * s / radius) / 2
        return [v, float(pull - mu * np.sign(v) * np.hypot(*loads(s, v)).mean())]

    motion = module.solve(-1, 3, L=radius, length=length, Omega=rate, mu=mu, t_max=3)
    stop = solve_ivp(law_of_motion, (0, 0.6), [-1, 3], "DOP853", rtol=3e-14, atol=1e-14).y[:, -1]
    state = motion.state(0.6)
    assert state.lam == pytest.approx(stop[0], rel=1e-13)
    assert state.v == pytest.approx(stop[1], rel=1e-13)
    force, aside = loads(*stop)
    found = motion.cars(0.6)
    assert found.normal_force == pytest.approx(force / cars, rel=1e-12)
    # Cars behind a coupling are as fast as the train; their own friction differs from its mean.
    rubbing = mu / cars * np.hypot(force, aside)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    places = (stop[0] + length * (shares[:, None] + nodes / (2 * cars))) / radius
    pulls = (9.81 * np.sin(places) - rate**2 * radius * np.sin(2 * places) / 2) @ weights / (2 * cars)
    lacking = np.cumsum(pulls + rubbing - np.mean(pulls + rubbing))
    assert found.coupling_force == pytest.approx(lacking[:-1], rel=0, abs=1e-12)


@pytest.mark.extended
def test_friction_on_a_rotating_helix(build_train: Build) -> None:
    """On a helix about the axis all cars press alike, so that time and place are integrals over the speed, which mpmath
    has in 30 digits; upwards and downwards the Coriolis force has opposite signs.
    """
    radius, rise, rate, mu, start = 2, 0.75, 0.5, 0.08, 9
    helix = gqm.families.helix(R="2", c="3/4", domain=(0, 40))
    law = gqm.Gravity() + gqm.RotatingFrame() + gqm.CoulombFriction()
    module = build_train("rubbing_train_on_rotating_helix", helix, law, 2)
    with mp.workdps(30):
        size = mp.hypot(radius, mpf(rise))
        across, slope, g = radius / size, mpf(rise) / size, mpf("9.81")

        def acceleration(v: Any) -> Any:  # V > 0 is upwards and turns with the frame
            inwards = radius * (v / size) ** 2 + 2 * mpf(rate) * across * v + radius * mpf(rate) ** 2
            return -g * slope - mp.sign(v) * mpf(mu) * mp.hypot(inwards, g * across)

        def spent(before: Any, after: Any) -> tuple[Any, Any]:
            time = mp.quad(lambda v: 1 / acceleration(v), [before, after])
            return time, mp.quad(lambda v: v / acceleration(v), [before, after])

        rises, up = spent(mpf(start), mpf("0"))
        passes, some = spent(mpf(start), mpf(5))
        falls, down = spent(mpf("-1e-25"), mpf(-4))
        motion = module.solve(10, start, length=1.5, mu=mu, Omega=rate, t_max=float(rises + falls + 1))
        for time, place, v in ((passes, some, 5), (rises + falls, up + down, -4)):
            state = motion.state(float(time))
            assert state.v == pytest.approx(v, rel=2e-14)
            assert state.lam == pytest.approx(float(10 + place), rel=2e-14)
