"""Bodies with a radius on banked tracks in space: the path of their centre is derived, and everything follows it."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.errors import DeclarationError

Build = Callable[[str, Any, Any], ModuleType]

BALL = gqm.Gravity() + gqm.Rolling(beta="2/5", radius="rho")
STANDARD_GRAVITY = 9.80665
VIVIANI = {"x": "1 + cos(u)", "y": "sin(u)", "z": "2*sin(u/2)", "parameter": "u"}


@pytest.mark.extended
def test_on_a_helix_the_centre_moves_along_a_helix(built: Build) -> None:
    """The centre falls with a constant acceleration along a helix of the same pitch and another radius."""
    radius, pitch, roll, rho = mp.mpf(2), mp.mpf("-0.5"), mp.pi / 6, mp.mpf("0.1")
    curve = gqm.Curve.space(x="2*cos(u)", y="2*sin(u)", z="-u/2", parameter="u", roll="pi/6")
    motion = built("helix_ball", curve, BALL).solve(0, 1, rho="0.1")
    size = mp.sqrt(radius**2 + pitch**2)
    # In polar coordinates the horizontal direction to the left is inwards.
    outwards, onwards = -mp.sin(roll), -pitch / size * mp.cos(roll)
    wide = mp.hypot(radius + rho * outwards, rho * onwards)
    along = mp.hypot(wide, pitch)
    acceleration = -mp.mpf("9.81") * pitch / along / mp.mpf("1.4")
    for t in (0.3, 2.0, 40.0):
        place, state = (t + acceleration * mp.mpf(t) ** 2 / 2) / along, motion.state(t)
        assert state.lam == pytest.approx(float(place), rel=1e-14)
        assert state.v == pytest.approx(float(1 + acceleration * t), rel=1e-14)
        assert np.hypot(state.x, state.y) == pytest.approx(float(wide), rel=1e-14)
        assert state.z == pytest.approx(float(pitch * place + rho * radius / size * mp.cos(roll)), rel=1e-14)
        assert state.kappa == pytest.approx(float(wide / along**2), rel=1e-14)
        on_track = [2 * np.cos(state.lam), 2 * np.sin(state.lam), -state.lam / 2]
        assert [state.track_x, state.track_y, state.track_z] == pytest.approx(on_track, rel=1e-13, abs=1e-13)


@pytest.mark.extended
def test_it_is_the_declared_path_of_the_centre(built: Build) -> None:
    """Along Viviani's curve the answers are those along the path of the centre, declared by hand."""
    tracked = built("viviani_ball", gqm.Curve.space(**VIVIANI, roll=0), BALL)
    across = "sqrt(1 + cos(u/2)**2)"
    centre = gqm.Curve.space(
        x=f"1 + cos(u) + rho*cos(u/2)*sin(u)/{across}",
        y=f"sin(u) - rho*cos(u/2)*cos(u)/{across}",
        z=f"2*sin(u/2) + rho/{across}",
        parameter="u",
    )
    declared = built("viviani_centre", centre, gqm.Gravity() + gqm.Rolling(beta="2/5"))
    one, other = (module.solve(-2, 3, rho="0.05") for module in (tracked, declared))
    assert one.period == pytest.approx(other.period, rel=2e-15)
    states = [motion.state(np.linspace(0.0, 3.0 * one.period, 31)) for motion in (one, other)]
    for name in ("lam", "x", "y", "z", "v", "normal_x", "normal_y", "normal_z"):
        assert getattr(states[0], name) == pytest.approx(getattr(states[1], name), rel=1e-12, abs=1e-12)
    slopes = [motion.gradient("half_period") for motion in (one, other)]
    for name in slopes[1]:
        assert slopes[0][name] == pytest.approx(slopes[1][name], rel=1e-12, abs=1e-14)


