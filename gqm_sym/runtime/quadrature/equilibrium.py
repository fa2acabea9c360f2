"""V**2 next to an equilibrium that a dissipative motion approaches, as polynomials of the distance d from there."""

from gqm_sym.runtime.arithmetic.clenshaw import chebyshev_sum
from gqm_sym.runtime.compiled.jit import Inner


@Inner
def along(field, d):  # type: ignore[no-untyped-def]
    """V**2 over d**2 and ds at a distance."""
    k, half = 0, field.shape[1] // 2 + 1
    while k < field.shape[0] - 1 and d > field[k, 1]:
        k += 1
    row = field[k]
    x = 2.0 * (d - row[0]) / (row[1] - row[0]) - 1.0
    return chebyshev_sum(row[2:half], x), chebyshev_sum(row[half:], x)
