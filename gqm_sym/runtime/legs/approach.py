"""The leg that tends to an equilibrium, followed back from there: V**2 near the equilibrium as a field of polynomials.

A row of the field has COLUMNS numbers: the distances from the equilibrium between which it holds, and the Chebyshev
coefficients of V**2/d**2 and of ds/dlam there (`quadrature.equilibrium` reads them).
"""

from math import fabs

from gqm_sym.runtime.arithmetic.clenshaw import chebyshev_sum
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.leg_breaks import span_before
from gqm_sym.runtime.legs.leg_equation import DS, OFFSET, SERIES, W_FACTOR, March, Panel, W, panel_buffer, set_nodes
from gqm_sym.runtime.legs.leg_panels import MAX_PANELS, NEVER, PanelRequest, next_panel, next_stop
from gqm_sym.runtime.legs.leg_record import has_space
from gqm_sym.runtime.legs.polynomials import COUNT, to_coefficients

# The numbers of a row of the field.
COLUMNS = 2 + 2 * COUNT

# Why a leg was not followed back.
NO_SPACE, LOST = -1, -2


@Inner
def approach(forces, end, breaks, off, record, used):  # type: ignore[no-untyped-def]
    """Enter the field of a leg that tends to an equilibrium, followed back from there to the middle of its run.

    Parameters
    ----------
    forces : Forces
    end : leg_run.End
        How the leg ends.
    breaks, off
        As of `leg_run.run`.
    record, used
        The field is entered in the record after the numbers that are used already.

    Returns
    -------
    int
        The number of rows; NO_SPACE if the record has none for them, LOST if the leg could not be followed.
    """
    work = panel_buffer()
    set_nodes(work)
    march = March((end.place[0], 0.0), -forces.direction, 0.0, 1.0)
    count, v2, left, linear_part, step = 0, 0.0, 0.0, 0.0, end.step
    length = fabs(end.middle[0] - end.place[0])
    remaining = (end.change_count - 1, breaks.size - 1, end.contact_sign)
    for _ in range(MAX_PANELS):
        stop, remaining = next_stop(march, left, length, record, breaks, remaining)
        if stop <= left:
            break
        panel = Panel(left, v2, remaining[2], span_before(breaks, remaining[1] + 1, forces.direction, off))
        request = PanelRequest(stop - left, step, 0.0, NEVER, False)
        width, step, _timed = next_panel(forces, march, panel, request, work)
        if width == 0.0:
            break
        row, right = used + count * COLUMNS, stop if width == stop - left else left + width
        if not has_space(record, row, end.change_count):
            return NO_SPACE
        record[row], record[row + 1] = left, right
        if count == 0:
            # V**2/d vanishes at the equilibrium, as the force does; what rounding leaves of it there is subtracted.
            to_coefficients(work, W_FACTOR, work, SERIES)
            linear_part = chebyshev_sum(work[SERIES : SERIES + COUNT], -1.0)
        for j in range(COUNT):
            d = left + work[OFFSET + j]
            work[W_FACTOR + j] = (work[W_FACTOR + j] - linear_part) / d if count == 0 else work[W + j] / (d * d)
        for begin, values in ((2, W_FACTOR), (2 + COUNT, DS)):
            to_coefficients(work, values, work, SERIES)
            for k in range(COUNT):
                record[row + begin + k] = work[SERIES + k]
        count, v2, left = count + 1, work[W + COUNT], right
    return count if left >= length else LOST
