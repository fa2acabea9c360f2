"""A leg from turn to turn as one polynomial, if that has enough terms.

V**2 is smooth along a leg; only its square root is not. With the width h of the leg and the share y of it that lies
behind the body, ``W = h y (1 - y) C`` with a smooth C > 0. With ``y = sin(phi/2)**2`` the time is the integral of ``f =
ds sqrt(h/C)`` over phi, which Gauss-Chebyshev quadrature gives from the nodes. C is computed from running means of
exp(q) P (`panels.equation`) from the nearer turn, so that nothing is subtracted. The width is that for which the mean
over the whole leg vanishes; Newton's method finds it.
"""

from math import fabs, fsum, pi, sin, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.arithmetic.matrices import multiply
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import over_rows
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.legs.leg_record import (
    COLUMNS,
    HEAD,
    NORMAL_LOAD,
    PANELS,
    PASSAGE,
    RIGHT,
    TIME,
    TIME_ERROR,
    WHOLE,
    Y_ROW,
    has_space,
)
from gqm_sym.runtime.legs.panels.breaks import CLEARANCE_SHARE, located, offset, span_before, within
from gqm_sym.runtime.legs.panels.equation import (
    ARC_RATE,
    DS,
    EXPM1_Q,
    FORCE,
    KAPPA,
    LOAD,
    MEAN,
    N0,
    NODES,
    OFFSET,
    SPEED,
    TAILS,
    TIME_RATE,
    W_FACTOR,
    March,
    P,
    Panel,
    W,
    begin_panel,
    copy,
    damped_row,
    fill_force,
    linear_row,
    load_per_mass_row,
    load_row,
    panel_buffer,
    set_nodes,
    time_rate_row,
)
from gqm_sym.runtime.legs.panels.point import ZERO_TOLERANCE, point_buffer, sign_of_load
from gqm_sym.runtime.legs.panels.polynomials import BITS, COUNT, MEANS, SHARES, TO_COEFFICIENTS, WIDE, size_of, to_means
from gqm_sym.runtime.legs.panels.resolution import (
    CANCELLATION_NOISE,
    are_resolved,
    examine,
    first_change_of,
    is_load_resolved,
    kink,
    set_sizes,
    size_at,
    tail_of,
)
from gqm_sym.runtime.legs.runs.ends import END_NONE, END_TURN, End

# The first width to try if none is known, in units of the first panel's width.
FIRST_WIDTH = 2.0

# The largest number of widths that are tried for a leg.
MAX_TRIES = 12

# The largest step of Newton's method as a share of the width; a turn farther away is searched for among the nodes.
MAX_STEP = 0.125

# After a step this short the next one would be rounding only.
LAST_STEP = 1e-3

# If the step itself changes by this little, the next one would be about its square.
LAST_CHANGE = 1e-9

# The smallest and the largest factor by which the width grows if no turn is found on it.
MIN_GROWTH, MAX_GROWTH = 1.05, 4.0

# The rounding error of a mean in units in the last place of its largest term.
MEAN_ROUNDINGS = 4.0

# The number of terms of the Taylor series at a leg's end.
TERMS = 6


def _end_terms() -> Array:
    """Return the matrix that gives the Taylor series, at the leg's end, of the integral from its start, in units of its
    width.
    """
    k = np.arange(COUNT, dtype=np.float64)
    slope, columns = np.ones(COUNT), [MEANS[COUNT]]
    for m in range(1, TERMS):
        columns.append(slope @ TO_COEFFICIENTS / m)
        # T_k has the m-th derivative prod (k**2 - i**2)/(2 i + 1) at 1; a share of the leg is half of x.
        slope = slope * (k * k - (m - 1) ** 2) / (2 * m - 1) * 2.0 / m
    return np.array(columns).T


def _factors() -> Array:
    """Return the matrix that gives C exp(q) from the means between each node and the nearer turn."""
    half = COUNT // 2 + 1
    near = MEANS[:half] / (1.0 - SHARES[:half, None])
    return np.vstack([near, -near[COUNT - half - 1 :: -1, ::-1]]).T


