"""Where a place lies that is given by its distances from two ends, and what a climb there leaves of V**2."""

from math import fabs

from gqm_sym.runtime.compiled.jit import Inlined


@Inlined
def nearest(a, b, da, db):  # type: ignore[no-untyped-def]
    """``a + da``, or ``b - db`` where that end is nearer: the rounding is then that of the shorter distance."""
    return a + da if fabs(da) <= fabs(db) else b - db


@Inlined
def left_of(w0, climb, level):  # type: ignore[no-untyped-def]
    """What a climb from a level leaves of V**2 = w0: all of it at that level, to the last bit."""
    return w0 - (climb - level)
