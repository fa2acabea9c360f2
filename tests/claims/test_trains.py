"""Trains agree with closed forms, with a 30-digit reference, and, if they are short, with the motion of a body."""

from collections.abc import Callable
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from naive import ulps
from scipy.integrate import solve_ivp

import generated.circle_drag
import generated.helix_coulomb
import gqm_sym as gqm
from gqm_sym.errors import DeclarationError, GQMError, InputError, LaunchError, ParameterError, SolutionError

G = mpf("9.81")
# Heights of a chart are right to a unit or two in the last place; half periods are tested to 2 of them.
MAX_ULPS = 3.0
# Forces are a few operations on such heights, and the tolerance is a share of the weight.
SHARE = 1e-14
# The tolerances of integrations by DOP853 over a few metres, whose errors are below those of the motion.
TIGHT = {"rtol": 3e-14, "atol": 1e-14}
# Times along points in space are known in doubles only, to some units in the last place.
ROUNDING = 4e-15

Build = Callable[..., ModuleType]


@pytest.fixture(scope="module")
def build(build_train: Build) -> Build:
    """Build the module of a train under gravity and perhaps another force."""

    def module(name: str, curve: gqm.Curve, force: Any = None, cars: int = 3) -> ModuleType:
        return build_train(name, curve, gqm.Gravity() if force is None else gqm.Gravity() + force, cars)

    return module


@pytest.fixture(scope="module")
def circle(build: Build) -> ModuleType:
    """Return a train on a circle."""
    return build("train_on_circle", gqm.families.circle())


def weaker(length: Any, radius: Any) -> Any:
    """Return the gravity of the pendulum that a train on a circle is equivalent to."""
    half = mpf(length) / (2 * mpf(radius))
    return G * mp.sin(half) / half


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("radius", "length", "place"),
    [(1, 1, 1.2), (5, 9.5, 1.5), (2, 6, 5.0), (1, 0.1, 0.01), (3, 12, 4.0), (1, 1e-6, 1.2), (1, 2.0**-40, 2.0)],
)
def test_on_a_circle_it_is_a_pendulum(circle: ModuleType, radius: float, length: float, place: float) -> None:
    """The half period is that of a pendulum under g*sinc(l/(2*R)), also for a train so short that it is a body."""
    with mp.workdps(40):
        sine = mp.sin(mpf(place) / (2 * radius))
        truth = 2 * mp.sqrt(radius / weaker(length, radius)) * mp.ellipk(sine**2)
        found = circle.solve(place, L=radius, length=length).half_period
        assert ulps(found, truth) <= MAX_ULPS
    assert circle.sweep("half_period", [place], L=radius, length=length).values[0] == pytest.approx(found, rel=1e-15)


@pytest.mark.parametrize(
    ("radius", "length", "angle"),
    [
        (0.109, 0.000566, 0.00278),
        (0.109, 0.000566, 0.0313),
        (0.109, 0.000566, 0.000652),
        (0.3186115687952875, 0.00038500124019736525, -0.0019450235259119313),
        (5.689898986605093, 0.022285694341114663, -0.0048662706504848914),
        (40.89235868677015, 0.047210990718864976, 0.0014709309872692083),
        (10.466112216758653, 0.08211080714535617, 0.016336325120811755),
    ],
)
def test_short_trains_on_small_swings(circle: ModuleType, radius: float, length: float, angle: float) -> None:
    """A swing may end close to where an end of the train passes the lowest place (the period was off by 5.8e-12).

    The other turning point was up to 2e-10 of the swing off, because the roundings of a lap came together there.
    """
    with mp.workdps(40):
        truth = (
            4 * mp.sqrt(radius / weaker(length, radius)) * mp.ellipk(mp.sin(mpf(angle * radius) / (2 * radius)) ** 2)
        )
        motion = circle.solve(angle * radius, L=radius, length=length)
        # The chart begins and ends at the lowest place, where a place has the rounding of the length of a lap.
        place = 2.0**-53 * 2 * mp.pi
        assert abs(motion.period / truth - 1) <= ROUNDING + place / abs(angle)
        assert abs(sum(motion.turning_points)) <= 8 * place * radius


