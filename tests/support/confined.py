"""Time and memory are limited while hostile input is processed."""

import gc
import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import thread_time

SECONDS = 1.0
MEGABYTES = 200


class OutOfTime(BaseException):
    """The limit of processor time was reached; no handler for ordinary errors takes it."""


@contextmanager
def confined(seconds: float = SECONDS, megabytes: int = MEGABYTES) -> Iterator[None]:
    """Let the block take this processor time, and this memory beyond what the process has.

    Only the processor time of this thread counts, so that neither a busy machine nor threads of other tests fail a
    test. What those left in memory is kept from the garbage collector meanwhile.
    """
    gc.freeze()
    begin = thread_time()

    def stop(*_: object) -> None:
        left = begin + seconds - thread_time()
        # The signal is repeated soon, because an exception in a finalizer is lost.
        signal.setitimer(signal.ITIMER_VIRTUAL, left if left > 0.0 else 0.1)
        if left <= 0.0:
            raise OutOfTime(f"more than {seconds} s of processor time")

    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    handler = signal.signal(signal.SIGVTALRM, stop)
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + (megabytes << 20), hard))
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, handler)
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
        gc.unfreeze()
