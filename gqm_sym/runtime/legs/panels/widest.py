"""The widest panel from a given place on which polynomials resolve V**2, the forces and the time rate."""

from math import fabs, inf, nan, sqrt
from typing import NamedTuple

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.panels.breaks import within
from gqm_sym.runtime.legs.panels.equation import (
    DS,
    KAPPA,
    LOAD,
    MEAN,
    N0,
    Q_RATE,
    TAILS,
    TIME_RATE,
    W_FACTOR,
    P,
    W,
    as_factor,
    distance,
    fill_length,
    fill_rates,
    load_per_mass_row,
    load_row,
    product,
    slope_at,
)
from gqm_sym.runtime.legs.panels.point import point_buffer, slope_of_v2
from gqm_sym.runtime.legs.panels.polynomials import COUNT, SHARES, size_of
from gqm_sym.runtime.legs.panels.resolution import (
    CANCELLATION_NOISE,
    are_resolved,
    examine,
    first_jump,
    fits,
    growth,
    growth_towards,
    is_curve_resolved,
    is_load_resolved,
    kink,
    narrower,
    set_sizes,
    size_at,
)
from gqm_sym.runtime.legs.panels.solving import begin_panel, may_jump, solve_panel

# A panel that begins before a kink is by this factor wider than the part in which the kink is known to lie; and by how
# much the panel behind one on which friction is constant may be wider.
ROOM_BEHIND, GROWTH_BEHIND_KINK = 1.25, 1e6

# A width of a few units in the last place of the curve's parameter.
MIN_RELATIVE_WIDTH = 1e-15

# If the ratio of the time rate's coefficients to those of all other functions is above this, a turning point is taken
# to lie ahead.
TURNING_RATIO = 10.0

# The largest share of the last coefficients of the contact force, or of its square, if its extremes are read.
FORCE_TAIL = 2e-14

# The ratio of V**2 at a panel's end to the largest V**2 so far above which time is resolved. Below it a turn is
# expected, and time is counted from there.
HIGH_V2_RATIO = 0.25

# On a part of a panel shorter than this share of a panel on which V**2 is resolved, structure of the time rate can only
# be noise.
NOISE_WIDTH_RATIO = 2.0**-20

# The largest number of panels of a leg, and of widths that are tried for one.
MAX_PANELS, MAX_WIDTHS = 20000, 2100

# The distance from the outermost node of a panel to the panel's end, over the distance to the next node.
TO_END = float(SHARES[0] / (SHARES[1] - SHARES[0]))

# If ds/dlam changes by this factor or more on a panel, and by extrapolation would vanish within so many units in the
# last place of its start, it is taken to vanish there: narrower panels would step over that place, which rounding
# hides.
CUSP_RATIO, CUSP_UNITS = 1.5, 32.0

# At a cusp found as the zero of a polynomial, ds/dlam is at most this share of its values nearby.
CUSP_SHARE = 1e-7

# Codes that say whether time has to be resolved.
NEVER, MAYBE, ALWAYS = range(3)


class PanelRequest(NamedTuple):
    """The requirements on the next panel.

    Attributes
    ----------
    max_width : float
        The largest width, in the march variable.
    step : float
        The width to begin with.
    largest_v2 : float
        The largest V**2 on the leg so far, reduced by the resistance since then.
    timing : int
        ALWAYS if time must be resolved, NEVER if not; MAYBE if it must unless V**2 is below HIGH_V2_RATIO of the
        largest at both ends.
    resolve_load : bool
        Whether N must be resolved as far as its changes of sign require.
    resolve_force, resolve_length : bool
        Whether the contact force, or the square of its length, must be resolved, as its extremes require. The former
        holds without a test unless the body has a radius.
    """

    max_width: float
    step: float
    largest_v2: float
    timing: int
    resolve_load: bool
    resolve_force: bool
    resolve_length: bool


@Inner
def resolve_time(forces, march, panel, request, largest_v2, worst, is_tiny_part, work):  # type: ignore[no-untyped-def]
    """Decide whether a panel resolves time, and the contact force if that is read, as far as that is required.

    ``worst`` is the ratio of middle coefficients of the other functions. If the panel is a very small part of a smooth
    one (``is_tiny_part``), only noise is unresolved, which the error of the time includes.

    Returns
    -------
    done : bool
        Whether the panel meets the requirement.
    factor : float
        The factor by which the next panel may be wider, or to which this one must be reduced if it does not meet the
        requirement.
    timed : bool
        Whether they are resolved.
    """
    top, end, factor = max(request.largest_v2, largest_v2), work[W + COUNT], growth(worst)
    is_high = end >= HIGH_V2_RATIO * top or panel.v2 < HIGH_V2_RATIO * top
    needed = request.timing == ALWAYS or (request.timing == MAYBE and is_high)
    timed, ratio, of_force = False, 0.0, 0.0
    if request.timing != NEVER:
        fill_rates(march, panel, work)
        work[size_at(TIME_RATE)] = size_of(work, TIME_RATE)
        timed, ratio = are_resolved(work, TIME_RATE, LOAD)
        if timed and (request.resolve_length or (request.resolve_force and forces.has_radius)):
            timed, of_force = is_force_resolved(forces, march, panel, request.resolve_length, work)
    timed = timed or (needed and is_tiny_part and work[TAILS] < inf)
    # If only time needs narrow panels while V**2 decreases, there is a turn ahead.
    turning = end < panel.v2 and ratio > TURNING_RATIO * max(worst, of_force)
    if timed:
        factor = min(factor, growth_towards(ratio, -1.0) if turning else growth(max(ratio, of_force)))
    elif needed:
        factor = growth_towards(ratio, 1.0) if turning else growth(max(ratio, of_force))
    return timed or not needed, factor, timed


