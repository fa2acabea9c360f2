"""V**2 along the legs of a dissipative motion: one linear equation, panel by panel (MATHS, section 2).

On a leg ``dW/dlam = P - Q W``. With d the distance run from a panel's start, where W is ``base``, and q the integral of
Q, ``W = exp(-q) (base + integral of exp(q) P)`` is kept as ``W = base + d R(d)``. R comes from running means, so that
nothing is subtracted however small d is: at a turning point base is 0 and R is what V**2 is divided by d.

The panels are kept as a field (`fields`).
"""

from math import exp, expm1, fabs, inf

import numpy as np

from gqm_sym.runtime.chebyshev import (
    COUNT,
    GRADED_MEANS,
    MEANS,
    SHARES,
    chebyshev_sum,
    coefficients,
    first_change,
    tail_and_level,
)
from gqm_sym.runtime.crossing import call_drive
from gqm_sym.runtime.fields import COLUMNS, enter
from gqm_sym.runtime.jit import Inner

# What ended a run along the curve.
TURN, LIMIT, LIFTOFF, ASYMPTOTE, PAUSED, NARROWED, SPENT = range(7)

# Last coefficients against the largest: noise in them is about 1e-16.
TAIL = 4e-16
# Coefficients that have stopped falling below this level are rounding noise, not structure.
PLATEAU = 1e-9
# What may be left of a function where all of it cancels, as a share of its parts.
NOISE = 1e-15
# The same of N, against the parts it is the sum of: the curvature of a chart has a digit less.
TOUCHED = 5e-14
# A width of a few units in the last place of the parameter.
NARROW = 1e-15
# A body this close to a turn, as a share of what has been run, is there: for laws that have no value beyond it.
NEAR = 1e-11
# W over a panel may not change by more than this factor's logarithm through resistance alone.
STEEPEST = 8.0
MOST_TRIES = 20000
MOST_ROUNDS = 40
MOST_PANELS = 512


@Inner
def judge(values, size):  # type: ignore[no-untyped-def]
    """Whether a function is resolved on the panel, and whether it would be on one twice as wide."""
    for j in range(COUNT):
        size = max(size, fabs(values[j]))
    tail, level = tail_and_level(values)
    if not tail < inf:
        return False, False
    if tail <= TAIL * size:
        return True, level <= TAIL * size
    return level <= PLATEAU * size and tail >= 0.05 * level, False


@Inner
def part(x, graded):  # type: ignore[no-untyped-def]
    """How far into a panel x is, as a share of its width."""
    share = 0.5 * (1.0 + x)
    return share * share if graded else share


@Inner
def solve_panel(drive, p, linear, here, u, width, base, v, nu, rows, line):  # type: ignore[no-untyped-def]
    """W on a panel that begins at ``here`` and runs towards growing (u = 1) or falling (u = -1) parameters.

    Fills ``rows`` by ``drive``, and in ``line`` the places (0), W (1), R (2), exp(q) P (3) and Q (4), all signed for
    the way that is run; R and W at the panel's end behind those at the nodes. Returns q there, inf where the panel is
    too wide for an answer.

    A law that is not linear may go like the speed itself, whose square is linear in d next to a turning point: a panel
    that begins there is graded, its nodes at the squares of the shares. Q is then that for the share.
    """
    graded = not linear and base == 0.0
    for j in range(COUNT):
        line[0, j] = here + u * (width * (SHARES[j] * SHARES[j] if graded else SHARES[j]))
        line[1, j] = base
    if graded:
        line[1, 0] = 1e-300
        call_drive(drive, 1, line[0], line[1], float(v), float(nu), p, rows)
        rise = u * (rows.flat[1] - rows.flat[2] * 1e-300)
        for j in range(COUNT):
            line[1, j] = rise * width * SHARES[j] * SHARES[j]
    stop = inf
    for _ in range(1 if linear else MOST_ROUNDS):
        call_drive(drive, COUNT, line[0], line[1], float(v), float(nu), p, rows)
        for j in range(COUNT):
            line[4, j] = u * rows[2, j] * (2.0 * SHARES[j] if graded else 1.0)
        for j in range(COUNT + 1):
            mean = 0.0
            for k in range(COUNT):
                mean += MEANS[j, k] * line[4, k]
            line[2, j] = mean
        far = width * line[2, COUNT]
        if not fabs(far) <= STEEPEST:
            return inf
        for j in range(COUNT):
            line[3, j] = u * exp(width * SHARES[j] * line[2, j]) * rows[1, j]
        moved, size = 0.0, 0.0
        for j in range(COUNT + 1):
            mean = 0.0
            for k in range(COUNT):
                mean += (GRADED_MEANS[j, k] if graded else MEANS[j, k]) * line[3, k]
            share = SHARES[j] if j < COUNT else 1.0
            d, q = width * (share * share if graded else share), width * share * line[2, j]
            kept = expm1(-q)
            lost = -line[2, j] if q == 0.0 else kept / d
            line[2, j] = base * lost + (1.0 + kept) * mean
            new = base + d * line[2, j]
            moved, size = max(moved, fabs(new - line[1, j])), max(size, fabs(new))
            line[1, j] = new
        if linear:
            return far
        # Newton's method: each round squares the miss, and the last ones only stir the rounding.
        if not moved < inf:
            return inf
        if moved <= 4e-16 * size or (moved <= 1e-13 * size and moved >= 0.5 * stop):
            return far
        stop = moved
    return inf


