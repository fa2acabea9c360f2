"""The ends and the time of a launch of a conservative model, in one call of compiled code."""

import numpy as np
from numba import types

from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import ADDRESSES, REAL, VECTOR
from gqm_sym.runtime.launch.domain import DOMAIN
from gqm_sym.runtime.launch.ends import END_TYPE, NO_ORBIT, ends, orbit_kind
from gqm_sym.runtime.quadrature.trapezoid import LIBRATION, time_by_trapezoid


@entry(
    types.Tuple((types.int64, END_TYPE, END_TYPE, REAL))(
        ADDRESSES, VECTOR, REAL, REAL, types.int64, DOMAIN, types.boolean
    ),
    checked=False,
)
def survey(fns, p, lam0, v0, direction, domain, is_smooth):  # type: ignore[no-untyped-def]
    """Find both ends of a motion, and its half period or loop time if the trapezoidal rule gives it.

    Parameters
    ----------
    lam0, v0 : float
        The launch place, and the speed there in m/s.
    direction : int
        The sign of ds/dt at launch; for a launch from rest it is determined here.
    domain : DomainNumbers
        The range of the curve parameter.
    is_smooth : bool
        Whether the curve is smooth everywhere. The trapezoidal rule does not converge on other curves.

    Returns
    -------
    direction : int
    ahead, behind : (what, near, far)
        As `ends.ends` returns them.
    time : float
        Half period of a libration or loop time of a circulation in s, within some units in the last place. NaN for any
        other motion, if the trapezoidal rule does not converge, or if too much of V**2 cancels for doubles.
    """
    direction, ahead, behind = ends(fns, p, lam0, v0, direction, domain)
    kind, time = orbit_kind(direction, ahead, behind, v0, domain.period), np.nan
    if kind != NO_ORBIT and is_smooth:
        near, far = min(ahead.near, behind.near), max(ahead.near, behind.near)
        width = far - near if kind == LIBRATION else direction * domain.period
        a, b = (lam0 + near, lam0 + far) if kind == LIBRATION else (lam0, lam0 + width)
        time = time_by_trapezoid(fns, p, kind, lam0, v0 * v0, a, b, width)
    return direction, (ahead.what, ahead.near, ahead.far), (behind.what, behind.near, behind.far), time
