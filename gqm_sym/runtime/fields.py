"""V**2 next to an equilibrium that a dissipative motion approaches, as polynomials of the distance d from there.

Kept is V**2 over d**2, without subtracting anything. One row is a panel:

======= ============================================================================
column  meaning
======= ============================================================================
0, 1    where the panel begins and ends, as distances
2 on    Chebyshev coefficients of V**2/d**2, then those of ds
======= ============================================================================
"""

from gqm_sym.runtime.fused import fma
from gqm_sym.runtime.jit import Inner


@Inner
def chebyshev_sum(c, x):  # type: ignore[no-untyped-def]
    """The Chebyshev series with coefficients c, at x, by Clenshaw's recurrence."""
    high, low, twice = 0.0, 0.0, 2.0 * x
    for k in range(c.size - 1, 0, -1):
        high, low = fma(twice, high, c[k] - low), high
    return fma(x, high, c[0] - low)


@Inner
def along(field, d):  # type: ignore[no-untyped-def]
    """V**2 over d**2 and ds at a distance."""
    k, half = 0, field.shape[1] // 2 + 1
    while k < field.shape[0] - 1 and d > field[k, 1]:
        k += 1
    row = field[k]
    x = 2.0 * (d - row[0]) / (row[1] - row[0]) - 1.0
    return chebyshev_sum(row[2:half], x), chebyshev_sum(row[half:], x)
