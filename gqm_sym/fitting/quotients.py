"""Difference quotients, for functions without derivatives."""

from collections.abc import Callable
from math import inf
from typing import Any

import numpy as np

from gqm_sym.runtime.compiled.types import Array


def usual_sizes(start: Array, low: Array, high: Array) -> Array:
    """Return the sizes that unknowns have in their units: those of first guesses, or the width between limits, or one.

    Parameters
    ----------
    start, low, high : (n,) array
        The first guesses and the limits, which may be infinite.
    """
    width = high - low
    sizes: Array = np.where(start != 0.0, np.abs(start), np.where(np.isfinite(width), width, 1.0))
    return sizes


def central_differences(
    function: Callable[[Array], Any], at: Array, steps: Array, low: Any = -inf, high: Any = inf
) -> Array:
    """Return the central difference quotients of a function by each of its arguments, one-sided at their limits.

    Parameters
    ----------
    function : callable
        ``f(x)`` gives a number or an array.
    at : (n,) array
        The place at which the quotients are taken.
    steps : (n,) array
        The steps in both directions, in the units of the arguments.
    low, high : float or (n,) array
        Limits of the arguments, which are not exceeded.

    Returns
    -------
    array
        The quotients, with one axis more than the function has: the last one, for the arguments.
    """
    columns = []
    ends = np.maximum(at - steps, low), np.minimum(at + steps, high)
    for k in range(at.size):
        before, after = (function(np.where(np.arange(at.size) == k, end, at)) for end in ends)
        columns.append((after - before) / (ends[1][k] - ends[0][k]))
    return np.stack(columns, axis=-1)
