"""Motions that do not repeat, and bodies at rest, are read by compiled code, with the digits of their segments."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.errors import InputError
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.parts import tabulated
from gqm_sym.runtime.motion.parts.positions import Positions

ModuleOf = Callable[[str], ModuleType]

# The tolerance relative to the largest value: both ways round a few times. Worst measured: 1.9e-15.
AGREE = 3e-15

# The tolerance of a speed, relative to it, of which the place has the largest share. Worst measured: 5.3e-16.
SPEED = 1e-15

# A row has the track, the launch and the last time, of motions with segments of all kinds.
MOTIONS: dict[str, tuple[str, dict[str, Any], float]] = {
    "turns and escapes": ("cubic", {"lam0": -1, "v0": 3}, 6.0),
    "through the domain": ("frequency", {"lam0": -1, "v0": 9, "a": 1}, 0.9),
    "to the hilltop": ("circle", {"lam0": 0, "v0": "2*sqrt(9.81)", "L": 1}, 8.0),
    "turns and comes to a hilltop": ("double_well", {"lam0": "1/2", "v0": "sqrt(2*9.81*(1/4 - 1/16))"}, 8.0),
    "lifts off": ("circle", {"lam0": "0", "v0": "5.5", "L": 1, "contact": "above"}, 0.4),
    "next to a hilltop": ("double_well", {"lam0": "1/2", "v0": "sqrt(2*9.81*(1/4 - 1/16)) + 1e-9", "t_max": 2}, 2.0),
}


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", MOTIONS)
def test_the_digits_are_those_of_the_segments(name: str, module_of: ModuleOf) -> None:
    """All columns of the state agree with those of the segments, the bounds are no smaller, and one time or many give
    the same, whatever their shape.
    """
    track, launch, last = MOTIONS[name]
    motion = module_of(track).solve(**launch)
    ends = [leg.t_end for leg in motion.legs if leg.t_end < last]
    t = np.sort([0.0, last, *ends, *np.nextafter(ends, 0.0), *np.linspace(0.0, last, 41)])
    read, laid = motion.state(t), Motion.state(motion, t)
    for field, got, old in zip(read._fields, read, laid, strict=True):
        if field == "error":
            assert ((got >= old * (1.0 - 1e-9)) & (got <= 8.0 * old.max())).all()
        else:
            assert np.abs(got - old).max() <= AGREE * np.abs(old).max(), field
    # Towards a hilltop the speed keeps its digits.
    assert read.v == pytest.approx(laid.v, rel=1e-14, abs=4e-15)
    assert (motion.lam(t) == read.lam).all()
    for k in (0, 7, -1):
        assert tuple(motion.state(float(t[k]))) == tuple(row[k] for row in read)
    assert (motion.lam(t[:12].reshape(3, 4)) == read.lam[:12].reshape(3, 4)).all()
    assert motion.lam(np.empty((0, 2))).shape == motion.state(np.empty((0, 2))).v.shape == (0, 2)


@pytest.mark.parametrize("launch", [{"lam0": -1, "v0": 3}, {"lam0": 0}])
def test_it_is_one_call_of_compiled_code(
    launch: dict[str, Any], module_of: ModuleOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After the first question places and states at one time or many need no segments, at rest at one time."""
    motion, many = module_of("cubic").solve(**launch), np.linspace(0.0, 1.0, 5)
    known = motion.state(1.0), motion.state(0.25), motion.state(many)
    monkeypatch.delattr(Positions, "_phase_points")
    monkeypatch.delattr(type(motion), "_phase_points", raising=False)
    assert motion.state(1.0) == known[0]
    assert motion.lam(0.25) == known[1].lam
    if launch["lam0"]:
        assert (motion.lam(many) == known[2].lam).all()


def test_speeds_without_a_resolved_series_are_those_of_the_segments(
    module_of: ModuleOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the series of the speed has not all digits, V**2 itself is computed."""
    real = tabulated.tabulated
    monkeypatch.setattr(tabulated, "tabulated", lambda *given: real(*given)._replace(is_resolved=False))
    motion, t = module_of("cubic").solve(-1, 3), np.linspace(0.0, 2.0, 9)
    assert (motion.state(t).v == Motion.state(motion, t).v).all()
    assert motion.state(0.5).v == Motion.state(motion, 0.5).v
    assert motion.lam(0.5) == motion.lam(np.array([0.5]))[0]


def test_panels_are_halved_until_speeds_are_resolved(generated_folder: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Behind a hump, where panels are too wide for the speed, it is that of the energy."""
    hump = gqm.build(gqm.derive(gqm.Curve.graph("exp(-x**2)"), gqm.Gravity()), name="hump", folder=generated_folder)
    monkeypatch.delattr(Positions, "_rows_of_states")
    state = hump.solve(-2, 5).state(np.linspace(0.0, 3.0, 200))
    with mp.workdps(30):
        for place, v in zip(state.lam.tolist(), state.v.tolist(), strict=True):
            truth = mp.sqrt(25 - 2 * mpf("9.81") * (mp.exp(-(mpf(place) ** 2)) - mp.exp(-4)))
            assert abs(mpf(v) - truth) <= SPEED * truth


def test_times_after_the_horizon_are_refused(module_of: ModuleOf) -> None:
    """A horizon within a segment ends the motion, whether times were asked for one by one or together, and at rest."""
    for launch in ({"lam0": -1, "v0": 3}, {"lam0": 0}):
        motion = module_of("cubic").solve(**launch, t_max=0.25)
        for ask in (motion.lam, motion.state):
            assert np.isfinite(motion.state(0.25).lam)
            with pytest.raises(InputError, match=r"ends at 0\.25"):
                ask(0.26)
            ask([0.0, 0.25])
            with pytest.raises(InputError, match=r"ends at 0\.25"):
                ask([0.1, 0.26])
