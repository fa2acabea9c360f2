"""Integrands of time and of arc length along one segment of the curve, and the speed there.

A *segment* is a part of the curve that the body passes in one direction. Its ends determine the substitution lam(phi)
that makes the integrands smooth; phi is the segment's *phase angle* (`substitution`, MATHS section 4). V**2 is computed
from divided differences of the effective potential or, next to an equilibrium with dissipative forces, from polynomials
in the distance (`equilibrium`).
"""

from math import cos, exp, fabs, inf, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.elementary import cos as cosine
from gqm_sym.runtime.arithmetic.elementary import sin as sine
from gqm_sym.runtime.compiled.calls import call_potential_divdiff1, call_potential_divdiff2
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import ADDRESSES, MATRIX, REAL, VECTOR
from gqm_sym.runtime.interface import Addresses
from gqm_sym.runtime.quadrature.equilibrium import speed_and_length_factors
from gqm_sym.runtime.quadrature.substitution import (
    FROM_SLOW,
    FROM_SLOW_TURN,
    FROM_TURN,
    REGULAR,
    TO_EQUILIBRIUM,
    TURN_TURN,
)

# If V**2 is given by polynomials, no function of the model is called.
NO_FUNCTIONS = Addresses(0, 0, 0, 0, 0)


class Integrand(NamedTuple):
    """The inputs of the integrands along a segment.

    Attributes
    ----------
    fns : Addresses
        Addresses of the model's compiled functions.
    p : array
        Run-time parameters.
    kind : int
        TURN_TURN, FROM_TURN, REGULAR, TO_EQUILIBRIUM or, for times only, FROM_SLOW and FROM_SLOW_TURN.
    a, b : float
        Values of the curve parameter at both ends.
    ref, w0 : float
        For REGULAR segments a place, and V**2 there in (m/s)**2. For FROM_SLOW and FROM_SLOW_TURN segments the slope of
        the effective potential at ``a``, and V**2 there.
    field : (n, m) array
        V**2 next to the equilibrium ``b`` with dissipative forces (`equilibrium`), else empty.
    """

    fns: Any
    p: Any
    kind: Any
    a: Any
    b: Any
    ref: Any
    w0: Any
    field: Any


@Inner
def fill_rates_from_place(integrand, phi, work, out):  # type: ignore[no-untyped-def]
    """Do the work of `fill_rates` for a segment on which V**2 follows from V**2 at one place, and from the slope of the
    potential there if the body is slow.
    """
    fns, p, kind, a, b, ref, w0, _ = integrand
    n = phi.size
    da, db, rows = work[0, :n], work[1, :n], work[2:4, :n]
    if kind == REGULAR:
        for i in range(n):
            da[i] = (a - ref) + (b - a) * phi[i]
            db[i] = ref + da[i]
        call_potential_divdiff1(fns.potential_divdiff1, n, ref, db, da, p, rows)
        for i in range(n):
            out[0, i] = rows[1, i] * fabs(b - a) / sqrt(w0 - 2.0 * da[i] * rows[0, i])
    else:  # the mean slope from ``a`` is the sum of the slope there and a term with the second difference
        at_turn = kind == FROM_SLOW_TURN
        for i in range(n):
            da[i] = (b - a) * phi[i] * (phi[i] if at_turn else 1.0)
            db[i] = -da[i]
        call_potential_divdiff2(fns.potential_divdiff2, n, a, a, da, db, p, rows)
        for i in range(n):
            loss = 2.0 * (ref + da[i] * rows[0, i])
            out[0, i] = rows[1, i] * fabs(b - a) / sqrt(w0 - (b - a if at_turn else da[i]) * loss)
        if at_turn:
            for i in range(n):
                out[0, i] *= 2.0
                rows[1, i] *= 2.0 * phi[i]
    for i in range(n):
        out[1, i] = rows[1, i] * fabs(b - a)


