"""Rotating frames and tracks that push to one side only, on space curves, agree with Newton's law and DOP853."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from newton import Newton, viviani

import gqm_sym as gqm
from gqm_sym.errors import LaunchError

Build = Callable[[str, Any, Any], ModuleType]
Vector = np.ndarray[Any, np.dtype[np.float64]]

# With its tightest tolerances DOP853 is right to some 1e-12 over a few seconds.
INTEGRATED = 3e-11


VIVIANI = gqm.Curve.space(x="1 + cos(u)", y="sin(u)", z="2*sin(u/2)", parameter="u")


def vectors(found: Any) -> Any:
    """Return the contact force as rows of vectors."""
    return np.stack([found.normal_x, found.normal_y, found.normal_z], axis=1)


@pytest.mark.extended
@pytest.mark.parametrize("mu", [0.0, 0.1])
def test_a_frame_that_turns(mu: float, built: Build) -> None:
    """Places and the contact force with its Coriolis part are right in both directions of motion, and friction includes
    that part.
    """
    frame = gqm.Gravity() + gqm.RotatingFrame(Omega="3/2")
    force, name = (frame + gqm.CoulombFriction(), "rough_turning") if mu else (frame, "turning")
    module = built(name, VIVIANI, force)
    numbers = {"mu": mu} if mu else {}
    motion, newton = module.solve(-2, 4, t_max=30, **numbers), Newton(viviani, 1.5, mu)
    turn = motion.legs[0].t_end
    # DOP853 cannot pass the jump of friction at a turn; without friction it is asked for times far beyond.
    times = np.array([0.1, 0.4, 0.7, 0.95]) * (turn if mu else motion.period)
    truth, state = newton.follow(-2.0, 4.0, times).y, motion.state(times)
    contact = np.array([newton.forces(*column[:2])[0] for column in truth.T])
    assert state.lam == pytest.approx(truth[0], abs=INTEGRATED)
    assert vectors(state) == pytest.approx(contact, abs=10 * INTEGRATED)
    assert state.normal_force == pytest.approx(np.linalg.norm(contact, axis=1), abs=10 * INTEGRATED)
    assert motion.state(float(times[2])).normal_force == state.normal_force[2]
    assert motion.energy(times).lost == pytest.approx(truth[2], abs=INTEGRATED)
    for sign in (1, -1):
        path = module.pass1(state.lam, lam0=-2, v0=4, direction=sign, **numbers)
        same = np.sign(state.v) == sign
        assert path.normal_force[same] == pytest.approx(state.normal_force[same], rel=1e-12)
        if not mu:
            assert np.all(np.abs(path.normal_force[~same] - state.normal_force[~same]) > 0.1)


@pytest.mark.extended
def test_a_frame_that_turns_has_extremes_of_its_contact_force(built: Build) -> None:
    """No state exceeds the extremes of the contact force, and sweeps return the same numbers within two
    roundings.
    """
    module = built("turning", VIVIANI, gqm.Gravity() + gqm.RotatingFrame(Omega="3/2"))
    motion = module.solve(-2, 4)
    force = motion.state(np.linspace(0.0, motion.period, 2001)).normal_force
    for extreme, told in ((motion.normal_force_max, force.max()), (motion.normal_force_min, force.min())):
        assert extreme.value == pytest.approx(told, rel=1e-5)
        assert motion.state(extreme.t).normal_force == pytest.approx(extreme.value, rel=1e-12)
    for name in ("normal_force_max", "normal_force_min"):
        swept = float(module.sweep(name, lam0=-2, v0=4.0).values)
        assert swept == pytest.approx(getattr(motion, name).value, rel=4.5e-16, abs=0.0)
    with pytest.raises(LaunchError, match="declare the upward direction"):
        module.solve(-2, 4, contact="above")


@pytest.mark.extended
def test_a_hoop_that_turns_is_the_planar_one(built: Build) -> None:
    """A hoop in a plane through the axis moves as the planar curve; the track also balances the Coriolis force."""
    force = gqm.Gravity() + gqm.RotatingFrame(Omega=2)
    flat = gqm.derive(gqm.Curve.parametric(x="sin(u)", z="-cos(u)", parameter="u"), force)
    model = gqm.derive(gqm.Curve.space(x="3/5*sin(u)", y="4/5*sin(u)", z="-cos(u)", parameter="u"), force)
    assert model.speed_squared == flat.speed_squared
    hoop = built("turning_hoop", model.curve, force).solve("1/2", 1)
    state = hoop.state(np.linspace(0.0, hoop.period, 7))
    # In the plane V**2 + (4*sin(u) - ...) balances; across it the force is 2*Omega*V*dx/ds.
    sideways = 2.0 * 2.0 * state.v * np.cos(state.lam)
    in_plane = state.v2 + 9.81 * np.cos(state.lam) + 4.0 * np.sin(state.lam) ** 2
    assert state.normal_force == pytest.approx(np.hypot(in_plane, sideways), rel=4e-15)
    assert -0.8 * state.normal_x + 0.6 * state.normal_y == pytest.approx(sideways, abs=1e-13)


def hill(u: float) -> tuple[Any, Any, Any]:
    """Return a hill in a bend, and its derivatives."""
    return (
        (10.0 * u, 4.0 * np.sin(u / 2), 3.0 * np.cos(u)),
        (10.0, 2.0 * np.cos(u / 2), -3.0 * np.sin(u)),
        (0.0, -np.sin(u / 2), -3.0 * np.cos(u)),
    )


def upright_on(track: Callable[[float], Any], u: float, roll: float) -> Vector:
    """Return the upward direction of riders at a roll angle from the level."""
    tangent = np.array(track(u)[1])
    tangent /= np.linalg.norm(tangent)
    left = np.cross([0.0, 0.0, 1.0], tangent)
    left /= np.linalg.norm(left)
    return np.cross(tangent, left) * np.cos(roll) + left * np.sin(roll)


@pytest.mark.extended
@pytest.mark.parametrize("mu", [0.0, 0.05])
def test_a_track_that_pushes_upwards_only(mu: float, built: Build) -> None:
    """Contact is lost at the place that DOP853 finds, where the contact force has no component along the upward
    direction.
    """
    curve = gqm.Curve.space(x="10*u", y="4*sin(u/2)", z="3*cos(u)", parameter="u", roll="u/10")
    rough = gqm.Gravity() + gqm.CoulombFriction(mu="1/20")
    module = built("rough_groove", curve, rough) if mu else built("groove", curve, gqm.Gravity())
    newton = Newton(hill, mu=mu)

    def lifts(_: float, state: Vector) -> float:
        return float(newton.forces(state[0], state[1])[0] @ upright_on(hill, state[0], state[0] / 10))

    lifts.terminal = True  # type: ignore[attr-defined]
    truth = newton.follow(-3.0, 30.0, [2.0], lifts)
    motion = module.solve(-3, 30, contact="above")
    assert [event.kind for event in motion.events] == ["liftoff"]
    assert motion.t_end == pytest.approx(truth.t_events[0][0], abs=INTEGRATED)
    assert motion.events[0].lam == pytest.approx(truth.y_events[0][0][0], abs=INTEGRATED)
    state = motion.state(motion.t_end)
    assert state.n_vertical == pytest.approx(0.0, abs=1e-12)
    # The sides of the groove still push.
    assert abs(state.n_lateral) > 0.01
    assert state.normal_force == pytest.approx(9.80665 * abs(state.n_lateral), rel=1e-12)
    held = module.solve(-3, 30, t_max=2)
    assert held.events[0].kind == "contact-sign"
    assert held.events[0].t == pytest.approx(motion.t_end, rel=1e-13)
    assert module.solve(-3, 5, contact="above", t_max=2).events[-1].kind == "horizon"
    assert module.sweep("t_end", lam0=-3, v0=[5.0, 30.0], contact="above", t_max=2.0).values == pytest.approx(
        [2.0, motion.t_end], rel=1e-13
    )
    below = module.solve(-3, 30, contact="below")
    assert (below.t_end, below.events[0].kind) == (0.0, "liftoff")


def valley(u: float) -> tuple[Any, Any, Any]:
    """Return a valley in a bend, and its derivatives."""
    return (
        (10.0 * u, 4.0 * np.sin(u / 2), 2.0 * u * u),
        (10.0, 2.0 * np.cos(u / 2), 4.0 * u),
        (0.0, -np.sin(u / 2), 4.0),
    )


@pytest.mark.extended
@pytest.mark.parametrize(("lam0", "v0", "way", "legs"), [(0.1, 8.0, 1, 2), (1.2, 6.7, -1, 1)])
def test_a_track_that_turns_and_pushes_upwards_only(lam0: float, v0: float, way: int, legs: int, built: Build) -> None:
    """In a frame that turns contact is lost on the way on which the Coriolis force lifts the body, although the other
    way, with the same speeds, it is kept.
    """
    curve = gqm.Curve.space(x="10*u", y="4*sin(u/2)", z="2*u**2", parameter="u", roll="pi/3")
    module = built("turning_groove", curve, gqm.Gravity() + gqm.RotatingFrame(Omega="1/2"))
    newton = Newton(valley, 0.5)

    def lifts(_: float, state: Vector) -> float:
        return float(newton.forces(state[0], state[1])[0] @ upright_on(valley, state[0], np.pi / 3))

    lifts.terminal = True  # type: ignore[attr-defined]
    motion = module.solve(lam0, v0, way, contact="above")
    truth = newton.follow(lam0, v0 * way, [20.0], lifts)
    assert [event.kind for event in motion.events] == ["turn"] * (legs - 1) + ["liftoff"]
    assert motion.t_end == pytest.approx(truth.t_events[0][0], abs=INTEGRATED)
    assert motion.events[-1].lam == pytest.approx(truth.y_events[0][0][0], abs=INTEGRATED)
    assert motion.state(motion.t_end).n_vertical == pytest.approx(0.0, abs=1e-12)
    assert module.sweep("t_end", [lam0], [v0], way, contact="above").values == pytest.approx([motion.t_end], rel=1e-13)
    assert module.solve(lam0, v0, way, contact="below").t_end == 0.0
    # Held from all sides, the body passes the same places the other way with a force that would keep it on the track.
    held = module.solve(lam0, v0, way)
    state = held.state(np.linspace(0.0, held.period, 101))
    assert state.n_vertical[state.v > 0.0].min() > 0.4
    assert state.n_vertical[state.v < 0.0].min() < 0.0
    assert [event.kind for event in held.events].count("contact-sign") == 2


TURNING_VALLEY = gqm.Curve.space(x="10*u", y="4*sin(u/2)", z="2*u**2", parameter="u", roll="pi/3")


@pytest.mark.extended
@pytest.mark.parametrize(("lam0", "v0", "way", "legs"), [(0.1, 10.0, 1, 2), (1.2, 6.7, -1, 1)])
def test_a_rough_track_that_turns_and_pushes_upwards_only(
    lam0: float, v0: float, way: int, legs: int, built: Build
) -> None:
    """With friction, contact is lost where DOP853 finds it, and the energy lost until then is right; a force that other
    losses leave linear in V**2 is seen to vanish as well.
    """
    frame = gqm.Gravity() + gqm.RotatingFrame(Omega="1/2")
    rough = built("rough_turning_groove", TURNING_VALLEY, frame + gqm.CoulombFriction(mu="1/50"))
    newton = Newton(valley, 0.5, 0.02)

    def lifts(_: float, state: Vector) -> float:
        return float(newton.forces(state[0], state[1])[0] @ upright_on(valley, state[0], np.pi / 3))

    def turns(_: float, state: Vector) -> float:
        return float(state[1])

    lifts.terminal = turns.terminal = True  # type: ignore[attr-defined]
    motion = rough.solve(lam0, v0, way, contact="above")
    assert [event.kind for event in motion.events] == ["turn"] * (legs - 1) + ["liftoff"]
    place, t, lost = lam0, 0.0, 0.0
    if legs == 2:
        first = newton.follow(lam0, v0 * way, [20.0], turns)
        place, _, lost = first.y_events[0][0]
        t = first.t_events[0][0]
        assert motion.events[0].t == pytest.approx(t, abs=INTEGRATED)
        # It sets out again with a speed that costs less than the bound.
        v0, way = 1e-13, -way
    truth = newton.follow(place, v0 * way, [20.0], lifts)
    assert motion.t_end == pytest.approx(t + truth.t_events[0][0], abs=10 * INTEGRATED)
    assert motion.events[-1].lam == pytest.approx(truth.y_events[0][0][0], abs=10 * INTEGRATED)
    assert motion.energy(motion.t_end).lost == pytest.approx(lost + truth.y_events[0][0][2], abs=10 * INTEGRATED)
    assert motion.state(motion.t_end).n_vertical == pytest.approx(0.0, abs=1e-11)


@pytest.mark.extended
def test_drag_on_a_track_that_turns_and_pushes_upwards_only(built: Build) -> None:
    """Drag leaves the law linear in V**2, but not the component of N that decides about contact."""
    frame = gqm.Gravity() + gqm.RotatingFrame(Omega="1/2")
    module = built("dragged_turning_groove", TURNING_VALLEY, frame + gqm.QuadraticDrag(b="1/100"))
    for way in (1, -1):
        start = (0.1, 10.0) if way > 0 else (1.2, 6.5)
        motion = module.solve(*start, way, contact="above", t_max=30)
        held = module.solve(*start, way, t_max=motion.t_end)
        state = held.state(np.linspace(0.0, motion.t_end, 201))
        assert motion.events[-1].kind == "liftoff"
        assert state.n_vertical[:-1].min() > 0.0
        assert state.n_vertical[-1] == pytest.approx(0.0, abs=1e-11)


def test_a_ball_on_a_banked_track(built: Build) -> None:
    """The path of the centre, banked with the radius as heartline, has a line of contact and energy without slip."""
    curve = gqm.Curve.space(x="2*cos(u)", y="2*sin(u)", z="-u/2", parameter="u", roll="pi/6", heartline="1/10")
    state = built("ball", curve, gqm.Gravity() + gqm.Rolling(beta="2/5")).solve(0, 1).state(np.linspace(0.0, 2.0, 5))
    assert state.v2 == pytest.approx(1.0 - 2.0 * 9.81 / 1.4 * state.z, rel=4e-15)
    gap = np.stack([state.x - state.track_x, state.y - state.track_y, state.z - state.track_z])
    assert np.linalg.norm(gap, axis=0) == pytest.approx(np.full(5, 0.1), rel=1e-13)


@pytest.mark.extended
def test_random_space_curves_with_friction(built: Build) -> None:
    """On twelve curves, places, speeds, contact forces and the energy lost to friction are right up to the first
    turn.
    """
    curve = gqm.Curve.space(
        x="a*cos(u) + b*sin(2*u)", y="c*sin(u) + d*cos(2*u)", z="h*cos(u + f) + k*sin(3*u)", parameter="u"
    )
    module = built("random_rough", curve, gqm.Gravity() + gqm.CoulombFriction())
    rng = np.random.default_rng(21)
    for _ in range(12):
        a, c = rng.uniform(1.0, 4.0, 2)
        b, d, h, k = rng.uniform(-0.8, 0.8, 4)
        f, mu, lam0, v0 = rng.uniform(0.0, 6.0), rng.uniform(0.01, 0.4), rng.uniform(0.0, 6.0), rng.uniform(2.0, 6.0)

        def place(u: float, o: tuple[float, ...] = (a, b, c, d, h, f, k)) -> tuple[Any, Any, Any]:
            a, b, c, d, h, f, k = o
            s, t, q = np.sin, np.cos, u + f
            return (
                (a * t(u) + b * s(2 * u), c * s(u) + d * t(2 * u), h * t(q) + k * s(3 * u)),
                (-a * s(u) + 2 * b * t(2 * u), c * t(u) - 2 * d * s(2 * u), -h * s(q) + 3 * k * t(3 * u)),
                (-a * t(u) - 4 * b * s(2 * u), -c * s(u) - 4 * d * t(2 * u), -h * t(q) - 9 * k * s(3 * u)),
            )

        newton = Newton(place, mu=mu)
        motion = module.solve(lam0, v0, t_max=1.5, a=a, b=b, c=c, d=d, h=h, k=k, f=f, mu=mu)
        times = np.array([0.2, 0.6, 0.95]) * motion.legs[0].t_end
        truth, state = newton.follow(lam0, v0, times).y, motion.state(times)
        contact = np.array([newton.forces(*column[:2])[0] for column in truth.T])
        assert state.lam == pytest.approx(truth[0], abs=INTEGRATED)
        size = np.linalg.norm(contact, axis=1)
        assert vectors(state) == pytest.approx(contact, abs=10 * INTEGRATED * size.max())
        assert motion.energy(times).lost == pytest.approx(truth[2], abs=INTEGRATED * 10)


def test_sides_that_nothing_tells_are_refused(built: Build) -> None:
    """If nothing determines the sides of a track, one error says what to declare."""
    module = built(
        "coordinated_hill", gqm.Curve.space(x="u", y="u**2", z="u**3", parameter="u", roll="coordinated"), gqm.Gravity()
    )
    with pytest.raises(LaunchError, match="declare the upward direction"):
        module.solve(0, 1, contact="above")
