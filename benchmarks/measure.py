"""Rows of the benchmarks: how they are timed, and how their errors are measured."""

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
# Digits of all reference values.
mp.dps = 40


@dataclass(frozen=True)
class Row:
    """One way of doing some work.

    ``each`` is the number of results of a call, ``line`` the limit of its error (ours only), ``unit`` that of errors.
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
    """A row with its measurements."""

    row: Row
    seconds: float
    error: float

    @property
    def missed(self) -> bool:
        """Return whether the error exceeds the limit of the row."""
        return not self.error <= self.row.line


# The time in seconds for which calls are not counted, so that functions that Python runs at first are compiled by then.
UNCOUNTED = 0.3


def measured(row: Row) -> Result:
    """Measure a row: the median time of some calls, after first calls that are not counted."""
    begin = perf_counter()
    value = row.call()
    while perf_counter() - begin < UNCOUNTED:
        row.call()
    times = []
    for _ in range(row.repeats):
        start = perf_counter()
        row.call()
        times.append(perf_counter() - start)
    return Result(row, median(times) / row.each, row.error(value))


def least(work: Work, count: int = 20, repeats: int = 300) -> float:
    """Return the shortest time of one call in seconds, which other work on the machine affects least."""
    times = []
    for _ in range(repeats):
        start = perf_counter()
        for _ in range(count):
            work()
        times.append((perf_counter() - start) / count)
    return min(times)


def ulps(values: Any, truths: list[mpf]) -> float:
    """Return the largest error in units of the last place."""
    return max(
        float(abs(mpf(float(v)) - t)) / float(np.spacing(abs(float(t)))) for v, t in zip(values, truths, strict=False)
    )


def apart(values: Any, truths: list[mpf], scale: float) -> float:
    """Return the largest error relative to a scale."""
    return max(float(abs(mpf(float(v)) - t)) / scale for v, t in zip(values, truths, strict=False))


def readable(seconds: float) -> str:
    """Return a time as text with its unit."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


@contextmanager
def one_core() -> Iterator[None]:
    """Restrict compiled loops to one core."""
    kept = threads.cores
    threads.cores = lambda: 1
    try:
        yield
    finally:
        threads.cores = kept


def on_one_core(call: Work) -> Work:
    """Return the same work, restricted to one core."""

    def limited() -> Any:
        with one_core():
            return call()

    return limited


def repeated(call: Work, count: int) -> Work:
    """Return the same work, repeated several times."""

    def many() -> Any:
        for _ in range(count - 1):
            call()
        return call()

    return many