def _half_times() -> Array:
    """Return the matrix that gives the times from the start to the middle, and from there to the end, from the values
    of f.
    """
    k = np.arange(1, COUNT)
    terms = np.append(0.5 * pi, [(-1.0) ** j * round(sin(0.5 * pi * j)) / j for j in k])
    first = terms @ TO_COEFFICIENTS
    return np.array([first, first[::-1]]).T


def _to_part(begin: float, end: float) -> Array:
    """Return the matrix that gives a function's values at the nodes of a panel on the half from the start to the
    middle.

    There the march variable is the root of the distance; the panel lies between two shares of its value in the middle.
    """
    one, rows = 1 << BITS, []
    for share in SHARES.tolist():
        top, bottom = (begin + (end - begin) * share).as_integer_ratio()
        x = one // (bottom * bottom) * (top * top) - one
        values = [one, x]
        for _ in range(COUNT - 2):
            values.append(2 * x * values[-1] // one - values[-2])
        terms = [value / one for value in values]
        rows.append([fsum(t * c for t, c in zip(terms, column, strict=True)) for column in TO_COEFFICIENTS.T])
    return np.array(rows).T


# Time on half a leg is not smooth at the other turn, and takes two panels. They meet at this share of the march
# variable in the middle.
JOINT = 0.625
TURN_PART, MIDDLE_PART = _to_part(0.0, JOINT), _to_part(JOINT, 1.0)
to_end_terms, to_factors, to_half_times = multiply(_end_terms()), multiply(_factors()), multiply(_half_times())
to_turn_part, to_middle_part = multiply(TURN_PART), multiply(MIDDLE_PART)
# Beyond the middle, distances are counted from the end.
from_turn_part, from_middle_part = multiply(TURN_PART[::-1]), multiply(MIDDLE_PART[::-1])

v2_row = over_rows(lambda factor, y, h: factor * (h * (y - y * y)), WIDE)
whole_time_row = over_rows(lambda ds, factor, h: ds * np.sqrt(h / factor), WIDE)
# Y at the share s of the value that the march variable has in the middle.
part_speed_row = over_rows(lambda factor, s: np.sqrt(factor - 0.5 * factor * (s * s)), WIDE)
part_arc_row = over_rows(lambda ds, s, slope: ds * (s * slope), WIDE)


@Inner
def step_to_turn(work):  # type: ignore[no-untyped-def]
    """Return the step to the zero of V**2 by its Taylor series at the end, as a share of the width."""
    a, b, c, d, e, f = (
        work[TAILS],
        work[TAILS + 1],
        work[TAILS + 2],
        work[TAILS + 3],
        work[TAILS + 4],
        work[TAILS + 5],
    )
    s = -a / b
    for _ in range(3):
        value = a + s * (b + s * (c + s * (d + s * (e + s * f))))
        slope = b + s * (2.0 * c + s * (3.0 * d + s * (4.0 * e + s * (5.0 * f))))
        change = value / slope
        s -= change
        if fabs(change) <= LAST_CHANGE:
            break
    return s


@Inner
def factor_to_turn(work):  # type: ignore[no-untyped-def]
    """Return an estimate of the factor by which the width must change if the turn is not near; NaN if there is none."""
    to_means(work, FORCE, work, MEAN)
    for j in range(COUNT + 1):
        mean = work[MEAN + j]
        if not mean > 0.0:
            if j == 0:
                return np.nan
            before, y = work[MEAN + j - 1], work[NODES + j - 1]
            return y + (work[NODES + j] - y) * before / (before - mean)
    first, last = work[FORCE], work[TAILS + 1]
    # If the force were linear, the turn would be twice as far away as the zero of the force.
    factor = 2.0 * first / (first - last) if last < first else MAX_GROWTH
    return min(max(factor, MIN_GROWTH), MAX_GROWTH)


@Inner
def width_of_leg(forces, march, panel, room, width, work):  # type: ignore[no-untyped-def]
    """Return the width of a leg, which is about ``width`` and at most ``room``, and fill FORCE and EXPM1_Q; return 0 if
    it is not found.
    """
    h, last = min(width, room), np.inf
    for _ in range(MAX_TRIES):
        begin_panel(forces, march, panel, h, work)
        if not fill_force(march, work) < np.inf:
            return 0.0
        to_end_terms(work, FORCE, work, TAILS)
        factor = 0.0
        if work[TAILS + 1] < 0.0:
            step = step_to_turn(work)
            rounding = ULP * (MEAN_ROUNDINGS + fabs(march.origin[0]) / h)
            if last <= LAST_STEP and fabs(step * work[TAILS + 1]) <= rounding * size_of(work, FORCE):
                return h
            last = fabs(step)
            factor = 1.0 + step if fabs(step) <= MAX_STEP else 0.0
        if factor == 0.0:
            factor = factor_to_turn(work)
        if not factor > 0.0 or (h == room and factor > 1.0):
            return 0.0
        h = min(h * factor, room)
    return 0.0


@Inner
def is_whole(forces, panel, h, work):  # type: ignore[no-untyped-def]
    """Fill the other rows; return whether all are resolved and whether V**2 and N each have one sign on the leg."""
    to_factors(work, FORCE, work, W_FACTOR)
    damped_row(work, W_FACTOR, W_FACTOR, EXPM1_Q)
    v2_row(work, W, W_FACTOR, NODES, h)
    if forces.kinked and not kink(work) > 1.0:
        return False
    load_row(work, LOAD, DS, N0, KAPPA, W)
    set_sizes(0.0, 0.0, work)
    if not (are_resolved(work, W_FACTOR, P)[0] and is_load_resolved(work)[0]):
        return False
    turn, _, touch = first_change_of(work, W_FACTOR, 1, CANCELLATION_NOISE * size_of(work, FORCE))
    change, _, _ = first_change_of(work, LOAD, panel.contact_sign, ZERO_TOLERANCE * work[size_at(LOAD)])
    if min(turn, touch, change) <= 1.0:
        return False
    whole_time_row(work, TIME_RATE, DS, W_FACTOR, h)
    work[size_at(TIME_RATE)] = size_of(work, TIME_RATE)
    return are_resolved(work, TIME_RATE, LOAD)[0]


@Inner
def enter_part(record, at, begin, end, w, work):  # type: ignore[no-untyped-def]
    """Write a part of a leg into the record as one panel, whose factor and ds are in SPEED and ARC_RATE.

    The panel lies between two shares of ``w``, the march variable in the middle. The function returns whether time on
    it is resolved.
    """
    width = (end - begin) * w
    linear_row(work, OFFSET, NODES, begin, end - begin)
    part_speed_row(work, SPEED, SPEED, OFFSET)
    time_rate_row(work, TIME_RATE, ARC_RATE, SPEED, 2.0)
    part_arc_row(work, ARC_RATE, ARC_RATE, OFFSET, 2.0 * w)
    fine = examine(work, TIME_RATE, size_of(work, TIME_RATE))[2]
    copy(record, at, work, TIME_RATE)
    copy(record, at + WIDE, work, ARC_RATE)
    copy(record, at + Y_ROW, work, SPEED)
    record[at + RIGHT] = end * w
    record[at + TIME], record[at + TIME_ERROR] = width * work[TAILS + 6], width * tail_of(work)
    return fine


@Inner
def enter_parts(record, h, work):  # type: ignore[no-untyped-def]
    """Write a leg into the record as two panels from each of its ends; return whether time is resolved on them."""
    w, at = sqrt(0.5 * h), HEAD
    load_per_mass_row(work, MEAN, N0, KAPPA, W)
    to_turn_part(work, W_FACTOR, work, SPEED)
    to_turn_part(work, DS, work, ARC_RATE)
    to_turn_part(work, MEAN, record, at + NORMAL_LOAD)
    fine = enter_part(record, at, 0.0, JOINT, w, work)
    at += COLUMNS
    to_middle_part(work, W_FACTOR, work, SPEED)
    to_middle_part(work, DS, work, ARC_RATE)
    to_middle_part(work, MEAN, record, at + NORMAL_LOAD)
    fine = enter_part(record, at, JOINT, 1.0, w, work) and fine
    at += COLUMNS
    from_turn_part(work, W_FACTOR, work, SPEED)
    from_turn_part(work, DS, work, ARC_RATE)
    from_turn_part(work, MEAN, record, at + NORMAL_LOAD)
    fine = enter_part(record, at, 0.0, JOINT, w, work) and fine
    at += COLUMNS
    from_middle_part(work, W_FACTOR, work, SPEED)
    from_middle_part(work, DS, work, ARC_RATE)
    from_middle_part(work, MEAN, record, at + NORMAL_LOAD)
    return enter_part(record, at, JOINT, 1.0, w, work) and fine


@Inner
def enter_time(record, begin, time, is_read):  # type: ignore[no-untyped-def]
    """Set the time on the panels of half a leg, the first of which is at ``begin`` in the record."""
    first = record[begin + TIME] if is_read else 0.0
    record[begin + TIME], record[begin + COLUMNS + TIME] = first, time - first


@Inner
def is_read(route, origin, v, h, time):  # type: ignore[no-untyped-def]
    """Return whether data that require panels are read from a leg of the width ``h``."""
    reads = route.reading.what
    if reads == PASSAGE:
        return 0.0 <= offset(route.target, origin, v) <= h * (1.0 + CLEARANCE_SHARE)
    return reads == PANELS or time > route.until


@Inner
def enter_rows(record, work):  # type: ignore[no-untyped-def]
    """Write a leg into the record as one row each of V**2 and N."""
    load_per_mass_row(work, MEAN, N0, KAPPA, W)
    copy(record, HEAD + NORMAL_LOAD, work, MEAN)
    copy(record, HEAD + Y_ROW, work, W)
    record[WHOLE] = 1.0


@Inner
def run_whole(forces, start, route, off, record):  # type: ignore[no-untyped-def]
    """Follow the body from one turn to the next, if that takes one polynomial only.

    The parameters are those of `runs.run.run`.

    Returns
    -------
    End
        Its code is END_NONE if the leg must be followed panel by panel.
    """
    breaks, origin, v, upcoming = route.breaks, (start.place, start.place_low), start.direction, 0
    while upcoming < breaks.size and offset(breaks[upcoming], origin, v) <= 0.0:
        upcoming += 1
    room = offset(route.limit if upcoming == breaks.size else breaks[upcoming], origin, v)
    march, span, nu = March(origin, v, 0.0, 1.0), span_before(breaks, upcoming, v, off), start.contact_sign
    what, middle, h = END_NONE, origin, 0.0
    if nu == 0:
        nu = sign_of_load(forces, within(start.place, span), 0.0, point_buffer())
    if nu != 0 and nu != -route.only_sign and has_space(record, HEAD + 3 * COLUMNS, 0):
        work = panel_buffer()
        set_nodes(work)
        panel = Panel(0.0, 0.0, nu, span)
        width = start.width if start.width > 0.0 else FIRST_WIDTH * start.step
        h = width_of_leg(forces, march, panel, room, width, work)
        if h > 0.0 and is_whole(forces, panel, h, work):
            to_half_times(work, TIME_RATE, work, TAILS)
            first, second = work[TAILS], work[TAILS + 1]
            has_panels = is_read(route, origin, v, h, first + second)
            if not has_panels:
                enter_rows(record, work)
            if not has_panels or enter_parts(record, h, work):
                what, middle = END_TURN, located(origin, v, 0.5 * h, breaks, upcoming)
                enter_time(record, HEAD, first, has_panels)
                enter_time(record, HEAD + 2 * COLUMNS, second, has_panels)
    place = located(origin, v, h, breaks, upcoming)
    return End(what, place, 0.0, nu, 0.5 * h, 0.0, middle, 0.0, 0, 2, upcoming)
