"""Making the table of a curve (`layout`).

If a curve is known in double-double arithmetic (`charts.double_double.parts`), parts of the potential and lengths of
panels are rounded from there, because the places of a chart of many short pieces are doubles, and their differences
have few digits. So is the length of the path of a rolling body, which depends on the curvature.
"""

from math import fabs
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import add
from gqm_sym.runtime.charts.double_double.parts import TRUE_PARTS, fill_differences
from gqm_sym.runtime.compiled.calls import (
    call_path_and_contact_force,
    call_potential_divdiff1,
    call_rider_loads,
    call_separated_terms,
)
from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.types import ADDRESSES, VECTOR
from gqm_sym.runtime.double_double.arithmetic import multiply as multiply_pairs
from gqm_sym.runtime.double_double.quadrature import fill_parameters
from gqm_sym.runtime.interface import PATH_ROWS, RIDER_ROWS
from gqm_sym.runtime.launch.rider import LEVEL_ROW, MIN_LEVEL, STANDARD_GRAVITY
from gqm_sym.runtime.sweep.tables.fitting import MAX_TRUE_TAIL_RATIO, fill_terms, fill_true_terms, fit, move_terms
from gqm_sym.runtime.sweep.tables.layout import (
    BASE,
    BASE_LOW,
    BASE_SIZE,
    CORIOLIS_SAMPLES,
    CORIOLIS_TERMS,
    DS_TERMS,
    FEW_GAUSS_WEIGHTS,
    FEW_GROWTH,
    FEW_NODES,
    FEW_POINTS,
    FEW_REACH,
    FEW_WEIGHTS,
    GAUSS_WEIGHTS,
    GROWTH,
    HALF,
    INCREASE,
    KAPPA_SAMPLES,
    KAPPA_TERMS,
    LEFT_TERMS,
    LOAD_ROW,
    MAY_STOP,
    MIDDLE,
    MIDDLE_TERMS,
    NODES,
    PATH_ROW,
    POINTS,
    POTENTIAL,
    POTENTIAL_ROW,
    POTENTIAL_SAMPLES,
    REACH,
    RIGHT_TERMS,
    SAMPLE_POINTS,
    SAMPLES,
    SERIES,
    SPREAD,
    TABLE,
    WEIGHTS,
    CurveTable,
)
from gqm_sym.runtime.sweep.tables.potential import potential_on, rise_on, value_on

# The largest share of the last coefficients for a panel next to an edge at which the potential is level; and the
# largest slope there, as a share of the mean slope, for which it counts as level. Small swings there have far less
# energy than the range of the potential on the panel, and still need all their digits. If the potential has one part
# only, a panel is cut at a place where it is level if that is farther from the edges than MIN_CUT, at multiples of
# CUT_STEP as shares of a piece. The level places of a sum of several parts depend on their factors.
MAX_LEVEL_TAIL_RATIO, LEVEL_SHARE, MIN_CUT, CUT_STEP = 1e-20, 1e-3, 1e-3, 2.0**-20

# The number of times that an interval is halved to find a level place.
HALVINGS = 50

# Values below this share of the typical size on the curve need no relative accuracy of their own.
NEGLIGIBLE = 1e-2

# The largest mean number of panels into which a piece of the curve is cut.
MAX_PARTS = 4

# The V**2 in m2/s2 at which the load at rest is less than the rounding of a load.
FAST = 2.0**64

# The size that what is added to N/m for each unit of ds/dt has at least, as a share of the load: a tail of some ten
# roundings of the load then is none.
ROUNDED_SIZE = 2.0


class Source(NamedTuple):
    """The functions from which a table is made.

    Attributes
    ----------
    fns : Addresses
        The module's compiled functions.
    separated_terms : int
        The address of the function of that name; 0 if potential and load are tabulated as a whole.
    potentials, loads : int
        The numbers of their parts.
    mass : int
        The index of the mass of the body among the run-time parameters.
    rider_loads : int
        The address of the function of that name, if the force that shows on which side of a space curve a body is shall
        be tabulated; otherwise 0.
    """

    fns: Any
    separated_terms: int
    potentials: int
    loads: int
    mass: int
    rider_loads: int


