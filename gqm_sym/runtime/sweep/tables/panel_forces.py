"""The potential and the load of one launch on the panels that it reaches: sums of the parts of a table times the
launch's factors.

A launch needs few numbers on most panels that it passes, and more on those next to its turning points. They are
computed when they are first needed, and kept for launches with the same factors.
"""

from math import fabs, inf

from gqm_sym.runtime.arithmetic.doubledouble import add
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.double_double.arithmetic import multiply
from gqm_sym.runtime.sweep.tables.layout import (
    BASE,
    BASE_LOW,
    BASE_SIZE,
    FEW_REACH,
    INCREASE,
    LEFT_TERMS,
    LOAD_ROW,
    LOAD_SAMPLES,
    LOAD_TERMS,
    MAY_STOP,
    MIDDLE,
    MIDDLE_TERMS,
    NODES,
    POTENTIAL_ROW,
    REACH,
    RIGHT_TERMS,
    SAMPLES,
    SERIES,
    SPREAD,
)

# Flags for the contents of a panel's row: numbers that suffice far from turning points, its polynomials, the load, and
# the contact force as a vector.
FAR, NEAR, LOAD, VECTORS = 1, 2, 4, 8

# The largest number of times that a panel is halved towards an edge to find a part on which the potential is convex.
HALVINGS = 20

# A row has the numbers that `layout` lists for one part; then an upper bound of the potential on the panel relative to
# the reference, infinite if ds may vanish; a better bound; 1 if the potential rises throughout, -1 if it falls, 0 if
# neither is certain; and the level above which it is certainly convex. For curves in space it ends with the vectors at
# the samples of which the contact force per unit mass is the sum, each component by itself: the first, V**2 times the
# second, and V times the third.
HIGHEST, TOP, SLOPE_SIGN, CONVEX_FROM = range(LOAD_SAMPLES + SAMPLES, LOAD_SAMPLES + SAMPLES + 4)
AT_REST, TURNING, MOVING = (CONVEX_FROM + 1 + 3 * k * SAMPLES for k in range(3))
ROW = MOVING + 3 * SAMPLES


@Inner
def fill_sums(parts, stride, factors, out):  # type: ignore[no-untyped-def]
    """Fill numbers with sums of parts times their factors; the columns of successive parts are ``stride`` apart."""
    for j in range(out.size):
        out[j] = factors[0] * parts[j]
    for i in range(1, factors.size):
        for j in range(out.size):
            out[j] += factors[i] * parts[i * stride + j]


@Inner
def fill_far(curve, k):  # type: ignore[no-untyped-def]
    """Fill the numbers that suffice far from turning points."""
    parts, row, factors, count = curve.table.parts[k], curve.rows[k], curve.factors, curve.table.potentials
    fill_sums(parts, POTENTIAL_ROW, factors[:count], row[:LEFT_TERMS])
    spread, reach, few_reach, base_size, base, base_low = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(count):
        factor, at = fabs(factors[i]), i * POTENTIAL_ROW
        spread += factor * parts[at + SPREAD]
        reach += factor * parts[at + REACH]
        few_reach += factor * parts[at + FEW_REACH]
        base_size += factor * parts[at + BASE_SIZE]
        part, part_low = multiply(factors[i], 0.0, parts[at + BASE], parts[at + BASE_LOW])
        base, base_low = add(base, base_low, part, part_low)
    row[BASE], row[BASE_LOW] = base, base_low
    row[SPREAD], row[REACH], row[FEW_REACH], row[BASE_SIZE] = spread, reach, few_reach, base_size
    row[HIGHEST] = inf if curve.table.paths[k, MAY_STOP] != 0.0 else row[BASE] + (row[MIDDLE] + spread)