@Inner
def resolved(rows, line, values, width, base, far):  # type: ignore[no-untyped-def]
    """Whether all of a panel's functions are resolved, and would be on one twice as wide; the size of N's parts."""
    fine, wide = judge(rows[0], 0.0)
    size = 0.0
    for j in range(COUNT):
        size = max(size, fabs(line[4, j]) * max(base, line[1, j]))
    ok, more = judge(line[3], size)
    fine, wide = fine and ok, wide and more
    ok, more = judge(line[4], 1.0 / width)
    fine, wide = fine and ok, wide and more
    ok, more = judge(line[2], base / width)
    fine, wide = fine and ok, wide and more
    size = 0.0
    for j in range(COUNT):
        values[j] = rows[0, j] * (rows[3, j] + rows[4, j] * line[1, j])
        size = max(size, fabs(rows[0, j]) * (fabs(rows[3, j]) + fabs(rows[4, j] * line[1, j])))
    ok, more = judge(values, size)
    return fine and ok, wide and more and fabs(far) <= 0.5 * STEEPEST, size


@Inner
def to_kink(rows, values, c):  # type: ignore[no-untyped-def]
    """The place x up to which the curvature keeps its sign: 2 if throughout, -1 if that is not resolved.

    The sign is that of ds kappa, which is smooth at cusps too.
    """
    for j in range(COUNT):
        values[j] = rows[0, j] * rows[4, j]
    fine, _ = judge(values, 0.0)
    if not fine:
        return -1.0
    coefficients(values, c)
    size = 0.0
    for j in range(COUNT):
        size = max(size, fabs(values[j]))
    return first_change(c, 0, NOISE * size)[0]


@Inner
def next_panel(drive, p, flags, here, left, u, room, step, base, v, nu, rows, line, values):  # type: ignore[no-untyped-def]
    """The widest panel that can be resolved, no wider than ``room`` and ``step``; ``left`` has been run before.

    Returns its width (0 if none is wide enough to be one), the step to go on with, q over it and the size of N's parts.
    """
    c = np.empty(COUNT)
    width, kink, graded = min(step, room), False, flags[2] == 0 and base == 0.0
    for _ in range(2100):
        if width <= NARROW * max(fabs(here), left) or width < 1e-300:
            return 0.0, step, 0.0, 0.0
        far = solve_panel(drive, p, flags[2] == 1, here, u, width, base, v, nu, rows, line)
        if flags[1] == 1 and not kink and (far < inf or flags[2] == 1):
            x = to_kink(rows, values, c)
            if x <= 1.0:
                kink = x > -1.0
                width *= part(x, graded) if kink else 0.5
                continue
        if far < inf:
            fine, wide, size = resolved(rows, line, values, width, base, far)
            if fine:
                if wide:
                    return width, max(step, 2.0 * width), far, size
                return width, (step if kink or width == room else width), far, size
        width, kink = 0.5 * width, False
    return 0.0, step, 0.0, 0.0