def test_times_by_the_length(circle: ModuleType) -> None:
    """The derivatives of a half period, of a lap and of a time at a place are those for a pendulum under weaker
    gravity, also of a short train, of which they are in proportion to the length.
    """

    def quarter(length: Any) -> Any:
        return mp.sqrt(2 / weaker(length, 2)) * mp.ellipk(mp.sin(mpf("0.3")) ** 2)

    def lap(length: Any) -> Any:
        share = 144 + 4 * weaker(length, 2) * (1 - mp.cos(mpf("0.6")))
        return 8 / mp.sqrt(share) * mp.ellipk(8 * weaker(length, 2) / share)

    with mp.workdps(40):
        for length, tolerance in (("3/2", 1e-14), ("5", 1e-14), ("1/1000", 1e-12)):
            value = mpf(3) / 2 if length == "3/2" else mp.mpf(1) / 1000 if length == "1/1000" else mpf(5)
            by_quarter, by_lap = float(mp.diff(quarter, value)), float(mp.diff(lap, value))
            swing = circle.solve("6/5", L=2, length=length)
            assert swing.gradient("half_period", "length")["length"] == pytest.approx(2 * by_quarter, rel=tolerance)
            if length == "3/2":
                assert swing.gradient("time_at", "length", lam=0)["length"] == pytest.approx(by_quarter, rel=1e-13)
                turning = circle.solve("6/5", 12, L=2, length=length).gradient("period", "length")
                assert turning["length"] == pytest.approx(by_lap, rel=tolerance)
    with pytest.raises(SolutionError, match="no second derivatives with respect to parameters that shape"):
        swing.gradient("half_period", ["length"], order=2)


def test_forces_on_cars(circle: ModuleType) -> None:
    """The forces are those on bodies on a circle at the speed of the train, and couplings carry the rest of gravity."""
    radius, length, cars, mass = 5.0, 4.0, 3, 900.0
    motion = circle.solve(6, L=radius, length=length, m=mass)
    times = np.array([[0.0, 0.3], [1.0, 9.0]])
    found, g, state = motion.cars(times), float(weaker(length, radius)), motion.state(times)
    shares = (np.arange(cars) + 0.5) / cars - 0.5
    angles = (state.lam + length * shares[:, None, None]) / radius
    v2 = 2 * g * radius * (np.cos(state.lam / radius) - np.cos(6 / radius))
    force = mass / cars * (v2 / radius + 9.81 * np.cos(angles))
    scale = SHARE * mass * 9.81
    assert found.lam.shape == (cars, 2, 2)
    np.testing.assert_allclose(found.normal_force, force, rtol=0, atol=scale)
    np.testing.assert_allclose(found.normal_x, -force * np.sin(angles), rtol=0, atol=scale)
    np.testing.assert_allclose(found.normal_z, force * np.cos(angles), rtol=0, atol=scale)
    assert not found.normal_y.any()
    assert not found.y.any()
    np.testing.assert_allclose(found.z, -radius * np.cos(angles), rtol=0, atol=1e-14)
    # The part behind a coupling is as fast as the train; its own gravity is g sinc(own length/2R) at its own middle.
    for k in range(1, cars):
        behind = length * k / cars
        middle = state.lam - length / 2 + behind / 2
        pull = float(weaker(behind, radius)) * np.sin(middle / radius) - g * np.sin(state.lam / radius)
        np.testing.assert_allclose(found.coupling_force[k - 1], mass * k / cars * pull, rtol=0, atol=scale)
    one = motion.cars(0.3)
    np.testing.assert_array_equal(one.coupling_force, found.coupling_force[:, 0, 1])
    assert one.t == 0.3


