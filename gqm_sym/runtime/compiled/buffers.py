"""Arrays that grow while they are filled."""

import numpy as np

from gqm_sym.runtime.compiled.jit import Inner


@Inner
def longer(array, size):  # type: ignore[no-untyped-def]
    """Return a vector of ``size`` elements that begins with those of ``array``."""
    out = np.empty(size)
    out[: array.size] = array
    return out


@Inner
def taller(array, rows):  # type: ignore[no-untyped-def]
    """Return a matrix of so many rows that begins with those of ``array``."""
    out = np.empty((rows, array.shape[1]))
    out[: array.shape[0]] = array
    return out
