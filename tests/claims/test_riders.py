"""Loads on riders of banked tracks agree with Newton's law in 40 digits and with closed forms."""

import pickle
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf

import generated.viviani
import gqm_sym as gqm
from gqm_sym.errors import DeclarationError, InputError, SolutionError
from gqm_sym.kernels.base import DIRECTION, W
from gqm_sym.specfile import read_spec

G0 = 9.80665
# This track rises, falls and turns, and its tangent is never vertical.
WAY = {"x": "3*sin(u)", "y": "4*cos(u) + u", "z": "u**2/8 + sin(2*u)/3", "parameter": "u"}
ROLLS: dict[str, Any] = {"angle": "u/3 - 1/4", "coordinated": "coordinated", "designed": ("coordinated", "6 + u/5")}


def place(u: Any) -> Any:
    """Return the place on that track."""
    return mp.matrix([3 * mp.sin(u), 4 * mp.cos(u) + u, u**2 / 8 + mp.sin(2 * u) / 3])


def rates(u: Any) -> tuple[Any, Any]:
    """Return the first and second derivatives of the place."""
    first = mp.matrix([3 * mp.cos(u), -4 * mp.sin(u) + 1, u / 4 + 2 * mp.cos(2 * u) / 3])
    second = mp.matrix([-3 * mp.sin(u), -4 * mp.cos(u), mpf(1) / 4 - 4 * mp.sin(2 * u) / 3])
    return first, second


