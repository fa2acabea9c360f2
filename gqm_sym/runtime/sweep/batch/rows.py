"""A batch of orbits: an array with a row for each quantity and a column for each orbit.

Run-time parameters lie beside it, a row each. Every step over a batch is a loop over the columns without branches,
which vectorises; columns are whole registers.
"""

from gqm_sym.runtime.compiled.jit import Inner

# Orbits of a batch: its arrays stay in the first-level cache. Orbits of a full register, at most.
BATCH, LANES = 128, 8

# Rows of a batch: which launch, and what the quadrature keeps of it; offsets of both ends from it, both ends; the
# launch's place and V**2, which the quadrature needs of laps alone; what the search needs: which way it goes and how
# far at most, and how far the other way, its state, bracket, trial and the zero, how far the axis of symmetry is that
# the orbit may have, the step from one axis to the next, and how far the zero behind is where that is known (NaN).
WHO, SUM, VALUE, CHANGE, LOW, HIGH, LEAST, MOST, A, B, START, SPEED, LASTING = range(13)
WAY, REACH, BACK, STATE, LEFT, RIGHT, TRIAL, AHEAD, AXIS, STEP, BEHIND, ROWS = range(12, 24)

# How far back it is on a closed curve: both zeros lie within one period.
CLOSED = -1.0

# What a search has come to.
SEEKING, FOUND, NOWHERE = 0.0, 1.0, 2.0


@Inner
def any_is(row, value):  # type: ignore[no-untyped-def]
    """Whether a value is in a row: a loop of its own, for a loop that also counts stays scalar."""
    found = False
    for v in row:
        found |= v == value
    return found


@Inner
def gather(s, p, count, n, chosen, kept, t, q, rows):  # type: ignore[no-untyped-def]
    """Copy ``chosen`` columns, ``kept`` of them, and their parameters; returns how many columns that fills."""
    full = -(-kept // LANES) * LANES
    for row in range(rows):
        for j in range(kept):
            t[row, j] = s[row, chosen[j]]
        for j in range(kept, full):
            t[row, j] = t[row, kept - 1]
    for row in range(count):
        for j in range(kept):
            q[row * full + j] = p[row * n + chosen[j]]
        for j in range(kept, full):
            q[row * full + j] = q[row * full + kept - 1]
    return full


@Inner
def shrink(s, p, count, n, chosen, kept, rows):  # type: ignore[no-untyped-def]
    """Close up to the ``kept`` columns that are ``chosen``, in ascending order; returns how many columns are left."""
    return n if kept == n else gather(s, p, count, n, chosen, kept, s, p, rows)


@Inner
def part(state, found, others):  # type: ignore[no-untyped-def]
    """List the columns whose state is FOUND, and the others; returns how many there are of each."""
    if not any_is(state, NOWHERE):
        for j in range(state.size):
            found[j] = j
        return state.size, 0
    kept, left = 0, 0
    for j in range(state.size):
        found[kept] = others[left] = j
        kept += state[j] == FOUND
        left += state[j] != FOUND
    return kept, left
