"""Rows of a leg from turn to turn as one polynomial: how well they are resolved, and whether they keep their sign.

Rows are those of a panel (`panels.equation`) with more nodes: with ``blocks`` blocks of numbers each (`whole_tables`),
the row ``r`` of a panel begins at ``blocks * r``. They are polynomials in the share of the way; or in another variable,
if the law contains roots of V**2 (`point.law_at_rest`). Linear drag contains the speed V itself. Both V and the
place are smooth in the phase angle, turns included, but V is not smooth in the place there.
"""

from math import fabs, inf, log, pi, sqrt

import numpy as np

from gqm_sym.runtime.compiled.calls import call_speed_equation, call_squared_contact
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.compiled.registers import on_stack, over_rows
from gqm_sym.runtime.legs.panels.breaks import within
from gqm_sym.runtime.legs.panels.equation import (
    ARC_RATE,
    DS,
    EXPM1_Q,
    FORCE,
    KAPPA,
    LOAD,
    MAX_Q,
    MEAN,
    N0,
    NODES,
    OFFSET,
    Q_RATE,
    SERIES,
    SPEED,
    TAILS,
    TIME_RATE,
    W_FACTOR,
    P,
    Q,
    W,
    copy_row,
    damped_row,
    difference_row,
    fill_expm1,
    force_row,
    linear_row,
    load_per_mass_row,
    load_row,
    load_size_row,
    product,
)
from gqm_sym.runtime.legs.panels.point import LEAST_V2, ZERO_TOLERANCE
from gqm_sym.runtime.legs.panels.polynomials import WIDE, extent, extent_of_block, size_of, size_of_block
from gqm_sym.runtime.legs.panels.resolution import (
    FAR_FROM_ZERO_RATIO,
    ONE_SIGN_RATIO,
    TAIL_RATIO,
    are_fine,
)
from gqm_sym.runtime.legs.runs.leg_variable import lay_places, stretch_law
from gqm_sym.runtime.legs.runs.whole_tables import (
    IN_SHARE,
    MAX_BLOCKS,
    MIDDLE_DEGREES,
    to_coefficients,
    to_factors,
    to_mean_rates,
    to_means,
    to_nodes,
    to_products,
    to_tails,
)

# The largest ratio of the last coefficients of a contact force to its size by which one can tell where it is largest.
# The value there then has an error of about its square, and the number by which ratios are raised is about
# log(TAIL_RATIO)/log(LOCATED_RATIO).
LOCATED_RATIO = 1e-10

# The row of ``y (1 - y)``, behind those of a panel. It has all its digits at both ends.
PRODUCTS = NODES + WIDE

# The rows, one after the other; and three numbers behind them: the grade (`whole_tables`), the number c for which
# iterations begin with ``V**2 = c y (1 - y)``, and the ratio to their size below which coefficients that no longer
# decrease are rounding noise.
ROWS = 23
GRADE, FIRST_V2, NOISE, WORK = range(ROWS * MAX_BLOCKS * WIDE, ROWS * MAX_BLOCKS * WIDE + 4)
whole_buffer = on_stack(WORK)

# The rows of a module's function `squared_contact`.
square_buffer = on_stack(4 * MAX_BLOCKS * WIDE)

# A bound on the Lebesgue constant for all numbers of nodes (`polynomials.LEBESGUE`).
LEBESGUE = 4.0

slope_row = over_rows(lambda p, q, w, step: step * (p - q * w), WIDE)
moved_row = over_rows(lambda w, y, slope: w + y * slope, WIDE)
size_row = over_rows(lambda w: abs(w), WIDE)
resistance_row = over_rows(lambda q, product, v: 2.0 * v * q * np.sqrt(product), WIDE)
v2_row = over_rows(lambda factor, vanishing, h: factor * (h * vanishing), WIDE)
whole_time_row = over_rows(lambda ds, factor, h: ds * np.sqrt(h / factor), WIDE)