TRACKS: tuple[tuple[dict[str, str], Callable[[Any], Any], Callable[[Any], Any]], ...] = (
    (
        {"x": "u", "y": "2*u", "z": "u**2", "roll": "pi/4"},
        lambda u: mp.matrix([u, 2 * u, u**2]),
        lambda _: mp.pi / 4,
    ),
    ({"x": "u", "y": "0", "z": "u**2", "roll": "u/4"}, lambda u: mp.matrix([u, 0, u**2]), lambda u: u / 4),
    (
        {"x": "10*u", "y": "4*sin(u/2)", "z": "2*u**2", "roll": "u/3"},
        lambda u: mp.matrix([10 * u, 4 * mp.sin(u / 2), 2 * u**2]),
        lambda u: u / 3,
    ),
)


def on_knot(u: Any) -> Any:
    """Return a place on the torus knot of `KNOT`."""
    wide = 2 + mp.cos(3 * u) / 2
    return mp.matrix([wide * mp.cos(2 * u), wide * mp.sin(2 * u), mp.sin(3 * u) / 2])


# The loads have 360,000 operations when they are expanded, of which 800 are different, and were refused.
KNOT = {"x": "(2 + cos(3*u)/2)*cos(2*u)", "y": "(2 + cos(3*u)/2)*sin(2*u)", "z": "sin(3*u)/2", "roll": "1/10"}


def unit(vector: Any) -> Any:
    """Return the direction of a vector."""
    return vector / mp.norm(vector)


def crossed(one: Any, other: Any) -> Any:
    """Return the vector product."""
    return mp.matrix([one[i] * other[j] - one[j] * other[i] for i, j in ((1, 2), (2, 0), (0, 1))])


def derivative(of: Callable[[Any], Any], u: Any, order: int = 1) -> Any:
    """Return a derivative of a vector."""
    return mp.matrix([mp.diff(lambda w, k=k: of(w)[k], u, order) for k in range(3)])


def on_a_track(written: dict[str, str], built: Build) -> ModuleType:
    """Return the module of a ball on one of these tracks."""
    return built("ball_" + written["roll"].replace("/", "_over_"), gqm.Curve.space(**written, parameter="u"), BALL)


@pytest.mark.sample(1)
@pytest.mark.parametrize(("written", "track", "roll"), [*TRACKS, (KNOT, on_knot, lambda _: mp.mpf(1) / 10)])
def test_forces_by_the_definition(
    written: dict[str, str], track: Callable[[Any], Any], roll: Callable[[Any], Any], built: Build
) -> None:
    """Place, energy, contact force and the loads along the direction to the centre are right to 13 digits."""
    module = on_a_track(written, built)
    rho, lam0 = mp.mpf("0.1"), mp.mpf("0.3")

    def upwards(u: Any) -> Any:
        tangent = unit(derivative(track, u))
        left = unit(mp.matrix([-tangent[1], tangent[0], 0]))
        return mp.cos(roll(u)) * crossed(tangent, left) + mp.sin(roll(u)) * left

    def centre(u: Any) -> Any:
        return track(u) + rho * upwards(u)

    state = module.solve(float(lam0), 1, rho="0.1").state(np.array([0.1, 0.7]))
    with mp.workdps(30):
        for k, place in enumerate(state.lam):
            u = mp.mpf(float(place))
            here, first, second, up = centre(u), derivative(centre, u), derivative(centre, u, 2), upwards(u)
            v2 = 1 + 2 * mp.mpf("9.81") * (centre(mp.mpf(0.3))[2] - here[2]) / mp.mpf("1.4")
            tangent = unit(first)
            bend = (second - tangent * (tangent.T * second)[0]) / (first.T * first)[0]
            held = mp.matrix([0, 0, mp.mpf("9.81")])
            force = v2 * bend + held - tangent * (tangent.T * held)[0]
            assert [state.x[k], state.y[k], state.z[k]] == pytest.approx([*map(float, here)], rel=1e-14, abs=1e-14)
            assert state.v2[k] == pytest.approx(float(v2), rel=1e-13)
            normal = [state.normal_x[k], state.normal_y[k], state.normal_z[k]]
            assert normal == pytest.approx([*map(float, force)], rel=1e-13, abs=1e-12)
            left = crossed(up, tangent)
            loads = [float((force.T * axis)[0]) / STANDARD_GRAVITY for axis in (up, left)]
            assert [state.n_vertical[k], state.n_lateral[k]] == pytest.approx(loads, rel=1e-13, abs=1e-13)
            on_track = [state.track_x[k], state.track_y[k], state.track_z[k]]
            assert on_track == pytest.approx([*map(float, track(u))], rel=1e-13, abs=1e-13)