@Inner
def hides_cusp(forces, march, panel, work):  # type: ignore[no-untyped-def]
    """Return whether ds/dlam vanishes between an end of a panel and the node next to it, where there are no values to
    show it.

    Extrapolation from the nodes then gives a negative value at that end, of about the actual size.
    """
    last = DS + COUNT - 1
    at_end = work[last] + TO_END * (work[last] - work[last - 1])
    if at_end < 0.0 and work[DS + COUNT] > -0.5 * at_end:
        return True
    at_start = work[DS] + TO_END * (work[DS] - work[DS + 1])
    if at_start >= 0.0:
        return False
    return ds_at(forces, march, panel, distance(panel.left, march)) > -0.5 * at_start


@Inner
def ds_at(forces, march, panel, far):  # type: ignore[no-untyped-def]
    """Return ds/dlam at a distance from the origin of the march variable."""
    point = point_buffer()
    place = within(march.origin[0] + march.direction * far, panel.span)
    slope_of_v2(forces, place, panel.v2, panel.contact_sign, point)
    return point[2]


@Inner
def is_cusp(forces, march, panel, far, work):  # type: ignore[no-untyped-def]
    """Return whether ds/dlam vanishes at a place on a panel at which the curvature changes sign.

    The curve turns back on itself there, and no panel may end there, because the next one would begin beyond the end of
    the motion.
    """
    return ds_at(forces, march, panel, far) <= CUSP_SHARE * max(work[DS], work[DS + COUNT - 1])


@Inner
def is_at_cusp(length, unit, work):  # type: ignore[no-untyped-def]
    """Return whether ds/dlam vanishes next to the start of a panel of the given length; ``unit`` is a unit in the last
    place.
    """
    first, last = work[DS], work[DS + COUNT - 1]
    if last > first:  # by linear extrapolation it vanishes this far before the start
        return last > CUSP_RATIO * first and length * first <= CUSP_UNITS * unit * last
    return first > CUSP_RATIO * last and length <= CUSP_UNITS * unit


@Inner
def is_constant(work):  # type: ignore[no-untyped-def]
    """Return whether the force on a panel is constant."""
    same = True
    for j in range(COUNT):
        same = same and work[P + j] == work[P] and work[Q_RATE + j] == 0.0
    return same


@Inner
def are_all_resolved(forces, march, panel, request, last, work):  # type: ignore[no-untyped-def]
    """Return whether the rows from W_FACTOR to ``last`` are resolved, and the contact force as far as that is required;
    and the largest ratio of their middle coefficients to their sizes.
    """
    fine, worst = are_resolved(work, W_FACTOR, last)
    if request.resolve_load:
        load_fine, ratio = is_load_resolved(work)
        # Beside a zero of N the panel is so narrow that friction is constant, and a kink of |N| needs no resolution.
        if not load_fine and forces.friction and not forces.linear and is_constant(work):
            load_fine, ratio = True, 0.0
        fine, worst = fine and load_fine, max(worst, ratio)
    return fine, worst


@Inner
def is_force_resolved(forces, march, panel, is_length, work):  # type: ignore[no-untyped-def]
    """Return whether the contact force is resolved, and the ratio of its middle coefficients to its size.

    If its length is read, that is the square of it, and the rows N0 and KAPPA become the length and 0. In a rotating
    frame the length depends on V, as time does.
    """
    if is_length:
        fill_length(forces, march, panel, work)
        product(work, MEAN, N0, N0)
    else:
        load_per_mass_row(work, MEAN, N0, KAPPA, W)
    size = size_of(work, MEAN)
    tail, middle, fine = examine(work, MEAN, size)
    if tail <= FORCE_TAIL * size:
        return True, middle / size
    # Where 1 - kappa rho is small, rho being the radius, the contact force has the roundings of that.
    return fine and not is_length, CANCELLATION_NOISE if fine else middle / size


