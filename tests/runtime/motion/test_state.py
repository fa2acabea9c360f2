"""Motions can be printed and copied, and give tables of states and energies."""

import copy
import pickle
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
from mpmath import mp, mpf
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.loading import load
from gqm_sym.runtime import Energy, State


@pytest.fixture(scope="module")
def swing(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a pendulum of one metre."""
    return gqm.build(
        gqm.derive(gqm.families.circle(L=1), gqm.Gravity()), name="swing", folder=tmp_path_factory.mktemp("a")
    )


@pytest.fixture(scope="module")
def dragged(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return the same pendulum with drag."""
    force = gqm.Gravity() + gqm.QuadraticDrag(b="1/10")
    return gqm.build(gqm.derive(gqm.families.circle(L=1), force), name="dragged", folder=tmp_path_factory.mktemp("b"))


TIMES = np.linspace(0.0, 2.0, 9)


@pytest.mark.parametrize("launch", [{"lam0": 1}, {"lam0": "1/3", "v0": 20}, {"lam0": 1, "t_max": 3}, {"lam0": 0}])
def test_copies_answer_the_same_bits(swing: ModuleType, dragged: ModuleType, launch: dict[str, object]) -> None:
    """Copied and pickled motions with exact numbers and parameters give the same bits, and are motions of their own."""
    for module in (swing, dragged):
        motion = module.solve(**launch, L="11/10")
        for twin in (copy.deepcopy(motion), pickle.loads(pickle.dumps(motion))):
            assert twin is not motion
            assert (twin.kind, twin.t_end) == (motion.kind, motion.t_end)
            for mine, other in zip(motion.state(TIMES), twin.state(TIMES), strict=True):
                assert np.array_equal(mine, other)


def test_a_copy_after_its_period_was_asked_for(swing: ModuleType) -> None:
    """The period of a motion is then known as two doubles, on which last digits depend; a copy has them too."""
    motion = swing.solve(1)
    _ = motion.period
    assert np.array_equal(copy.deepcopy(motion).lam(TIMES), motion.lam(TIMES))


def test_a_motion_goes_to_another_process(swing: ModuleType, tmp_path: Path) -> None:
    """A motion is sent by the text of its module, also if the file is gone; the answers are the same to the last
    bit.
    """
    motion = swing.solve("5/2", 1)
    file = tmp_path / "motion.pickle"
    file.write_bytes(pickle.dumps(motion))
    code = f"import pickle; m = pickle.load(open({str(file)!r}, 'rb')); print(m.lam(0.7).hex(), m.kind)"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert said == [motion.lam(0.7).hex(), "libration"]


def test_a_launch_by_a_point_is_copied(tmp_path: Path) -> None:
    """The copy is launched by the point as well."""
    ring = gqm.Curve.implicit("x**2 + z**2 - 1", start=(1, 0))
    module = gqm.build(gqm.derive(ring, gqm.Gravity()), name="ring", folder=tmp_path)
    motion = module.solve(point=("3/5", "-4/5"), v0=1)
    assert np.array_equal(copy.deepcopy(motion).lam(TIMES), motion.lam(TIMES))


def test_a_motion_prints_itself(swing: ModuleType) -> None:
    """A motion prints its kind, the launch as written, times with units and parameters; or one line if there is no
    room.
    """
    motion = swing.solve("5/2")
    text = str(motion)
    for part in ("Motion of swing", "libration", "5/2", "period (s)", "9.81"):
        assert part in text
    assert repr(motion) == "<libration of swing: lam0 = 5/2, v0 = 0.0>"


def test_a_state_prints_itself(swing: ModuleType) -> None:
    """A state prints one line for each field at one time, a table at some times, and the first of many, with units."""
    motion = swing.solve(1)
    assert "v (m/s)" in str(motion.state(0.5))
    lines = str(motion.state(TIMES)).splitlines()
    assert len(lines) == 1 + TIMES.size
    assert "normal_force (N)" in lines[0]
    assert str(motion.state(np.linspace(0, 1, 50))).splitlines()[-1] == "  ... and 40 more"
    assert motion.state(TIMES)._repr_html_().count("<tr>") == 1 + TIMES.size


def test_states_as_a_table(swing: ModuleType) -> None:
    """There is a column for each field and a row for each time; one time is one row."""
    state = swing.solve(1).state(TIMES)
    table = state.to_pandas()
    assert isinstance(table, pd.DataFrame)
    assert tuple(table.columns) == State._fields
    assert len(table) == TIMES.size
    assert np.array_equal(table["lam"], state.lam)
    assert len(swing.solve(1).state(0.5).to_pandas()) == 1


@pytest.mark.parametrize("launch", [(1, 0), ("1/3", 20), (0, 0)])
def test_one_time_is_a_float_and_one_element_an_array(
    swing: ModuleType, dragged: ModuleType, launch: tuple[object, ...]
) -> None:
    """One time gives a float, and one element an array, whatever the kind of motion and the type of the number."""
    for motion in (swing.solve(*launch), dragged.solve(*launch)):
        for t in (0.1, np.float64(0.1), np.array(0.1), "1/10"):
            for answer in (motion.lam(t), *motion.state(t), motion.error_bound(t), *motion.energy(t)):
                assert type(answer) is float
        for t in ([0.1], np.array([0.1]), (0.1,)):
            for answer in (motion.lam(t), *motion.state(t), motion.error_bound(t), *motion.energy(t)):
                assert isinstance(answer, np.ndarray)
                assert answer.shape == (1,)


def test_energy_is_kept(swing: ModuleType) -> None:
    """The energies are m*V**2/2 and m*g*z, and nothing is lost."""
    motion = swing.solve(1, 2, m=3, g=5)
    energy, state = motion.energy(TIMES), motion.state(TIMES)
    assert isinstance(energy, Energy)
    assert energy.kinetic == pytest.approx(1.5 * state.v2, rel=1e-15)
    assert energy.potential == pytest.approx(15 * state.z, rel=1e-14, abs=1e-14)
    assert np.array_equal(energy.lost, np.zeros(TIMES.size))
    assert energy.kinetic + energy.potential == pytest.approx(np.full(TIMES.size, 6 - 15 * np.cos(1)), rel=1e-13)


@pytest.mark.extended
def test_the_speed_beside_a_hilltop() -> None:
    """A body that passes a hilltop slowly has V**2 = v0**2 + 2 g h (2 x**2 - x**4), however much of that cancels in
    doubles.
    """
    motion = load(str(ROOT / "generated" / "double_well.py"), "double_well").solve(0, 1e-12, h="1/4", g="9.81")
    state = motion.state(motion.period * np.linspace(0.0, 0.24, 500))
    with mp.workdps(40):
        squares = [mpf(x) ** 2 for x in state.lam]
        wanted = [mp.sqrt(mpf(1e-12) ** 2 + mpf("9.81") / 2 * (2 * square - square**2)) for square in squares]
    np.testing.assert_allclose(state.v, np.array(wanted, dtype=float), atol=8e-15, rtol=0)


def test_a_rolling_body_turns_too(tmp_path: Path) -> None:
    """The kinetic energy has the factor 1 + beta, and the potential energy does not."""
    force = gqm.Gravity() + gqm.Rolling(beta="2/5")
    module = gqm.build(gqm.derive(gqm.Curve.graph("x**2"), force), name="ball", folder=tmp_path)
    motion = module.solve(1, m=2)
    energy, state = motion.energy(0.3), motion.state(0.3)
    assert energy.kinetic == pytest.approx(1.4 * state.v2, rel=1e-14)
    assert energy.potential == pytest.approx(2 * 9.81 * state.z, rel=1e-14)


def test_what_drag_takes(dragged: ModuleType) -> None:
    """The energy lost is the work of b*V**2 along the path, by Gauss-Legendre quadrature of the power b*|V|**3."""
    motion = dragged.solve(1, m=2)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    stops = [0.0, *(event.t for event in motion.events_between(0, 2) if event.kind == "turn" and 0 < event.t < 2), 2.0]
    total = 0.0
    for start, stop in pairwise(stops):
        times = 0.5 * (start + stop) + 0.5 * (stop - start) * nodes
        total += 0.5 * (stop - start) * float(weights @ (0.1 * np.abs(motion.state(times).v) ** 3))
    assert motion.energy(2.0).lost == pytest.approx(total, rel=1e-11)
    assert motion.energy(0.0).lost == 0.0


def test_what_friction_takes(tmp_path: Path) -> None:
    """On a slope the work of friction is mu*N times the length of the path, until the body rests."""
    slope = gqm.Curve.graph("x/2")
    force = gqm.Gravity() + gqm.CoulombFriction(mu="9/10")
    module = gqm.build(gqm.derive(slope, force), name="slope", folder=tmp_path)
    motion = module.solve(0, 3)
    end = motion.state(motion.t_end)
    assert motion.energy(motion.t_end).lost == pytest.approx(0.9 * end.normal_force * end.s, rel=1e-12)
    assert motion.energy(motion.t_end).kinetic == pytest.approx(0.0, abs=1e-14)


def test_a_state_is_read_by_name_by_position_and_as_a_table(swing: ModuleType, dragged: ModuleType) -> None:
    """Fields are columns for pandas; when unpacked, copied and pickled they are the same."""
    for module in (swing, dragged):
        motion = module.solve(1)
        state = motion.state(TIMES)
        frame = pd.DataFrame(state)
        assert list(frame.columns) == list(State._fields)
        assert frame.shape == (TIMES.size, len(State._fields))
        assert np.array_equal(frame["lam"], motion.lam(TIMES))
        assert frame.equals(state.to_pandas())
        assert pd.DataFrame(motion.state([0.5])).shape == (1, len(State._fields))
        t, lam, *rest = state
        assert t is state.t is state["t"] is state[0]
        assert lam is state.lam
        assert len(rest) == len(state) - 2
        assert np.array_equal(np.asarray(state), np.array(tuple(state)))
        for twin in (copy.copy(state), copy.deepcopy(state), pickle.loads(pickle.dumps(state))):
            assert type(twin) is State
            assert np.array_equal(np.asarray(twin), np.asarray(state))
        assert state._replace(lam=0.0).lam == 0.0
        assert repr(motion.state(0.5)).startswith("State(t=0.5, lam=")
        with pytest.raises(AttributeError, match=r"a state has no 'place'; it has t, lam, s"):
            state.place  # noqa: B018


def test_states_are_compared_and_cannot_be_changed(swing: ModuleType) -> None:
    """States compare like named tuples and cannot be changed."""
    state = swing.solve(1).state(0.5)
    twin = swing.solve(1).state(0.5)
    assert state == twin == tuple(state)
    assert len({state, twin}) == 1
    assert state != swing.solve(1).state(0.25)
    assert state != twin._replace(lam=0.0)
    for change in (
        lambda: state.update(lam=0.0),
        lambda: state.__setitem__("lam", 0.0),
        lambda: state.pop("lam"),
        state.clear,
    ):
        with pytest.raises(TypeError, match=r"a state cannot be changed; state\._replace"):
            change()
    assert state == twin


def test_one_number_gives_numbers_and_one_element_an_array(swing: ModuleType, dragged: ModuleType) -> None:
    """One number gives numbers and one element an array, whatever their type, for every kind of motion."""
    for motion in (swing.solve(1), swing.solve(0), swing.solve(0, 20), dragged.solve(1)):
        asked = (motion.lam, motion.error_bound, lambda t, m=motion: m.state(t).v, lambda t, m=motion: m.energy(t).lost)
        for ask in asked:
            for one in (0.25, "1/4", np.float32(0.25), np.array(0.25), 1):
                assert type(ask(one)) is float
            for few in ([0.25], (0.25,), ["1/4"], np.array([0.25])):
                assert ask(few).shape == (1,)
            assert ask(np.array([[0.25]])).shape == (1, 1)
            assert ask([]).shape == (0,)


def test_any_array_of_numbers_is_taken(swing: ModuleType, dragged: ModuleType) -> None:
    """Arrays that cannot be written, as pandas and broadcasting give them, are accepted; also strided, reversed and of
    other types.
    """
    plain = np.linspace(0.125, 1.0, 8)
    frozen = plain.copy()
    frozen.setflags(write=False)
    unaligned = np.frombuffer(b"\0" + plain.tobytes(), dtype=np.uint8)[1:].view(np.float64)
    assert not unaligned.flags.aligned
    kinds = (frozen, pd.Series(plain).to_numpy(), np.repeat(plain, 2)[::2], plain.astype(">f8"), unaligned)
    for module in (swing, dragged):
        motion = module.solve(1)
        for t in (*kinds, plain.astype(np.float32), np.broadcast_to(0.5, (8,)), np.asfortranarray(plain.reshape(2, 4))):
            expected = motion.state(np.array(t, dtype=np.float64))
            state = motion.state(t)
            assert state.lam.shape == t.shape
            for answer in (motion.lam(t), state.lam):  # some are read one by one, and differ in the last place
                assert (np.abs(answer - expected.lam) <= expected.error).all()
            assert motion.error_bound(t) == pytest.approx(expected.error, rel=1e-2)
            assert motion.energy(t).kinetic == pytest.approx(0.5 * expected.v2, rel=1e-13)
        for places in kinds:
            assert np.array_equal(module.pass1(places, lam0=1).v2, module.pass1(plain, lam0=1).v2)
            swept = module.sweep("v_max", places, t_max=3).values
            assert np.array_equal(swept, module.sweep("v_max", plain, t_max=3).values)
            assert (swept > 0.0).all()
    for t in kinds:
        assert swing.solve(1).sensitivity(t).lam == pytest.approx(swing.solve(1).sensitivity(plain).lam, rel=1e-13)