# The row of what W vanishes with, between two turns, and on a part of a leg that begins at a turn.
BETWEEN_TURNS, FROM_TURN = PRODUCTS, NODES

# The number of blocks to try next on a leg with a kink of the law, and the ends of a leg that are no kinks.
HAS_KINKS, NO_KINKS = -1, (False, False)

# Coefficients that decrease by the same factor with each degree as in their middle fall short of the expected size at
# their end by this share of the nodes, because singularities of curves are mostly those of roots.
ENOUGH_NODES = 1.25


@Inner
def size_of_row(blocks, work, row):  # type: ignore[no-untyped-def]
    """Return the largest absolute value at the nodes."""
    at = blocks * row
    size = size_of(work, at + (blocks - 1) * WIDE)
    for k in range(blocks - 1):
        size = max(size, size_of_block(work, at + k * WIDE))
    return size


@Inner
def extent_of_row(blocks, work, row):  # type: ignore[no-untyped-def]
    """Return the smallest and the largest value at the nodes."""
    at = blocks * row
    low, high = extent(work, at + (blocks - 1) * WIDE)
    for k in range(blocks - 1):
        least, most = extent_of_block(work, at + k * WIDE)
        low, high = min(low, least), max(high, most)
    return low, high


@Inner
def examine_row(blocks, work, row, size):  # type: ignore[no-untyped-def]
    """Return what `resolution.examine` does: the sizes of the last coefficients and of some in the middle, and whether
    the function is resolved.
    """
    at = blocks * TAILS
    to_tails(blocks, work, blocks * row, work, at)
    tail = max(fabs(work[at]), max(fabs(work[at + 1]), fabs(work[at + 2])))
    middle = max(fabs(work[at + 3]), max(fabs(work[at + 4]), fabs(work[at + 5])))
    return tail, middle, are_fine(tail, middle, size, work[NOISE])


@Inner
def keeps_sign(blocks, work, row, sign, noise):  # type: ignore[no-untyped-def]
    """Return whether a function is proved to have a sign on the whole leg."""
    low, high = extent_of_row(blocks, work, row)
    least = low if sign > 0 else -high
    if not least > noise:
        return False
    if 0.5 * fabs(low + high) > 0.5 * LEBESGUE * (high - low) + noise:
        return True
    # A series in cosines of an angle differs between nodes from a value beside it by less than this times a bound of
    # its second derivative.
    at, bend, spacing = blocks * SERIES, 0.0, pi / (blocks * WIDE - 1)
    to_coefficients(blocks, work, blocks * row, work, at)
    for k in range(1, blocks * WIDE - 1):
        bend += k * k * fabs(work[at + k])
    return least > 0.125 * spacing * spacing * bend + noise


@Inner
def fits_on_leg(forces, blocks, work):  # type: ignore[no-untyped-def]
    """Return whether a body with a radius is proved to fit into its track all along a leg."""
    return not forces.has_radius or keeps_sign(blocks, work, DS, 1, 0.0)


@Inlined
def form_of(blocks, work):  # type: ignore[no-untyped-def]
    """Return the form of rows (`whole_tables`)."""
    return blocks + MAX_BLOCKS * int(work[GRADE])


@Inner
def choose_variable(rest, width, work):  # type: ignore[no-untyped-def]
    """Choose the variable of the rows of a leg of about this width, given `point.LawAtRest`."""
    work[GRADE], work[FIRST_V2], work[NOISE] = rest.grade, rest.slope * width, rest.noise


@Inner
def begin_leg(blocks, work):  # type: ignore[no-untyped-def]
    """Fill in the nodes, and V**2 to begin with, once for all widths."""
    work[0] = 1.0
    to_nodes(form_of(blocks, work), work, 0, work, blocks * NODES)
    to_products(form_of(blocks, work), work, 0, work, blocks * PRODUCTS)
    for at in range(0, blocks * WIDE, WIDE):
        copy_row(work, blocks * SPEED + at, 1.0)
        v2_row(work, blocks * W + at, blocks * SPEED + at, blocks * PRODUCTS + at, work[FIRST_V2])
    keep_positive(blocks, work)