@Inner
def bottom(rows, line, values, c, v, touch):  # type: ignore[no-untyped-def]
    """The place x near ``touch`` where V**2, all but zero there, is least: the force vanishes."""
    for j in range(COUNT):
        values[j] = v * (rows[1, j] - rows[2, j] * line[1, j])
    coefficients(values, c)
    x, new = touch, touch + 1e-4
    before = chebyshev_sum(c, x)
    for _ in range(30):
        slope = chebyshev_sum(c, new)
        if slope == before:
            break
        x, before, new = new, slope, new - slope * (new - x) / (slope - before)
    return new if fabs(new - touch) <= 1e-2 else touch


@Inner
def pushed(array, count, value):  # type: ignore[no-untyped-def]
    """The array with a value entered behind ``count`` others; longer if it had to be."""
    if count == array.size:
        longer = np.empty(2 * count)
        longer[:count] = array
        array = longer
    array[count] = value
    return array


@Inner
def run(drive, p, flags, start, w, v, nu, breaks, limit, reach, step, side):  # type: ignore[no-untyped-def]
    """Follow the body from ``start`` with V**2 = w in direction v, to the first turn, end or pause.

    Parameters
    ----------
    flags : (friction, kinked, linear)
        Of what kind the forces are.
    nu : int
        The sign of N; 0 to find it out.
    breaks : array
        Places at which panels must begin, in the order they are met.
    limit, reach : float
        The end of the domain; the distance from which on the run may pause.
    side : int
        The only sign that N can have; 0 where it can have both.

    Returns
    -------
    what : int
        TURN, LIMIT, LIFTOFF, ASYMPTOTE (V**2 and the force vanish together), PAUSED, NARROWED (a place where the
        functions are not smooth), SPENT.
    place, w, nu : float, float, int
        Where, with what V**2, and the sign of N.
    step : float
        The step to go on with.
    middle : float
        The last place at which V**2 is still large against all that it was: a turn is followed back to there.
    changes : (k,) array
        Places at which N changes sign.
    first : int
        The sign of N to begin with.
    field : (n, COLUMNS) array
        V**2 on the way, by distance from ``start``.
    """
    rows, line, values = np.empty((5, COUNT)), np.empty((5, COUNT + 1)), np.empty(COUNT)
    c, changes = np.empty(COUNT), np.empty(16)
    field, spot = np.empty((8, COLUMNS)), np.empty((6, 1))
    count, met, coming = 0, 0, 0
    first, base, left = nu, w, 0.0
    ceiling, middle, what = w, start, SPENT
    for _ in range(MOST_TRIES):
        here = start + v * left
        while coming < breaks.size and v * (breaks[coming] - here) <= 0.0:
            coming += 1
        stop = breaks[coming] if coming < breaks.size else limit
        room = v * (stop - start) - left
        if room <= 0.0:
            what = LIMIT
            break
        width, step, far, size = next_panel(drive, p, flags, here, left, v, room, step, base, v, nu, rows, line, values)
        graded = flags[2] == 0 and base == 0.0
        if width == 0.0:
            what = NARROWED
            if flags[2] == 0 and base > 0.0:
                line[0, 0], line[1, 0] = here, base
                call_drive(drive, 1, line[0], line[1], float(v), float(nu), p, rows)
                slope = v * (rows.flat[1] - rows.flat[2] * base)
                if slope < 0.0 and base <= -slope * NEAR * max(fabs(here), left):
                    what, left, base = TURN, left - base / slope, 0.0
            break
        for j in range(COUNT):
            values[j] = rows[0, j] * (rows[3, j] + rows[4, j] * line[1, j])
        coefficients(values, c)
        turn_of_force, before, _ = first_change(c, nu, TOUCHED * size)
        if nu == 0 and before != 0:
            nu = before
            if count == 0:
                first = nu
            if nu == -side:
                what = LIFTOFF
                break
            if flags[0] == 1:
                continue
        # V**2, or what it is divided by the distance from the turning point it begins with.
        largest = base
        for j in range(COUNT):
            largest = max(largest, line[1, j])
        if base == 0.0:
            coefficients(line[2], c)
            scale = 0.0
            for j in range(COUNT):
                scale = max(scale, fabs(line[3, j]))
        else:
            coefficients(line[1], c)
            scale = max(ceiling, largest)
        at_rest, _, touch = first_change(c, 1, NOISE * scale)
        if touch <= -1.0 and base == 0.0:
            touch = 2.0
        end = min(at_rest, touch, turn_of_force)
        right = left + width if end > 1.0 else left + width * part(end, graded)
        if end == turn_of_force and end <= 1.0 and right <= left + NARROW * max(fabs(here), left):
            nu = -nu  # N is zero here: what follows decides its sign
            if left == 0.0:
                first = nu
            else:
                changes, met = pushed(changes, met, here), met + 1
            if nu == -side:
                what = LIFTOFF
                break
            continue
        if end == at_rest and end <= 1.0 and flags[2] == 1:
            # Once more on a panel that ends there: its own sum has more digits than the series of a wider one.
            width, at_rest, end = right - left, 1.0, 1.0
            solve_panel(drive, p, True, here, v, width, base, v, nu, rows, line)
            over = line[1, COUNT]
            spot[0, 0] = start + v * right
            call_drive(drive, 1, spot[0], spot[0], float(v), float(nu), p, spot[1:])
            slope = v * (spot[2, 0] - spot[3, 0] * over)
            if fabs(over) < fabs(slope) * 1e-6 * width:
                right -= over / slope
        if end <= 1.0 and end == touch and end != at_rest:
            right = left + width * part(bottom(rows, line, values, c, v, touch), graded)
        field = enter(field, count, left, right, -width if graded else width, base, line[2], rows[0])
        count += 1
        # The largest V**2 on the part that is run.
        share, largest, best = 0.5 * (1.0 + min(end, 1.0)), base, left
        for j in range(COUNT):
            if SHARES[j] < share and line[1, j] > largest:
                largest, best = line[1, j], left + width * (SHARES[j] * SHARES[j] if graded else SHARES[j])
        ceiling = max(ceiling * exp(-far) if end > 1.0 else ceiling, largest)
        if largest >= 0.5 * ceiling:
            middle = start + v * best
        coefficients(line[2], c)
        base = max(base + (right - left) * chebyshev_sum(c, 2.0 * share - 1.0), 0.0)
        left = right
        if end <= 1.0:
            if end == at_rest or end == touch:
                what, base = (TURN if end == at_rest else ASYMPTOTE), 0.0
                break
            changes, met = pushed(changes, met, start + v * left), met + 1
            nu = -nu
            if nu == -side:
                what = LIFTOFF
                break
        elif width == room and stop == limit:
            what = LIMIT
            break
        elif (left >= reach and 2.0 * base >= ceiling) or count >= MOST_PANELS:
            what = PAUSED
            break
    place = limit if what == LIMIT else start + v * left
    return what, place, base, nu, step, middle, changes[:met].copy(), first, field[:count].copy()


