"""The pace of time and of arc length along one stretch of the curve.

A *stretch* is a part of the curve that is run through in one direction. Its ends decide the substitution that makes
the integrands smooth (MATHS, section 4); the new variable is the stretch's *anomaly* ``phi``:

=============== ======================================= ================================
kind            lam                                     phi
=============== ======================================= ================================
TURN_TURN       a + (b-a) sin(phi/2)**2                 0 to pi
FROM_TURN       a + (b-a) phi**2                        0 to 1
REGULAR         a + (b-a) phi                           0 to 1
TO_EQUILIBRIUM  b + (a-b) exp(-phi)                     0 onwards
=============== ======================================= ================================

V**2 comes from the climb, or, next to an equilibrium where forces dissipate, from a field (`fields`).
"""

from math import cos, exp, fabs, inf, sin, sqrt

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.elementary import cos as cosine
from gqm_sym.runtime.arithmetic.elementary import sin as sine
from gqm_sym.runtime.compiled.calls import call_potential_divdiff1, call_potential_divdiff2
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import ADDRESSES, MATRIX, REAL, VECTOR
from gqm_sym.runtime.interface import Addresses
from gqm_sym.runtime.quadrature.equilibrium import along

# Where V**2 is a field of its own, no function of the model is called.
NO_FUNCTIONS = Addresses(0, 0, 0, 0, 0)

TURN_TURN, FROM_TURN, REGULAR, TO_EQUILIBRIUM = range(4)


@Inner
def rates(fns, p, kind, a, b, ref, w, field, phi, work, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with dt/dphi and ds/dphi at each phi. ``w`` is V**2 at ``ref`` (used where no end is special)."""
    n = phi.size
    da, db, rows = work[0, :n], work[1, :n], work[2:4, :n]
    if field.size > 0:
        whole = fabs(b - a)
        for i in range(n):
            d = whole * exp(-phi[i])
            share, ds = along(field, d)
            out[0, i] = ds / sqrt(share)
            out[1, i] = ds * d
    elif kind == TURN_TURN:
        for i in range(n):
            s, c = sin(0.5 * phi[i]), cos(0.5 * phi[i])
            da[i] = (b - a) * s * s
            db[i] = (b - a) * c * c
        call_potential_divdiff2(fns.potential_divdiff2, n, a, b, da, db, p, rows)
        for i in range(n):
            out[0, i] = rows[1, i] / sqrt(rows[0, i])
            out[1, i] = rows[1, i] * sqrt(da[i] * db[i])
    elif kind == FROM_TURN:
        for i in range(n):
            da[i] = (b - a) * phi[i] * phi[i]
            db[i] = a + da[i]
        call_potential_divdiff1(fns.potential_divdiff1, n, a, db, da, p, rows)
        root = 2.0 * sqrt(fabs(b - a))
        for i in range(n):
            fall = -rows[0, i] if b > a else rows[0, i]
            out[0, i] = rows[1, i] * root / sqrt(fall)
            out[1, i] = rows[1, i] * 2.0 * fabs(b - a) * phi[i]
    elif kind == REGULAR:
        for i in range(n):
            da[i] = (a - ref) + (b - a) * phi[i]
            db[i] = ref + da[i]
        call_potential_divdiff1(fns.potential_divdiff1, n, ref, db, da, p, rows)
        for i in range(n):
            out[0, i] = rows[1, i] * fabs(b - a) / sqrt(w - da[i] * rows[0, i])
            out[1, i] = rows[1, i] * fabs(b - a)
    else:
        for i in range(n):
            da[i] = (a - b) * exp(-phi[i])
            db[i] = -da[i]
        call_potential_divdiff2(fns.potential_divdiff2, n, b, b, da, db, p, rows)
        for i in range(n):
            out[0, i] = rows[1, i] / sqrt(-rows[0, i])
            out[1, i] = rows[1, i] * fabs(da[i])


@Inner
def speeds(fns, p, kind, a, b, ref, w, field, phi, work, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with V at each phi: no difference of heights, and exactly zero at a turning point."""
    n = phi.size
    da, db, rows = work[0, :n], work[1, :n], work[2:4, :n]
    if field.size > 0:
        whole = fabs(b - a)
        for i in range(n):
            d = whole * exp(-phi[i])
            out[i] = d * sqrt(along(field, d)[0])
    elif kind == TURN_TURN:
        for i in range(n):
            s, c = sine(0.5 * phi[i]), cosine(0.5 * phi[i])
            da[i] = (b - a) * s * s
            db[i] = (b - a) * c * c
        call_potential_divdiff2(fns.potential_divdiff2, n, a, b, da, db, p, rows)
        for i in range(n):
            out[i] = sqrt(da[i] * db[i] * rows[0, i])
    elif kind == TO_EQUILIBRIUM:
        for i in range(n):
            da[i] = (a - b) * exp(-phi[i])
            db[i] = -da[i]
        call_potential_divdiff2(fns.potential_divdiff2, n, b, b, da, db, p, rows)
        for i in range(n):  # V**2 may lie below the least double
            out[i] = fabs(da[i]) * sqrt(-rows[0, i])
    else:
        start = a if kind == FROM_TURN else ref
        for i in range(n):
            da[i] = (b - a) * phi[i] * (phi[i] if kind == FROM_TURN else 1.0) + (a - start)
            db[i] = start + da[i]
        call_potential_divdiff1(fns.potential_divdiff1, n, start, db, da, p, rows)
        for i in range(n):
            out[i] = sqrt(max(w - da[i] * rows[0, i], 0.0))


@Inner
def shares(kind, w, field, work, n, peak):  # type: ignore[no-untyped-def]
    """What is left of V**2 where it cancels, over the places last filled.

    Between two turning points that is its regular factor, least and largest. From where V**2 is known it is V**2
    itself, against the largest on the way, ``peak``: a body that has been fast and is slow again passes a barrier.

    Returns
    -------
    low, high : float
        Their ratio is the share that is left.
    peak : float
        The largest V**2 on the way up to the last place.
    """
    low, high = 1.0, 1.0
    if field.size > 0:
        return low, high, peak
    if kind == TURN_TURN:
        low, high = inf, 0.0
        for i in range(n):
            low, high = min(low, work[2, i]), max(high, work[2, i])
    elif kind != TO_EQUILIBRIUM:
        # Towards the place where V**2 is known it only grows more certain.
        outwards = fabs(work[0, 0]) <= fabs(work[0, n - 1])
        for i in range(n):
            lost = work[0, i] * work[2, i]
            if outwards:
                peak = max(peak, w - lost)
            if peak > 0.0 or not outwards:
                low = min(low, (w - lost) / max(peak, w + fabs(lost)))
    return low, high, peak


@entry(VECTOR(ADDRESSES, VECTOR, types.int64, REAL, REAL, REAL, REAL, VECTOR))
def speeds_at(fns, p, kind, a, b, ref, w, phi):  # type: ignore[no-untyped-def]
    """V at many anomalies of a stretch."""
    out = np.empty(phi.size)
    speeds(fns, p, kind, a, b, ref, w, np.empty((0, 0)), phi, np.empty((4, phi.size)), out)
    return out


@entry(VECTOR(REAL, REAL, MATRIX, VECTOR))
def speeds_along(a, b, field, phi):  # type: ignore[no-untyped-def]
    """V at many anomalies of a stretch towards an equilibrium b where V**2 is a field."""
    out, work = np.empty(phi.size), np.empty((4, phi.size))
    speeds(NO_FUNCTIONS, np.empty(0), TO_EQUILIBRIUM, a, b, a, 0.0, field, phi, work, out)
    return out
