"""The data kept of the gap and of the block of gaps ahead of a body, filled in where they are not known yet."""

from math import inf

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.gaps.data import (
    BLOCK,
    END_EXPM1,
    END_GAINED,
    FACTORS,
    FILLED,
    FIRST_OF_BLOCK,
    GAP_COLUMNS,
    MOMENTS,
    REFUSED,
    WITH_FEW,
    add_moments,
    behind_gap,
    fill_gap,
    keep_range,
    keeps_blocks,
    read_gained,
    to_time_coefficients,
    widen_bounds,
    widen_range,
)
from gqm_sym.runtime.legs.gaps.octaves import forget_octaves
from gqm_sym.runtime.legs.gaps.places import fill_places, has_flows
from gqm_sym.runtime.legs.panels.breaks import clearance
from gqm_sym.runtime.legs.panels.equation import March, Panel


@Inner
def ends_of_gap(all_breaks, period, gap):  # type: ignore[no-untyped-def]
    """Return the places between which a gap lies; the last gap of a closed curve extends to the first break of the next
    lap.
    """
    return all_breaks[gap], (all_breaks[gap + 1] if gap + 1 < all_breaks.size else all_breaks[0] + period)


@Inner
def gap_behind(route, upcoming, v):  # type: ignore[no-untyped-def]
    """Return the index of the gap ahead of the break at ``upcoming``, among all of the curve."""
    return (route.first_break + (upcoming if v > 0 else -upcoming - 1)) % route.all_breaks.size


@Inner
def place_of_data(gap, v, contact_sign):  # type: ignore[no-untyped-def]
    """Return the position of the data kept of a gap."""
    return GAP_COLUMNS * (4 * gap + (v + 1) + (contact_sign + 1) // 2)


@Inner
def fill_kept_gap(forces, route, gap, v, contact_sign, at, work):  # type: ignore[no-untyped-def]
    """Fill in the data kept of a gap, from ``route.gaps[at]`` on."""
    low, high = ends_of_gap(route.all_breaks, route.period, gap)
    off, begin_at = clearance(low, high), low if v > 0 else high
    panel = Panel(0.0, 0.0, contact_sign, (low + off, high - off))
    march = March((begin_at, 0.0), v, 0.0, 1.0)
    if has_flows(forces):
        fill_places(forces, march, panel, high - low, route.gaps, at, work)
    else:
        fill_gap(forces, march, panel, high - low, route.gaps, at, work)


@Inner
def kept_gap(forces, route, upcoming, v, contact_sign, work):  # type: ignore[no-untyped-def]
    """Return the position of the data kept of the gap ahead of the break at ``upcoming``, and its width; the data are
    filled in if they are not known yet.
    """
    gap = gap_behind(route, upcoming, v)
    low, high = ends_of_gap(route.all_breaks, route.period, gap)
    at = place_of_data(gap, v, contact_sign)
    if route.gaps[at] == 0.0:
        fill_kept_gap(forces, route, gap, v, contact_sign, at, work)
    return at, high - low


@Inner
def fill_block(forces, route, upcoming, v, contact_sign, to, work):  # type: ignore[no-untyped-def]
    """Fill in the data kept of the block of gaps ahead of the break at ``upcoming``, from ``route.gaps[to]`` on."""
    gaps, before, extremes = route.gaps, (0.0, 0.0), (inf, -inf)
    gaps[to] = REFUSED
    for k in range(BLOCK):
        at, _ = kept_gap(forces, route, upcoming + k, v, contact_sign, work)
        if gaps[at] != FILLED or not (forces.linear or gaps[at + WITH_FEW] > 0.0):
            return
        widen_bounds(1.0 + before[0], k == 0, gaps, at, to)
        if forces.linear:
            before, extremes = behind_gap(before, gaps, at), widen_range(extremes, before, gaps, at)
    if not forces.linear:
        forget_octaves(gaps, to - FIRST_OF_BLOCK, v)
        gaps[to] = FILLED
        return
    gaps[to + END_EXPM1], gaps[to + END_GAINED] = before
    middle, largest = keep_range(extremes[0], extremes[1], gaps, to, work)
    before = (0.0, 0.0)
    for k in range(BLOCK):
        at, width = kept_gap(forces, route, upcoming + k, v, contact_sign, work)
        read_gained(width, gaps, at, work)
        add_moments(width, before, middle, largest, work)
        before = behind_gap(before, gaps, at)
    to_time_coefficients(work, MOMENTS, gaps, to + FACTORS)
    gaps[to] = FILLED


@Inner
def kept_block(forces, route, upcoming, v, contact_sign, work):  # type: ignore[no-untyped-def]
    """Return the position of the data kept of the block of gaps ahead of the break at ``upcoming``, which are filled in
    if they are not known yet; -1 if none are kept, no block begins there, or it contains the end of the route or of a
    lap.
    """
    gap = gap_behind(route, upcoming, v)
    first = gap if v > 0 else gap + 1 - BLOCK
    is_whole = first % BLOCK == 0 and first + BLOCK <= route.all_breaks.size and upcoming + BLOCK < route.breaks.size
    if not is_whole or not keeps_blocks(route.gaps):
        return -1
    at = place_of_data(gap, v, contact_sign) + FIRST_OF_BLOCK
    if route.gaps[at] == 0.0:
        fill_block(forces, route, upcoming, v, contact_sign, at, work)
    return at
