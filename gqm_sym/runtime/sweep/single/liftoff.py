"""The first place of an orbit at which the track would have to pull, by formulas."""

from math import fabs, nan, pi
from typing import NamedTuple

from gqm_sym.runtime.arithmetic.elementary import sin
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.quadrature.time_panels import joints_between
from gqm_sym.runtime.sweep.orbit import Orbit
from gqm_sym.runtime.sweep.single.orbit_extremes import (
    FORCE,
    GRID_INTERVALS,
    GRID_POINTS,
    LARGEST,
    LEAST,
    MAX_GRIDS,
    MEAN_ROUNDING,
    PEAK_MARGIN,
    REFINEMENT,
    UPWARDS,
    WHOLE,
    find_peaks,
    frame_buffer,
    highest_top,
    is_resolved,
    line_buffer,
    peak_buffer,
    point_buffer,
    sample_loads,
    sum_buffer,
)

# The number of steps of the search for a zero of N between two points of a grid.
MAX_STEPS = 80

# What the search for a loss of contact comes to: the body keeps contact, it leaves the track, or that is not decided.
KEEPS, LEAVES, UNKNOWN = range(3)


class Loss(NamedTuple):
    """What the search comes to, and where a body leaves the track: the offset from its launch, and whether it has
    turned before.
    """

    what: int
    offset: float
    has_turned: bool


@Inner
def force_of(curve):  # type: ignore[no-untyped-def]
    """Return the force whose sign tells on which side of the track a body is, as a function that is searched."""
    return (FORCE if curve.signed else UPWARDS), 0, *WHOLE


@Inner
def sampled_forces(curve, way, side, begin, step, n, forces):  # type: ignore[no-untyped-def]
    """Fill N at n places of a way from the launch to its end, positive if the track pushes.

    The first place has the phase angle ``begin`` as a share of pi, in which the way begins at 0 and ends at 1; ``step``
    is that of the places.
    """
    shares, frame, outwards = line_buffer(), frame_buffer(), way.high > 0.0
    for i in range(n):
        share = sin(0.5 * pi * (begin + step * i)) ** 2
        shares[i] = share if outwards else 1.0 - share
    sample_loads(curve, way, force_of(curve), shares, n, forces, frame, False)
    for i in range(n):
        forces[i] *= side


@Inner
def force_at(curve, way, side, phase):  # type: ignore[no-untyped-def]
    """Return N at one phase angle of a way."""
    forces = point_buffer()
    sampled_forces(curve, way, side, phase, 0.0, 1, forces)
    return forces[0]


@Inner
def change_between(curve, way, side, pushes, pulls, forces):  # type: ignore[no-untyped-def]
    """Return the phase angle at which N changes its sign, between one at which the track pushes and one at which it
    pulls; ``forces`` are N at both.
    """
    f, g = forces
    for step in range(MAX_STEPS):
        middle = 0.5 * (pushes + pulls)
        phase = middle if step % 3 == 2 or not f > g else pushes + (pulls - pushes) * f / (f - g)
        if not pushes < phase < pulls:
            return phase if f > g else middle
        value = force_at(curve, way, side, phase)
        if value < 0.0:
            pulls, g = phase, value
        else:
            pushes, f = phase, value
        if value == 0.0:
            return phase
    return pulls


@Inner
def first_loss(curve, way, side, grids, range_of_force):  # type: ignore[no-untyped-def]
    """Return the first phase angle of a way at which the track would pull, on a grid on which it does so somewhere; NaN
    if a dip of N between points of the grid may be deeper than 0.
    """
    forces, step = line_buffer(), 1.0 / (grids * GRID_INTERVALS)
    before, f0, f1 = 0.0, 0.0, 0.0
    for grid in range(grids):
        first = grid * GRID_INTERVALS
        sampled_forces(curve, way, side, first * step, step, GRID_POINTS, forces)
        for i in range(min(grid, 1), GRID_POINTS):
            j, force = first + i, forces[i]
            if j == 0 and not fabs(force) > MEAN_ROUNDING * range_of_force:
                return nan  # N vanishes at the launch itself
            if force < 0.0:
                return change_between(curve, way, side, before, j * step, (f1, force)) if j > 0 else 0.0
            if j > 1 and f1 <= min(f0, force):
                bottom = f1 - 0.125 * (f0 - force) ** 2 / max(f0 - 2.0 * f1 + force, 1e-300)
                if not bottom > PEAK_MARGIN * (f0 + force - 2.0 * f1):
                    return nan
            before, f0, f1 = j * step, f1, force
    return nan


@Inner
def loss_on_way(curve, orbit, end, side):  # type: ignore[no-untyped-def]
    """Return the offset at which a body leaves the track between its launch and the offset ``end``, as a `Loss`."""
    low, high = min(end, 0.0), max(end, 0.0)
    way = Orbit(False, False, orbit.direction, orbit.lam0, orbit.v2, low, high, 0)
    sums, peaks, grids, force = sum_buffer(), peak_buffer(), 1, force_of(curve)
    while grids <= MAX_GRIDS:
        find_peaks(curve, way, force, -side, grids, sums, peaks)
        if is_resolved(sums, grids * GRID_INTERVALS, True):
            least, most = side * sums[LEAST], side * sums[LARGEST]
            if min(least, most) > 0.0:
                top, _ = highest_top(curve, way, force, -side, grids, sums, peaks)
                if top < 0.0:
                    return Loss(KEEPS, nan, False)
            else:
                phase = first_loss(curve, way, side, grids, max(fabs(least), fabs(most)))
                if phase == phase:
                    share = sin(0.5 * pi * phase) ** 2
                    return Loss(LEAVES, end * share, False)
        grids *= REFINEMENT
    return Loss(UNKNOWN, nan, False)


@Inner
def loss_by_itself(curve, orbit, side):  # type: ignore[no-untyped-def]
    """Return where a body leaves the track before it reaches an end of the curve, without a table.

    Parameters
    ----------
    side : int
        1 if the track can only push along the normal, -1 if only against it.
    """
    joints = joints_between(curve.joints, curve.period, orbit.lam0 + orbit.low, orbit.lam0 + orbit.high)
    if joints.size or curve.directed:
        return Loss(UNKNOWN, nan, False)
    ahead, behind = (orbit.high, orbit.low) if orbit.direction > 0 else (orbit.low, orbit.high)
    loss = loss_on_way(curve, orbit, ahead, side) if ahead != 0.0 else Loss(KEEPS, nan, False)
    if loss.what != KEEPS or behind == 0.0 or orbit.circulates or orbit.leaves == orbit.direction:
        return loss
    what, offset, _ = loss_on_way(curve, orbit, behind, side)
    return Loss(what, offset, offset != 0.0)


@Inner
def until_loss(orbit, offset, has_turned):  # type: ignore[no-untyped-def]
    """Return the part of an orbit up to a loss of contact, as the orbit of a body that leaves the curve there."""
    sense, turn = -orbit.direction if has_turned else orbit.direction, 0.0
    if has_turned:
        turn = orbit.high if orbit.direction > 0 else orbit.low
    low, high = min(turn, offset), max(turn, offset)
    return Orbit(False, False, orbit.direction, orbit.lam0, orbit.v2, low, high, sense)