def cross(a: Any, b: Any) -> Any:
    """Return the vector product."""
    return mp.matrix([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def dot(a: Any, b: Any) -> Any:
    """Return the scalar product."""
    return sum(a[i] * b[i] for i in range(3))


def newton(roll: str, u: Any, w: Any, way: int, mu: Any, b: Any) -> tuple[list[Any], Any, Any]:
    """Return the loads by Newton's law, the tangential acceleration, and the rider's upward direction."""
    first, second = rates(u)
    size = mp.norm(first)
    tangent, up = first / size, mp.matrix([0, 0, 1])
    bend = (second - tangent * dot(tangent, second)) / size**2
    weight = mpf("9.81") * up

    def pressed(w: Any) -> Any:
        return w * bend + weight - tangent * dot(tangent, weight)

    along = -dot(tangent, weight) - way * (mu * mp.norm(pressed(w)) + b * w)
    felt = w * bend + along * tangent + weight
    left = cross(up, tangent)
    left = left / mp.norm(left)
    if roll == "angle":
        angle = u / 3 - mpf(1) / 4
        upright = cross(tangent, left) * mp.cos(angle) + left * mp.sin(angle)
    else:
        upright = pressed(w if roll == "coordinated" else (6 + u / 5) ** 2)
        upright = upright / mp.norm(upright)
    g0 = mpf("9.80665")
    return [dot(felt, axis) / g0 for axis in (upright, cross(upright, tangent), tangent)], along, upright


@pytest.mark.sample(1)
@pytest.mark.parametrize("roll", ROLLS)
@pytest.mark.parametrize("lossy", [False, True])
def test_closed_forms_against_newton(roll: str, lossy: bool) -> None:
    """Loads and their rates agree to 30 digits, with and without friction and drag, in both directions."""
    force = gqm.Gravity() + gqm.CoulombFriction() + gqm.QuadraticDrag() if lossy else gqm.Gravity()
    model = gqm.derive(gqm.Curve.space(**WAY, roll=ROLLS[roll]), force)
    assert model.rider is not None
    symbols = [sp.Symbol(name, real=True) for name in model.parameters]
    forms = (*model.rider.loads, *model.rider.onsets, *model.rider.up)
    with mp.workdps(45):
        numbers = {"g": mpf("9.81"), "m": mpf(1), "mu": mpf("0.1"), "b": mpf("0.02")}
        call = sp.lambdify((model.parameter, W, DIRECTION, *symbols), forms, "mpmath", cse=True)
        given = [numbers[name] for name in model.parameters]
        friction, drag = (mpf("0.1"), mpf("0.02")) if lossy else (mpf(0), mpf(0))
        for u, w, way in ((mpf("0.3"), mpf("41"), 1), (mpf("-1.7"), mpf("9.5"), -1), (mpf("2.9"), mpf("0.4"), 1)):
            found = call(u, w, way, *given)
            true, along, up = newton(roll, u, w, way, friction, drag)
            size = mp.norm(rates(u)[0])

            def nearby(h: Any, k: int, u: Any = u, w: Any = w, way: int = way, slope: Any = 2 * size * along) -> Any:
                return newton(roll, u + h, w + slope * h, way, friction, drag)[0][k]

            onset = [way * mp.sqrt(w) / size * mp.diff(lambda h, k=k: nearby(h, k), 0) for k in range(3)]
            scale = mp.norm(mp.matrix(true))
            assert max(abs(a - b) for a, b in zip(found[:3], true, strict=True)) < 1e-30 * scale
            assert max(abs(a - b) for a, b in zip(found[3:6], onset, strict=True)) < mpf("1e-20") * scale
            assert max(abs(found[6 + k] - up[k]) for k in range(3)) < 1e-30


def test_the_upright_force_in_a_rotating_frame() -> None:
    """N/m along the upward direction is n0 + kappa*V**2 + c*V by Newton's law, and none of the three contains V.

    On tracks without lateral force at a declared speed c contained it, and their modules could not be run.
    """
    model = gqm.derive(gqm.Curve.space(**WAY, roll=ROLLS["designed"]), gqm.Gravity() + gqm.RotatingFrame())
    forms, rate, w, way = model.upright, mpf("0.7"), mpf("9.5"), -1
    symbols = [sp.Symbol(name, real=True) for name in ("g", "Omega")]
    assert all(form.free_symbols <= {model.parameter, *symbols} for form in forms)
    with mp.workdps(40):
        numbers = sp.lambdify((model.parameter, *symbols), forms, "mpmath")
        for u in (mpf("0.3"), mpf("-1.7")):
            first, second = rates(u)
            tangent = first / mp.norm(first)
            bend = (second - tangent * dot(tangent, second)) / mp.norm(first) ** 2
            axis = mp.matrix([0, 0, rate])
            applied = -mpf("9.81") * mp.matrix([0, 0, 1]) - cross(axis, cross(axis, place(u)))

            def force(v: Any, parts: Any = (tangent, bend, axis, applied)) -> Any:
                tangent, bend, axis, applied = parts
                total = applied - 2 * v * cross(axis, tangent)
                return v * v * bend - total + tangent * dot(tangent, total)

            up = force(6 + u / 5) / mp.norm(force(6 + u / 5))
            rest, turning, moving = numbers(u, mpf("9.81"), rate)
            v = way * mp.sqrt(w)
            true = dot(force(v), up)
            assert abs(rest + turning * w + moving * v - true) < mpf("1e-35") * abs(true)


@pytest.fixture(scope="module")
def rough(built: Callable[..., ModuleType]) -> ModuleType:
    """Return the track above with friction and drag, banked by an angle."""
    curve = gqm.Curve.space(**WAY, roll=ROLLS["angle"], heartline="0.9")
    return built("rough", curve, gqm.Gravity() + gqm.CoulombFriction(mu="1/50") + gqm.QuadraticDrag(b="1/200"))


@pytest.fixture(scope="module")
def loop(built: Callable[..., ModuleType]) -> ModuleType:
    """Return a vertical loop of radius R that begins at its bottom."""
    curve = gqm.Curve.space(x="R*sin(u)", y="0", z="-R*cos(u)", parameter="u", roll="coordinated", parameters={"R": 7})
    return built("loop", curve, gqm.Gravity())


@pytest.mark.extended
def test_states_of_a_rough_track(rough: ModuleType) -> None:
    """States of a rough track have Newton's loads to the accuracy of doubles, in both directions, and the track lies
    below the rider.
    """
    motion = rough.solve(-4, 2, t_max=12)
    state = motion.state(np.array([0.2, 1.9, 4.7, 7.5, 9.5]))
    assert (state.v < 0.0).any()
    for k in range(state.t.size):
        u, w, way = mpf(state.lam[k]), mpf(state.v2[k]), int(np.sign(state.v[k]))
        true, along, up = newton("angle", u, w, way, mpf("0.02"), mpf("0.005"))
        found = [state.n_vertical[k], state.n_lateral[k], state.n_longitudinal[k]]
        assert found == pytest.approx([float(load) for load in true], rel=1e-14, abs=1e-14)
        size = mp.norm(rates(u)[0])
        slope, losses = 2 * size * along, (mpf("0.02"), mpf("0.005"))
        nearby = [newton("angle", u + h, w + slope * h, way, *losses)[0] for h in (1e-5, -1e-5)]
        onset = [float(mp.sqrt(w) * way / size * (a - b) / mpf("2e-5")) for a, b in zip(*nearby, strict=True)]
        found = [state.onset_vertical[k], state.onset_lateral[k], state.onset_longitudinal[k]]
        assert found == pytest.approx(onset, rel=1e-7, abs=1e-7)
        below = place(u) - mpf("0.9") * up
        assert [state.track_x[k], state.track_y[k], state.track_z[k]] == pytest.approx(
            [float(part) for part in below], rel=1e-14, abs=1e-14
        )
        assert state.roll[k] == pytest.approx(float(u / 3 - mpf(1) / 4), rel=1e-15)
        one = motion.state(float(state.t[k]))
        assert one == tuple(field[k] for field in state)
    assert pickle.loads(pickle.dumps(one)) == one
    assert "n_lateral (9.80665 m/s2)" in str(one)
    assert motion.to_xarray(np.array([0.2])).n_lateral.item() == motion.state(0.2).n_lateral
    path = rough.pass1(state.lam[:1], lam0=-4, v0=2)
    for name in ("n_vertical", "n_lateral", "n_longitudinal", "onset_vertical", "roll", "track_z"):
        assert getattr(path, name)[0] == pytest.approx(getattr(state, name)[0], rel=1e-12)


@pytest.mark.extended
def test_a_rider_at_rest_feels_his_weight(rough: ModuleType) -> None:
    """If friction holds the body, the loads are those of gravity alone and their rates are zero."""
    motion = rough.solve("5/2", 1, mu="3/5")
    assert motion.legs[-1].end == "rest"
    state = motion.state(motion.t_end)
    weight = np.sqrt(state.n_vertical**2 + state.n_lateral**2 + state.n_longitudinal**2)
    assert weight == pytest.approx(9.81 / G0, rel=1e-14)
    assert (state.onset_vertical, state.onset_lateral, state.onset_longitudinal) == (0.0, 0.0, 0.0)


@pytest.mark.extended
def test_a_rider_who_starts_or_turns(rough: ModuleType) -> None:
    """At a launch from rest and at a turn, the loads are the limits of those of the motion afterwards."""
    motion = rough.solve(-1, t_max=12)
    assert [leg.end for leg in motion.legs[:2]] == ["turn", "turn"]
    for leg in motion.legs[:2]:
        state = motion.state(leg.t_start)
        true = newton("angle", mpf(leg.lam_start), mpf(0), leg.direction, mpf("0.02"), mpf("0.005"))[0]
        found = [state.n_vertical, state.n_lateral, state.n_longitudinal]
        assert found == pytest.approx([float(load) for load in true], rel=1e-14, abs=1e-14)


@pytest.mark.extended
def test_a_vertical_loop(loop: ModuleType) -> None:
    """Between top and bottom the load changes by six g, all the way round the rider is upright, and levels are crossed
    where closed forms say.
    """
    motion = loop.solve(0, 20)
    most, least = motion.n_vertical_max, motion.n_vertical_min
    assert most.value - least.value == pytest.approx(6 * 9.81 / G0, rel=1e-14)
    assert (most.lam, least.lam) == (0.0, pytest.approx(np.pi, rel=1e-12))
    assert (motion.n_lateral_max.value, motion.n_longitudinal_min.value) == (0.0, 0.0)
    # n = (400/R - 2 g (1 - cos u) + g cos u)/g0
    levels = np.array([1.0, 2.5, 4.0, 6.0])
    angles = np.arccos((levels * G0 - 400 / 7 + 2 * 9.81) / (3 * 9.81))
    times = np.array([motion.time_at(angle) for angle in angles])
    found = motion.exceedance("vertical", levels, limits=[(1.0, 5.0), (3.0, 3.0), (0.1, 6.5)])
    assert found.total == pytest.approx(2 * times, rel=1e-13)
    assert found.longest == pytest.approx(2 * times, rel=1e-13)
    assert found.allowed == pytest.approx([np.inf, np.inf, 2.0, 0.4])
    assert found.within.tolist() == (found.longest <= found.allowed).tolist()
    below = motion.exceedance("vertical", 2.5, side="below")
    assert below.total == pytest.approx(motion.period - 2 * times[1], rel=1e-13)
    assert motion.exceedance("vertical", least.value - 0.01)[1:3] == (pytest.approx(motion.period), np.inf)
    assert motion.exceedance("vertical", most.value + 0.01)[1:3] == (0.0, 0.0)
    with pytest.raises(InputError, match="no limits were given"):
        assert below.within
    swept = loop.sweep("n_vertical_max", lam0=0.0, v0=[15.0, 20.0])
    assert swept.values == pytest.approx([225 / 7 / G0 + 9.81 / G0, most.value], rel=1e-14)


@pytest.mark.extended
def test_levels_along_legs(rough: ModuleType) -> None:
    """At every crossing the load equals the level, with losses too, and the times above and below add up to the
    whole.
    """
    motion = rough.solve(-4, 2, t_max=12)
    times = np.linspace(0.0, 12.0, 20001)
    for load, level in (("vertical", 1.05), ("lateral", 0.1), ("longitudinal", -0.05)):
        above = motion.exceedance(load, [level])
        below = motion.exceedance(load, [level], side="below")
        assert above.total + below.total == pytest.approx(12.0, rel=1e-12)
        values = getattr(motion.state(times), f"n_{load}")
        crossings = np.count_nonzero(np.diff(values > level))
        assert above.total == pytest.approx(np.mean(values > level) * 12.0, abs=6e-4 * (crossings + 1))


def test_the_banking_of_a_helix(built: Callable[..., ModuleType]) -> None:
    """On a helix the curvature is horizontal, so that the banking is atan(kappa V**2/(g cos(slope)))."""
    curve = gqm.Curve.space(x="5*cos(u)", y="5*sin(u)", z="-3*u", parameter="u", roll="coordinated", heartline="h")
    module = built("helix_ride", curve, gqm.Gravity())
    motion = module.solve(0, 4, h="9/10", t_max=9)
    state = motion.state(np.array([0.0, 2.0, 8.5]))
    kappa, slope = 5.0 / 34.0, np.arctan2(3.0, 5.0)
    assert state.roll == pytest.approx(np.arctan2(kappa * state.v2, 9.81 * np.cos(slope)), rel=1e-14)
    assert state.n_vertical == pytest.approx(np.hypot(kappa * state.v2, 9.81 * np.cos(slope)) / G0, rel=1e-14)
    assert np.all(state.n_lateral == 0.0)
    offset = np.stack([state.x - state.track_x, state.y - state.track_y, state.z - state.track_z])
    force = np.stack([state.normal_x, state.normal_y, state.normal_z]) / state.normal_force
    assert offset == pytest.approx(0.9 * force, abs=1e-13)


def test_a_leaning_rider_in_a_vertical_plane(built: Callable[..., ModuleType]) -> None:
    """The force is along the normal of the plane, so that a roll to the left gives it a component to the right."""
    curve = gqm.Curve.space(x="u", y="0", z="u**2/2", parameter="u", roll="psi")
    model = gqm.derive(curve, gqm.Gravity())
    assert model.rider is not None
    force, psi = model.kappa * W + model.static_normal_load, sp.Symbol("psi", real=True)
    wanted = (force * sp.cos(psi), -force * sp.sin(psi), 0)
    g0 = sp.Rational("9.80665")
    assert all(sp.simplify(load * g0 - form) == 0 for load, form in zip(model.rider.loads, wanted, strict=True))
    assert model.units["psi"] == "1"


BAD: tuple[tuple[Callable[[], object], str], ...] = (
    (lambda: gqm.Curve.space(**WAY, heartline=1), "heartline: 1 is measured across the banked track; declare roll too"),
    (lambda: gqm.Curve.space(**WAY, roll=("flat", 3)), r"roll: must be an angle, 'coordinated' or \('coordinated'"),
    (lambda: gqm.Curve.space(**WAY, roll="sin("), "space: roll"),
    (lambda: gqm.Curve.space(**WAY, roll="pieces"), r"roll: 'pieces' is the roll of the pieces of a rail"),
    (lambda: generated.viviani.solve("3/10").exceedance("vertical", 1), "declare it by Curve.space"),
    (lambda: generated.viviani.solve("3/10").n_lateral_max, "n_lateral: the load on a rider depends on the banking"),
    (
        lambda: generated.viviani.sweep("n_vertical_max", lam0=0.3),
        "n_vertical_max: the load on a rider depends on the banking",
    ),
)


@pytest.mark.parametrize(("ask", "message"), BAD)
def test_what_is_no_banking_is_refused(ask: Callable[[], object], message: str) -> None:
    """Each declaration that is no banking is refused with a reason."""
    with pytest.raises(InputError, match=message):
        ask()


def test_bad_questions_about_loads(loop: ModuleType, built: Callable[..., ModuleType]) -> None:
    """Loads, levels, sides and limits that do not exist are refused, and so is a roll angle where the tangent is
    vertical.
    """
    motion = loop.solve(0, 20)
    for arguments, message in (
        (("upwards", 1), "load: must be"),
        (("vertical", "high"), "levels: must be finite numbers"),
        (("vertical", [1, np.nan]), "levels: must be finite numbers"),
    ):
        with pytest.raises(InputError, match=message):
            motion.exceedance(*arguments)
    with pytest.raises(InputError, match="side: must be"):
        motion.exceedance("vertical", 1, side="beside")
    for limits in ([1, 2], [(1, 2), (1, 3)], [(1, 2), (2, 3)], [(-1, 2)], []):
        with pytest.raises(InputError, match="limits: "):
            motion.exceedance("vertical", 1, limits=limits)
    upright = gqm.Curve.space(x="sin(u)", y="u**3", z="-cos(u)", parameter="u", roll=0)
    tall = gqm.Curve.space(x="u**2", y="u**3", z="u", parameter="u", roll="1/3")
    assert gqm.derive(upright, gqm.Gravity()).rider is not None
    module = built("tall", tall, gqm.Gravity())
    with pytest.raises(SolutionError, match=r"roll: the tangent is vertical at u = 0\.0"):
        module.pass1([0.5, 0.0], lam0=0, v0=1)
    with pytest.raises(InputError, match="gradient: there is none of n_vertical_max"):
        loop.sweep("n_vertical_max", lam0=0, v0=20, gradient="v0")
    with pytest.raises(DeclarationError, match="'y' is a coordinate"):
        gqm.Curve.space(**WAY, roll="y")


def test_a_banked_track_in_a_file(tmp_path: Path) -> None:
    """The keys in a file are those of Python, and the design speed is the second entry of a pair."""
    file = tmp_path / "banked.yaml"
    track = "x: 3*sin(u), y: 4*cos(u), z: u, parameter: u, roll: {}, heartline: 90 cm"
    text = f"name: banked\ncurve:\n  space: {{{{{track}}}}}\n"
    for roll, declared in (("u/3", "u/3"), ("coordinated", "coordinated"), ("[coordinated, 12]", ("coordinated", 12))):
        file.write_text(text.format(roll) + "kernel: {gravity: {}}\n", encoding="utf-8")
        curve = gqm.Curve.space(
            x="3*sin(u)", y="4*cos(u)", z="u", parameter="u", roll=declared, heartline=sp.Rational(9, 10)
        )
        assert read_spec(file).curve.banking == curve.banking
