"""The panels of a leg: as wide as V**2, the forces and the pace of time on them can be resolved."""

from math import fabs, inf

from gqm_sym.runtime.compiled.intrinsics import bits, from_bits
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.legs.leg_breaks import offset
from gqm_sym.runtime.legs.leg_equation import (
    BARE,
    DS,
    FORCE,
    KAPPA,
    LOAD,
    MEAN,
    N0,
    PACE,
    PLACE,
    PULL,
    SERIES,
    SIZES,
    TAILS,
    D,
    P,
    W,
    as_bare,
    begin_panel,
    distance,
    pace,
    product,
    push,
    push_sizes,
    solve_panel,
)
from gqm_sym.runtime.legs.leg_record import change_at, last_of
from gqm_sym.runtime.legs.polynomials import (
    COUNT,
    LEBESGUE,
    WIDE,
    extent,
    first_change,
    size_of,
    to_coefficients,
    to_tails,
)

# Last coefficients against the largest: noise in them is about 1e-16.
TAIL = 4e-16

# Coefficients that have stopped falling below this level are rounding noise, not structure.
PLATEAU = 1e-9

# Last coefficients of N against the largest where it has one sign at all nodes, for its changes of sign are decided to
# no more than that (`legs.TOUCHED`); and where the polynomial is far from nothing throughout.
ONE_SIGN, CLEAR = 1e-14, 1e-7

# What may be left of a function where all of it cancels, as a share of its parts.
NOISE = 1e-15

# A width of a few units in the last place of the parameter.
NARROW = 1e-15

# Coefficients that fall by this factor a degree reach TAIL with the last ones but one; those in the middle are as many
# degrees from the first.
FALL, DEGREES = 5.4, 15

# Bits of 1.0, and what x**(-1/DEGREES) would have if logarithms were straight lines between powers of two.
ONE = 0x3FF0000000000000
STRAIGHT = ONE + ONE // DEGREES

# By what coefficients of time are then larger than those of all else.
TURNING = 10.0

# How far, in half widths from the middle of a panel, what is not smooth may be for coefficients to fall so.
REACH = 0.5 * (FALL + 1.0 / FALL)

# A panel is made this much narrower than it would seem to be allowed to be, and at most that many times wider.
CAUTION, GROWTH = 0.9, 4.0

# V**2 at a panel's end against the largest so far from which on time is resolved: below, a turn is expected, and time
# is counted from there.
HIGH = 0.25

# A part this small of a panel on which V**2 is resolved tells noise from structure.
SLIVER = 2.0**-20

# Panels that are tried in a row along a leg.
MOST_TRIES = 20000

# Whether time is to be resolved.
NEVER, MAYBE, ALWAYS = range(3)


@Inlined
def size_at(row):  # type: ignore[no-untyped-def]
    """Where the size is kept that a row's coefficients are held against."""
    return SIZES + row // WIDE


@Inner
def weigh(base, bare, work):  # type: ignore[no-untyped-def]
    """What the coefficients of each function but the pace are held against; the largest V**2 on the panel.

    The panel begins with V**2 = ``base``, which is ``bare`` in the units of BARE.
    """
    push_sizes(work, MEAN, DS, N0, KAPPA, W)
    highest, pull = max(base, extent(work, W)[1]), size_of(work, PULL)
    width = work[PLACE + COUNT]
    work[size_at(DS)] = size_of(work, DS)
    work[size_at(FORCE)] = max(size_of(work, FORCE), pull * highest * width / work[D + COUNT])
    work[size_at(PULL)] = max(pull, 1.0 / width)
    work[size_at(BARE)] = max(size_of(work, BARE), bare)
    work[size_at(LOAD)] = extent(work, MEAN)[1]
    return highest


@Inner
def falls(work, row, size):  # type: ignore[no-untyped-def]
    """The size of a function's last coefficients and of some in the middle, and whether it is resolved."""
    to_tails(work, row, work, TAILS)
    tail, level = last_of(work), max(fabs(work[TAILS + 3]), max(fabs(work[TAILS + 4]), fabs(work[TAILS + 5])))
    return tail, level, tail <= TAIL * size or (level <= PLATEAU * size and tail >= 0.05 * level)