@pytest.mark.extended
def test_parabola(build: Build) -> None:
    """On an open track the half period is that of the mean height, whose integral has a closed form there."""
    length, reach = mpf(3) / 2, 2
    with mp.workdps(30):

        def arc(x: Any) -> Any:
            return x * mp.sqrt(1 + 4 * x * x) / 2 + mp.asinh(2 * x) / 4

        def raised(x: Any) -> Any:  # the integral of z = x² over arc length
            return x * (8 * x * x + 1) * mp.sqrt(1 + 4 * x * x) / 32 - mp.asinh(2 * x) / 64

        def place(s: Any) -> Any:
            return mp.findroot(lambda x: arc(x) - s, s / 2)

        def height(s: Any, length: Any = length) -> Any:
            return (raised(place(s + length / 2)) - raised(place(s - length / 2))) / length

        def fastest(length: Any) -> Any:
            """Return the largest speed after a launch at 10 m/s, which is that at the lowest place."""
            return mp.sqrt(100 + 2 * G * (height(-end, length) - height(mpf(0), length)))

        start, end = arc(mpf(reach)), mpf(5) / 2
        low, high = height(mpf(0)), height(end)
        assert low > 0
        count = 40  # trapezoidal rule over the angle with s = end*sin(angle), which is periodic
        total = mpf(0)
        for k in range(count):
            angle = mp.pi * (k + mpf(1) / 2) / (2 * count)
            s = end * mp.sin(angle)
            total += end * mp.cos(angle) / mp.sqrt(2 * G * (high - height(s)))
        truth = total * mp.pi / count
        launch, change = str(start - end), float(mp.diff(fastest, length))
    module = build("train_on_parabola", gqm.Curve.graph("x**2", parameter="x", domain=(-reach, reach)))
    motion = module.solve(launch, length="3/2")
    assert ulps(motion.half_period, truth) <= MAX_ULPS
    assert motion.turning_points == pytest.approx((float(start - end), float(start + end)), rel=1e-15)
    # The lowest place is the same for any length.
    fast = module.solve(launch, 10, length="3/2")
    assert fast.gradient("v_max", "length")["length"] == pytest.approx(change, rel=1e-13)
    # Beyond its range an end of the train would be beyond the end of the track.
    with pytest.raises(LaunchError, match="domain"):
        module.solve("1/2", length="3/2")


def test_across_joints(build: Build) -> None:
    """At a joint of a rail the mean height is that of the exact heights; nothing is smoothed over a joint."""
    rail = gqm.Curve.piecewise([gqm.line(length=2), gqm.arc(radius=1, angle=1), gqm.line(length=3)], heading=-1)
    module = build("train_on_rail", rail)
    length = 1.25
    launch, v0 = 0.7, 3.0
    places = np.array([0.7, 1.3, 1.5, 2.2, 2.9, 3.4, 3.8, 5.0])
    found = module.pass1(places, launch, v0, length=length).v2
    nodes, weights = np.polynomial.legendre.leggauss(20)

    def mean(s: float) -> float:
        edges = np.unique(np.clip([s - length / 2, 2.0, 3.0, s + length / 2], s - length / 2, s + length / 2))
        half = np.diff(edges)[:, None] / 2
        at = (edges[:-1, None] + half * (1 + nodes)).ravel()
        slide, turned = np.minimum(at, 2.0), np.clip(at - 2.0, 0.0, 1.0)
        z = -slide * np.sin(1) + np.cos(1) - np.cos(1 - turned)
        return float((half * (z.reshape(half.size, -1) @ weights)[:, None]).sum() / length)

    heights = np.array([mean(s) for s in places])
    np.testing.assert_allclose(found, v0**2 - 2 * 9.81 * (heights - heights[0]), rtol=0, atol=4e-14)


