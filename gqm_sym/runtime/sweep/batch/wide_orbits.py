"""The regular factor of V**2 on orbits that are too wide for the closed forms of second divided differences."""

from math import fabs

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.calls import call_potential_divdiff1_batch
from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.quadrature.trapezoid import NODE_SHARES, OFFSETS_FROM_A, OFFSETS_TO_B
from gqm_sym.runtime.sweep.batch.rows import END_HIGH, END_LOW, LAUNCH_PLACE, OFFSET_HIGH, OFFSET_LOW

# The distance of an end from zero, in widths of the orbit, from which on its rounding counts, because it is more than
# that of the width.
FAR = 1.0

# The share of an orbit over which the slope of the potential changes in proportion to the distance from an end.
NEAR = 2.0**-20


@Inner
def fill_end_roundings(fns, n, from_below, rows, p, work):  # type: ignore[no-untyped-def]
    """Fill the roundings of one end of each orbit, and dU/dlam there if any of them counts; return whether any does.

    They count as 0 where the end is nearer to zero than the width of the orbit.
    """
    ends = rows[END_LOW if from_below else END_HIGH, :n]
    offset_low, offset_high, start = rows[OFFSET_LOW, :n], rows[OFFSET_HIGH, :n], rows[LAUNCH_PLACE, :n]
    roundings, slopes, offsets = work[2, :n], work[5, :n], work[9, :n]
    out, any_far = work[10:13].reshape(-1)[: 3 * n].reshape(3, n), False
    for j in range(n):
        end, rounding = two_sum(start[j], offset_low[j] if from_below else offset_high[j])
        far = fabs(ends[j]) > FAR * (offset_high[j] - offset_low[j])
        roundings[j] = choose(far, (end - ends[j]) + rounding, 0.0)
        any_far |= far
    slopes[:] = 0.0
    if any_far:
        offsets[:] = 0.0
        call_potential_divdiff1_batch(fns.potential_divdiff1, n, ends, ends, offsets, p, out)
        slopes[:] = out[2]
    return any_far


@Inner
def replace_on_wide_orbits(fns, n, node, rows, p, two, work):  # type: ignore[no-untyped-def]
    """Replace NaN in the results of `potential_divdiff2` for orbits that are too wide for its closed forms.

    V**2 is computed from U[a, x] or U[b, x] with the nearer turning point, which loses no digits on a wide orbit. If
    that turning point is far from zero, its rounding is taken into account.
    """
    from_below = NODE_SHARES[node] <= 0.5
    any_far = fill_end_roundings(fns, n, from_below, rows, p, work)
    ends = rows[END_LOW if from_below else END_HIGH, :n]
    da, db, places, offsets = work[0, :n], work[1, :n], work[8, :n], work[9, :n]
    roundings, slopes = work[2, :n], work[5, :n]
    out = work[10:13].reshape(-1)[: 3 * n].reshape(3, n)
    at_end = any_far and (OFFSETS_FROM_A[node] if from_below else OFFSETS_TO_B[node]) == 0.0
    share = NEAR if at_end else 0.0
    for j in range(n):
        offsets[j] = da[j] + share * db[j] if from_below else -(db[j] + share * da[j])
        places[j] = ends[j] + offsets[j]
    call_potential_divdiff1_batch(fns.potential_divdiff1, n, ends, places, offsets, p, out)
    if any_far:
        for j in range(n):
            roundings[j] = choose(roundings[j] == 0.0, 0.0, roundings[j] * (out[2, j] - slopes[j]) / offsets[j])
    if at_end:
        offsets[:] = 0.0
        call_potential_divdiff1_batch(fns.potential_divdiff1, n, ends, ends, offsets, p, out)
    for j in range(n):
        wide = two[0, j] != two[0, j]
        first = out[0, j] + roundings[j]
        q = -first / db[j] if from_below else first / da[j]
        two[0, j] = choose(wide, q, two[0, j])
        two[1, j] = choose(two[1, j] == two[1, j], two[1, j], out[1, j])