@Inner
def law_at_start(forces, march, panel):  # type: ignore[no-untyped-def]
    """Return the increase of V**2 with the distance at the start of panels where the derivative of the law with respect
    to V**2 may jump, and that derivative; otherwise NaN.
    """
    if not may_jump(forces, march):
        return nan, nan
    point = point_buffer()
    place = within(march.origin[0] + (march.direction * distance(panel.left, march) + march.origin[1]), panel.span)
    slope_of_v2(forces, place, panel.v2, panel.contact_sign, point)
    return march.direction * (point[3] - point[4] * panel.v2), point[4]


@Inner
def jump_on(before, work):  # type: ignore[no-untyped-def]
    """Return `first_jump` of the law on a panel, given the derivative at its start (`law_at_start`); 1 and 2 where it
    has no kinks, or is constant but for rounding.
    """
    return first_jump(before, work) if before == before and not is_constant(work) else (1.0, 2.0)


@Inner
def before_jump(jump, factor, width):  # type: ignore[no-untyped-def]
    """Return the width to try next where a panel is not resolved, and that to try on the panel behind it; the latter is
    0 if nothing is known of it.

    Up to a kink of friction the law is smooth, so that a panel may end next to it, and the next one begin with the
    small part of the panel that contains the kink. Other panels become narrower by a factor.
    """
    before, behind = jump
    if before == 1.0:
        return factor * width, 0.0
    reach = ROOM_BEHIND * (behind - before) * width
    return (before * width, reach) if before > 0.0 else (min(reach, factor * width), 0.0)


@Inner
def next_panel(forces, march, panel, request, work):  # type: ignore[no-untyped-def]
    """Find the widest panel from a given start that can be resolved.

    Returns
    -------
    width : float
        The width in the march variable; 0 if no width that doubles can represent suffices.
    step : float
        The width to begin with on the next panel.
    timed : bool
        Whether time is resolved.
    """
    step, ends_at_kink, widest, next_width = request.step, False, 0.0, 0.0
    start, slope = distance(panel.left, march), slope_at(panel.left, march)
    unit = MIN_RELATIVE_WIDTH * max(fabs(march.origin[0] + march.direction * start), start)
    # The rest of a leg may be hardly wider than the narrowest possible panel.
    width = min(max(step, 4.0 * unit / (slope + sqrt(slope * slope + 8.0 * march.g * unit))), request.max_width)
    steepness, before = law_at_start(forces, march, panel)
    # Rows that are known before V**2 show most panels that are too wide.
    curve_first = forces.linear and not forces.kinked
    last = Q_RATE if curve_first else P
    for _ in range(MAX_WIDTHS):
        length = width * (slope + march.g * width)
        # A panel may be narrower than the spacing of doubles if its end is given, because distances on it keep their
        # digits.
        if (length <= unit and width < request.max_width) or length < 1e-300:
            return 0.0, step, False
        begin_panel(forces, march, panel, width, work)
        ratio = 0.0
        if curve_first:
            fine, ratio = is_curve_resolved(width, work)
            if not fine:
                width = narrower(width, growth(ratio))
                continue
        q = solve_panel(forces, march, panel, steepness, work)
        if forces.kinked and not ends_at_kink and (q < inf or forces.linear):
            x = kink(work)
            to_kink = width * (0.5 * (1.0 + x) if x > -1.0 else 0.5)
            # A leg that begins at a kink may begin before it by a rounding.
            far = to_kink * (slope + march.g * to_kink)
            if x <= 1.0 and far > unit and not (x > -1.0 and is_cusp(forces, march, panel, start + far, work)):
                width, ends_at_kink = to_kink, x > -1.0
                continue
            load_row(work, LOAD, DS, N0, KAPPA, W)
        if not q < inf:
            ends_at_kink = False
            width, next_width = before_jump(jump_on(before, work), 0.5, width)
            continue
        largest_v2 = set_sizes(panel.v2, as_factor(panel.v2, march, panel.left), work)
        fine, worst = are_all_resolved(forces, march, panel, request, last, work)
        worst = max(worst, ratio)
        factor, jump = growth(worst), jump_on(before, work)
        if fine and jump[0] == 1.0 and fits(forces, work) and not hides_cusp(forces, march, panel, work):
            widest = max(widest, width)
            is_tiny_part = width <= NOISE_WIDTH_RATIO * widest
            done, factor, timed = resolve_time(forces, march, panel, request, largest_v2, worst, is_tiny_part, work)
            if is_at_cusp(length, unit, work):
                return 0.0, step, False
            if done and next_width > 0.0:
                return width, next_width, timed
            if done and may_jump(forces, march) and is_constant(work):
                factor = GROWTH_BEHIND_KINK
            if done:
                grown = width * factor
                return width, max(step, grown) if ends_at_kink or width == request.max_width else grown, timed
        ends_at_kink = False
        width, next_width = before_jump(jump, narrower(1.0, factor), width)
    return 0.0, step, False