@pytest.mark.extended
def test_drag(build: Build) -> None:
    """A train on a circle with drag turns where a pendulum under weaker gravity does."""
    module = build("train_with_drag", gqm.families.circle(), gqm.QuadraticDrag())
    length, drag = 1.5, 0.05
    legs = module.solve(2.0, L=1, length=length, b=drag, t_max=4).legs
    body = generated.circle_drag.solve(2.0, L=1, b=drag, g=float(weaker(length, 1)), t_max=4).legs
    assert len(legs) == len(body) > 2
    for train, pendulum in zip(legs, body, strict=True):
        assert train.lam_end == pytest.approx(pendulum.lam_end, rel=0, abs=1e-13)
        assert train.t_end == pytest.approx(pendulum.t_end, rel=1e-13)


@pytest.mark.extended
def test_in_space(build: Build) -> None:
    """Along points in space a vertical track gives the planar motion, and sweeps give single motions."""
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    x, z = 4 * np.cos(angle), np.sin(2 * angle) + np.sin(angle)
    flat = build("train_in_plane", gqm.Curve.sampled(np.stack([x, z], axis=1), closed=True))
    upright = np.stack([0.6 * x, 0.8 * x, z], axis=1)
    tilted = build("train_in_space", gqm.Curve.sampled(upright, closed=True))
    planar, spatial = (module.solve(9, length=2.5) for module in (flat, tilted))
    assert spatial.half_period == pytest.approx(planar.half_period, rel=1e-13)
    cars, theirs = planar.cars(0.7), spatial.cars(0.7)
    # The curvature of a spline through 60 points has some hundred roundings of the points.
    np.testing.assert_allclose(theirs.normal_force, np.abs(cars.normal_force), rtol=1e-11)
    np.testing.assert_allclose(0.6 * theirs.normal_x + 0.8 * theirs.normal_y, cars.normal_x, rtol=0, atol=1e-11)
    np.testing.assert_allclose(theirs.coupling_force, cars.coupling_force, rtol=0, atol=1e-13)
    swept = tilted.sweep("half_period", [9, 9.5], length=2.5).values
    np.testing.assert_allclose(
        swept, [tilted.solve(place, length=2.5).half_period for place in (9, 9.5)], rtol=ROUNDING
    )


def test_on_a_helix(build: Build) -> None:
    """On a helix the height is linear in arc length, so that a train falls as a body does; its cars press inwards and
    down.
    """
    radius, rise, length, cars = 2.0, 0.75, 3.0, 5
    module = build("train_on_helix", gqm.families.helix(R="2", c="3/4", domain=(0, 12)), cars=cars)
    rate, launch = float(np.hypot(radius, rise)), 20.0
    slope = rise / rate
    motion = module.solve(launch, length=length)
    assert motion.t_end == pytest.approx(np.sqrt(2 * (launch - length / 2) / (9.81 * slope)), rel=1e-15)
    time = 1.25
    found = motion.cars(time)
    shares = (np.arange(cars) + 0.5) / cars - 0.5
    places, v2 = launch - 9.81 * slope * time**2 / 2 + length * shares, (9.81 * slope * time) ** 2
    angles = places / rate
    inwards, tangent = radius / rate**2 * v2, np.array([-radius * np.sin(angles), radius * np.cos(angles)]) / rate
    scale = SHARE * 9.81
    np.testing.assert_allclose(found.lam, places, rtol=1e-14)
    wanted = [
        -inwards * np.cos(angles) - 9.81 * slope * tangent[0],
        -inwards * np.sin(angles) - 9.81 * slope * tangent[1],
    ]
    np.testing.assert_allclose(cars * found.normal_x, wanted[0], rtol=0, atol=scale)
    np.testing.assert_allclose(cars * found.normal_y, wanted[1], rtol=0, atol=scale)
    np.testing.assert_allclose(cars * found.normal_z, 9.81 * (1 - slope**2), rtol=0, atol=scale)
    np.testing.assert_allclose(found.coupling_force, 0, rtol=0, atol=scale)


