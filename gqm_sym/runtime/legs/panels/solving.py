"""V**2 on a panel for the forces on it, which need not be linear in V**2.

Friction of the contact force in space makes the law ``P - Q W - f |N|/m``, where ``(N/m)**2`` is a polynomial in W with
coefficients that depend on the place alone, as P, Q and f do. So the curve is looked at once for all iterations.
"""

from math import fabs, inf, sqrt

from gqm_sym.runtime.compiled.calls import call_speed_equation
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import over_rows
from gqm_sym.runtime.legs.panels.equation import (
    ARC_RATE,
    AT_REST,
    DS,
    EXPM1_Q,
    GRADED,
    KAPPA,
    LENGTH,
    LENGTH_SLOPE,
    LOAD,
    MEAN,
    MIXED,
    N0,
    NODES,
    OFFSET,
    PLAIN_P,
    PLAIN_Q,
    Q_RATE,
    RUBBING,
    SPEED,
    TURNING,
    W_FACTOR,
    D,
    P,
    Q,
    W,
    copy_row,
    damped_row,
    difference_row,
    distance_row,
    factor_row,
    fill_square,
    integrate,
    lay_places,
    length_row,
    linear_row,
    load_row,
    product,
    q_rate_row,
    sample,
    slope_at,
)
from gqm_sym.runtime.legs.panels.polynomials import COUNT, WIDE, extent, size_of, size_of_block
from gqm_sym.runtime.legs.panels.resolution import first_jump

# The largest number of iterations for forces that are not linear in V**2.
MAX_ITERATIONS = 40

# After this iteration V**2 is known so well that a kink of friction shows on panels that contain one, where no
# polynomial resolves V**2.
ROUGH_ITERATIONS = 2

# The change of V**2 in an iteration as a share of its largest value that is rounding only; and a share below which it
# is, if changes do not decrease any more.
ROUNDED, NEARLY_ROUNDED = 4e-16, 1e-13

# If (N/m)**2 is a smaller share than this of its parts somewhere on a panel, the derivative of N with respect to V**2
# is mostly rounding there.
CANCELLED = 1e-6

# The largest change of V**2 by friction for a change of V**2 at which it is found by fixed-point iteration.
MAX_CONTRACTION = 1e-3

# The largest change of V**2 by the changes of friction on a panel, as a share, that is rounding only.
CONSTANT = 1e-15

length_slope_row = over_rows(lambda b, c, w, length: (0.5 * b + w * c) / length, WIDE)
rubbed_p_row = over_rows(lambda p, rubbing, length, slope, w: p - rubbing * (length - slope * w), WIDE)
rubbed_q_row = over_rows(lambda q, rubbing, slope: q + rubbing * slope, WIDE)
sum_row = over_rows(lambda one, other: one + other, WIDE)


@Inner
def split_law(forces, march, panel, work):  # type: ignore[no-untyped-def]
    """Fill the rows for a law with friction in space, apart from those that depend on V**2."""
    copy_row(work, W, 0.0)
    sample(forces, march, panel, work)
    fill_square(forces, ARC_RATE, work)
    product(work, RUBBING, RUBBING, float(forces.direction))
    # The law at rest, without the friction there.
    length_row(work, LENGTH, AT_REST, MIXED, TURNING, W)
    length_slope_row(work, LENGTH_SLOPE, MIXED, TURNING, W, LENGTH)
    product(work, PLAIN_P, RUBBING, LENGTH)
    sum_row(work, PLAIN_P, P, PLAIN_P)
    product(work, PLAIN_Q, RUBBING, LENGTH_SLOPE)
    difference_row(work, PLAIN_Q, Q, PLAIN_Q)
    if size_of_block(work, KAPPA) == 0.0 and extent(work, N0)[0] >= 0.0:
        # A length has no sign to be followed, but a kink where the curve is vertical.
        copy_row(work, N0, size_of(work, N0))


@Inner
def rub(march, panel, work):  # type: ignore[no-untyped-def]
    """Fill the rows P and Q_RATE of a law with friction in space, for the values of V**2 in the row W."""
    length_row(work, LENGTH, AT_REST, MIXED, TURNING, W)
    length_slope_row(work, LENGTH_SLOPE, MIXED, TURNING, W, LENGTH)
    rubbed_p_row(work, P, PLAIN_P, RUBBING, LENGTH, LENGTH_SLOPE, W)
    rubbed_q_row(work, Q, PLAIN_Q, RUBBING, LENGTH_SLOPE)
    q_rate_row(work, Q_RATE, Q, OFFSET, slope_at(panel.left, march), march.g, float(march.direction))


