"""Compiled work over large arrays on all cores, in threads of Python.

The compiled loops release the interpreter's lock. Unlike numba's own threads these need no threading layer, and they
work everywhere, in forked processes too.
"""

import os
from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from typing import Any

from gqm_sym.runtime.compiled.uncompiled import sharing_arrays


@lru_cache(maxsize=1)
def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_in_threads(work: Callable[[slice], Any], size: int, min_slice: int) -> None:
    """Call ``work`` in threads, on one slice of ``range(size)`` for each core.

    Parameters
    ----------
    work
        A function of a slice; it must write only to its own part of the results.
    size : int
        Number of elements.
    min_slice : int
        The shortest slice that is worth a thread.
    """
    parts = min(cores(), size // min_slice)
    if parts <= 1:
        work(slice(0, size))
        return
    from concurrent.futures import ThreadPoolExecutor

    def in_thread(part: slice) -> None:
        with sharing_arrays():
            work(part)

    marks = [size * k // parts for k in range(parts + 1)]
    with ThreadPoolExecutor(parts) as pool:
        for done in [pool.submit(in_thread, slice(*ends)) for ends in pairwise(marks)]:
            done.result()