def test_declared_in_one_piece() -> None:
    """The mass is that of the whole train, and forces that are not known of a train are refused."""
    train = gqm.Train(length="2.5", cars=4, mass=1200)
    assert dict(train.defaults) == {"length": "2.5", "m": 1200}
    circle = gqm.families.circle()
    assert dict(gqm.derive(circle, train + gqm.Gravity()).defaults)["m"] == 1200
    for force, message in (
        (gqm.Gravity() + gqm.Kernel.law("-k*W", parameters={"k": 1}), "law: a law of acceleration"),
        (gqm.Kernel(terms=()), "no potential acts on it"),
        (gqm.Gravity() + gqm.Rolling(radius=1), "rolling: radius"),
        (gqm.Gravity() + train, "train is given twice"),
    ):
        with pytest.raises(DeclarationError, match=message):
            gqm.derive(circle, train + force)
    with pytest.raises(DeclarationError, match="has no end to measure arc length from"):
        gqm.derive(gqm.families.parabola(), gqm.Gravity() + train)
    for cars in (0, 1.5, True, 10**6):
        with pytest.raises(DeclarationError, match="cars: must be a whole number"):
            gqm.Train(cars=cars)


def test_impossible_trains(circle: ModuleType, build: Build) -> None:
    """A train longer than the track, or without length, one over corners, and one on a one-sided track are refused."""
    cases: tuple[tuple[type[GQMError], str, Callable[[], Any]], ...] = (
        (ParameterError, "not shorter than the track", lambda: circle.solve(1, L=1, length=7)),
        (ParameterError, "length: must be positive", lambda: circle.solve(1, L=1, length=0)),
        (LaunchError, "is for one body", lambda: circle.solve(1, L=1, length=1, contact="above")),
        (InputError, "one body", lambda: circle.sweep("half_period", 1, L=1, length=1, contact="above")),
        (InputError, "is not a train", lambda: generated.circle_drag.solve(1, L=1).cars(0)),
    )
    for kind, message, call in cases:
        with pytest.raises(kind, match=message):
            call()
    planes = build("train_over_corners", gqm.Curve.sampled([(0, 1), (1, 0), (3, 0)], kind="linear"))
    with pytest.raises(ParameterError, match="corners"):
        planes.solve(1, length="1/2")


@pytest.mark.extended
def test_what_riders_feel_in_each_car(build: Build) -> None:
    """The loads are the acceleration of the places of the cars less gravity, along the rider's directions there."""
    track = gqm.Curve.space(x="20*cos(u)", y="30*sin(u)", z="4*cos(2*u)", parameter="u", roll="2/9", domain=(0, 6))
    module = build("train_with_riders", track, cars=5)
    motion = module.solve(40, 9, length=12)
    h, time = 2e-3, 2.0
    times = time + h * np.arange(-3, 4)
    cars = motion.cars(times)
    places = np.stack([cars.x, cars.y, cars.z])
    # Differences of sixth order.
    first = places @ np.array([-1, 9, -45, 0, 45, -9, 1]) / (60 * h)
    felt = places @ np.array([2, -27, 270, -490, 270, -27, 2]) / (180 * h * h) + np.array([[0], [0], [9.81]])
    ahead = first / np.linalg.norm(first, axis=0)
    left = np.cross([0, 0, 1], ahead.T).T
    left /= np.linalg.norm(left, axis=0)
    above = np.cross(ahead.T, left.T).T
    here = cars.lam[:, 3]
    roll = [float(module.pass1(lam, 40, 9, length=12).roll) for lam in here]
    up, side = above * np.cos(roll) + left * np.sin(roll), left * np.cos(roll) - above * np.sin(roll)
    for load, along in (("vertical", up), ("lateral", side), ("longitudinal", ahead)):
        told = getattr(cars, f"n_{load}")[:, 3]
        assert told == pytest.approx((felt * along).sum(axis=0) / 9.80665, abs=2e-8), load
    middle = motion.state(times)
    assert cars.n_longitudinal[2] == pytest.approx(middle.n_longitudinal, abs=1e-14)
    assert cars.n_vertical[2] == pytest.approx(middle.n_vertical, rel=1e-14)
    assert motion.cars(time).n_lateral == pytest.approx(cars.n_lateral[:, 3], rel=1e-12)
    assert not hasattr(build("train_on_circle", gqm.families.circle()).solve(1, length=1, L=1).cars(0), "n_vertical")