@Inner
def fill_rates(integrand, phi, work, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with dt/dphi and ds/dphi.

    Parameters
    ----------
    phi : (n,) array
        Phase angles.
    work : (4, n) array
        Work space. Afterwards its first row holds the offsets from ``a`` or ``ref``, and its third row the regular
        factor of V**2, or the first divided difference of the effective potential (`cancellation_range`).
    out : (2, n) array
        dt/dphi in s, ds/dphi in m.
    """
    fns, p, kind, a, b, _, _, field = integrand
    n = phi.size
    da, db, rows = work[0, :n], work[1, :n], work[2:4, :n]
    if field.size > 0:
        width = fabs(b - a)
        for i in range(n):
            d = width * exp(-phi[i])
            factor, ds = speed_and_length_factors(field, d)
            out[0, i] = ds / sqrt(factor)
            out[1, i] = ds * d
    elif kind == TURN_TURN:
        for i in range(n):
            s, c = sin(0.5 * phi[i]), cos(0.5 * phi[i])
            da[i] = (b - a) * s * s
            db[i] = (b - a) * c * c
            out[1, i] = fabs((b - a) * s * c)  # the root of da*db, which may underflow
        call_potential_divdiff2(fns.potential_divdiff2, n, a, b, da, db, p, rows)
        for i in range(n):
            out[0, i] = rows[1, i] / sqrt(2.0 * rows[0, i])
            out[1, i] *= rows[1, i]
    elif kind == FROM_TURN:
        for i in range(n):
            da[i] = (b - a) * phi[i] * phi[i]
            db[i] = a + da[i]
        call_potential_divdiff1(fns.potential_divdiff1, n, a, db, da, p, rows)
        root = 2.0 * sqrt(fabs(b - a))
        for i in range(n):
            fall = -2.0 * rows[0, i] if b > a else 2.0 * rows[0, i]
            out[0, i] = rows[1, i] * root / sqrt(fall)
            out[1, i] = rows[1, i] * 2.0 * fabs(b - a) * phi[i]
    elif kind in (REGULAR, FROM_SLOW, FROM_SLOW_TURN):
        fill_rates_from_place(integrand, phi, work, out)
    else:
        for i in range(n):
            da[i] = (a - b) * exp(-phi[i])
            db[i] = -da[i]
        call_potential_divdiff2(fns.potential_divdiff2, n, b, b, da, db, p, rows)
        for i in range(n):
            out[0, i] = rows[1, i] / sqrt(-2.0 * rows[0, i])
            out[1, i] = rows[1, i] * fabs(da[i])


@Inner
def fill_speeds(integrand, phi, work, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with V in m/s at each phase angle, without cancellation and with exactly zero at a turning point.

    ``work`` is a work space of four rows.
    """
    fns, p, kind, a, b, ref, w0, field = integrand
    n = phi.size
    da, db, rows = work[0, :n], work[1, :n], work[2:4, :n]
    if field.size > 0:
        width = fabs(b - a)
        for i in range(n):
            d = width * exp(-phi[i])
            out[i] = d * sqrt(speed_and_length_factors(field, d)[0])
    elif kind == TURN_TURN:
        for i in range(n):
            s, c = sine(0.5 * phi[i]), cosine(0.5 * phi[i])
            da[i] = (b - a) * s * s
            db[i] = (b - a) * c * c
            out[i] = fabs((b - a) * s * c)  # the root of da*db, which may underflow
        call_potential_divdiff2(fns.potential_divdiff2, n, a, b, da, db, p, rows)
        for i in range(n):
            out[i] *= sqrt(2.0 * rows[0, i])
    elif kind == TO_EQUILIBRIUM:
        for i in range(n):
            da[i] = (a - b) * exp(-phi[i])
            db[i] = -da[i]
        call_potential_divdiff2(fns.potential_divdiff2, n, b, b, da, db, p, rows)
        for i in range(n):  # V**2 itself may be smaller than the smallest double
            out[i] = fabs(da[i]) * sqrt(-2.0 * rows[0, i])
    else:
        start = a if kind == FROM_TURN else ref
        for i in range(n):
            da[i] = (b - a) * phi[i] * (phi[i] if kind == FROM_TURN else 1.0) + (a - start)
            db[i] = start + da[i]
        call_potential_divdiff1(fns.potential_divdiff1, n, start, db, da, p, rows)
        for i in range(n):
            out[i] = sqrt(max(w0 - 2.0 * da[i] * rows[0, i], 0.0))


@Inner
def cancellation_range(integrand, work, n, peak):  # type: ignore[no-untyped-def]
    """Return a measure of the cancellation in V**2 at the n places that `fill_rates` filled last.

    Between two turning points it is the ratio of the smallest to the largest value of the regular factor of V**2. On a
    segment that starts from a place where V**2 is known, it is the ratio of V**2 itself to the largest V**2 so far,
    because a body that has been fast and becomes slow is passing over a barrier.

    Parameters
    ----------
    work : (4, n) array
        The work space after a call of `fill_rates`.
    peak : float
        The largest V**2 before these places.

    Returns
    -------
    low, high : float
        Their ratio is the part of V**2 that cancellation leaves.
    peak : float
        The largest V**2 up to the last place.
    """
    kind, w0 = integrand.kind, integrand.w0
    low, high = 1.0, 1.0
    if integrand.field.size > 0:
        return low, high, peak
    if kind == TURN_TURN:
        low, high = inf, 0.0
        for i in range(n):
            low, high = min(low, work[2, i]), max(high, work[2, i])
    elif kind not in (TO_EQUILIBRIUM, FROM_SLOW, FROM_SLOW_TURN):
        # Towards the place where V**2 is known, its relative error only decreases.
        outwards = fabs(work[0, 0]) <= fabs(work[0, n - 1])
        for i in range(n):
            loss = 2.0 * work[0, i] * work[2, i]
            if outwards:
                peak = max(peak, w0 - loss)
            if peak > 0.0 or not outwards:
                low = min(low, (w0 - loss) / max(peak, w0 + fabs(loss)))
    return low, high, peak


@entry(VECTOR(ADDRESSES, VECTOR, types.int64, REAL, REAL, REAL, REAL, VECTOR))
def speeds_at(fns, p, kind, a, b, ref, w0, phi):  # type: ignore[no-untyped-def]
    """Return V in m/s at many phase angles of a segment; the other arguments are those of `Integrand`."""
    out = np.empty(phi.size)
    fill_speeds(Integrand(fns, p, kind, a, b, ref, w0, np.empty((0, 0))), phi, np.empty((4, phi.size)), out)
    return out


@entry(VECTOR(REAL, REAL, MATRIX, VECTOR))
def speeds_along(a, b, field, phi):  # type: ignore[no-untyped-def]
    """Return V in m/s at many phase angles of a segment from ``a`` to an equilibrium ``b``, with V**2 from
    `equilibrium`.
    """
    out, work = np.empty(phi.size), np.empty((4, phi.size))
    fill_speeds(Integrand(NO_FUNCTIONS, np.empty(0), TO_EQUILIBRIUM, a, b, a, 0.0, field), phi, work, out)
    return out