SOURCE = types.NamedTuple((ADDRESSES, *(types.int64,) * 5), Source)


@Inner
def fill_upright_force(source, p, n, places, out):  # type: ignore[no-untyped-def]
    """Fill kappa and n0 of the component of N/m along the upward direction of riders, and what is added to it for each
    unit of ds/dt; NaN where that direction is not known.
    """
    loads = np.empty((5, RIDER_ROWS, n))
    for k, w, v in ((0, 0.0, 1.0), (1, 1.0, 1.0), (2, 1.0, -1.0), (3, FAST, 1.0), (4, FAST, -1.0)):
        call_rider_loads(source.rider_loads, n, places, np.full(n, w), v, 1.0, p, loads[k])
    for i in range(n):
        unit = STANDARD_GRAVITY if loads[0, LEVEL_ROW, i] >= MIN_LEVEL else np.nan
        out[0, i] = unit * 0.5 * (loads[3, 0, i] + loads[4, 0, i]) / FAST
        out[1, i] = unit * loads[0, 0, i]
        out[2, i] = unit * 0.5 * (loads[1, 0, i] - loads[2, 0, i])


@Inner
def fill_terms_at(source, p, n, a, places, offsets, out):  # type: ignore[no-untyped-def]
    """Fill the rows of ``separated_terms`` at n places, and what is added to N/m for each unit of ds/dt."""
    out[-1] = 0.0
    if source.separated_terms != 0:
        call_separated_terms(source.separated_terms, n, a, places, offsets, p, out)
        return
    frame = np.empty((PATH_ROWS, n))
    call_potential_divdiff1(source.fns.potential_divdiff1, n, a, places, offsets, p, out)
    call_path_and_contact_force(source.fns.path_and_contact_force, n, places, np.zeros(n), p, frame)
    for i in range(n):
        out[2, i], out[3, i] = frame[3, i], frame[4, i] / p[source.mass]
    if source.rider_loads != 0:
        fill_upright_force(source, p, n, places, out[2:])


@Inner
def fill_path(half, ds, kappa, coriolis, size, row):  # type: ignore[no-untyped-def]
    """Fill the data of the path on a panel from ds/dlam, kappa and what is added to N/m for each unit of ds/dt at the
    Gauss points; return whether it is resolved. ``size`` is the size of the latter elsewhere on the curve.
    """
    work, one = np.empty(NODES), row.reshape(1, PATH_ROW)
    resolved = fill_terms(ds, work, row, DS_TERMS, 0.0)
    least_ds = 2.0 * work[0]
    for j in range(NODES):
        least_ds -= fabs(work[j])
        row[WEIGHTS + j] = half * GAUSS_WEIGHTS[j] * ds[j]
    row[MAY_STOP], row[HALF] = 0.0 if least_ds > 0.0 else 1.0, half
    resolved &= fill_terms(kappa, work, row, KAPPA_TERMS, NEGLIGIBLE / row[WEIGHTS])
    resolved &= fill_terms(coriolis, work, row, CORIOLIS_TERMS, NEGLIGIBLE * size)
    for j in range(SAMPLES):
        row[KAPPA_SAMPLES + j] = value_on(one, 0, KAPPA_TERMS, SAMPLE_POINTS[j])
        row[CORIOLIS_SAMPLES + j] = value_on(one, 0, CORIOLIS_TERMS, SAMPLE_POINTS[j])
    for j in range(FEW_NODES):
        row[FEW_WEIGHTS + j] = half * FEW_GAUSS_WEIGHTS[j] * value_on(one, 0, DS_TERMS, FEW_POINTS[j])
    return resolved