@Inner
def resolved(work, first, last):  # type: ignore[no-untyped-def]
    """Whether the functions from ``first`` to before ``last`` are resolved, and how large coefficients in their middle
    are, against the largest.
    """
    fine, worst = True, 0.0
    for row in range(first, last, WIDE):
        size = work[size_at(row)]
        tail, level, ok = falls(work, row, size)
        if not (tail < inf and level < inf):
            return False, inf
        if size > 0.0:
            worst = max(worst, level / size)
        fine = fine and ok
    return fine, worst


@Inner
def rate(worst):  # type: ignore[no-untyped-def]
    """By what coefficients fall a degree, to a few per cent, if ``worst`` is the size of those in the middle."""
    return from_bits(STRAIGHT - bits(worst) // DEGREES)


@Inner
def growth(worst):  # type: ignore[no-untyped-def]
    """By what a panel's width may be multiplied: coefficients are powers of the distance of what is not smooth."""
    return min(CAUTION / FALL * rate(worst), GROWTH) if worst < inf else 0.5


@Inner
def ahead(worst, side):  # type: ignore[no-untyped-def]
    """The same where what is not smooth lies ahead, as for time a turn: for the panel once more, or for the next.

    ``side`` is 1 for the panel itself, -1 for that which begins at its end. Coefficients fall as on an ellipse through
    what is ahead.
    """
    if not worst < inf:
        return 0.5
    fall = rate(worst)
    return min(CAUTION * (0.5 * (fall + 1.0 / fall) + side) / (REACH + 1.0), GROWTH)


@Inner
def narrower(width, factor):  # type: ignore[no-untyped-def]
    """The width to try next."""
    return width * max(min(factor, 0.9), 0.2)


@Inner
def keeps_sign(work, row, noise):  # type: ignore[no-untyped-def]
    """Whether values of a function are so far from nothing that the polynomial through them changes sign nowhere."""
    low, high = extent(work, row)
    return fabs(0.5 * (low + high)) > 0.5 * LEBESGUE * (high - low) + noise


@Inner
def told(work):  # type: ignore[no-untyped-def]
    """Whether N is resolved as far as its changes of sign on a panel ask for, and how large its coefficients are."""
    size = work[size_at(LOAD)]
    tail, level, fine = falls(work, LOAD, size)
    if not (tail < inf and level < inf):
        return False, inf
    if not fine:
        low, high = extent(work, LOAD)
        same = low * high > 0.0 and low * work[LOAD + COUNT] > 0.0
        fine = (same and tail <= ONE_SIGN * size) or (
            tail <= CLEAR * size and keeps_sign(work, LOAD, 4.0 * CLEAR * size)
        )
    return fine, 0.0 if fine else level / size


@Inner
def change_of(work, row, sign, noise):  # type: ignore[no-untyped-def]
    """`first_change` of a function by its values; its coefficients are found only where values leave a doubt."""
    if keeps_sign(work, row, noise):
        found = 1 if work[row] > 0.0 else -1
        if sign == 0 or found == sign:
            return 2.0, found, 2.0
    to_coefficients(work, row, work, SERIES)
    return first_change(work[SERIES : SERIES + COUNT], sign, noise)


@Inner
def to_kink(work):  # type: ignore[no-untyped-def]
    """The place x up to which the curvature keeps its sign: 2 if throughout, -1 if that is not resolved.

    The sign is that of ds kappa, which is smooth at cusps too.
    """
    product(work, LOAD, DS, KAPPA)
    size = size_of(work, LOAD)
    if not falls(work, LOAD, size)[2]:
        return -1.0
    return change_of(work, LOAD, 0, NOISE * size)[0]


@Inner
def next_panel(  # type: ignore[no-untyped-def]
    drive,
    p,
    flags,
    origin,
    span,
    u,
    g,
    c,
    left,
    room,
    step,
    base,
    v,
    nu,
    ceiling,
    ask,
    watch,
    work,
):
    """The widest panel that can be resolved, no wider than ``room`` and ``step``; on the piece within ``span``.

    Time on it is resolved too: where ``ask`` is ALWAYS; never where it is NEVER; where it is MAYBE, unless V**2 falls
    below a part of the largest so far, ``ceiling``. N is resolved as well as its changes of sign ask for, and not at
    all unless ``watch`` is set.

    Returns
    -------
    width : float
        In the march variable; 0 if none is wide enough to be one.
    step : float
        To go on with.
    timed : bool
        Whether time is resolved.
    """
    width, kink, widest = min(step, room), False, 0.0
    gone, near = distance(left, g, c), 2.0 * g * left + c
    here = origin[0] + u * gone
    for _ in range(2100):
        run = width * (near + g * width)
        # As narrow as its room, a panel may be narrower than places in doubles: distances on it keep their digits.
        if (run <= NARROW * max(fabs(here), gone) and width < room) or run < 1e-300:
            return 0.0, step, False
        begin_panel(drive, p, flags[2], origin, span, u, g, c, left, width, base, v, nu, work)
        untold, worst = P, 0.0
        if not flags[1] and flags[2]:  # most that is too wide is told from the curve alone
            work[size_at(DS)], work[size_at(PULL)] = size_of(work, DS), max(size_of(work, PULL), 1.0 / width)
            fine, worst = resolved(work, PULL, P)
            if not fine:
                width = narrower(width, growth(worst))
                continue
            untold = PULL
        far = solve_panel(drive, p, flags[2], u, g, c, left, base, v, nu, work)
        if flags[1] and not kink and (far < inf or flags[2]):
            x = to_kink(work)
            kinked = width * (0.5 * (1.0 + x) if x > -1.0 else 0.5)
            # A run that begins at a kink may begin a rounding before it.
            if x <= 1.0 and kinked * (near + g * kinked) > NARROW * max(fabs(here), gone):
                width, kink = kinked, x > -1.0
                continue
            push(work, LOAD, DS, N0, KAPPA, W)
        if not far < inf:
            width, kink = 0.5 * width, False
            continue
        highest = weigh(base, as_bare(base, g, c, left), work)
        fine, more = resolved(work, BARE, untold)
        worst = max(worst, more)
        if watch:
            enough, more = told(work)
            fine, worst = fine and enough, max(worst, more)
        factor = growth(worst)
        if fine:
            widest = max(widest, width)
            top, end = max(ceiling, highest), work[W + COUNT]
            needed = ask == ALWAYS or (ask == MAYBE and (end >= HIGH * top or base < HIGH * top))
            timed, more = False, 0.0
            if ask != NEVER:
                pace(g, c, left, base, work)
                work[size_at(PACE)] = size_of(work, PACE)
                timed, more = resolved(work, PACE, LOAD)
            # On so small a part of what is smooth it is noise that is not resolved; the error says so.
            timed = timed or (needed and width <= SLIVER * widest and work[TAILS] < inf)
            # Where time alone asks for narrow panels while V**2 falls, it is for a turn.
            turning = end < base and more > TURNING * worst
            if timed:
                factor = min(factor, ahead(more, -1.0) if turning else growth(more))
            if timed or not needed:
                step = max(step, width * factor) if kink or width == room else width * factor
                return width, step, timed
            factor = ahead(more, 1.0) if turning else growth(more)
        width, kink = narrower(width, factor), False
    return 0.0, step, False


@Inner
def next_stop(origin, u, gone, whole, record, breaks, met, passed, nu):  # type: ignore[no-untyped-def]
    """On the way back: the distance at which the next panel must end, and what has been passed.

    ``met`` and ``passed`` are the last changes of N's sign ``nu`` and the last breaks that are still to come.
    """
    stop = whole
    # By distances, for what has been run to is as far as it was said to be: a place may be a rounding farther.
    while met >= 0 and offset(record[change_at(record, met)], origin, u) <= gone:
        met, nu = met - 1, -nu
    while passed >= 0 and offset(breaks[passed], origin, u) <= gone:
        passed -= 1
    if met >= 0:
        stop = min(stop, offset(record[change_at(record, met)], origin, u))
    if passed >= 0:
        stop = min(stop, offset(breaks[passed], origin, u))
    return stop, met, passed, nu
