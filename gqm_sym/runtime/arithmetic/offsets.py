"""A place from its distances to two ends, and V**2 from the effective potential."""

from math import fabs

from gqm_sym.runtime.compiled.jit import Inlined


@Inlined
def place_from_ends(a, b, da, db):  # type: ignore[no-untyped-def]
    """Return ``a + da``, or ``b - db`` if that end is nearer, so that the rounding is that of the shorter distance."""
    return a + da if fabs(da) <= fabs(db) else b - db


@Inlined
def speed_squared_from_potential(w0, potential, level):  # type: ignore[no-untyped-def]
    """Return V**2 = w0 - 2*(U - level) for the effective potential U; if U is ``level``, this is w0 to the last bit."""
    return w0 - 2.0 * (potential - level)
