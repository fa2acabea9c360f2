"""Motions that begin or end at a cusp agree with the cycloid's closed forms.

In arc length the hanging cycloid is a harmonic oscillator, S'' = -w**2 S with w**2 = g/(4R) and S = 4R cos(theta/2),
and the arch is the same with the other sign. Its cusps are at S = 4R and S = -4R.
"""

from types import ModuleType

import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.errors import LaunchError

ULP = 2.0**-52
R, G = 0.5, 9.81
W = np.sqrt(G / (4 * R))


@pytest.fixture(scope="module")
def hanging(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return the tautochrone between its two cusps."""
    model = gqm.derive(gqm.families.cycloid(inverted=True), gqm.Gravity(), parameters={"R": "1/2"})
    return gqm.build(model, name="hanging", folder=tmp_path_factory.mktemp("hanging"))


@pytest.fixture(scope="module")
def arch(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return the arch between its two cusps."""
    model = gqm.derive(gqm.families.cycloid(), gqm.Gravity(), parameters={"R": "1/2"})
    return gqm.build(model, name="arch", folder=tmp_path_factory.mktemp("arch"))


@pytest.fixture(scope="module")
def chain(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return hanging cycloids side by side, with cusps inside the curve, at odd multiples of pi."""
    curve = gqm.Curve.parametric(x="R*(u + sin(u))", z="R*(1 - cos(u))", parameter="u")
    model = gqm.derive(curve, gqm.Gravity(), parameters={"R": "1/2"})
    return gqm.build(model, name="chain", folder=tmp_path_factory.mktemp("chain"))


@pytest.mark.parametrize(("lam0", "end"), [(0, 2 * np.pi), ("2*pi", 0.0)])
def test_from_rest_at_the_top_cusp(hanging: ModuleType, lam0: object, end: float) -> None:
    """From cusp to cusp the motion takes the tautochrone's time; V**2 and ds vanish together at both ends."""
    motion = hanging.solve(lam0)
    (event,) = motion.events
    assert (motion.kind, event.kind, event.lam) == ("transit", "cusp", end)
    assert abs(motion.t_end - np.pi / W) <= 2 * ULP * motion.t_end
    t = np.linspace(0.0, motion.t_end, 40)[1:-1]
    state = motion.state(t)
    angle = 2 * np.arccos(np.cos(W * t))
    assert np.abs(state.lam - (angle if end else 2 * np.pi - angle)).max() <= 2e-14
    assert np.abs(np.abs(state.v) - 4 * R * W * np.sin(W * t)).max() <= 1e-14


@pytest.mark.extended
@pytest.mark.parametrize("v0", [1e-4, 1e-2, 0.3, 1.0, 20.0])
def test_thrown_from_a_cusp(hanging: ModuleType, v0: float) -> None:
    """A body thrown from one cusp moves through to the other."""
    motion = hanging.solve(0, v0)
    assert [event.kind for event in motion.events] == ["cusp"]
    truth = 2 / W * np.arctan(4 * R * W / v0)
    assert abs(motion.t_end - truth) <= 1e-14 * truth


@pytest.mark.extended
@pytest.mark.parametrize("v0", [1e-5, 0.1, 1.0, 4.0])
def test_up_the_arch_and_back(arch: ModuleType, v0: float) -> None:
    """A body too slow for the top comes back to its cusp."""
    motion = arch.solve(0, v0)
    assert [event.kind for event in motion.events] == ["contact-sign", "turn", "contact-sign", "cusp"]
    truth = np.arctanh(v0 / (4 * R * W)) / W
    assert abs(motion.events[1].t - truth) <= 1e-14 * truth
    assert abs(motion.events[3].t - 2 * truth) <= 1e-14 * truth
    # N/m = 2*g*sin(theta/2) - v0**2/(4*R*sin(theta/2)) presses against the arch in the sharp bend at its foot.
    place = 2 * np.arcsin(v0 / np.sqrt(8 * G * R))
    assert abs(motion.events[0].lam - place) <= 1e-14 * place


def test_over_the_arch(arch: ModuleType) -> None:
    """A fast body passes the top and ends at the other cusp."""
    motion = arch.solve(0, 8)
    assert [event.kind for event in motion.events] == ["cusp"]
    truth = 2 / W * np.arctanh(4 * R * W / 8)
    assert abs(motion.t_end - truth) <= 1e-14 * truth


@pytest.mark.extended
def test_at_rest_in_a_cusp(arch: ModuleType, chain: ModuleType) -> None:
    """A cusp that is the lowest point holds the body; from the highest one it moves in the requested direction."""
    assert arch.solve(0).kind == "rest"
    for direction, lam in ((1, 3 * np.pi), (-1, -np.pi)):
        motion = chain.solve("pi", direction=direction)
        assert (motion.direction, motion.events[-1].kind) == (direction, "cusp")
        assert abs(motion.events[-1].lam - lam) <= 4 * ULP * abs(lam)
        assert abs(motion.t_end - np.pi / W) <= 4 * ULP * motion.t_end


def test_energy_just_enough_for_the_cusp(hanging: ModuleType) -> None:
    """V**2 vanishes at the cusp itself, which takes a finite time, because the height is linear in arc length near
    it.
    """
    motion = hanging.solve("pi/2", "sqrt(9.81)", -1)  # g*R*(1 - cos(pi/2)) = v0**2/2
    assert [event.kind for event in motion.events] == ["cusp"]
    assert abs(motion.t_end - np.pi / 4 / W) <= 1e-14


def test_no_way_out(arch: ModuleType) -> None:
    """A launch out of the domain is refused, and the message says what would be right."""
    with pytest.raises(LaunchError, match=r"is the cusp itself.*direction=1"):
        arch.solve(0, 8, -1)
