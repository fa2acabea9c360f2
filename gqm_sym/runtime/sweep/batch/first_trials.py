"""Where searches for turning points of many orbits begin."""

from math import sqrt

from gqm_sym.runtime.compiled.calls import call_potential_divdiff1_batch
from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.sweep.batch.rows import LAUNCH_PLACE, LAUNCH_V2, SEARCH_DIRECTION, TRIAL

# A careful search looks at so many places before its first trial, with distances in this ratio.
SAMPLES, SAMPLE_RATIO = 16, 1.25

# The distance, as a share of the first trial, over which the change of the force at a launch is taken.
FORCE_STEP = 2.0**-12


@Inner
def fill_slopes(fns, n, rows, p, work):  # type: ignore[no-untyped-def]
    """Fill dU/dlam at each launch into row 7 of the work space."""
    offsets, out, start = work[0, :n], work[2:5].reshape(-1)[: 3 * n].reshape(3, n), rows[LAUNCH_PLACE, :n]
    offsets[:] = 0.0
    call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, start, offsets, p, out)
    for j in range(n):
        work[7, j] = out[2, j]


@Inner
def start_at_harmonic_turns(fns, n, rows, p, images, work):  # type: ignore[no-untyped-def]
    """Let searches begin where V**2 would vanish if the force changed at the same rate as at the launch, if that is
    nearer.

    It is so for small swings, whatever their scale is. ``images`` has 1 for searches that begin at the mirror image of
    a zero or are not needed; these stay as they are. The slopes must have been filled.
    """
    offsets, places, out = work[0, :n], work[1, :n], work[2:5].reshape(-1)[: 3 * n].reshape(3, n)
    slopes = work[7, :n]
    start, w0, direction, trial = (
        rows[LAUNCH_PLACE, :n],
        rows[LAUNCH_V2, :n],
        rows[SEARCH_DIRECTION, :n],
        rows[TRIAL, :n],
    )
    for j in range(n):
        offsets[j] = direction[j] * (FORCE_STEP * trial[j])
        places[j] = start[j] + offsets[j]
    call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, places, offsets, p, out)
    for j in range(n):
        # V**2 is about w0 - 2*slope*d - rate*d**2 at the distance d.
        slope, rate = direction[j] * slopes[j], 2.0 * (out[0, j] - slopes[j]) / offsets[j]
        root = sqrt(slope * slope + rate * w0[j])
        turn = choose(slope > 0.0, w0[j] / (slope + root), (root - slope) / rate)
        better = (turn > 0.0) & (turn < trial[j]) & (images[j] == 0.0)
        trial[j] = choose(better, turn, trial[j])


@Inner
def start_at_axes(fns, n, rows, p, axes, work):  # type: ignore[no-untyped-def]
    """Let searches that would begin at a mirror image begin at the axis of symmetry if V**2 < 0 there.

    The image has the same V**2, and belongs to another orbit then. ``axes`` has the distances of the axes from the
    launches, and those of other searches, which stay as they are, have TRIAL there.
    """
    offsets, places, out = work[0, :n], work[1, :n], work[2:5].reshape(-1)[: 3 * n].reshape(3, n)
    start, w0, direction, trial = (
        rows[LAUNCH_PLACE, :n],
        rows[LAUNCH_V2, :n],
        rows[SEARCH_DIRECTION, :n],
        rows[TRIAL, :n],
    )
    any_axis = False
    for j in range(n):
        offsets[j] = direction[j] * axes[j]
        places[j] = start[j] + offsets[j]
        any_axis |= axes[j] != trial[j]
    if not any_axis:
        return
    call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, places, offsets, p, out)
    for j in range(n):
        trial[j] = choose(w0[j] - 2.0 * offsets[j] * out[0, j] < 0.0, axes[j], trial[j])


@Inner
def start_at_first_hill(fns, n, rows, p, work):  # type: ignore[no-untyped-def]
    """Let searches begin at the first of some places up to the first trial at which V**2 < 0, if there is one.

    So they do not pass over hills, or over poles of the potential, that are not narrower than the distances between
    these places.
    """
    offsets, places, out = work[0, :n], work[1, :n], work[2:5].reshape(-1)[: 3 * n].reshape(3, n)
    firsts, start, w0 = work[5, :n], rows[LAUNCH_PLACE, :n], rows[LAUNCH_V2, :n]
    direction, trial, share = rows[SEARCH_DIRECTION, :n], rows[TRIAL, :n], SAMPLE_RATIO**-SAMPLES
    firsts[:] = 0.0
    for _ in range(SAMPLES):
        for j in range(n):
            offsets[j] = direction[j] * share * trial[j]
            places[j] = start[j] + offsets[j]
        call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, places, offsets, p, out)
        for j in range(n):
            is_first = (firsts[j] == 0.0) & (w0[j] - 2.0 * offsets[j] * out[0, j] < 0.0)
            firsts[j] = choose(is_first, share * trial[j], firsts[j])
        share *= SAMPLE_RATIO
    for j in range(n):
        trial[j] = choose(firsts[j] > 0.0, firsts[j], trial[j])
