"""Limits at the launch of what is smooth in time from there on, but has no value at the launch itself."""

from collections.abc import Callable

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.types import Array

# The number of times at which values are taken, at the nodes of Chebyshev polynomials on an interval from the launch.
NODES = 16

# The last two coefficients, as a share of the largest one, at which the values are resolved, and at most. The interval
# is halved until they are, at most so many times; they then decrease no further because the values are rounded.
RESOLVED, MAX_TAIL, HALVINGS = 1e-15, 1e-11, 24


def limit_at_launch(values: Callable[[Array], Array], end: float) -> Array:
    """Return the limit of functions of time as time decreases to 0.

    Parameters
    ----------
    values : function
        The values at times, a row for each function.
    end : float
        The longest time in s that is tried.

    Raises
    ------
    SolutionError
        If the functions are not smooth there.
    """
    places = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    basis = chebvander(places, NODES - 1)
    weights = np.where(np.arange(NODES) > 0, 2.0, 1.0) / NODES
    best, limit = MAX_TAIL, None
    for _ in range(HALVINGS):
        found = values(0.5 * end * (1.0 + places)) @ basis * weights
        sizes = np.abs(found).max(axis=1)
        tail = float(np.max(np.abs(found[:, -2:]).max(axis=1) / np.where(sizes > 0.0, sizes, 1.0)))
        if tail < best:
            best, limit = tail, found @ (-1.0) ** np.arange(NODES)
        if tail <= RESOLVED:
            break
        end *= 0.5
    if limit is None:
        raise SolutionError("sensitivity: the derivatives of the contact force at t = 0 have no limit after the launch")
    return limit