@Inner
def fill_potential(half, differences, is_exact, slope, row):  # type: ignore[no-untyped-def]
    """Fill the data of a part of the potential on a panel, except its base; return whether it is resolved.

    ``differences`` (2, 2, NODES) are its divided differences from both edges, two doubles each, the second of which
    count only if ``is_exact``; and ``slope`` is the slope of the part elsewhere on the curve.
    """
    values, work, one, resolved = np.empty((2, NODES)), np.empty(NODES), row.reshape(1, POTENTIAL_ROW), True
    sums, size = np.zeros((2, NODES)), NEGLIGIBLE * half * slope
    for side, at, edge in ((1, RIGHT_TERMS, 1.0), (0, LEFT_TERMS, -1.0)):
        for j in range(NODES):
            high, low = differences[side, 0, j], differences[side, 1, j] if is_exact else 0.0
            values[0, j], values[1, j] = multiply_pairs(half, 0.0, high, low)
        tail, largest = 0.0, 0.0
        if is_exact:
            tail, largest = fill_true_terms(values, work, sums, size)
        else:
            resolved &= fill_terms(values[0], work, sums[0], 0, size)
            sums[1] = 0.0
        move_terms(sums, edge, row[at : at + NODES], row[MIDDLE_TERMS : MIDDLE_TERMS + NODES])
        far = fabs(values[0, 0 if edge > 0.0 else NODES - 1])
        is_level = fabs(row[at]) <= LEVEL_SHARE * far
        resolved &= tail <= (MAX_LEVEL_TAIL_RATIO if is_level else MAX_TRUE_TAIL_RATIO) * largest
    reach, few_reach, spread = 0.0, 0.0, 0.0
    for j in range(NODES):
        row[POTENTIAL + j] = (1.0 + POINTS[j]) * values[0, j]
    fit(row, POTENTIAL, row, SERIES)
    for j in range(1, NODES):
        size = fabs(row[SERIES + j])
        reach += size * GROWTH[j]
        few_reach += size * FEW_GROWTH[j]
        spread += size
    row[INCREASE], row[MIDDLE], row[SPREAD] = rise_on(one, 0, LEFT_TERMS, 2.0), row[SERIES], spread
    row[REACH], row[FEW_REACH] = reach, few_reach
    for j in range(SAMPLES):
        row[POTENTIAL_SAMPLES + j] = potential_on(one, 0, SAMPLE_POINTS[j])
    return resolved


@Inner
def level_place(row):  # type: ignore[no-untyped-def]
    """Return the place inside a panel at which a part of the potential that is not monotone on it is stationary; NaN if
    there is none.
    """
    low, high, sign, x = -1.0, 1.0, row[LEFT_TERMS], 0.0
    if not sign * row[RIGHT_TERMS] < 0.0:
        return np.nan
    for _ in range(HALVINGS):
        x, slope = 0.5 * (low + high), 0.0
        for j in range(NODES - 1, -1, -1):
            slope = slope * x + (j + 1) * row[MIDDLE_TERMS + j]
        if sign * slope > 0.0:
            low = x
        else:
            high = x
    return x if fabs(x) < 1.0 - MIN_CUT else np.nan


@Inner
def cut_between(part, begin, end):  # type: ignore[no-untyped-def]
    """Return the share of a piece, between two shares, at which to cut a panel because the potential is level there;
    NaN if there is none.
    """
    cut = CUT_STEP * np.rint((begin + 0.5 * (1.0 + level_place(part)) * (end - begin)) / CUT_STEP)
    return cut if begin < cut < end else np.nan


