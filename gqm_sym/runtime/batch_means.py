"""Half periods that are complete elliptic integrals of the first kind, by Gauss's arithmetic-geometric mean.

The integral of du/sqrt(a**2*cos(u)**2 + b**2*sin(u)**2) over a quarter turn is pi/(2*agm(a, b)) (Gauss 1818; Borwein
and Borwein, Pi and the AGM, 1987, section 1.1): a handful of square roots, and no error but rounding.
"""

from math import inf, nan, pi, sqrt

from gqm_sym.runtime.batch_rows import LEAST, MOST, WHO
from gqm_sym.runtime.crossing import call_mean_each
from gqm_sym.runtime.fused import choose
from gqm_sym.runtime.jit import Inner
from gqm_sym.runtime.panels import LEAST_BALANCE
from gqm_sym.runtime.swift import DONE, HARD, WHOLE

# The kind of such orbits, beside those of `swift` and `batch_times`.
MEANS = 3
# From numbers in a ratio of 1 : 10, the root of LEAST_BALANCE, both are the same to half an ulp after so many steps
# and one more arithmetic mean: their relative difference is 9e-1, 6e-1, 4e-2, 2e-4, 4e-9, and its square counts.
STEPS = 4


@Inner
def by_means(fns, n, s, flat, count, work, asked, out, reasons):  # type: ignore[no-untyped-def]
    """Half periods, or periods, into the rows of ``out`` that belong to the orbits; none next to a barrier."""
    p, halves, rows = flat[: count * n].reshape(count, n), work[0, :n], work[1:3].reshape(-1)[: 2 * n].reshape(2, n)
    clear, times = work[3, :n], work[4, :n]
    for j in range(n):
        halves[j] = 0.5 * (s[MOST, j] - s[LEAST, j])
    call_mean_each(fns[6], n, halves, p, rows)
    for j in range(n):
        a, b = rows[0, j], rows[1, j]
        balanced = (b > LEAST_BALANCE * a) & (a > LEAST_BALANCE * b) & (a + b < inf)
        clear[j] = choose(balanced, 1.0, 0.0)
        rows[0, j], rows[1, j] = sqrt(a), sqrt(b)
    for _ in range(STEPS):
        for j in range(n):
            a, b = rows[0, j], rows[1, j]
            rows[0, j], rows[1, j] = 0.5 * (a + b), sqrt(a * b)
    turn = 2.0 * pi if asked != WHOLE else 4.0 * pi
    for j in range(n):
        times[j] = choose(clear[j] == 1.0, turn / (rows[0, j] + rows[1, j]), nan)
    for j in range(n):
        k = int(s[WHO, j])
        out[k, 0] = times[j]
        reasons[k] = DONE if clear[j] == 1.0 else HARD
