"""The time for which Python may run functions before they are compiled, in one launch or in several."""

import math
import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace

# A function is compiled in the first launch after so many launches that have used it, in this process or in others.
MAX_LAUNCHES = 2


class TooSlowError(Exception):
    """Python has used up the time that it was given."""


class _Deadline(threading.local):
    """The time by which plain Python must end in this thread."""

    at = math.inf


_DEADLINE = _Deadline()

# Launches in this process so far.
_LAUNCHES = SimpleNamespace(count=0)


def begin_launch() -> None:
    """Count a launch, or a sweep of them."""
    _LAUNCHES.count += 1


class Trial:
    """The work that Python has done for a function, which decides when it is compiled.

    Parameters
    ----------
    seconds : float
        The time after which it is worth compiling.
    record : Path, optional
        A file that gets one byte for each launch, so that a script which is run again and again has its functions
        compiled too. It is stored beside the compiled code and may be missing.
    """

    def __init__(self, seconds: float, record: Path = Path(os.devnull)) -> None:
        self.left = seconds
        self._launch, self._launches, self._record = -1, 0, record

    def is_over(self) -> bool:
        """Return whether the function is to be compiled: after the given time, or in the third launch that uses it."""
        if self._launch != _LAUNCHES.count:
            self._launch = _LAUNCHES.count
            self._launches = max(self._launches, self._recorded()) + 1
        return self.left <= 0.0 or self._launches > MAX_LAUNCHES

    def _recorded(self) -> int:
        """Return the number of launches in the record before this one."""
        with suppress(OSError), self._record.open("ab") as file:
            return file.write(b".") and file.tell() - 1
        return 0


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Let functions run as plain Python for at most this time."""
    before, _DEADLINE.at = _DEADLINE.at, time.perf_counter() + seconds
    try:
        yield
    finally:
        _DEADLINE.at = before


@contextmanager
def paused() -> Iterator[None]:
    """Exclude the time of the ``with`` block, in which something is compiled, from the time that Python may take."""
    started = time.perf_counter()
    try:
        yield
    finally:
        _DEADLINE.at += time.perf_counter() - started


def go_on() -> None:
    """Raise TooSlowError if Python has used up the time that it was given."""
    if time.perf_counter() > _DEADLINE.at:
        raise TooSlowError
