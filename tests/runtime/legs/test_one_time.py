"""The state of a motion with losses at one time is that of many times, and costs one segment only."""

from typing import Any

import numpy as np
import pytest

import generated.circle_drag
from gqm_sym.runtime.legs import inherited
from gqm_sym.runtime.motion.parts import tabulated


@pytest.mark.parametrize("t", [0.0, 0.3, 1.7, 4.9])
def test_the_state_at_one_time_tabulates_one_piece(t: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The state agrees to the last bit with that of a motion which was asked for many times; another segment is
    tabulated with all.
    """
    known = generated.circle_drag.solve(1.0, 0)
    known.lam(np.linspace(0.0, 5.0, 50))
    made: list[Any] = []
    real = tabulated.tabulated
    monkeypatch.setattr(tabulated, "tabulated", lambda *given: made.append(given) or real(*given))
    motion = generated.circle_drag.solve(1.0, 0)
    assert motion.state(t) == known.state(t)
    assert motion.lam(t) == known.lam(t)
    assert len(made) == 1
    assert motion.state(9.0) == known.state(9.0)
    assert motion.state(t) == known.state(t)
    count = len(made)
    motion.lam(np.linspace(0.0, 5.0, 50))
    assert len(made) == count


def test_a_place_needs_no_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Errors are computed when a state is asked for, and agree with those of a motion that was asked for a state
    first.
    """
    known = generated.circle_drag.solve(1.0, 0).state(3.0)
    motion, count = generated.circle_drag.solve(1.0, 0), 0
    real = inherited.carry

    def carried(*given: Any) -> Any:
        nonlocal count
        count += 1
        return real(*given)

    monkeypatch.setattr(inherited, "carry", carried)
    places = motion.lam(np.linspace(0.0, 3.0, 50))
    assert (motion.lam(3.0), count) == (places[-1], 0)
    assert motion.state(3.0) == known
    assert count > 0
