"""Budgets of processor time end the right stage, name it, and leave nothing behind."""

import gc
import threading
import time
from collections.abc import Callable
from itertools import count
from types import ModuleType
from typing import Any

import pytest

from gqm_sym import budgets
from gqm_sym.budgets import budget, check_budget, outside_budgets
from gqm_sym.errors import BudgetError


def _work(steps: int) -> None:
    for _ in range(steps):
        check_budget()


def test_without_a_budget_nothing_ends() -> None:
    """Work without a budget is not ended."""
    _work(1000)


def test_a_budget_ends_its_stage() -> None:
    """The error says which stage, how long it had, and what to try; what comes after is free again."""
    words = r"^derivation: not done after 0 s of processor time; write less$"
    with pytest.raises(BudgetError, match=words), budget("derivation", 0.0, "write less"):
        _work(1_000_000)
    _work(1000)


def test_collecting_garbage_does_not_count() -> None:
    """Garbage collection, which in a program of millions of objects takes longer than a stage has, does not count;
    callbacks are removed.
    """
    gc.freeze()  # objects of other tests, which would take seconds
    many, callbacks = [[[]] for _ in range(1_000_000)], len(gc.callbacks)
    begin = time.thread_time()
    with budget("reading", 0.005, "-"), budget("parsing", 0.005, "-"):
        gc.collect()
        check_budget()
        taken = time.thread_time() - begin
    gc.unfreeze()
    assert taken > 0.005
    assert len(many) == 1_000_000
    assert len(gc.callbacks) == callbacks


@pytest.mark.parametrize(("outer", "inner", "named"), [(0.0, 60.0, "outer"), (60.0, 0.0, "inner")])
def test_the_shorter_of_two_budgets_ends_the_work(outer: float, inner: float, named: str) -> None:
    """A stage within a stage has no more time than the outer one, and the error names the stage whose budget ended."""
    with pytest.raises(BudgetError, match=f"^{named}: "), budget("outer", outer, "-"), budget("inner", inner, "-"):
        _work(1_000_000)


def test_the_stack_is_part_of_it() -> None:
    """Expressions that are nested too deeply for Python's stack are refused in the same way."""

    def deeper() -> None:
        deeper()

    words = r"^emission: nested too deeply; write less$"
    with pytest.raises(BudgetError, match=words), budget("emission", 60.0, "write less"):
        deeper()


def _take(seconds: float) -> None:
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        check_budget()


def _stages() -> None:
    with budget("outer", 0.05, "-"):
        with budget("inner", 0.05, "-"):
            with outside_budgets():
                _take(0.1)
            check_budget()
        check_budget()
        _take(0.1)


def test_time_apart_counts_for_no_stage() -> None:
    """Time that is excluded ends neither the stage nor the outer one; both end by their own time afterwards."""
    with pytest.raises(BudgetError, match=r"^outer: "):
        _stages()


def test_a_budget_is_its_threads_own() -> None:
    """Another thread's budget does not end the work of this one."""
    done = []
    with budget("reading", 0.0, "-"):
        thread = threading.Thread(target=lambda: done.append(_work(1000)))
        thread.start()
        thread.join()
    assert done == [None]


# A row has the stage, its launch, and what is asked of the motion (None: the motion itself).
ASKED: dict[str, tuple[str, str, Callable[[Any], object] | None]] = {
    "an equilibrium": ("search for turning points", "pi/2 - 1e-30", None),
    "a time": ("quadrature", "pi/2 - 1e-6", lambda motion: motion.lam(1e9)),
    "digits": ("period_to", "-pi/2 + 6/5", lambda motion: motion.period_to(50)),
}


@pytest.mark.parametrize("question", ASKED)
def test_extended_precision_is_bounded(
    question: str, module_of: Callable[[str], ModuleType], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Extended precision has a budget of time; the error says what was computed and what to try."""
    stage, lam0, ask = ASKED[question]
    module = module_of("pendulum")
    motion = module.solve(lam0=lam0, L=1)
    passing = count(0, 1000)
    monkeypatch.setattr(budgets, "thread_time", lambda: next(passing))
    with pytest.raises(BudgetError, match=rf"^{stage}: not done after \d+ s of processor time; (launch|ask)"):
        module.solve(lam0=lam0, L=1) if ask is None else ask(motion)
