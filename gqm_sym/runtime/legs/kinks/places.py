"""Kinks of a law that contains the absolute value of the curvature: the places where the curvature changes its sign.

They are found on a leg that is not one polynomial because of them, and kept for the later legs of the body
(`legs.body`): their number, then for each number of blocks (`whole_tables`) but the largest the width of the last part
of a leg that so many do not resolve, or 0, and then the places. If the number is negative, legs past kinks are not
followed in parts. Nothing depends on all kinks being known, because each part of a leg is proved to have none within it
(`whole_rows.curvature_sign`).

The turning rate of a curve in space is the root of a sum of squares. Where this almost vanishes, a law that contains it
has branch points beside a leg, which is divided between them in the same way (`whole_leg.note_branch_of_turning`).
"""

from math import fabs, inf

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.panels.breaks import offset
from gqm_sym.runtime.legs.panels.equation import LOAD, NODES
from gqm_sym.runtime.legs.panels.point import point_buffer, slope_of_v2
from gqm_sym.runtime.legs.panels.polynomials import WIDE
from gqm_sym.runtime.legs.runs.leg_variable import distance_at
from gqm_sym.runtime.legs.runs.whole_tables import MAX_BLOCKS

# Where the places begin, and the number of elements for all that is known.
FIRST_PLACE = MAX_BLOCKS
ROOM_FOR_KINKS = FIRST_PLACE + 4

# The largest number of steps of the method of false position, and the last step as a share of the places.
MAX_STEPS, LAST_STEP = 40, 1e-16


@Inner
def next_kink(kinks, origin, v):  # type: ignore[no-untyped-def]
    """Return the nearest known kink ahead of a place of two doubles, and its distance; the latter is infinite if there
    is none.
    """
    place, nearest = 0.0, inf
    for k in range(FIRST_PLACE, FIRST_PLACE + int(kinks[0])):
        d = offset(kinks[k], origin, v)
        if 0.0 < d < nearest:
            place, nearest = kinks[k], d
    return place, nearest


@Inner
def bend_at(forces, place, point):  # type: ignore[no-untyped-def]
    """Return the curvature times ds at a place."""
    slope_of_v2(forces, place, 0.0, 1, point)
    return point[2] * point[6]


@Inner
def note_place(place, kinks):  # type: ignore[no-untyped-def]
    """Note a place at which legs are divided; return whether there is space for it, and it is not known yet."""
    count = int(kinks[0])
    if count < 0 or FIRST_PLACE + count >= kinks.size:
        return False
    for k in range(FIRST_PLACE, FIRST_PLACE + count):
        if kinks[k] == place:
            return False
    kinks[FIRST_PLACE + count], kinks[0] = place, 1.0 + count
    return True


@Inner
def note_kink_between(forces, a, b, kinks):  # type: ignore[no-untyped-def]
    """Note the kink between two places at which the curvature has different signs."""
    point, count = point_buffer(), int(kinks[0])
    before, value = bend_at(forces, a, point), bend_at(forces, b, point)
    if count < 0 or FIRST_PLACE + count >= kinks.size or not before * value < 0.0:
        return
    for _ in range(MAX_STEPS):  # if an end of the bracket stays, its value is halved (Illinois method)
        new = b - value * ((b - a) / (value - before))
        bend = bend_at(forces, new, point)
        if bend * value < 0.0:
            a, before = b, value
        else:
            before *= 0.5
        done = fabs(new - b) <= LAST_STEP * fabs(new)
        b, value = new, bend
        if done or bend == 0.0:
            break
    note_place(b, kinks)


@Inner
def lowest_between(work, row, nodes, j):  # type: ignore[no-untyped-def]
    """Return the share at which a parabola through a value next to zero and those beside it is nearest to zero."""
    before, here, after = work[nodes + j - 1], work[nodes + j], work[nodes + j + 1]
    slope = (work[row + j] - work[row + j - 1]) / (here - before)
    bend = ((work[row + j + 1] - work[row + j]) / (after - here) - slope) / (after - before)
    return 0.5 * (before + here - slope / bend)


@Inner
def note_kinks(forces, march, blocks, variable, kinks, work):  # type: ignore[no-untyped-def]
    """Note the kinks on a leg, as far as the curvature in the row LOAD shows them (`whole_rows.curvature_sign`); return
    whether there is one.

    Between two of them that are closer than the nodes, the curvature is smallest beside a node.
    """
    if kinks.size == 1:
        return False
    row, nodes, v, any_kink, point = blocks * LOAD, blocks * NODES, float(march.direction), False, point_buffer()
    begin = march.origin[0] + march.origin[1]
    for j in range(1, blocks * WIDE - 1):
        before, here = work[row + j - 1], work[row + j]
        behind = begin + v * distance_at(variable, work[nodes + j - 1])
        place = begin + v * distance_at(variable, work[nodes + j])
        if before * here < 0.0:
            any_kink = True
            note_kink_between(forces, behind, place, kinks)
        elif j + 2 < blocks * WIDE and fabs(here) <= fabs(before) and fabs(here) <= fabs(work[row + j + 1]):
            lowest = begin + v * distance_at(variable, lowest_between(work, row, nodes, j))
            if bend_at(forces, lowest, point) * here < 0.0:
                any_kink = True
                is_before = v * (lowest - place) < 0.0
                ahead = begin + v * distance_at(variable, work[nodes + j + 1])
                note_kink_between(forces, behind if is_before else place, lowest, kinks)
                note_kink_between(forces, lowest, place if is_before else ahead, kinks)
    return any_kink