@Inner
def begin_panel(forces, march, panel, width, work):  # type: ignore[no-untyped-def]
    """Lay the nodes of a panel; if the forces are linear in V**2, or apart from friction, also fill the rows
    that do not depend on it.
    """
    product(work, OFFSET, NODES, width)
    distance_row(work, D, OFFSET, slope_at(panel.left, march), march.g)
    lay_places(march, panel, ARC_RATE, work)
    copy_row(work, W, panel.v2)
    if forces.linear:
        sample(forces, march, panel, work)
    elif forces.squared_contact != 0:
        split_law(forces, march, panel, work)


@Inner
def slope_at_start(forces, march, panel, work):  # type: ignore[no-untyped-def]
    """Return the increase of V**2 with the distance at a panel's start, or 0 if it decreases."""
    if forces.squared_contact != 0:
        w = panel.v2
        length = sqrt(work[AT_REST] + w * (work[MIXED] + w * work[TURNING]))
        return max(march.direction * (work[PLAIN_P] - work[PLAIN_Q] * w - work[RUBBING] * length), 0.0)
    v, nu = float(forces.direction), float(panel.contact_sign)
    work[W] = max(panel.v2, 1e-300)  # laws may contain its square root
    call_speed_equation(forces.speed_equation, 1, work, (ARC_RATE, W, MEAN), v, nu, forces.params)
    return max(march.direction * (work[MEAN + 1] - work[MEAN + 2] * work[W]), 0.0)


@Inner
def improve(march, panel, work):  # type: ignore[no-untyped-def]
    """Set V**2 in the row W to that by the law in the rows P, Q and Q_RATE; return q over the panel, the change and the
    size of V**2. If the panel is too wide, q is inf.
    """
    total = integrate(march, panel, SPEED, work)
    difference_row(work, W, SPEED, W)
    change, size = size_of_block(work, W), size_of_block(work, SPEED)
    copy_row(work, W, SPEED)
    return total if change < inf else inf, change, size


@Inner
def is_beside_zero(march, panel, work):  # type: ignore[no-untyped-def]
    """Return whether N almost vanishes somewhere on a panel, which is so narrow that V**2 follows from friction for the
    approximation before.
    """
    contraction = fabs(work[RUBBING]) * sqrt(max(work[TURNING], work[TURNING + COUNT - 1])) * work[D + COUNT]
    if not contraction <= MAX_CONTRACTION:
        return False
    slope = march.direction * (work[PLAIN_P] - work[PLAIN_Q] * panel.v2)
    for j in range(COUNT):
        w = panel.v2 + slope * work[D + j]
        turned = w * w * work[TURNING + j]
        if work[AT_REST + j] + w * work[MIXED + j] + turned <= CANCELLED * (work[AT_REST + j] + turned):
            return True
    return False


@Inner
def rub_beside_zero(march, panel, work):  # type: ignore[no-untyped-def]
    """Fill the rows P, Q and Q_RATE with the law for friction by the values of V**2 in the row W, or for its mean if
    its changes alter V**2 by no more than rounding.
    """
    low, high = inf, -inf
    for j in range(WIDE):
        w = work[W + j]
        rubbed = work[RUBBING + j] * sqrt(max(work[AT_REST + j] + w * (work[MIXED + j] + w * work[TURNING + j]), 0.0))
        work[LENGTH + j], low, high = rubbed, min(low, rubbed), max(high, rubbed)
    if (high - low) * work[D + COUNT] <= CONSTANT * panel.v2:
        copy_row(work, LENGTH, 0.5 * (low + high))
    difference_row(work, P, PLAIN_P, LENGTH)
    copy_row(work, Q, PLAIN_Q)
    q_rate_row(work, Q_RATE, Q, OFFSET, slope_at(panel.left, march), march.g, float(march.direction))


@Inner
def solve_beside_zero(march, panel, work):  # type: ignore[no-untyped-def]
    """Do the work of `integrate` for friction in space where N almost vanishes; return inf if it does not converge.

    N has a kink there, as on a hill in a vertical plane that the body would leave if the track did not hold it. No
    polynomial resolves a kink, but a panel may be so narrow that it does not matter. Beside it ``N**2`` is the small
    difference of its parts. By fixed-point iteration no derivative of N is needed, which would have no digits.
    """
    linear_row(work, W, D, panel.v2, march.direction * (work[PLAIN_P] - work[PLAIN_Q] * panel.v2))
    last_change = 0.0
    for _ in range(MAX_ITERATIONS):
        rub_beside_zero(march, panel, work)
        total, change, size = improve(march, panel, work)
        if not total < inf:
            return inf
        if change <= ROUNDED * size or change * change <= ROUNDED * size * last_change:
            return total
        last_change = change
    return inf


