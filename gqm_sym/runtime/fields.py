"""V**2 along a leg as polynomials, panel by panel, by the distance d from the place where it was begun.

On a panel that begins at distance l with V**2 = ``base``, ``V**2 = base + (d - l) R``. On the first panel from a
turning point R is V**2 over d, on that from an equilibrium V**2 over d**2: both without subtracting anything. One row
is a panel:

======= ===========================================================================================
column  meaning
======= ===========================================================================================
0, 1    where the panel begins, and up to where it holds, as distances
2       the width that its polynomials were made for; below 0 if they are polynomials in the root of d
3       base
4 on    Chebyshev coefficients of R, then those of ds
======= ===========================================================================================
"""

from math import sqrt

import numpy as np

from gqm_sym.runtime.chebyshev import COUNT, chebyshev_sum, coefficients
from gqm_sym.runtime.jit import Inner

COLUMNS = 4 + 2 * COUNT


@Inner
def enter(field, count, left, right, width, base, regular, ds):  # type: ignore[no-untyped-def]
    """Enter a panel, by values at its nodes, behind ``count`` others; the field, longer if it had to be."""
    if count == field.shape[0]:
        longer = np.empty((2 * count, COLUMNS))
        longer[:count] = field
        field = longer
    field[count, 0], field[count, 1], field[count, 2], field[count, 3] = left, right, width, base
    coefficients(regular, field[count, 4 : 4 + COUNT])
    coefficients(ds, field[count, 4 + COUNT :])
    return field


@Inner
def along(field, d, order):  # type: ignore[no-untyped-def]
    """V**2 at distance d, what it is divided by ``d**order``, and ds; ``order`` is that of its zero at d = 0."""
    k = 0
    while k < field.shape[0] - 1 and d > field[k, 1]:
        k += 1
    row = field[k]
    inside = d - row[0]
    x = 2.0 * inside / row[2] - 1.0 if row[2] > 0.0 else 2.0 * sqrt(inside / -row[2]) - 1.0
    regular, ds = chebyshev_sum(row[4 : 4 + COUNT], x), chebyshev_sum(row[4 + COUNT :], x)
    if k == 0 and row[3] == 0.0:
        return (regular * d * d if order == 2 else regular * d), regular, ds
    v2 = row[3] + inside * regular
    if order == 0:
        return v2, v2, ds
    return v2, (v2 / d if order == 1 else v2 / (d * d)), ds