@Inner
def fill_panel(source, true, p, panel, scales, path, parts):  # type: ignore[no-untyped-def]
    """Fill the data of the path and of all parts on a panel; return whether all are resolved.

    The values of the potential at the left edge are filled in only if they are known (`fill_bases`).

    Parameters
    ----------
    source, true, p
        As `tabulate` takes them.
    panel : (left, right, piece, span)
        The places of its edges, the piece on which it lies, and its beginning and end as shares of the piece.
    scales : array
        The slopes of the parts of the potential elsewhere on the curve, the sizes of the parts of the load, and that of
        what is added to N/m for each unit of ds/dt.
    path, parts : arrays
        Filled.
    """
    left, right, piece, span = panel
    half, potentials, count = 0.5 * (right - left), source.potentials, source.potentials + source.loads
    places, gaps, rests, work = np.empty(NODES), np.empty(NODES), np.empty(NODES), np.empty(NODES)
    shares = np.empty(NODES)
    from_left, from_right = np.empty((count + 3, NODES)), np.empty((count + 3, NODES))
    differences, ends, is_exact = (
        np.empty((2, potentials, 2, NODES)),
        np.empty((potentials, 2, 2)),
        true.values.size > 0,
    )
    for j in range(NODES):
        gaps[j] = half * (1.0 + POINTS[j])
        places[j], rests[j] = left + gaps[j], -half * (1.0 - POINTS[j])
    fill_terms_at(source, p, NODES, left, places, gaps, from_left)
    if is_exact:
        half = fill_differences(true, piece, span, POINTS, differences, ends, shares)
        if true.curve.offset[0] != 0.0:  # the curvature of a chart of many short pieces has few digits
            from_left[potentials] = shares
    else:
        fill_terms_at(source, p, NODES, right, places, rests, from_right)
        for i in range(potentials):
            differences[0, i, 0], differences[1, i, 0] = from_left[i], from_right[i]
    of_path = from_left[potentials], from_left[potentials + 1], from_left[count + 2]
    resolved = fill_path(half, *of_path, scales[count], path)
    for i in range(potentials):
        part = parts[i * POTENTIAL_ROW : (i + 1) * POTENTIAL_ROW]
        resolved &= fill_potential(half, differences[:, i], is_exact, scales[i], part)
        if is_exact:
            part[BASE], part[BASE_LOW] = ends[i, 0, 0], ends[i, 1, 0]
            part[INCREASE] = add(ends[i, 0, 1], ends[i, 1, 1], -ends[i, 0, 0], -ends[i, 1, 0])[0]
    for i in range(potentials, count):
        at = potentials * POTENTIAL_ROW + (i - potentials) * LOAD_ROW
        part = parts[at : at + LOAD_ROW]
        resolved &= fill_terms(from_left[i + 2], work, part, 0, NEGLIGIBLE * scales[i])
        for j in range(SAMPLES):
            part[NODES + j] = value_on(part.reshape(1, LOAD_ROW), 0, 0, SAMPLE_POINTS[j])
    return resolved


@Inner
def scales_of(source, p, pieces):  # type: ignore[no-untyped-def]
    """Return the largest slopes of the parts of the potential at the edges of pieces, and the largest values of the
    parts of the load and of what is added to N/m for each unit of ds/dt.
    """
    scales, offset = np.zeros(source.potentials + source.loads + 1), np.zeros(1)
    out = np.empty((scales.size + 2, 1))
    for k in range(pieces.size):
        fill_terms_at(source, p, 1, pieces[k], pieces[k : k + 1], offset, out)
        for i in range(scales.size):
            scales[i] = max(scales[i], fabs(out[i if i < source.potentials else i + 2, 0]))
    # The last is a difference of contact forces, and known to their roundings only: a rider without roll does not feel
    # the Coriolis force along his upward direction.
    if scales[-1] > 0.0:
        scales[-1] = max(scales[-1], ROUNDED_SIZE * scales[source.potentials : scales.size - 1].max())
    return scales


