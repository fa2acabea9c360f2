"""Where a place lies that is given by its distances from two ends."""

from math import fabs

from gqm_sym.runtime.jit import Inlined


@Inlined
def nearest(a, b, da, db):  # type: ignore[no-untyped-def]
    """``a + da``, or ``b - db`` where that end is nearer: the rounding is then that of the shorter distance."""
    return a + da if fabs(da) <= fabs(db) else b - db
