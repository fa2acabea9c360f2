"""Arrays that grow while they are filled.

Elements are copied one by one, because for ``out[:n] = array`` numba spends five seconds on compiling the message about
an array of the wrong shape.
"""

import numpy as np

from gqm_sym.runtime.compiled.jit import Inner


@Inner
def longer(array, size):  # type: ignore[no-untyped-def]
    """Return a vector of ``size`` elements that begins with those of ``array``."""
    out = np.empty(size)
    for i in range(array.size):
        out[i] = array[i]
    return out


@Inner
def with_rows(array, rows):  # type: ignore[no-untyped-def]
    """Return a matrix of so many rows that begins with those of ``array``."""
    out = np.empty((rows, array.shape[1]))
    for i in range(array.shape[0]):
        for j in range(array.shape[1]):
            out[i, j] = array[i, j]
    return out
