"""The record of a leg: one line of numbers that compiled code fills and Python reads when somebody asks.

At its beginning stands what the leg is known by; behind that its panels from the start, and what was followed back from
its end: panels from a turn, or a field from an equilibrium (`fields`); at its end, backwards, the places at which N
changes sign.
"""

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.compiled.registers import copied
from gqm_sym.runtime.legs.leg_equation import ARC, PACE, SPEED, TAILS
from gqm_sym.runtime.legs.polynomials import COUNT, WIDE, to_tails

# Where the leg ends and up to where time is counted from the start, each as two doubles; c/2 of the march variable,
# infinite where it is the distance itself; the times from the start and from the turn; how often N changes sign.
END, END_LOW, MIDDLE, MIDDLE_LOW, SLACK, BEFORE, AFTER, MET, HEAD = range(9)

# A panel: at its nodes the pace of time, that of arc length, and Y; behind each of them one of where the panel ends,
# its time, and what that may be off by.
COLUMNS = 3 * WIDE
RIGHT, TIME, ERROR = range(COUNT, COLUMNS, WIDE)
copy = copied(WIDE)


@Inlined
def has_room(record, used, met):  # type: ignore[no-untyped-def]
    """Whether there is room for a panel, and for one more change of sign."""
    return used + COLUMNS + met < record.size


@Inlined
def change_at(record, k):  # type: ignore[no-untyped-def]
    """Where in a record a change of N's sign stands."""
    return record.size - 1 - k


@Inlined
def last_of(work):  # type: ignore[no-untyped-def]
    """The largest of the last coefficients of the function that was looked at before."""
    return max(abs(work[TAILS]), max(abs(work[TAILS + 1]), abs(work[TAILS + 2])))


@Inner
def keep(record, at, right, width, work):  # type: ignore[no-untyped-def]
    """Enter a panel that ends at w = ``right``, from ``at`` on."""
    to_tails(work, PACE, work, TAILS)
    copy(record, at, work, PACE)
    copy(record, at + WIDE, work, ARC)
    copy(record, at + 2 * WIDE, work, SPEED)
    record[at + RIGHT], record[at + TIME], record[at + ERROR] = right, width * work[TAILS + 6], width * last_of(work)


@Inner
def total(record, begin, count):  # type: ignore[no-untyped-def]
    """The time of panels that stand from ``begin`` on."""
    high, low = 0.0, 0.0
    for k in range(count):
        high, rest = two_sum(high, record[begin + k * COLUMNS + TIME])
        low += rest
    return high + low