@Inner
def convex_level(row, at, edge):  # type: ignore[no-untyped-def]
    """Return the smallest height above an edge from which the potential is certainly convex; infinity if there is none.

    It is convex where one term of its second derivative, in powers of the distance from the edge, outweighs all
    negative terms. In a flat well the terms before this one are as small as the edge is near the lowest place.
    """
    lead, behind, power, first = 0.0, 0.0, 1.0, 0
    for j in range(1, NODES):
        part = j * (j + 1) * row[at + j] * power
        behind, power = behind + max(-part, 0.0), -2.0 * edge * power
        if part > lead:
            lead, behind, first = part, 0.0, j
    distance, height = 2.0, 0.0
    if not lead > 2.0 * behind:
        return inf
    for _ in range(HALVINGS):
        before, power = 0.0, 1.0
        for j in range(1, first):
            before, power = before + max(-j * (j + 1) * row[at + j] * power, 0.0), -edge * distance * power
        if 2.0 * before > first * (first + 1) * row[at + first] * power:
            break
        distance *= 0.5
    for j in range(NODES - 1, -1, -1):
        height = (height + fabs(row[at + j])) * 2.0 * distance
    return height if distance < 2.0 else inf


@Inner
def fill_near(curve, k):  # type: ignore[no-untyped-def]
    """Fill the polynomials, and the sign of the slope and the bound that follow from them."""
    parts, row, count = curve.table.parts[k], curve.rows[k], curve.table.potentials
    fill_sums(parts[LEFT_TERMS:], POTENTIAL_ROW, curve.factors[:count], row[LEFT_TERMS:POTENTIAL_ROW])
    change, slope, spread, convexity = 0.0, row[MIDDLE_TERMS], 0.0, 2.0 * row[MIDDLE_TERMS + 1]
    for j in range(2, NODES + 1):
        term = fabs(row[MIDDLE_TERMS + j - 1])
        change += j * term
        convexity -= j * (j - 1) * term if j > 2 else 0.0
        spread += fabs(row[SERIES + j - 1])
    row[CONVEX_FROM] = -inf
    if not convexity > 0.0:
        from_right = row[INCREASE] + convex_level(row, RIGHT_TERMS, 1.0)
        row[CONVEX_FROM] = row[BASE] + min(convex_level(row, LEFT_TERMS, -1.0), from_right)
    row[SLOPE_SIGN], top = 0.0, row[MIDDLE] + spread
    if fabs(slope) > change:
        row[SLOPE_SIGN], top = 1.0 if slope > 0.0 else -1.0, max(row[INCREASE], 0.0)
    row[TOP] = inf if curve.table.paths[k, MAY_STOP] != 0.0 else row[BASE] + top


@Inner
def fill_load(curve, k):  # type: ignore[no-untyped-def]
    """Fill the load."""
    count = curve.table.potentials
    parts, row = curve.table.parts[k, count * POTENTIAL_ROW :], curve.rows[k]
    fill_sums(parts, LOAD_ROW, curve.factors[count:], row[LOAD_TERMS : LOAD_TERMS + LOAD_ROW])


@Inner
def fill_missing(curve, k, missing):  # type: ignore[no-untyped-def]
    """Fill the missing parts of the row of panel k."""
    if missing & FAR:
        fill_far(curve, k)
    if missing & NEAR:
        fill_near(curve, k)
    if missing & LOAD:
        fill_load(curve, k)
    curve.levels[k] |= missing


@Inlined
def prepare(curve, k, wanted):  # type: ignore[no-untyped-def]
    """Fill those parts of the row of panel k that are ``wanted`` (a sum of FAR, NEAR and LOAD) and still missing."""
    missing = wanted & ~curve.levels[k]
    if missing != 0:
        fill_missing(curve, k, missing)


@Inner
def take_factors(curve, given):  # type: ignore[no-untyped-def]
    """Set the factors to those of the launch; rows that were computed with other factors are discarded."""
    changed = False
    for i in range(given.size):
        changed |= curve.factors[i] != given[i]
        curve.factors[i] = given[i]
    if changed:
        for k in range(curve.levels.size):
            curve.levels[k] = 0
