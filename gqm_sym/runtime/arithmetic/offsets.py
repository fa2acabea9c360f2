"""A place from its offsets from two ends, and V**2 from the effective potential there."""

from math import fabs

from gqm_sym.runtime.compiled.jit import Inlined


@Inlined
def nearest(a, b, da, db):  # type: ignore[no-untyped-def]
    """Return ``a + da``, or ``b - db`` if b is nearer: so the place is rounded like the shorter offset."""
    return a + da if fabs(da) <= fabs(db) else b - db


@Inlined
def left_of(w0, climb, level):  # type: ignore[no-untyped-def]
    """Return V**2 = w0 - (climb - level), which is exactly w0 where ``climb`` is ``level``."""
    return w0 - (climb - level)
