"""Limits of the processor time of stages, because the cost of symbolic work cannot be bounded from its input.

Processor time is measured and not the time of the clock, so that nothing is refused because a machine is busy. The time
of garbage collections does not count, so that nothing is refused because a program is large. Work in a stage calls
`check_budget` often; its callers need not know of budgets, and stages may be nested.
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
    """Limit the processor time of the ``with`` block to so many seconds.

    Parameters
    ----------
    stage
        The name of the stage in the error, such as ``derivation``.
    seconds
        The limit of time.
    remedy
        A remedy to try if that is not enough.
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
    """Exclude the time of the ``with`` block from the budgets around it, because its work is bounded by its size."""
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


def check_budget() -> None:
    """End the stage if its time, or that of an enclosing stage, is used up.

    Raises
    ------
    BudgetError
        If it is; the message names the stage, its limit and a remedy.
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
