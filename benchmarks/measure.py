"""What a benchmark row is, how it is timed, and how its error is measured."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import inf
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
from mpmath import mp, mpf

from gqm_sym.runtime.compiled import threads

Work = Callable[[], Any]
# Digits of all truths.
mp.dps = 40


@dataclass(frozen=True)
class Row:
    """One way of doing some work.

    ``each`` is how many results a call gives, ``line`` the error it may have (ours only), ``unit`` what errors are in.
    """

    work: str
    who: str
    call: Work
    error: Callable[[Any], float]
    each: int = 1
    repeats: int = 15
    line: float = inf
    unit: str = ""


@dataclass(frozen=True)
class Result:
    """A row with what was measured."""

    row: Row
    seconds: float
    error: float

    @property
    def missed(self) -> bool:
        """Whether the accuracy misses the row's line."""
        return not self.error <= self.row.line


def measured(row: Row) -> Result:
    """Time a row: the median of some calls after a first."""
    value = row.call()
    times = []
    for _ in range(row.repeats):
        start = perf_counter()
        row.call()
        times.append(perf_counter() - start)
    return Result(row, median(times) / row.each, row.error(value))


def least(work: Work, count: int = 20, repeats: int = 300) -> float:
    """Return the least time of one call, in seconds: other work on the machine weighs little in it."""
    times = []
    for _ in range(repeats):
        start = perf_counter()
        for _ in range(count):
            work()
        times.append((perf_counter() - start) / count)
    return min(times)


def ulps(values: Any, truths: list[mpf]) -> float:
    """Worst error in units of the last place."""
    return max(
        float(abs(mpf(float(v)) - t)) / float(np.spacing(abs(float(t)))) for v, t in zip(values, truths, strict=False)
    )


def apart(values: Any, truths: list[mpf], scale: float) -> float:
    """Worst error as a share of a scale."""
    return max(float(abs(mpf(float(v)) - t)) / scale for v, t in zip(values, truths, strict=False))


def readable(seconds: float) -> str:
    """Write a time with its unit."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


@contextmanager
def one_core() -> Iterator[None]:
    """Keep compiled loops on one core."""
    kept = threads.cores
    threads.cores = lambda: 1
    try:
        yield
    finally:
        threads.cores = kept


def on_one_core(call: Work) -> Work:
    """Give the same work, done on one core."""

    def limited() -> Any:
        with one_core():
            return call()

    return limited


def repeated(call: Work, count: int) -> Work:
    """Give the same work, done some times over."""

    def many() -> Any:
        for _ in range(count - 1):
            call()
        return call()

    return many
