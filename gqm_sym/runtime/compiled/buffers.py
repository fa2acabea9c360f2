"""Arrays that grow as they are filled."""

import numpy as np

from gqm_sym.runtime.compiled.jit import Inner


@Inner
def longer(array, size):  # type: ignore[no-untyped-def]
    """The array with room for more."""
    out = np.empty(size)
    out[: array.size] = array
    return out


@Inner
def taller(array, rows):  # type: ignore[no-untyped-def]
    """The table with room for more rows."""
    out = np.empty((rows, array.shape[1]))
    out[: array.shape[0]] = array
    return out