@Inner
def fill_bases(parts, potentials, known):  # type: ignore[no-untyped-def]
    """Fill the parts of the potential at the left edges of panels, each relative to the edge at which it is lowest.

    They are sums of the increases over the panels before, unless they are ``known`` relative to another reference.
    """
    for i in range(potentials):
        rows = parts[:, i * POTENTIAL_ROW : (i + 1) * POTENTIAL_ROW]
        base, low, least, least_low = 0.0, 0.0, np.inf, 0.0
        for k in range(rows.shape[0]):
            if not known:
                rows[k, BASE], rows[k, BASE_LOW] = base, low
                base, low = add(base, low, rows[k, INCREASE], 0.0)
            if rows[k, BASE] < least:
                least, least_low = rows[k, BASE], rows[k, BASE_LOW]
        for k in range(rows.shape[0]):
            rows[k, BASE], rows[k, BASE_LOW] = add(rows[k, BASE], rows[k, BASE_LOW], -least, -least_low)
            rows[k, BASE_SIZE] = rows[k, BASE]


@Inlined
def place_on_piece(true, pieces, k, share):  # type: ignore[no-untyped-def]
    """Return the place at a share of piece k, as two doubles."""
    if true.values.size > 0:
        high, low, _ = true.curve.lengths[k]
        high, low = multiply_pairs(high, low, share, 0.0)
        return add(true.origins[k, 0], true.origins[k, 1], high, low)
    return pieces[k] + share * (pieces[k + 1] - pieces[k]) if share < 1.0 else pieces[k + 1], 0.0


@entry(TABLE(SOURCE, TRUE_PARTS, VECTOR, VECTOR))
def tabulate(source, true, p, pieces):  # type: ignore[no-untyped-def]
    """Tabulate a curve.

    Parameters
    ----------
    source : Source
        The module's functions.
    true : TrueParts
        The parts of the potential in double-double arithmetic, on the same pieces; its arrays are empty if there are
        none.
    p : array
        Run-time parameters, of which only those that the functions read matter, followed by the chart.
    pieces : (n+1,) array
        The edges of the pieces on which the curve is smooth.

    Returns
    -------
    CurveTable
        The table; it is empty if the pieces would have to be cut into too many panels.
    """
    capacity = MAX_PARTS * (pieces.size - 1)
    width = source.potentials * POTENTIAL_ROW + source.loads * LOAD_ROW
    edges, lows = np.empty(capacity + 1), np.empty(capacity + 1)
    paths, parts = np.empty((capacity, PATH_ROW)), np.empty((capacity, width))
    pending, count, scales = np.empty(64), 0, scales_of(source, p, pieces)
    is_exact = true.values.size > 0
    if is_exact:
        fill_parameters(true.tape, true.parameters, true.work)
    for k in range(pieces.size - 1):
        waiting, begin = 1, 0.0
        pending[0] = 1.0
        while waiting > 0:
            end = pending[waiting - 1]
            if count == capacity or waiting == pending.size:
                none = np.empty((0, PATH_ROW)), np.empty((0, width))
                return CurveTable(np.empty(0), np.empty(0), none[0], none[1], source.potentials, False, 0.0)
            edges[count], lows[count] = place_on_piece(true, pieces, k, begin)
            edges[count + 1], lows[count + 1] = place_on_piece(true, pieces, k, end)
            panel = edges[count], edges[count + 1], k, (begin, end)
            cut = 0.5 * (begin + end)
            if fill_panel(source, true, p, panel, scales, paths[count], parts[count]):
                cut = cut_between(parts[count], begin, end) if is_exact and source.potentials == 1 else np.nan
            if cut == cut:
                pending[waiting] = cut
                waiting += 1
            else:
                count, waiting, begin = count + 1, waiting - 1, end
    parts = parts[:count].copy()
    fill_bases(parts, source.potentials, is_exact)
    edges, lows, paths = edges[: count + 1].copy(), lows[: count + 1].copy(), paths[:count].copy()
    return CurveTable(edges, lows, paths, parts, source.potentials, is_exact, NEGLIGIBLE * scales[0])