@Inner
def is_law_constant(march, panel, work):  # type: ignore[no-untyped-def]
    """Return whether the changes of a sampled law on a panel alter V**2 by no more than rounding; if so, fill the rows
    P, Q and Q_RATE with its mean.

    Friction of the cars of a train has a kink wherever N vanishes on one of them.
    """
    low, high = inf, -inf
    for j in range(COUNT):
        here = work[P + j] - work[Q + j] * work[W + j]
        if here != here:
            return False  # beyond a turn, where a law that contains a root of V**2 has no values
        low, high = min(low, here), max(high, here)
    if not (high - low) * work[D + COUNT] <= CONSTANT * panel.v2:
        return False
    copy_row(work, P, 0.5 * (low + high))
    copy_row(work, Q, 0.0)
    copy_row(work, Q_RATE, 0.0)
    return True


@Inner
def is_settled(change, last_change, size, is_contact_known):  # type: ignore[no-untyped-def]
    """Return whether V**2 has converged; ``last_change`` is that of the iteration before, or 0 in the first.

    Each iteration squares the error, until changes are rounding only. The contact force belongs to V**2 before the
    change. Where it is not computed from V**2 afterwards (``is_contact_known``), the change must be rounding only too.
    """
    if change <= ROUNDED * size or (change <= NEARLY_ROUNDED * size and change >= 0.5 * last_change > 0.0):
        return True
    return is_contact_known and change * change * change <= ROUNDED * size * last_change * last_change


@Inner
def may_jump(forces, march):  # type: ignore[no-untyped-def]
    """Return whether the derivative of friction with respect to V**2 may jump on a panel, as at kinks of the law.

    On panels from a turn other laws than that of trains have a pole of it.
    """
    return forces.friction and not forces.linear and forces.squared_contact == 0 and march.g == 0.0


@Inner
def solve_nonlinear(forces, march, panel, slope, work):  # type: ignore[no-untyped-def]
    """Do the work of `integrate` for forces that are not linear in V**2, by Newton's method; return inf if it does not
    converge.

    The first approximation is linear, with the ``slope`` of V**2 at the panel's start; NaN if that is not known.
    """
    slope = max(slope, 0.0) if slope == slope else slope_at_start(forces, march, panel, work)
    linear_row(work, W, D, panel.v2, slope)
    last_change, is_constant = 0.0, False
    for k in range(MAX_ITERATIONS):
        if forces.squared_contact != 0:
            rub(march, panel, work)
        else:
            sample(forces, march, panel, work)
            is_constant = forces.friction and is_law_constant(march, panel, work)
        total, change, size = improve(march, panel, work)
        if not total < inf:
            return inf
        # The first approximation may be constant where V**2 is not, and so then is a law that depends on it.
        if (is_constant and k > 0) or is_settled(change, last_change, size, forces.squared_contact != 0):
            return total
        if k >= ROUGH_ITERATIONS and may_jump(forces, march) and first_jump(work[Q], work)[0] < 1.0:
            return inf
        last_change = change
    return inf


@Inner
def solve_panel(forces, march, panel, slope, work):  # type: ignore[no-untyped-def]
    """Compute W on a panel prepared by `begin_panel`, and all rows that do not need W > 0.

    Return q over the panel, or inf if the panel is too wide to be solved. ``slope`` is as in `solve_nonlinear`.
    """
    if forces.linear:
        total = integrate(march, panel, W, work)
    elif forces.squared_contact != 0 and is_beside_zero(march, panel, work):
        total = solve_beside_zero(march, panel, work)
    else:
        total = solve_nonlinear(forces, march, panel, slope, work)
    if not total < inf:
        return inf
    if panel.v2 == 0.0:
        damped_row(work, W_FACTOR, GRADED if march.g > 0.0 else MEAN, EXPM1_Q)
    elif march.g > 0.0 and panel.left == 0.0:
        factor_row(work, W_FACTOR, W, OFFSET, 0.5 * march.c)
    else:
        copy_row(work, W_FACTOR, W)
    load_row(work, LOAD, DS, N0, KAPPA, W)
    return total