@Inner
def keep_positive(blocks, work):  # type: ignore[no-untyped-def]
    """Keep V**2 from being zero at the end of a leg where the law is infinitely steep at rest."""
    last = blocks * W + blocks * WIDE - 1
    if work[GRADE] > IN_SHARE:
        work[last] = max(work[last], LEAST_V2)


@Inner
def sample_leg(forces, march, panel, blocks, variable, work):  # type: ignore[no-untyped-def]
    """Fill the rows DS to KAPPA, EXPM1_Q and FORCE of a leg with a variable (`leg_variable`), for V**2 in the row W;
    return whether resistance is small enough for that.
    """
    wide, origin, v, nu = blocks * WIDE, march.origin, float(march.direction), float(panel.contact_sign)
    is_stretched = variable.extent > 0.0
    if is_stretched:
        lay_places(variable, march, blocks, work)
    else:
        for at in range(0, wide, WIDE):
            product(work, blocks * OFFSET + at, blocks * NODES + at, variable.width)
            linear_row(work, blocks * ARC_RATE + at, blocks * OFFSET + at, origin[0] + origin[1], v)
    if panel.span[0] > -inf or panel.span[1] < inf:
        for j in range(blocks * ARC_RATE, blocks * ARC_RATE + wide):
            work[j] = within(work[j], panel.span)
    rows = (blocks * ARC_RATE, blocks * W, blocks * DS)
    call_speed_equation(forces.speed_equation, wide, work, rows, v, nu, forces.params)
    if is_stretched:
        stretch_law(blocks, work)
    for at in range(0, wide, WIDE):
        if work[GRADE] > IN_SHARE:
            resistance_row(work, blocks * Q_RATE + at, blocks * Q + at, blocks * PRODUCTS + at, v)
        else:
            product(work, blocks * Q_RATE + at, blocks * Q + at, v)
    # The product with the larger matrices is saved where nothing resists in proportion to V**2.
    if blocks == 1 or size_of_row(blocks, work, Q_RATE) != 0.0:
        to_mean_rates(form_of(blocks, work), work, blocks * Q_RATE, work, blocks * SPEED)
        for at in range(0, wide, WIDE):
            product(work, blocks * SPEED + at, blocks * SPEED + at, blocks * OFFSET + at)
        if not fabs(work[blocks * SPEED + wide - 1]) <= MAX_Q:
            return False
        for at in range(0, wide, WIDE):
            fill_expm1(work, blocks * SPEED + at, blocks * EXPM1_Q + at)
            force_row(work, blocks * FORCE + at, blocks * P + at, blocks * EXPM1_Q + at, v)
    else:
        for at in range(0, wide, WIDE):
            copy_row(work, blocks * EXPM1_Q + at, 0.0)
            product(work, blocks * FORCE + at, blocks * P + at, v)
    return True


@Inner
def replace_v2(blocks, work):  # type: ignore[no-untyped-def]
    """Replace the row W by the row SPEED; return the largest change of W, and the largest W."""
    change = 0.0
    for at in range(0, blocks * WIDE, WIDE):
        w, new = blocks * W + at, blocks * SPEED + at
        difference_row(work, w, new, w)
        change = max(change, size_of_block(work, w))
        copy_row(work, w, new)
    keep_positive(blocks, work)
    return change, extent_of_row(blocks, work, W)[1]