@pytest.mark.sample(1)
@pytest.mark.parametrize("written", [row[0] for row in TRACKS], ids=[row[0]["roll"] for row in TRACKS])
def test_rates_of_loads(written: dict[str, str], built: Build) -> None:
    """The rates of the loads are the differences of the loads."""
    motion = on_a_track(written, built).solve(0.3, 1, rho="0.1")
    before, here, after = (motion.state(0.5 + step) for step in (-1e-5, 0.0, 1e-5))
    for name in ("vertical", "lateral", "longitudinal"):
        rate = (getattr(after, f"n_{name}") - getattr(before, f"n_{name}")) / 2e-5
        assert getattr(here, f"onset_{name}") == pytest.approx(rate, rel=1e-6, abs=1e-8)


@pytest.mark.extended
def test_contact_is_lost_where_the_track_no_longer_pushes(built: Build) -> None:
    """On a crest a ball that only lies on the track leaves it where the load along its upward direction vanishes."""
    curve = gqm.Curve.space(x="10*u", y="u**2", z="-3*u**2", parameter="u", roll="0")
    module = built("crest_ball", curve, BALL)
    motion = module.solve(-1, 15, contact="above", rho="0.2")
    assert [event.kind for event in motion.events] == ["liftoff"]
    assert motion.state(motion.t_end).n_vertical == pytest.approx(0.0, abs=1e-12)
    before = module.solve(-1, 15, rho="0.2", t_max=2).state(np.linspace(0.0, motion.t_end, 50)[:-1])
    assert before.n_vertical.min() > 0.0


def test_in_a_vertical_plane_it_is_the_planar_one(built: Build) -> None:
    """An upright track in a vertical plane gives the answers of the planar curve."""
    space = built("plane_ball", gqm.Curve.space(x="u", y="0", z="u**2", parameter="u", roll=0), BALL)
    plane = built("graph_ball", gqm.Curve.graph("x**2"), BALL)
    one, other = space.solve(0.3, 1, rho="0.1"), plane.solve(0.3, 1, rho="0.1")
    assert one.period == pytest.approx(other.period, rel=4e-16)
    assert one.state(1.0).normal_force == pytest.approx(other.state(1.0).normal_force, rel=1e-14)


COIL = {"yaw": "1/8", "pitch": "1/50", "length": 20}


def test_along_pieces_the_declared_line_is_the_path_of_the_centre(built: Build) -> None:
    """A rail whose heartline is the radius of the body needs nothing derived."""
    rail = gqm.Curve.piecewise([gqm.transition(**COIL)], roll=0, heartline="1/10")
    with_radius = built("rail_ball", rail, gqm.Gravity() + gqm.Rolling(beta="2/5", radius="1/10"))
    without = built("rail_bead", rail, gqm.Gravity() + gqm.Rolling(beta="2/5"))
    states = [module.solve(0, 20).state(0.5) for module in (with_radius, without)]
    assert states[0] == states[1]


@pytest.mark.parametrize(
    ("curve", "message"),
    [
        (gqm.Curve.space(**VIVIANI), "on which side of a track in space the body rolls is not known; declare roll="),
        (gqm.Curve.space(**VIVIANI, roll="coordinated"), "needs a roll that does not depend on forces"),
        (gqm.Curve.piecewise([gqm.transition(**COIL)], roll=0), "declare that path, with the radius as heartline="),
    ],
)
def test_what_is_not_known_is_refused(curve: gqm.Curve, message: str) -> None:
    """Without an upward direction of the track the side on which the body rolls is not known."""
    with pytest.raises(DeclarationError, match=message):
        gqm.derive(curve, BALL)
