"""Budgets of processor time: they end what they should, say whose they were, and leave no trace."""

import threading
import time

import pytest

from gqm_sym.budgets import apart, budget, spend
from gqm_sym.errors import BudgetError


def _work(steps: int) -> None:
    for _ in range(steps):
        spend()


def test_without_a_budget_nothing_ends() -> None:
    """Work that nobody limits goes on."""
    _work(1000)


def test_a_budget_ends_its_stage() -> None:
    """The error says which stage, how long it had, and what to try; what comes after is free again."""
    words = r"^derivation: not done after 0 s of processor time; write less$"
    with pytest.raises(BudgetError, match=words), budget("derivation", 0.0, "write less"):
        _work(1_000_000)
    _work(1000)


@pytest.mark.parametrize(("outer", "inner", "named"), [(0.0, 60.0, "outer"), (60.0, 0.0, "inner")])
def test_the_shorter_of_two_budgets_ends_the_work(outer: float, inner: float, named: str) -> None:
    """A stage within a stage has no more time than what is around it, and the error names whose it was."""
    with pytest.raises(BudgetError, match=f"^{named}: "), budget("outer", outer, "-"), budget("inner", inner, "-"):
        _work(1_000_000)


def test_the_stack_is_part_of_it() -> None:
    """What is nested too deeply for Python's stack is told in the same way."""

    def deeper() -> None:
        deeper()

    words = r"^emission: nested too deeply; write less$"
    with pytest.raises(BudgetError, match=words), budget("emission", 60.0, "write less"):
        deeper()


def _take(seconds: float) -> None:
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        spend()


def _stages() -> None:
    with budget("outer", 0.05, "-"):
        with budget("inner", 0.05, "-"):
            with apart():
                _take(0.1)
            spend()
        spend()
        _take(0.1)


def test_time_apart_counts_for_no_stage() -> None:
    """Neither the stage nor the one around it ends by what was taken apart; both end by their own afterwards."""
    with pytest.raises(BudgetError, match=r"^outer: "):
        _stages()


def test_a_budget_is_its_threads_own() -> None:
    """Another thread's work is not ended by it."""
    done = []
    with budget("reading", 0.0, "-"):
        thread = threading.Thread(target=lambda: done.append(_work(1000)))
        thread.start()
        thread.join()
    assert done == [None]
