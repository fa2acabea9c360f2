"""Many launches whose motions are periodic, with the symmetry of their orbits."""

from math import fabs
from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.literals.namespaces import ARRAYS
from gqm_sym.runtime.compiled.intrinsics import nearest_whole
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.strided import fill_row, pointers
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR, Array
from gqm_sym.runtime.launch.formulas import Formulas

# The kinds of orbits: librations by their symmetry, and circulations. Those from EVEN on are mirror images of
# themselves.
UNEVEN, LAP, EVEN, ABOUT_ONE_AXIS = range(4)

# The layouts of launches as compiled code takes them. The run-time parameters and lam0 are first. From v0 and the
# change of the energy, which is zero, with both turning points; from the number of the axis and the sign of the
# launch's distance from it; or from v0, the energy, the number of the axis, and the upper turning point.
BETWEEN_TURNS, FROM_AXIS, AROUND_AXIS = range(3)

# The largest distance of the middle of an even orbit from its axis of symmetry, as a share of the places.
EVEN_TOLERANCE = 4.0 * 2.0**-52

COLUMNS, SPANS = types.int64[:, ::1], types.float64[:, :]


class Launches(NamedTuple):
    """Many launches whose motions are periodic.

    Attributes
    ----------
    lines : list of arrays
        The run-time parameters, lam0 and v0: each a vector, or one number that all launches have in common.
    directions : array
        The sign of ds/dt at launch, in the same form.
    spans : (m, 2) array
        The turning points of each launch; NaN for a circulation.
    kinds : (m,) array
        UNEVEN, or EVEN if the orbit is even about an axis of symmetry, or ABOUT_ONE_AXIS if it also contains no other
        and is an even number of steps away from the axis whose well has a closed form; LAP for a circulation.
    axes : pair of arrays
        A place of symmetry and the distance to the next, in the form of ``lines``; empty if there are none.
    """

    lines: list[Array]
    directions: Array
    spans: Array
    kinds: NDArray[np.int8]
    axes: tuple[Array, Array]

    def laid_out(self, layout: int) -> Array:
        """Return the launches with their orbits in one of the layouts, a column for each."""
        found = np.empty((len(self.lines) + (1 if layout == FROM_AXIS else 3), self.kinds.size))
        fill_table(pointers(self.lines), *self.axes, self.spans, layout, found)
        return found

    @property
    def table(self) -> Array:
        """The arguments of compiled code: the variables of each launch, then its turning points, a column for each."""
        return self.laid_out(BETWEEN_TURNS)

    @property
    def circulates(self) -> NDArray[np.bool_]:
        """Whether each motion is a circulation."""
        return np.asarray(self.kinds == LAP)


@Inner
def number_of_axis(place, step, middle):  # type: ignore[no-untyped-def]
    """Return the number of the axis of symmetry that is nearest to a place."""
    number = nearest_whole((middle - place) / step) if step != 0.0 else 0.0
    return number if number - number == 0.0 else 0.0


@entry(INTEGER(VECTOR, VECTOR, SPANS, types.int8[::1]), nogil=True)
def fill_kinds(places, steps, spans, kinds):  # type: ignore[no-untyped-def]
    """Fill the kind of each orbit, and return how many have no turning points although they are no circulations.

    Parameters
    ----------
    places, steps : arrays
        ``axes`` of `Launches`. The distance is 0 if there is no other axis.
    spans, kinds : arrays
        As in `Launches`.
    """
    missing, place, step, has_axes = 0, 0.0, 0.0, places.size > 0
    if has_axes:
        place, step = places[0], steps[0]
    for i in range(kinds.size):
        if places.size > 1:
            place = places[i]
        if steps.size > 1:
            step = steps[i]
        low, high = spans[i, 0], spans[i, 1]
        if low != low:
            kinds[i] = LAP
            missing += high != high
            continue
        if not has_axes:
            kinds[i] = UNEVEN
            continue
        number = number_of_axis(place, step, 0.5 * (low + high))
        middle = 0.5 * (low + high) - place
        is_even = fabs(middle - step * number) <= EVEN_TOLERANCE * (fabs(low) + fabs(high) + fabs(place))
        # Wells about axes that are an odd number of steps away may have another shape than the one that is known.
        is_known = number == 2.0 * nearest_whole(0.5 * number)
        is_alone = is_known and (step == 0.0 or high - low < 2.0 * fabs(step))
        kinds[i] = (ABOUT_ONE_AXIS if is_alone else EVEN) if is_even else UNEVEN
    return missing


@entry(types.void(COLUMNS, VECTOR, VECTOR, SPANS, INTEGER, MATRIX), nogil=True)
def fill_table(columns, places, steps, spans, layout, table):  # type: ignore[no-untyped-def]
    """Fill launches in one of the layouts.

    Parameters
    ----------
    columns : array
        The run-time parameters, lam0 and v0, as `strided.pointers` gives them.
    places, steps, spans : arrays
        As for `fill_kinds`.
    layout : int
        BETWEEN_TURNS, FROM_AXIS or AROUND_AXIS.
    table : (k, m) array
        Filled with a column for each launch.
    """
    count, size = columns.shape[0] - 1, table.shape[1]
    for k in range(count if layout == FROM_AXIS else count + 1):
        fill_row(columns, k, 0, 1 if columns[k, 1] == 0 else size, table[k])
    if layout != FROM_AXIS:
        table[count + 1, :] = 0.0
    if layout == BETWEEN_TURNS:
        for i in range(size):
            table[count + 2, i], table[count + 3, i] = spans[i, 0], spans[i, 1]
        return
    first = count if layout == FROM_AXIS else count + 2
    starts, numbers, others = table[count - 1], table[first], table[first + 1]
    for i in range(size):
        low, high = spans[i, 0], spans[i, 1]
        place, step = places[min(i, places.size - 1)], steps[min(i, steps.size - 1)]
        number = number_of_axis(place, step, 0.5 * (low + high))
        side = 1.0 if starts[i] >= place + step * number else -1.0
        numbers[i], others[i] = number, side if layout == FROM_AXIS else high


def launches_of(formulas: Formulas, lines: list[Array], directions: Array, spans: Array) -> tuple[Launches, int]:
    """Return launches, whose librations may be even about an axis of symmetry of the curve and the forces on it, and
    how many of them lack their turning points.
    """
    kinds, axes = np.empty(len(spans), dtype=np.int8), (np.empty(0), np.empty(0))
    place, step = formulas.axes(ARRAYS, tuple(lines[:-2]))
    if place is not None and len(spans):
        places, steps = (np.asarray(v, dtype=np.float64).reshape(-1) for v in (place, 0.0 if step is None else step))
        axes = np.ascontiguousarray(places), np.ascontiguousarray(steps)
    missing = fill_kinds(*axes, spans, kinds)
    return Launches(lines, directions, spans, kinds, axes), int(missing)
