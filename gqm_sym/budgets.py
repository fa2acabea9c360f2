"""Processor time that a stage may take: symbolic work has no bound that could be seen from its input.

Processor time is measured, not the time of the clock, so that nothing is refused because a machine is busy. Nor is a
large program: what collecting its garbage takes meanwhile does not count. Work in the stage calls `spend` often; what
it is called from says nothing of budgets, and stages may lie within one another.
"""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from threading import get_ident
from time import perf_counter, thread_time
from typing import Any

from gqm_sym.errors import BudgetError


@dataclass
class _Budget:
    stage: str
    seconds: float
    remedy: str
    end: float
    around: "_Budget | None"
    # The time of the clock at which its processor time can be used up at the earliest.
    earliest_end: float = 0.0


_CURRENT: ContextVar[_Budget | None] = ContextVar("budget", default=None)


def _without_collections(own: _Budget) -> Callable[[str, Any], None]:
    """Return the callback of garbage collection, whose time is added to the budget."""
    thread, begin = get_ident(), thread_time()

    def collecting(phase: str, _: Any) -> None:
        nonlocal begin
        if get_ident() == thread:
            if phase == "start":
                begin = thread_time()
            else:
                own.end += thread_time() - begin

    return collecting


@contextmanager
def budget(stage: str, seconds: float, remedy: str) -> Iterator[None]:
    """Let the block take so many seconds of processor time.

    Parameters
    ----------
    stage
        What it does, as the error should call it: ``derivation``.
    seconds
        The limit of time.
    remedy
        What to try if that is not enough.
    """
    own = _Budget(stage, seconds, remedy, thread_time() + seconds, _CURRENT.get())
    token, collecting = _CURRENT.set(own), _without_collections(own)
    gc.callbacks.append(collecting)
    try:
        yield
    except RecursionError:
        raise BudgetError(f"{stage}: nested too deeply; {remedy}") from None
    finally:
        gc.callbacks.remove(collecting)
        _CURRENT.reset(token)


@contextmanager
def outside_budgets() -> Iterator[None]:
    """Let the block's time count for no stage around it: what it does is bounded by its size."""
    around, begin = _CURRENT.get(), thread_time()
    token = _CURRENT.set(None)
    try:
        yield
    finally:
        _CURRENT.reset(token)
        taken = thread_time() - begin
        while around is not None:
            around.end += taken
            around = around.around


def spend() -> None:
    """End the stage if its time, or that of a stage around it, is used up.

    Raises
    ------
    BudgetError
        Which says what stage it was, how long it had, and what to try.
    """
    found = _CURRENT.get()
    while found is not None:
        # Reading processor time takes ten times as long as reading the clock, and it never passes faster.
        if perf_counter() >= found.earliest_end:
            left = found.end - thread_time()
            if left < 0.0:
                raise BudgetError(
                    f"{found.stage}: not done after {found.seconds:g} s of processor time; {found.remedy}"
                )
            found.earliest_end = perf_counter() + left
        found = found.around
