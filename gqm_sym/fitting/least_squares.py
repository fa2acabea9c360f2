"""Least squares between limits, where the answer may lie on some of them."""

from collections.abc import Callable
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gqm_sym.arguments import short
from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.types import Array

# An unknown lies on a limit if the sum of squares would decrease beyond it, and if it is nearer to it than this share
# of the distance to the minimum beyond. The solver stays between the limits and only comes near them.
NEAR_LIMIT = 1e-3

# The largest number of steps of the solver, which takes ten from a good guess.
MAX_STEPS = 200

Function = Callable[[Array], Array]


def least_squares_between(
    residuals: Function, jacobian: Function, start: Array, low: Array, high: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Return the unknowns with the least sum of squared residuals between limits, and which of them lie on a limit.

    Unknowns on limits are held there, exactly, and the others are found once more for these values.

    Parameters
    ----------
    residuals, jacobian : callable
        The residuals at values of the unknowns, and their derivatives, a column for each unknown.
    start, low, high : (n,) array
        The first guess and the limits, which may be infinite.

    Raises
    ------
    SolutionError
        If no minimum is found.
    """
    x, held = start.copy(), np.zeros(start.size, dtype=np.bool_)
    while not held.all():
        x = _with_moved(residuals, jacobian, x, low, high, ~held)
        limits = _limits_at(residuals(x), jacobian(x), x, low, high)
        reached = np.isfinite(limits) & ~held
        if not reached.any():
            break
        x, held = np.where(reached, limits, x), held | reached
    return x, held


def _with_moved(
    residuals: Function, jacobian: Function, x: Array, low: Array, high: Array, moves: NDArray[np.bool_]
) -> Array:
    """Return the unknowns with the least sum of squares if only some of them move.

    SciPy's tolerances are those of numbers near one. So it is given each unknown by what the residuals owe to it, and
    the residuals by the largest of these, or by their size where that is larger. These units are powers of two, and
    nothing is rounded.
    """
    from scipy.optimize import least_squares

    owed = np.linalg.norm(jacobian(x)[:, moves], axis=0)
    unit = power_of_two(max(np.linalg.norm(residuals(x)), np.max(np.abs(x[moves]) * owed)))
    units = unit / power_of_two(owed)

    def all_of(some: Array) -> Array:
        moved = x.copy()
        moved[moves] = some * units
        return moved

    found = least_squares(
        lambda some: residuals(all_of(some)) / unit,
        x[moves] / units,
        jac=lambda some: jacobian(all_of(some))[:, moves] * (units / unit),
        bounds=(low[moves] / units, high[moves] / units),
        x_scale="jac",
        xtol=1e-15,
        ftol=1e-14,
        gtol=1e-15,
        max_nfev=MAX_STEPS,
    )
    x = all_of(found.x)
    if not found.success:
        raise SolutionError(
            f"fit: no minimum was found within {MAX_STEPS} steps; begin nearer than at {short(x.tolist())}"
        )
    return x


def power_of_two(size: Any) -> Any:
    """Return the powers of two next to sizes; one for zero."""
    return np.exp2(np.rint(np.log2(np.where(size > 0.0, size, 1.0))))


def _limits_at(off: Array, slopes: Array, x: Array, low: Array, high: Array) -> Array:
    """Return the limit on which each unknown lies, given the residuals and their derivatives; NaN if on none."""
    squares = np.einsum("ij,ij->j", slopes, slopes)
    # The step of each unknown alone to the least sum of squares.
    steps = -(off @ slopes) / np.where(squares > 0.0, squares, 1.0)
    limits = np.where(steps < 0.0, low, high)
    return np.where((steps != 0.0) & (np.abs(limits - x) <= NEAR_LIMIT * np.abs(steps)), limits, nan)
