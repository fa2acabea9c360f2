"""Python calls compiled code rarely, because each call costs about a microsecond, and more with every array."""

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

import pytest

import gqm_sym as gqm
from gqm_sym.runtime.compiled import jit

ModuleOf = Callable[[str], ModuleType]


def crossings(work: Callable[[], Any]) -> int:
    """Return the calls of entry points during some work."""
    count = 0

    def look(frame: FrameType, event: str, _: Any) -> None:
        nonlocal count
        code = frame.f_code
        count += event == "call" and code.co_name == "call" and code.co_filename == jit.__file__

    work()  # compiled before
    sys.setprofile(look)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


@pytest.mark.parametrize("launch", [(1.0, 0.0), (0.5, 2.0), (0.0, 9.0)])
def test_one_crossing_a_solve_and_a_time(launch: tuple[float, float], module_of: ModuleOf) -> None:
    """A launch is solved in one call, without its tables; a place or a state at a time takes another call."""
    module = module_of("circle")
    assert crossings(lambda: module.solve(*launch, L=1)) == 1
    motion = module.solve(*launch, L=1)
    assert crossings(lambda: motion.lam(1000.0)) == 1
    assert crossings(lambda: motion.state(1000.0)) == 1


def test_panels_are_laid_when_asked_for(module_of: ModuleOf) -> None:
    """A solved motion knows its turning points and its time; panels are computed with the first position."""
    motion = module_of("circle").solve(1.0, 0.5, L=1)
    assert motion._segment.stored_panels is None
    before = motion._segment.duration
    motion.lam(0.1)
    assert motion._segment.stored_panels is not None
    assert before == pytest.approx(motion.half_period, rel=5e-16)


def test_one_crossing_a_leg(generated_folder: Path) -> None:
    """A dissipative motion takes one call a leg, with its time and its events, so that the cost of N legs is linear in
    N.
    """
    circle = gqm.Curve.parametric(x="sin(th)", z="-cos(th)", parameter="th", period="2*pi")
    model = gqm.derive(circle, gqm.Gravity() + gqm.QuadraticDrag(b="c"))
    module = gqm.build(model, name="counted_legs", folder=generated_folder)
    assert crossings(lambda: module.solve(0, 3, c="0.01")) == 1

    def motion_to(t: float) -> Any:
        """Return a motion followed up to a time."""
        motion = module.solve(0, 3, c="0.01")
        while motion._driver.elapsed < t:
            motion._follow_next()
        return motion

    for t in (10.0, 300.0):
        turns = sum(run.end == "turn" for run in motion_to(t)._all_runs)
        assert turns <= crossings(lambda t=t: motion_to(t)) <= turns + 2  # a run may pause
        assert turns > 8.0 * t / 10.0
