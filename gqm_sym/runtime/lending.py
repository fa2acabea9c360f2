"""Memory of large results, lent to the next one when the last array in it is gone.

The system gives memory page by page and clears each before: for results that take a few nanoseconds a number, that is
longer than the work. NumPy keeps small blocks only.
"""

from collections import deque

import numpy as np

from gqm_sym.runtime.stores import LARGE, LINE
from gqm_sym.runtime.stretch import Array

# Bytes up to which a block is kept.
MOST = 2**27

# The block that was given back last. Both ends of a deque may be used by any thread at any time, and by the collector
# of garbage in between.
_spare: deque[Array] = deque(maxlen=1)


class _Lent:
    """A block while arrays lie in it. They hold this object, as NumPy's array interface has it, and it the block."""

    def __init__(self, block: Array, count: int, stride: int, size: int) -> None:
        start = block.ctypes.data
        self.__array_interface__ = {
            "version": 3,
            "typestr": block.dtype.str,
            "shape": (count, size),
            "strides": (stride * block.itemsize, block.itemsize),
            "data": (start + -start % (LINE * block.itemsize), False),
        }
        self._block, self._give_back = block, _spare.append  # both are here still when the process ends

    def __del__(self) -> None:
        self._give_back(self._block)


def rows(count: int, size: int) -> Array:
    """A new array of ``count`` rows of doubles, not cleared; each row of a large one begins a line of the cache."""
    stride = -(-size // LINE) * LINE
    doubles = count * stride + LINE
    if not LARGE <= doubles * 8 <= MOST:
        return np.empty((count, size))
    try:
        block = _spare.pop()
    except IndexError:
        block = np.empty(doubles)
    return np.asarray(_Lent(block if block.size == doubles else np.empty(doubles), count, stride, size))
