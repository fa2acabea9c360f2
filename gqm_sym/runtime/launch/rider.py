"""Loads on the rider of a banked track, at places and speeds."""

from itertools import product
from math import atan2
from typing import TYPE_CHECKING

import numpy as np

from gqm_sym.errors import InputError, SolutionError
from gqm_sym.runtime.compiled.calls import call_rider_loads
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, REAL, VECTOR, Array
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

# A tangent whose horizontal component has a smaller square is vertical to rounding.
MIN_LEVEL = 1e-20


@entry(MATRIX(INTEGER, VECTOR, VECTOR, VECTOR, REAL, REAL), nogil=True)
def rider_loads_at(address, p, lam, v2, v, nu):  # type: ignore[no-untyped-def]
    """Return the rows of `FIELDS` at places ``lam``, and the square of the tangent's horizontal component."""
    out = np.empty((RIDER_ROWS, lam.size))
    call_rider_loads(address, lam.size, lam, v2, v, nu, p, out)
    for i in range(lam.size):
        out[6, i] = atan2(out[7, i], out[6, i])
    for row in range(7, RIDER_ROWS - 1):
        out[row] = out[row + 1]
    return out[: RIDER_ROWS - 1]


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
    assert formulas.rider_loads is not None
    rows: Array | None = None
    rubs = formulas.signed and formulas.dissipation is not None and formulas.dissipation.friction
    pushed = force < 0.0 if rubs else np.zeros(lam.size, dtype=np.bool_)
    for v, nu in product((1.0, -1.0, 0.0), (1.0, -1.0)):
        here = (direction == v) & (pushed == (nu < 0.0))
        if not here.any():
            continue
        if here.all():
            rows = rider_loads_at(formulas.rider_loads.address, p, lam, v2, v, nu)
            break
        if rows is None:
            rows = np.full((len(FIELDS) + 1, lam.size), np.nan)
        rows[:, here] = rider_loads_at(formulas.rider_loads.address, p, lam[here], v2[here], v, nu)
    if rows is None:
        rows = np.empty((len(FIELDS) + 1, 0))
    if (vertical := rows[-1] < MIN_LEVEL).any():
        raise SolutionError(
            f"roll: the tangent is vertical at {formulas.parameter} = {float(lam[vertical][0])!r}, where there is no "
            "level to measure a roll angle from; declare roll='coordinated'"
        )
    return rows[:-1]
