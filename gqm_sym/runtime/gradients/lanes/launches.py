"""Many launches whose motions are periodic, with the symmetry of their orbits."""

from math import fabs
from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.literals.namespaces import ARRAYS
from gqm_sym.runtime.compiled.intrinsics import nearest_whole
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR, Array
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
        UNEVEN, or EVEN if the orbit is even about an axis of symmetry, or ABOUT_ONE_AXIS if it also contains no other
        and is an even number of steps away from the axis whose well has a closed form.
    from_axis : (m, n + 1) array
        The run-time parameters and lam0, the number of the axis, and the sign of the launch's distance from it.
    """

    given: Array
    directions: Array
    spans: Array
    even: NDArray[np.int8]
    from_axis: Array

    @property
    def table(self) -> Array:
        """The arguments of compiled code: the variables of each launch, then its turning points."""
        count = self.given.shape[1]
        found = np.empty((len(self.given), count + 3))
        found[:, :count], found[:, count], found[:, count + 1 :] = self.given, 0.0, self.spans
        return found

    @property
    def circulates(self) -> NDArray[np.bool_]:
        """Whether each motion is a circulation."""
        circulates: NDArray[np.bool_] = np.isnan(self.spans[:, 0])
        return circulates


@entry(
    types.void(VECTOR, VECTOR, types.float64[:, :], types.float64[:, :], types.Tuple((types.int8[::1], MATRIX))),
    nogil=True,
)
def fill_symmetry(places, steps, given, spans, found):  # type: ignore[no-untyped-def]
    """Fill the kind of each orbit by its symmetry, and its axis.

    Parameters
    ----------
    places, steps : arrays
        A place of symmetry and the distance to the next for each launch, or one that all launches have in common. The
        distance is 0 if there is no other axis.
    given, spans : arrays
        As in `Launches`.
    found : (array, array)
        Filled: ``even`` and ``from_axis`` of `Launches`.
    """
    (even, from_axis), count = found, given.shape[1] - 1
    for i in range(even.size):
        place, step = places[min(i, places.size - 1)], steps[min(i, steps.size - 1)]
        low, high = spans[i, 0], spans[i, 1]
        middle, number = 0.5 * (low + high) - place, 0.0
        if step != 0.0:
            number = nearest_whole(middle / step)
            number = number if number - number == 0.0 else 0.0
        axis = step * number
        is_even = fabs(middle - axis) <= EVEN_TOLERANCE * (fabs(low) + fabs(high) + fabs(place))
        # Wells about axes that are an odd number of steps away may have another shape than the one that is known.
        is_known = number == 2.0 * nearest_whole(0.5 * number)
        is_alone = is_known and (step == 0.0 or high - low < 2.0 * fabs(step))
        even[i] = (ABOUT_ONE_AXIS if is_alone else EVEN) if is_even else UNEVEN
        for k in range(count):
            from_axis[i, k] = given[i, k]
        from_axis[i, count], from_axis[i, count + 1] = number, 1.0 if given[i, count - 1] >= place + axis else -1.0


def launches_of(formulas: Formulas, given: Array, directions: Array, spans: Array) -> Launches:
    """Return launches, whose librations may be even about an axis of symmetry of the curve and the forces on it."""
    even, from_axis = np.full(len(spans), UNEVEN, dtype=np.int8), np.empty((len(spans), given.shape[1] + 1))
    place, step = formulas.axes(ARRAYS, tuple(given[:, :-2].T))
    if place is not None and len(spans):
        places, steps = (np.atleast_1d(np.asarray(v, dtype=np.float64)) for v in (place, 0.0 if step is None else step))
        fill_symmetry(np.ascontiguousarray(places), np.ascontiguousarray(steps), given, spans, (even, from_axis))
    return Launches(given, directions, spans, even, from_axis)
