"""V**2 next to an equilibrium that a motion with losses approaches, as polynomials in the distance d from it.

The approach is divided into intervals of d. A *field* is an array with one row for each of them: both ends of the
interval, the Chebyshev coefficients of V**2/d**2, and as many of ds/dlam.
"""

from gqm_sym.runtime.arithmetic.clenshaw import chebyshev_sum
from gqm_sym.runtime.compiled.jit import Inner


@Inner
def speed_and_length_factors(field, d):  # type: ignore[no-untyped-def]
    """Return V**2/d**2 and ds/dlam at the distance d; neither of them vanishes at the equilibrium."""
    k, half = 0, field.shape[1] // 2 + 1
    while k < field.shape[0] - 1 and d > field[k, 1]:
        k += 1
    row = field[k]
    x = 2.0 * (d - row[0]) / (row[1] - row[0]) - 1.0
    return chebyshev_sum(row[2:half], x), chebyshev_sum(row[half:], x)
