"""The leg that tends to an equilibrium, followed back from there: the field of V**2 next to it (`fields`)."""

from math import fabs

from gqm_sym.runtime.arithmetic.clenshaw import chebyshev_sum
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.leg_breaks import between
from gqm_sym.runtime.legs.leg_equation import BARE, DS, PLACE, SERIES, panel_room, set_nodes
from gqm_sym.runtime.legs.leg_equation import W as V2
from gqm_sym.runtime.legs.leg_panels import MOST_TRIES, NEVER, next_panel, next_stop
from gqm_sym.runtime.legs.leg_record import has_room
from gqm_sym.runtime.legs.polynomials import COUNT, to_coefficients

# Of a field.
COLUMNS = 2 + 2 * COUNT

# Why a leg was not followed back.
NO_ROOM, LOST = -1, -2


@Inner
def approach(drive, p, flags, top, end, v, nu, met, breaks, off, step, record, used):  # type: ignore[no-untyped-def]
    """The field of the leg that tends to the equilibrium ``top``, followed back from there to ``end``.

    ``nu`` is the sign of N at the equilibrium, which has changed ``met`` times on the way. The field is entered behind
    what is ``used`` of a record (`leg_records`). Returns how many rows it has; NO_ROOM where there is none, LOST where
    it could not be followed. ``off`` is as `leg_breaks.between` has it.
    """
    work = panel_room()
    set_nodes(work)
    count, base, left, least, u, whole, origin = 0, 0.0, 0.0, 0.0, -v, fabs(end - top), (top, 0.0)
    coming, passed = met - 1, breaks.size - 1
    for _ in range(MOST_TRIES):
        stop, coming, passed, nu = next_stop(origin, u, left, whole, record, breaks, coming, passed, nu)
        if stop <= left:
            break
        span = between(breaks, passed + 1, v, off)
        width, step, _ = next_panel(
            *(drive, p, flags, origin, span, u, 0.0, 1.0, left, stop - left, step, base, v, nu, 0.0, NEVER, False, work)
        )
        if width == 0.0:
            break
        row, right = used + count * COLUMNS, stop if width == stop - left else left + width
        if not has_room(record, row, met):
            return NO_ROOM
        record[row], record[row + 1] = left, right
        if count == 0:
            # V**2 over d vanishes at the equilibrium, as the force does.
            to_coefficients(work, BARE, work, SERIES)
            least = chebyshev_sum(work[SERIES : SERIES + COUNT], -1.0)
        for j in range(COUNT):
            d = left + work[PLACE + j]
            work[BARE + j] = (work[BARE + j] - least) / d if count == 0 else work[V2 + j] / (d * d)
        for begin, values in ((2, BARE), (2 + COUNT, DS)):
            to_coefficients(work, values, work, SERIES)
            for k in range(COUNT):
                record[row + begin + k] = work[SERIES + k]
        count, base, left = count + 1, work[V2 + COUNT], right
    return count if left >= whole else LOST
