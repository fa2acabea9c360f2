"""Loads on the rider of a banked track, at places and speeds."""

from math import isnan, nan
from typing import TYPE_CHECKING

import numpy as np
from numba import types

from gqm_sym.errors import InputError, SolutionError
from gqm_sym.runtime.arithmetic.elementary import atan2
from gqm_sym.runtime.compiled.calls import call_rider_loads
from gqm_sym.runtime.compiled.jit import Inlined, entry
from gqm_sym.runtime.compiled.streaming import put, settle
from gqm_sym.runtime.compiled.types import INTEGER, VECTOR, Array
from gqm_sym.runtime.interface import RIDER_ROWS
from gqm_sym.runtime.launch.kinds import LOADS

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas

FIELDS = (
    *(f"n_{load}" for load in LOADS),
    *(f"onset_{load}" for load in LOADS),
    *("roll", "track_x", "track_y", "track_z"),
)

# The unit of loads in m/s**2.
STANDARD_GRAVITY = 9.80665

# The row of the square of the tangent's horizontal component (`interface`), and the value below which the tangent is
# vertical to rounding.
LEVEL_ROW, MIN_LEVEL = 11, 1e-20

# The number of places that are filled at a time.
BLOCK = 256

NOTHING: Array = np.empty(0)


@entry(
    types.int64(
        *(INTEGER, types.UniTuple(VECTOR, 5), types.UniTuple(VECTOR, len(FIELDS)), types.UniTuple(INTEGER, 2)),
        types.boolean,
    ),
    nogil=True,
)
def fill_rider_loads(address, given, rows, part, past_cache):  # type: ignore[no-untyped-def]
    """Fill a part of the rows of `FIELDS`; return the number of the first place at which the tangent is vertical where
    the roll angle is measured from the level, or -1.

    Parameters
    ----------
    address : int
        The address of the module's function for loads on a rider.
    given : (p, places, speeds, directions, forces)
        The run-time parameters; places, V**2, and signs of ds/dt there, of which there may be one for all places; and
        contact forces, of which only the signs matter, or nothing if these do not matter either.
    rows : tuple of arrays
        The rows to be filled.
    part : (begin, end)
        The range of places to fill.
    past_cache : bool
        Whether the rows are written past the caches (`streaming.put`).
    """
    p, places, speeds, directions, forces = given
    field, other = np.empty(RIDER_ROWS * BLOCK), np.empty(RIDER_ROWS * BLOCK)
    for first in range(part[0], part[1], BLOCK):
        n = min(BLOCK, part[1] - first)
        block, v2, filled = places[first : first + n], speeds[first : first + n], 0
        for sign in range(6):
            v, nu, count = 1.0 - sign % 3, 1.0 - 2.0 * (sign // 3), 0
            for i in range(first, first + n):
                count += 1 if _has_signs(directions, forces, i, v, nu) else 0
            if count == 0:
                continue
            call_rider_loads(address, n, block, v2, v, nu, p, other if filled else field)
            for i in range(n if filled else 0):
                for row in range(RIDER_ROWS if _has_signs(directions, forces, first + i, v, nu) else 0):
                    field[row * n + i] = other[row * n + i]
            filled += count
            if filled == n:
                break
        for i in range(n if filled < n else 0):  # places without a direction are no numbers
            for row in range(RIDER_ROWS if isnan(directions[first + i]) else 0):
                field[row * n + i] = nan
        for i in range(n):
            field[6 * n + i] = atan2(field[7 * n + i], field[6 * n + i])
        for row in range(len(FIELDS)):
            put(rows[row], first, field, (row if row < 7 else row + 1) * n, n, past_cache)
        for i in range(n):
            if field[LEVEL_ROW * n + i] < MIN_LEVEL:
                return first + i
    settle(rows[0])
    return -1


@Inlined
def _has_signs(directions, forces, i, v, nu):  # type: ignore[no-untyped-def]
    """Return whether the direction of the motion and the sign of the contact force at a place are these."""
    direction = directions[i if directions.size > 1 else 0]
    return direction == v and (nu < 0.0) == (forces.size > 0 and forces[i] < 0.0)


def check_banked(formulas: "Formulas", asked: str) -> None:
    """Refuse to compute loads on a rider if the banking of the track is not declared.

    Raises
    ------
    InputError
        If it is not declared.
    """
    if formulas.rider_loads is None:
        raise InputError(
            f"{asked}: the load on a rider depends on the banking, which is not declared; declare it by "
            "Curve.space(..., roll=...), with an angle or 'coordinated'"
        )


def rider_loads(formulas: "Formulas", p: Array, lam: Array, v2: Array, direction: Array, force: Array) -> Array:
    """Return the rows of `FIELDS` at places.

    Parameters
    ----------
    p : array
        The run-time parameters and the numbers that follow them.
    lam, v2 : (n,) arrays
        The places, and V**2 there.
    direction : (n,) array
        The sign of ds/dt. Where it is 0, forces that oppose the motion are omitted.
    force : (n,) array
        The contact force. Only its sign matters, if it has one.

    Raises
    ------
    SolutionError
        If the tangent is vertical where the roll angle is measured from the level.
    """
    rows: Array = np.empty((len(FIELDS), lam.size))
    fill_rows(formulas, p, (lam, v2, direction, force), tuple(rows), slice(0, lam.size))
    return rows


def fill_rows(
    formulas: "Formulas",
    p: Array,
    given: tuple[Array, ...],
    rows: tuple[Array, ...],
    part: slice,
    *,
    large: bool = False,
) -> None:
    """Fill a part of the arrays ``rows`` with what `rider_loads` returns.

    ``given`` are its last four arguments, of which there may be a single direction for all places. The results are
    written past the caches if they are ``large``.

    Raises
    ------
    SolutionError
        If the tangent is vertical where the roll angle is measured from the level.
    """
    assert formulas.rider_loads is not None
    lam, v2, direction, force = given
    rubs = formulas.signed and formulas.dissipation is not None and formulas.dissipation.friction
    arrays = (
        p,
        *(np.ascontiguousarray(row, dtype=np.float64) for row in (lam, v2, direction)),
        force if rubs else NOTHING,
    )
    vertical = fill_rider_loads(formulas.rider_loads.address, arrays, rows, (part.start, part.stop), large)
    if vertical >= 0:
        raise SolutionError(
            f"roll: the tangent is vertical at {formulas.parameter} = {float(lam[vertical])!r}, where there is no "
            "level to measure a roll angle from; declare roll='coordinated'"
        )