@pytest.mark.extended
def test_how_fast_loads_on_riders_change_under_friction(build: Build) -> None:
    """The onset of each load is the derivative of the load, which under friction depends on the loads of all cars."""
    track = gqm.Curve.space(x="20*cos(u)", y="30*sin(u)", z="4*cos(2*u)", parameter="u", roll="2/9", domain=(0, 6))
    forces = gqm.CoulombFriction() + gqm.RotatingFrame(Omega="1/10")
    motion = build("riders_with_friction", track, forces).solve(40, 9, length=12, mu=0.1, t_max=3)
    h, time = 2e-3, 2.0
    states = motion.state(time + h * np.arange(-3, 4))
    for load in ("vertical", "lateral", "longitudinal"):
        rate = getattr(states, f"n_{load}") @ np.array([-1, 9, -45, 0, 45, -9, 1]) / (60 * h)
        assert getattr(states, f"onset_{load}")[3] == pytest.approx(rate, rel=1e-9, abs=1e-11), load


@pytest.mark.extended
def test_friction_on_a_helix(build: Build) -> None:
    """All cars press alike on a helix, so that the train slides as one body, to the same limit."""
    helix = gqm.families.helix(R=2, c="-2*tan(1/2)", domain=(0, 400))
    module = build("rubbing_train_on_helix", helix, gqm.CoulombFriction(mu="1/5"), cars=7)
    motion = module.solve(4, length=3, t_max=60)
    assert motion.state(58.0).v2 == pytest.approx(56.8285107057949251514199278096, rel=1e-13)
    cars = motion.cars(1.5)
    one = generated.helix_coulomb.solve(0, t_max=5, R=2, c="-2*tan(1/2)", mu="0.2").state(1.5)
    assert motion.state(1.5).v == pytest.approx(one.v, rel=1e-13)
    assert cars.normal_force == pytest.approx(np.full(7, one.normal_force / 7), rel=1e-13)
    # Each car would move like that alone.
    assert np.abs(cars.coupling_force).max() < 1e-12