@Inner
def run_back(drive, p, flags, turn, end, v, nu, changes, breaks, step, level):  # type: ignore[no-untyped-def]
    """V**2 of the leg that turns at ``turn``, followed back from there to ``end``; as a field from the turn.

    ``nu`` is the sign of N at the turn, ``changes`` are the places where it has changed sign on the way. ``level`` says
    that the force vanishes at the turn as well: it is an equilibrium, and d is divided out twice.
    """
    rows, line, values = np.empty((5, COUNT)), np.empty((5, COUNT + 1)), np.empty(COUNT)
    field = np.empty((8, COLUMNS))
    count, base, left, u = 0, 0.0, 0.0, -v
    met, passed = changes.size - 1, breaks.size - 1
    whole = fabs(end - turn)
    for _ in range(MOST_TRIES):
        here, graded = turn + u * left, flags[2] == 0 and base == 0.0
        while met >= 0 and u * (changes[met] - here) <= 0.0:
            met, nu = met - 1, -nu
        while passed >= 0 and u * (breaks[passed] - here) <= 0.0:
            passed -= 1
        right = whole
        if met >= 0:
            right = min(right, u * (changes[met] - turn))
        if passed >= 0:
            right = min(right, u * (breaks[passed] - turn))
        width, step, _, _ = next_panel(
            drive, p, flags, here, left, u, right - left, step, base, v, nu, rows, line, values
        )
        if width == 0.0:
            break
        stop = right if width == right - left else left + width
        if level and count == 0:
            coefficients(line[2], values)
            least = chebyshev_sum(values, -1.0)
            for j in range(COUNT):
                line[2, j] = (line[2, j] - least) / (width * (SHARES[j] * SHARES[j] if graded else SHARES[j]))
        field = enter(field, count, left, stop, -width if graded else width, base, line[2], rows[0])
        count += 1
        base, left = line[1, COUNT], stop
        if left >= whole:
            break
    return field[:count].copy()
