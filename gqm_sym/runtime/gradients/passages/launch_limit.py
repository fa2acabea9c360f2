"""Limits at the launch of what is smooth in time or distance from there on, but has no value at the launch itself."""

from collections.abc import Callable

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.types import Array

# The number of times or distances at which values are taken, at the nodes of Chebyshev polynomials on an interval from
# the launch.
NODES = 16

# The last two coefficients, as a share of the largest one, at which the values are resolved, and at most. The interval
# is halved until they are, at most so many times, or until they decrease by no more than this factor, because the
# values are rounded: on shorter intervals roundings of the place would be larger shares of the distances.
RESOLVED, MAX_TAIL, HALVINGS, SLOW_DECREASE = 1e-15, 1e-11, 24, 0.25


def limit_at_launch(values: Callable[[Array], Array], end: float) -> Array:
    """Return the limit of functions of the time or the distance from the launch as that decreases to 0.

    Parameters
    ----------
    values : function
        The values at times or distances, a row for each function.
    end : float
        The longest one that is tried.

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
        was_resolved = limit is not None and tail > SLOW_DECREASE * best
        if tail < best:
            best, limit = tail, found @ (-1.0) ** np.arange(NODES)
        if tail <= RESOLVED or was_resolved:
            break
        end *= 0.5
    if limit is None:
        raise SolutionError("t = 0: the contact force, or one of its derivatives, has no limit after this release")
    return limit