@pytest.mark.extended
@pytest.mark.parametrize("in_space", [True, False])
def test_friction_of_each_car(in_space: bool, build: Build) -> None:
    """Friction acts on each car by its own contact force, as in Newton's law for all cars by DOP853; couplings add
    up. In space another potential acts too.
    """
    waves = {"x": "20*u", "z": "3*cos(u)", "parameter": "u", "domain": (-3, 3)}
    curve = gqm.Curve.space(**waves, y="5*sin(u)") if in_space else gqm.Curve.parametric(**waves)
    field = gqm.Potential("x**2/40 + y*z/8") if in_space else None
    name = "rubbing_train_in_a_field" if in_space else "rubbing_train_in_plane"
    module = build(name, curve, field + gqm.CoulombFriction() if field else gqm.CoulombFriction(), cars=4)
    length, mu, v0, launch = 8.0, 0.05, 12.0, 30.0
    motion = module.solve(launch, v0, length=length, mu=mu)
    shares = (np.arange(4) + 0.5) / 4 - 0.5

    def pressed(s: float, w: float) -> Any:
        """Return |N|/m of each car, from the formulas of the curve."""
        u = places(s + length * shares)
        first = np.array([20 + 0 * u, 5 * np.cos(u) * in_space, -3 * np.sin(u)])
        second = np.array([0 * u, -5 * np.sin(u) * in_space, -3 * np.cos(u)])
        size = np.linalg.norm(first, axis=0)
        t = first / size
        bend = (second - t * (t * second).sum(axis=0)) / size**2
        x, y, z = 20 * u, 5 * np.sin(u), 3 * np.cos(u)
        pull = np.array([x / 20, z / 8, y / 8]) * in_space + 9.81 * np.array([[0], [0], [1]])
        return np.linalg.norm(w * bend + pull - t * (t * pull).sum(axis=0), axis=0)

    def energy(s: Any) -> Any:
        """Return the potential energy per unit mass of a body."""
        u = places(s)
        return 9.81 * 3 * np.cos(u) + (10 * u**2 + 15 * np.sin(u) * np.cos(u) / 8) * in_space

    nodes, weights = np.polynomial.legendre.leggauss(40)

    def arc(u: Any) -> Any:
        at = -3 + (u + 3)[..., None] * (1 + nodes) / 2
        rate = np.sqrt(400 + 25 * np.cos(at) ** 2 * in_space + 9 * np.sin(at) ** 2)
        return (u + 3) / 2 * (rate @ weights)

    def places(s: Any) -> Any:
        u = s / 20.0 - 3
        for _ in range(6):
            rate = np.sqrt(400 + 25 * np.cos(u) ** 2 * in_space + 9 * np.sin(u) ** 2)
            u = u - (arc(u) - s) / rate
        return u

    def slopes(_: float, y: Any) -> Any:
        s, v, _ = y
        low, high = energy(s + length * np.array([-0.5, 0.5]))
        rubbing = mu * pressed(s, v * v).mean()
        return [v, -(high - low) / length - np.sign(v) * rubbing, rubbing * abs(v)]

    times = [0.5, 1.5, 3.0]
    truth = solve_ivp(slopes, (0.0, 3.0), [launch, v0, 0.0], "DOP853", times, rtol=1e-12, atol=1e-12).y
    state = motion.state(np.array(times))
    assert state.lam == pytest.approx(truth[0], rel=1e-11)
    assert state.v == pytest.approx(truth[1], rel=1e-11)
    assert motion.energy(np.array(times)).lost == pytest.approx(truth[2], rel=1e-10)
    cars = motion.cars(1.5)
    force = pressed(truth[0][1], truth[1][1] ** 2)
    assert np.abs(cars.normal_force) == pytest.approx(force / 4, rel=1e-10)
    edges = energy(truth[0][1] + length * (np.arange(5) / 4 - 0.5))
    acceleration = -(edges[-1] - edges[0]) / length - mu * force.mean()
    # A coupling balances what the cars behind it lack, which is the potential's force over their part of the track.
    lacking = np.cumsum(acceleration / 4 + np.diff(edges) / length + mu * force / 4)
    assert cars.coupling_force == pytest.approx(lacking[:-1], abs=1e-10)
    # At a launch from rest, friction is that of the motion that begins.
    launch = 10.0
    start, force = module.solve(launch, length=length, mu=mu, t_max=1), pressed(launch, 0.0)
    way, edges = start.legs[0].direction, energy(launch + length * (np.arange(5) / 4 - 0.5))
    acceleration = -(edges[-1] - edges[0]) / length - way * mu * force.mean()
    lacking = np.cumsum(acceleration / 4 + np.diff(edges) / length + way * mu * force / 4)
    assert start.cars(0).coupling_force == pytest.approx(lacking[:-1], abs=1e-10)


