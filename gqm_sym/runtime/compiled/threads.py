"""Compiled work over large arrays, on all cores.

A pool of Python's threads: the compiled loops let go of the interpreter, need no threading layer of numba's, and may be
called from anywhere, forked processes included.
"""

import os
from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from typing import Any


@lru_cache(maxsize=1)
def cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_in_threads(work: Callable[[slice], Any], size: int, least: int) -> None:
    """Do ``work`` on slices of ``range(size)``, one a core, none shorter than ``least``; each fills its own part."""
    parts = min(cores(), size // least)
    if parts <= 1:
        work(slice(0, size))
        return
    from concurrent.futures import ThreadPoolExecutor

    marks = [size * k // parts for k in range(parts + 1)]
    with ThreadPoolExecutor(parts) as pool:
        for done in [pool.submit(work, slice(*ends)) for ends in pairwise(marks)]:
            done.result()
