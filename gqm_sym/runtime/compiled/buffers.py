"""Arrays that grow while they are filled.

Elements are copied one by one: for ``out[:n] = array`` numba compiles five seconds of text functions, which say of what
shape an array was that does not fit.
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
def taller(array, rows):  # type: ignore[no-untyped-def]
    """Return a matrix of so many rows that begins with those of ``array``."""
    out = np.empty((rows, array.shape[1]))
    for i in range(array.shape[0]):
        for j in range(array.shape[1]):
            out[i, j] = array[i, j]
    return out