@pytest.mark.extended
def test_cars_pass_jumps_of_curvature(build: Build) -> None:
    """Friction jumps when a car passes the end of an arc, between which places DOP853 integrates Newton's law; motions
    ended at one of them as if the track were singular there.
    """
    radius, half, length, mu = 8.0, 10.0, 6.0, 0.02
    bend, rest = gqm.arc(radius=8, angle="pi"), gqm.line(length=10)
    stadium = gqm.Curve.piecewise([rest, bend, gqm.line(length=20), bend, rest], closed=True)
    module = build("rubbing_train_on_stadium", stadium, gqm.CoulombFriction())
    shares = np.array([-1, 0, 1]) / 3
    passages = np.sort([side * half - length * share for side in (-1, 1) for share in (-0.5, *shares, 0.5)])

    def angle(s: Any) -> Any:
        return np.sign(s) * np.maximum(np.abs(s) - half, 0.0) / radius

    def slope(s: float, w: float, direction: int, bent: Any) -> float:
        """Return the derivative of V**2; ``bent`` says which cars are on an arc."""
        low, high = radius * (1 - np.cos(angle(s + length * np.array([-0.5, 0.5]))))
        force = 9.81 * np.cos(angle(s + length * shares)) + w / radius * bent
        assert (force > 0).all()
        return float(-2 * 9.81 * (high - low) / length - 2 * mu * direction * force.mean())

    motion, place, w = module.solve(0, 9, length=length, mu=mu), 0.0, 81.0
    for leg, direction in zip(motion.legs, (1, -1, 1), strict=False):
        stops = [stop for stop in passages[::direction] if direction * (stop - place) > 0]
        for stop in stops:
            bent = np.abs((place + stop) / 2 + length * shares) > half
            law = partial(slope, direction=direction, bent=bent)
            w = solve_ivp(lambda s, y, law=law: [law(s, y[0])], (place, stop), [w], "DOP853", **TIGHT).y[0, -1]
            place = stop
        law = partial(slope, direction=direction, bent=np.ones(3))
        place = solve_ivp(lambda w, y, law=law: [1 / law(y[0], w)], (w, 0.0), [place], "DOP853", **TIGHT).y[0, -1]
        w = 0.0
        assert leg.end == "turn"
        assert leg.lam_end == pytest.approx(place, rel=ROUNDING)


@pytest.mark.extended
@pytest.mark.parametrize("in_space", [True, False])
def test_a_short_train_is_a_body(in_space: bool, build: Build) -> None:
    """A short train moves like a body with friction in the limit; at a length of a nanometre both move alike."""
    waves = {"x": "20*u", "z": "3*cos(u)", "parameter": "u", "domain": (-3, 3)}
    curve = gqm.Curve.space(**waves, y="5*sin(u)") if in_space else gqm.Curve.parametric(**waves)
    name = "rubbing_train_in_space" if in_space else "rubbing_train_in_plane"
    module = build(name, curve, gqm.CoulombFriction(), cars=4)
    rail = gqm.Curve.piecewise([curve])
    body = build(f"body_{in_space}", rail, gqm.CoulombFriction(), cars=0).solve(30, 12, mu="0.05", t_max=3).state(2.0)
    trains = [module.solve(30, 12, mu="0.05", length=length, t_max=3).state(2.0) for length in (2.0, 1.0, 1e-9)]
    # The effect of a train's length on its cars is in proportion to its square.
    wide, half, short = (abs(train.lam - body.lam) for train in trains)
    assert wide / half == pytest.approx(4.0, rel=0.05)
    assert short < 1e-12 * body.lam
    assert trains[2].v == pytest.approx(body.v, rel=1e-12)
    assert trains[2].normal_force == pytest.approx(body.normal_force, rel=1e-11)


def test_a_roll_in_another_parameter_than_arc_length_is_refused() -> None:
    """A roll in another parameter is refused, because it would have to be known in arc length; other rolls are
    accepted.
    """
    rolled = {"x": "20*cos(u)", "y": "30*sin(u)", "z": "u", "parameter": "u", "domain": (0, 6)}
    law = gqm.Gravity() + gqm.Train(length=2)
    with pytest.raises(DeclarationError, match="roll: u/9 is in u, and the track of a train has arc length"):
        gqm.derive(gqm.Curve.space(**rolled, roll="u/9"), law)
    assert gqm.derive(gqm.Curve.space(**rolled, roll=("coordinated", "v_d")), law).rider is not None