@Inner
def fill_v2(blocks, h, vanishing, work):  # type: ignore[no-untyped-def]
    """Fill the rows W_FACTOR and W of a leg between two turns (``vanishing`` is BETWEEN_TURNS) or of a part that begins
    at a turn (FROM_TURN); return the largest change of W, and the largest W.
    """
    if vanishing == BETWEEN_TURNS:
        to_factors(form_of(blocks, work), work, blocks * FORCE, work, blocks * W_FACTOR)
    else:
        to_means(form_of(blocks, work), work, blocks * FORCE, work, blocks * W_FACTOR)
    for at in range(0, blocks * WIDE, WIDE):
        factor = blocks * W_FACTOR + at
        damped_row(work, factor, factor, blocks * EXPM1_Q + at)
        v2_row(work, blocks * SPEED + at, factor, blocks * vanishing + at, h)
    return replace_v2(blocks, work)


@Inner
def move_v2(forces, blocks, h, step, work):  # type: ignore[no-untyped-def]
    """Move the row W of a leg of the width ``h`` to the nodes of one that is wider by a share ``step`` of it.

    W is known from the nearer turn on: from the start in the first half, and from where the leg ended in the second.
    There it changes by that at the end, damped by the resistance in between.
    """
    v, last, growth = float(forces.direction), blocks * WIDE - 1, blocks * EXPM1_Q
    for at in range(0, last, WIDE):
        slope_row(work, blocks * SPEED + at, blocks * P + at, blocks * Q + at, blocks * W + at, v * h * step)
    at_end = work[blocks * SPEED + last] * (1.0 + work[growth + last])
    for at in range(0, last, WIDE):
        moved_row(work, blocks * W + at, blocks * W + at, blocks * NODES + at, blocks * SPEED + at)
    for j in range(last // 2 + 1, last + 1):
        work[blocks * W + j] -= at_end / (1.0 + work[growth + j])
    for at in range(0, last, WIDE):
        size_row(work, blocks * W + at, blocks * W + at)
    keep_positive(blocks, work)


@Inner
def fill_load(blocks, work):  # type: ignore[no-untyped-def]
    """Fill the row LOAD, and the size of its terms in MEAN."""
    for at in range(0, blocks * WIDE, WIDE):
        w, ds = blocks * W + at, blocks * DS + at
        load_row(work, blocks * LOAD + at, ds, blocks * N0 + at, blocks * KAPPA + at, w)
        load_size_row(work, blocks * MEAN + at, ds, blocks * N0 + at, blocks * KAPPA + at, w)


@Inner
def are_rows_resolved(blocks, h, work):  # type: ignore[no-untyped-def]
    """Return whether the rows W_FACTOR, FORCE, Q_RATE and DS are resolved, and the largest ratio of their middle
    coefficients to their sizes.
    """
    resolved, worst, resistance = True, 0.0, size_of_row(blocks, work, Q_RATE)
    for row in (W_FACTOR, FORCE, Q_RATE, DS):
        if row == Q_RATE and resistance == 0.0:
            continue
        size = size_of_row(blocks, work, row)
        if row == FORCE:
            size = max(size, resistance * extent_of_row(blocks, work, W)[1])
        if row == Q_RATE:
            size = max(size, 1.0 / h)
        tail, middle, fine = examine_row(blocks, work, row, size)
        if not (tail < inf and middle < inf):
            return False, inf
        if not fine and size > 0.0:
            resolved, worst = False, max(worst, middle / size)
    return resolved, worst


@Inner
def sign_of_row(blocks, work, row, sign, limits):  # type: ignore[no-untyped-def]
    """Return whether a function is resolved as far as its changes of sign require (`resolution.is_load_resolved`);
    whether it is proved to have a sign on the whole leg; and the ratio of its middle coefficients to its size.

    ``limits`` are the size and the noise of the function.
    """
    size, noise = limits
    tail, middle, fine = examine_row(blocks, work, row, size)
    if not (tail < inf and middle < inf):
        return False, False, inf
    if fine or tail <= ONE_SIGN_RATIO * size:
        return True, keeps_sign(blocks, work, row, sign, noise), middle / size
    if tail <= FAR_FROM_ZERO_RATIO * size:
        kept = keeps_sign(blocks, work, row, sign, max(noise, 4.0 * FAR_FROM_ZERO_RATIO * size))
        return kept, kept, middle / size
    return False, False, middle / size


@Inner
def load_sign(is_stretched, blocks, contact_sign, work):  # type: ignore[no-untyped-def]
    """Return `sign_of_row` for N; the ratio is 0 if it is resolved.

    With a map, N has stronger singularities than all that must be resolved to the last digit, so that its ratio is
    squared (as in `curvature_sign`).
    """
    size = extent_of_row(blocks, work, MEAN)[1]
    fine, kept, ratio = sign_of_row(blocks, work, LOAD, contact_sign, (size, ZERO_TOLERANCE * size))
    if is_stretched:
        ratio *= ratio
    return fine, kept, 0.0 if fine else ratio


@Inner
def is_contact_force_resolved(forces, is_length, is_stretched, blocks, work):  # type: ignore[no-untyped-def]
    """Return whether N itself is resolved, as its extremes require, and the ratio of its middle coefficients.

    If it is a length, that is its square, which is smooth also where it almost vanishes; the rows N0 and KAPPA become
    the length and 0. On a leg whose variable is stretched, or that has the grade 2, its extremes need only be located
    (`peaks`).
    """
    if is_length:
        fill_lengths(forces, blocks, work)
    for at in range(0, blocks * WIDE, WIDE):
        n0, kappa, w = blocks * N0 + at, blocks * KAPPA + at, blocks * W + at
        load_per_mass_row(work, blocks * SERIES + at, n0, kappa, w)
        if is_length:
            product(work, blocks * SERIES + at, n0, n0)
    size = size_of_row(blocks, work, SERIES)
    tail, middle, fine = examine_row(blocks, work, SERIES, size)
    if (is_stretched or work[GRADE] > 1.0) and not is_length:
        fine, middle = tail <= LOCATED_RATIO * size, middle * sqrt(middle / size)
    return fine, middle / size


@Inner
def fill_lengths(forces, blocks, work):  # type: ignore[no-untyped-def]
    """Replace the rows N0 and KAPPA by the length of the contact force per mass, and 0 (`equation.fill_length`)."""
    wide, terms = blocks * WIDE, square_buffer()
    places = work[blocks * ARC_RATE : blocks * ARC_RATE + wide]
    call_squared_contact(forces.squared_contact, wide, places, forces.params, terms)
    for j in range(wide):
        w = work[blocks * W + j]
        square = terms[j] + w * (terms[wide + j] + w * terms[2 * wide + j])
        work[blocks * N0 + j], work[blocks * KAPPA + j] = sqrt(max(square, 0.0)), 0.0


@Inner
def fill_times(blocks, h, work):  # type: ignore[no-untyped-def]
    """Fill the row TIME_RATE with f; return whether it is resolved, and the ratio of its middle coefficients."""
    for at in range(0, blocks * WIDE, WIDE):
        whole_time_row(work, blocks * TIME_RATE + at, blocks * DS + at, blocks * W_FACTOR + at, h)
    size = size_of_row(blocks, work, TIME_RATE)
    _tail, middle, fine = examine_row(blocks, work, TIME_RATE, size)
    return fine, middle / size


@Inlined
def blocks_for(ratio, blocks, is_stretched, grade):  # type: ignore[no-untyped-def]
    """Return the number of blocks that resolve a function whose middle coefficients have this ratio to its size with
    fewer ``blocks``; 0 if there is no such number, as for the ratio 1. In a stretched variable there are no roots near,
    and with the ``grade`` 2 coefficients decrease slowly at first.
    """
    if not 0.0 < ratio < 1.0:
        return 0
    nodes = MIDDLE_DEGREES[blocks - 1] * log(TAIL_RATIO) / log(ratio)
    needed = max(int(nodes / ((1.0 if is_stretched else ENOUGH_NODES) * WIDE)) + 1, blocks + 1)
    return needed if needed <= MAX_BLOCKS else (MAX_BLOCKS if grade > 1.0 and blocks < MAX_BLOCKS else 0)
