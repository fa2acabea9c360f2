"""Many launches whose motions are periodic, with the symmetry of their orbits."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.literals.namespaces import ARRAYS
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.formulas import Formulas

# The kinds of librations by their symmetry.
UNEVEN, EVEN, ABOUT_ONE_AXIS = range(3)

# The largest distance of the middle of an even orbit from its axis of symmetry, as a share of the places.
EVEN_TOLERANCE = 4.0 * 2.0**-52


class Launches(NamedTuple):
    """Many launches whose motions are periodic.

    Attributes
    ----------
    given : (m, n) array
        The run-time parameters, lam0 and v0 of each launch.
    directions : (m,) array
        The sign of ds/dt at launch.
    spans : (m, 2) array
        The turning points of each launch; NaN for a circulation.
    even : (m,) array
        UNEVEN, or EVEN if the orbit is even about an axis of symmetry, or ABOUT_ONE_AXIS if it also contains no other.
    axes : (m, 2) array
        The number of the axis, and the sign of the launch's distance from it.
    """

    given: Array
    directions: Array
    spans: Array
    even: NDArray[np.int8]
    axes: Array

    @property
    def table(self) -> Array:
        """The arguments of compiled code: the variables of each launch, then its turning points."""
        return np.hstack([self.given, np.zeros((len(self.given), 1)), self.spans])

    @property
    def circulates(self) -> NDArray[np.bool_]:
        """Whether each motion is a circulation."""
        circulates: NDArray[np.bool_] = np.isnan(self.spans[:, 0])
        return circulates


def launches_of(formulas: Formulas, given: Array, directions: Array, spans: Array) -> Launches:
    """Return launches, whose librations may be even about an axis of symmetry of the curve and the forces on it."""
    even, axes = np.full(len(spans), UNEVEN, dtype=np.int8), np.zeros((len(spans), 2))
    place, step = formulas.axes(ARRAYS, tuple(given[:, :-2].T))
    if place is not None:
        low, high = spans.T
        middle = 0.5 * (low + high) - place
        if step is not None:
            axes[:, 0] = np.nan_to_num(np.rint(middle / step))
        axis = 0.0 if step is None else step * axes[:, 0]
        is_even = np.abs(middle - axis) <= EVEN_TOLERANCE * (np.abs(low) + np.abs(high) + np.abs(place))
        is_alone = True if step is None else high - low < 2.0 * np.abs(step)
        even = np.where(is_even, np.where(is_alone, ABOUT_ONE_AXIS, EVEN), UNEVEN).astype(np.int8)
        axes[:, 1] = np.where(given[:, -2] >= place + axis, 1.0, -1.0)
    return Launches(given, directions, spans, even, axes)
