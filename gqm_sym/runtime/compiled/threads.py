"""Compiled work over large arrays on all cores, in threads of Python.

The compiled loops release the interpreter's lock. Unlike numba's own threads these need no threading layer, and they
work everywhere, in forked processes too.
"""

import os
from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from gqm_sym.runtime.compiled.uncompiled import sharing_arrays

if TYPE_CHECKING:
    from concurrent.futures import ThreadPoolExecutor


@lru_cache(maxsize=1)
def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@lru_cache(maxsize=1)
def _pool(threads: int) -> "ThreadPoolExecutor":
    """Return the threads beside the caller's. They are kept: to start them takes longer than many a sweep."""
    from concurrent.futures import ThreadPoolExecutor  # some 20 ms, and most sessions need no threads

    return ThreadPoolExecutor(threads, thread_name_prefix="gqm")


if hasattr(os, "register_at_fork"):  # a forked process has none of its parent's threads
    os.register_at_fork(after_in_child=_pool.cache_clear)


def run_in_threads(work: Callable[[slice], Any], size: int, min_slice: int) -> None:
    """Call ``work`` in threads, the caller's among them, on one slice of ``range(size)`` for each core.

    It returns, or raises what a call has raised, when no call is running any more.

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

    from concurrent.futures import wait

    def share(part: slice) -> None:
        with sharing_arrays():
            work(part)

    marks = [size * k // parts for k in range(parts + 1)]
    own, *others = (slice(*ends) for ends in pairwise(marks))
    submitted = [(part, _pool(cores() - 1).submit(share, part)) for part in others]
    try:
        share(own)
        for part, future in submitted:
            if future.cancel():  # not begun: all threads are busy with the work of others
                share(part)
    finally:
        begun = [future for _, future in submitted if not future.cancel()]
        wait(begun)
    for future in begun:
        future.result()
