"""Places and states that compiled code reads on motions with losses agree with a spring with dry friction."""

import math
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.errors import InputError
from gqm_sym.runtime.compiled import threads
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.parts import tabulated

G, K, MU = 9.81, 40.0, 0.02
START = 0.5


@pytest.fixture(scope="module")
def spring(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a level line with a spring and friction."""
    force = gqm.Gravity() + gqm.Potential("k*x**2/2") + gqm.CoulombFriction()
    folder: Path = tmp_path_factory.mktemp("legs")
    return gqm.build(gqm.derive(gqm.Curve.graph("0*x"), force), name="read_spring", folder=folder)


def swing(time: float) -> tuple[float, float, float]:
    """Return place, velocity and arc length: on leg n a cosine of amplitude START - (2 n + 1) OFFSET about +-OFFSET."""
    with mp.workdps(30):
        rate, offset = mp.sqrt(mpf(K)), mpf(MU) * mpf("9.81") / mpf(K)
        n = int(mpf(time) * rate / mp.pi)
        side, amplitude, phase = (-1) ** n, mpf(START) - (2 * n + 1) * offset, mpf(time) * rate - mp.pi * n
        place = side * (offset + amplitude * mp.cos(phase))
        return float(place), float(-side * amplitude * rate * mp.sin(phase)), float(place - mpf(START))


def test_places_and_states(spring: ModuleType) -> None:
    """Places and states are right within rounding, on all legs, and within the bound; one time alone has the same
    digits.
    """
    motion = spring.solve(START, k=K, mu=MU)
    t = np.random.default_rng(3).uniform(0.0, motion.t_end, 900)
    place, velocity, arc = np.array([swing(time) for time in t.tolist()]).T
    assert motion.lam(t) == pytest.approx(place, rel=0.0, abs=4e-15)
    state = motion.state(t.reshape(3, -1))
    assert state.t.shape == state.error.shape == (3, 300)
    assert np.array_equal(state.lam.reshape(-1), motion.lam(t))
    assert (np.abs(motion.lam(t) - place) <= state.error.reshape(-1)).all()
    assert state.error.max() <= 1e-13
    assert state.v.reshape(-1) == pytest.approx(velocity, rel=0.0, abs=3e-14)
    assert state.s.reshape(-1) == pytest.approx(arc, rel=0.0, abs=4e-15)
    assert state.normal_force == pytest.approx(np.full((3, 300), G), rel=1e-15)
    for i in (0, 17, 899):
        assert motion.lam(float(t[i])) == motion.lam(t)[i]
        assert motion.state(float(t[i])) == tuple(field.reshape(-1)[i] for field in state)


def test_as_the_segments_have_it(spring: ModuleType) -> None:
    """All numbers but the bound, which is no smaller, are those of the segments; at the ends they are exact."""
    motion = spring.solve(START, 1.5, -1, k=K, mu=MU, t_max=7.0)
    ends = [leg.t_end for leg in motion.legs]
    t = np.sort([0.0, *ends, *np.nextafter(ends[:-1], 0.0), *np.linspace(0.0, 7.0, 500)])
    read, laid = motion.state(t), Motion.state(motion, t)
    for name in ("lam", "s", "x", "z", "kappa", "normal_force"):
        assert getattr(read, name) == pytest.approx(getattr(laid, name), rel=0.0, abs=4e-16 * (1.0 + G))
    assert read.v == pytest.approx(laid.v, rel=0.0, abs=2e-15)
    assert (read.error >= laid.error * (1.0 - 1e-12)).all()
    assert (motion.state(0.0).lam, motion.state(0.0).v, motion.state(0.0).s) == (START, -1.5, 0.0)
    assert [motion.lam(leg.t_end) for leg in motion.legs] == pytest.approx(
        [leg.lam_end for leg in motion.legs], abs=3e-16
    )


def test_legs_one_after_the_other(spring: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """Increasing times one by one give the answers of all at once, and the record is made a few times only."""
    made: list[int] = []

    def counted(*args: Any) -> Any:
        made.append(len(args[2]))
        return original(*args)

    original = tabulated.leg_record
    monkeypatch.setattr(tabulated, "leg_record", counted)
    motion, other = spring.solve(START, k=K, mu=MU), spring.solve(START, k=K, mu=MU)
    t = np.linspace(0.0, other.t_end, 300)
    places = other.lam(t)
    assert [motion.lam(time) for time in t.tolist()] == pytest.approx(places.tolist(), rel=0.0, abs=4e-16)
    assert len(made) <= 20
    with pytest.raises(InputError, match="t: the motion ends at"):
        motion.lam(motion.t_end + 1e-9)
    with pytest.raises(InputError, match="t: cannot be negative"):
        motion.state(-1e-9)
    for wrong in (math.nan, np.array([0.0, math.inf])):
        with pytest.raises(InputError, match="t: "):
            motion.lam(wrong)


def test_the_same_bits_on_any_number_of_cores(spring: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each time is answered independently of the others."""
    motion = spring.solve(START, k=K, mu=MU)
    t = np.linspace(0.0, motion.t_end, 1000)
    whole = motion.lam(t), motion.state(t)
    monkeypatch.setattr(threads, "cores", lambda: 3)
    monkeypatch.setattr(tabulated, "MIN_PLACES_PER_THREAD", 100)
    monkeypatch.setattr(tabulated, "MIN_STATES_PER_THREAD", 100)
    assert np.array_equal(motion.lam(t), whole[0])
    assert np.array_equal(np.array(motion.state(t)), np.array(whole[1]))
