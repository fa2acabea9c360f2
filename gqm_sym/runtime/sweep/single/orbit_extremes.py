"""The smallest and largest speed or contact force on one of many orbits: the best point of a grid, refined."""

from math import fabs, floor, inf, pi, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.elementary import sin
from gqm_sym.runtime.compiled.calls import (
    call_path_and_contact_force,
    call_path_in_space,
    call_potential_divdiff1,
    call_rider_loads,
)
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.interface import PATH_ROWS, RIDER_ROWS, SPACE_ROWS
from gqm_sym.runtime.launch.rider import LEVEL_ROW, MIN_LEVEL

# The functions whose extremes are searched for: V**2; the contact force, if it has a sign; the square of its length,
# which is smooth also where the length almost vanishes; and the load on riders upwards, whose sign tells on which side
# of a track in space a body is.
V2, FORCE, FORCE_SQUARED, UPWARDS = range(4)

# The number of intervals of the first grid, in equal steps of the phase angle; the factors by which the step shrinks
# when the best point is refined for the first time and each time after that; and the factor by which it grows if the
# vertex of a parabola lies outside of it.
GRID_INTERVALS, FIRST_STEP_RATIO, STEP_RATIO, GROWTH = 64, 4.0, 16.0, 4.0

# A grid that does not resolve the orbit or one of its peaks is followed by one that is finer by this factor, up to so
# many grids of the first size side by side.
REFINEMENT, MAX_GRIDS = 4, 256

# A grid resolves a function if its mean over every second point is the same up to this share of its range, and up to
# rounding. The mean of the contact force converges later than those of the coordinates and of ds, which vary where the
# curve bends; only these show a bend that is shorter than the grid's steps.
MAX_MEAN_CHANGE, MAX_FORCE_MEAN_CHANGE, MEAN_ROUNDING = 1e-8, 1e-4, 1e-13

# The largest number of refinements of the best point. Refinement ends if the parabola through the last three values
# rises above the middle one by less than this share of the largest value on the grid, and if its step is so small that
# its top, which is off by the fourth power of the step, has all digits.
MAX_REFINEMENTS, MAX_GAIN, MAX_LAST_STEP = 13, 1e-15, 1e-4

# A point of the grid stands for one peak if the second difference at it is proportional to the square of the step, up
# to this share and up to rounding. Otherwise two peaks and the dip between them may lie within one step, as where a
# maximum in the middle of a well has just become two beside it. If the second difference is smaller, a peak at the
# end of the grid may also be flat, as that of a force which changes with V**4 beside a turning point: then there is no
# dip if the second difference keeps its sign while the step shrinks.
MAX_BEND_CHANGE, BEND_ROUNDING = 0.25, 2e-15

# The square of a length that is only a rounding of the largest length, as a share of the square of the latter.
SMALLEST_SQUARE = 1e-32

# The shares of a libration's period between which it is searched, if it is passed as a whole. A period begins at the
# lower turning point.
WHOLE = (0.0, 1.0)

# The grid as shares of a lap, and as shares of a libration's width.
LAP_SHARES = np.arange(GRID_INTERVALS + 1) / GRID_INTERVALS
WIDTH_SHARES = np.sin(0.5 * pi * LAP_SHARES) ** 2
GRID_POINTS = GRID_INTERVALS + 1
# The data of each function on a grid: the sums over all points and over every second one, the smallest value and the
# largest. The functions are the quantity whose extreme is searched for and, with the contact force, x, z and ds.
SUM, COARSE_SUM, LEAST, LARGEST = range(4)
FUNCTIONS, COORDINATES = 4, 3
# The number of highest peaks of a grid that are kept, and the number of values for each: the top of the parabola, the
# point of the grid, and the values before, at and after it. Peaks within the third share of the range from the highest
# are refined, because the grid does not distinguish them.
PEAKS, PEAK_ROW, PEAK_MARGIN = 4, 5, 0.02
line_buffer, pair_buffer, frame_buffer, vector_buffer, rider_buffer, point_buffer, sum_buffer, peak_buffer = (
    on_stack(n)
    for n in (
        *(GRID_POINTS, 2 * GRID_POINTS, PATH_ROWS * GRID_POINTS, SPACE_ROWS * GRID_POINTS, RIDER_ROWS * GRID_POINTS),
        *(3, 4 * FUNCTIONS, PEAKS * PEAK_ROW),
    )
)


@Inner
def fill_squares(curve, direction, n, lam, v2, out):  # type: ignore[no-untyped-def]
    """Fill the square of the contact force at n places for a direction of motion, on which it depends."""
    vector = vector_buffer()
    call_path_in_space(curve.path_in_space, n, lam, v2, float(direction), curve.p, vector)
    for i in range(n):
        out[i] = vector[n + i] ** 2 + vector[2 * n + i] ** 2 + vector[3 * n + i] ** 2


@Inner
def fill_force(curve, function, n, lam, v2, frame, out):  # type: ignore[no-untyped-def]
    """Fill the contact force at n places, or the square of its length or the load upwards if that is the function that
    is searched, and ``frame`` with the path.
    """
    call_path_and_contact_force(curve.fns.path_and_contact_force, n, lam, v2, curve.p, frame)
    if function == UPWARDS:
        loads = rider_buffer()
        call_rider_loads(curve.rider_loads, n, lam, v2, 1.0, 1.0, curve.p, loads)
        for i in range(n):
            out[i] = loads[i] if loads[LEVEL_ROW * n + i] >= MIN_LEVEL else np.nan
        return
    for i in range(n):
        force = frame[4 * n + i]
        out[i] = force * force if function == FORCE_SQUARED else force


@Inner
def is_loop(orbit, sought):  # type: ignore[no-untyped-def]
    """Return whether the function that is sought is searched along a whole lap or period.

    ``sought`` has the function that is searched; the direction of motion at launch if the force depends on it,
    otherwise 0; and the shares of a period between which it is then searched on a libration (`WHOLE`). That is so for
    circulations, and for librations if the force depends on the direction of motion.
    """
    return orbit.circulates or (sought[1] != 0 and orbit.leaves == 0 and sought[3] - sought[2] == 1.0)


@Inlined
def moving_at(orbit, sought, share):  # type: ignore[no-untyped-def]
    """Return a place on an orbit, as a share of the orbit's width from its lower end, and the sign of ds/dt there;
    ``sought`` is that of `is_loop`.

    ``share`` is one of a lap, of a period of a libration or a part of it, or of the way of a body that leaves the
    curve. If that body turns on its way, the root of its distance from the turning point, with the sign of ds/dt, grows
    in equal steps, because the speed is smooth in it.
    """
    direction = sought[1]
    if orbit.circulates:
        return share, direction
    if orbit.leaves == 0:
        share = sought[2] + (sought[3] - sought[2]) * share
        return sin(pi * share) ** 2, 1 if floor(2.0 * share) % 2.0 == 0.0 else -1
    turn = orbit.low if orbit.leaves > 0 else orbit.high
    begin = 0.0 if orbit.leaves == direction else -sqrt(fabs(turn) / (orbit.high - orbit.low))
    root = begin + (1.0 - begin) * share
    away = share if orbit.leaves == direction and orbit.v2 > 0.0 else root * root
    return away if orbit.leaves > 0 else 1.0 - away, orbit.leaves if root >= 0.0 else -orbit.leaves


@Inner
def sample_loads(curve, orbit, sought, shares, n, out, frame, with_path):  # type: ignore[no-untyped-def]
    """Fill the function that is sought (`is_loop`) at n shares of an orbit's width from its lower end.

    If the force depends on the direction of motion, they are the shares of `moving_at`. For the contact force, and only
    then, ``frame`` is filled with the path, unless ``with_path`` is false and it is not needed. V**2 is its value at
    launch less its decrease from there. Next to a turning point its error is a rounding of the largest V**2 on the
    orbit, not of the small value itself.
    """
    offsets, lam, rows, v2 = line_buffer(), line_buffer(), pair_buffer(), line_buffer()
    width = orbit.high - orbit.low
    for i in range(n):
        share = moving_at(orbit, sought, shares[i])[0] if sought[1] != 0 else shares[i]
        offsets[i] = orbit.low + width * share
        lam[i] = orbit.lam0 + offsets[i]
    call_potential_divdiff1(curve.fns.potential_divdiff1, n, orbit.lam0, lam, offsets, curve.p, rows)
    for i in range(n):
        out[i] = v2[i] = max(orbit.v2 - 2.0 * offsets[i] * rows[i], 0.0)
    if sought[0] == V2:
        return
    if sought[1] == 0:
        fill_force(curve, sought[0], n, lam, v2, frame, out)
        return
    if with_path:
        call_path_and_contact_force(curve.fns.path_and_contact_force, n, lam, v2, curve.p, frame)
    begin = 0
    while begin < n:
        way, end = moving_at(orbit, sought, shares[begin])[1], begin + 1
        while end < n and moving_at(orbit, sought, shares[end])[1] == way:
            end += 1
        fill_squares(curve, way, end - begin, lam[begin:end], v2[begin:end], out[begin:end])
        begin = end


@Inner
def resolution(function, value, size):  # type: ignore[no-untyped-def]
    """Return the size whose roundings a value has, if the largest value on the orbit is ``size``.

    A length has roundings of the largest length, so its square has roundings of the product of both.
    """
    if function != FORCE_SQUARED:
        return size
    return sqrt(size * max(fabs(value), SMALLEST_SQUARE * size))


@Inner
def accumulate(sums, at, value, weight, is_coarse):  # type: ignore[no-untyped-def]
    """Add the value of a function at a point of the grid to the function's data, which begin at the index ``at``."""
    sums[at + SUM] += weight * value
    if is_coarse:
        sums[at + COARSE_SUM] += 2.0 * weight * value
    sums[at + LEAST], sums[at + LARGEST] = min(sums[at + LEAST], value), max(sums[at + LARGEST], value)


@Inner
def is_resolved(sums, intervals, force):  # type: ignore[no-untyped-def]
    """Return whether a grid of so many intervals resolves the functions sampled on it."""
    for k in range(FUNCTIONS if force else 1):
        at = k * FUNCTIONS
        share = MAX_FORCE_MEAN_CHANGE if force and k == 0 else MAX_MEAN_CHANGE
        least, largest = sums[at + LEAST], sums[at + LARGEST]
        allowed = share * (largest - least) + MEAN_ROUNDING * max(fabs(least), fabs(largest))
        if not fabs(sums[at + SUM] - sums[at + COARSE_SUM]) <= allowed * intervals:
            return False
    return True


@Inner
def note_peak(peaks, sign, j, f0, f1, f2):  # type: ignore[no-untyped-def]
    """Keep the point ``j`` of the grid if its value is not exceeded by its neighbours and is among the highest so
    far.
    """
    if sign * f1 < max(sign * f0, sign * f2):
        return
    curvature = sign * (f0 - 2.0 * f1 + f2)
    top = sign * f1 - 0.125 * (f0 - f2) ** 2 / curvature if curvature < 0.0 else sign * f1
    at = PEAKS * PEAK_ROW
    while at > 0 and top > peaks[at - PEAK_ROW]:
        at -= PEAK_ROW
        if at + PEAK_ROW < PEAKS * PEAK_ROW:
            for i in range(PEAK_ROW):
                peaks[at + PEAK_ROW + i] = peaks[at + i]
    if at < PEAKS * PEAK_ROW:
        peaks[at], peaks[at + 1], peaks[at + 2], peaks[at + 3], peaks[at + 4] = top, j, f0, f1, f2


@Inner
def find_peaks(curve, orbit, sought, sign, grids, sums, peaks):  # type: ignore[no-untyped-def]
    """Find the highest peaks of a grid that consists of ``grids`` grids of the first size side by side.

    A libration passes the grid there and back, so that a turning point has the same neighbour on both sides. In the
    phase angle, any function is even about the end of a curve too.
    """
    out, shares, frame, force = line_buffer(), line_buffer(), frame_buffer(), sought[0] != V2
    loop = is_loop(orbit, sought)
    count, f0, f1, second = grids * GRID_INTERVALS, 0.0, 0.0, 0.0
    for k in range(FUNCTIONS):
        at = k * FUNCTIONS
        sums[at + SUM], sums[at + COARSE_SUM], sums[at + LEAST], sums[at + LARGEST] = 0.0, 0.0, inf, -inf
    for k in range(PEAKS):
        peaks[k * PEAK_ROW] = -inf
    for grid in range(grids):
        for i in range(GRID_POINTS):
            shares[i] = LAP_SHARES[i] if loop else WIDTH_SHARES[i]
            if grids > 1:
                share = (grid + LAP_SHARES[i]) / grids
                shares[i] = share if loop else sin(0.5 * pi * share) ** 2
        sample_loads(curve, orbit, sought, shares, GRID_POINTS, out, frame, True)
        for i in range(min(grid, 1), GRID_POINTS):
            j = grid * GRID_INTERVALS + i
            weight, is_coarse = 0.5 if j in (0, count) else 1.0, i % 2 == 0
            accumulate(sums, 0, out[i], weight, is_coarse)
            for k in range(COORDINATES if force else 0):
                accumulate(sums, (1 + k) * FUNCTIONS, frame[k * GRID_POINTS + i], weight, is_coarse)
            second = out[i] if j == 1 else second
            if j > 1 or (j == 1 and not loop):
                note_peak(peaks, sign, j - 1, out[i] if j == 1 else f0, f1, out[i])
            f0, f1 = f1, out[i]
    note_peak(peaks, sign, count, f0, f1, second if loop else f0)


@Inner
def top_of(curve, orbit, sought, sign, peak, step, size):  # type: ignore[no-untyped-def]
    """Return the value at a peak of a grid with steps of ``step``, and the share of the grid at which it is; NaN if the
    parabolas do not converge to it, or if there may be more than one peak within a step.
    """
    points, found, frame = point_buffer(), point_buffer(), frame_buffer()
    f0, f1, f2 = peak[2], peak[3], peak[4]
    share, value, expected, is_flat, grid_step = peak[1] * step, f1, 0.0, False, step
    at = share
    for k in range(MAX_REFINEMENTS):
        tilt, bend, scale = sign * (f0 - f2), sign * (f0 - 2.0 * f1 + f2), resolution(sought[0], f1, size)
        if k == 1 and not fabs(bend - expected) <= MAX_BEND_CHANGE * fabs(expected) + BEND_ROUNDING * scale:
            is_flat = bend > expected and peak[1] * (peak[1] * grid_step - 1.0) == 0.0
            if not is_flat:
                return np.nan, share
        if is_flat and not bend <= BEND_ROUNDING * scale:
            return np.nan, share
        ratio = FIRST_STEP_RATIO if k == 0 else STEP_RATIO
        expected = bend / ratio**2
        move = 0.5 * tilt / bend if bend < 0.0 else 0.0
        gain = -0.25 * tilt * move if bend < 0.0 else 0.5 * (fabs(tilt) + bend)
        if k > 0 and step <= MAX_LAST_STEP and gain <= MAX_GAIN * scale:
            return value, at
        share += step * min(max(move, -1.0), 1.0)
        step *= 1.0 / ratio if fabs(move) < 1.0 else GROWTH
        points[0], points[1], points[2] = share, share - step, share + step
        if not is_loop(orbit, sought):
            for i in range(3):
                points[i] = sin(0.5 * pi * points[i]) ** 2
        sample_loads(curve, orbit, sought, points, 3, found, frame, False)
        f1, f0, f2 = found[0], found[1], found[2]
        if sign * f1 > sign * value:
            value, at = f1, share
    return np.nan, share


@Inner
def highest_top(curve, orbit, sought, sign, grids, sums, peaks):  # type: ignore[no-untyped-def]
    """Return ``sign`` times the value at the highest peak of a grid, and the share of the grid at which it is; NaN if
    the grid is too coarse for one of them.
    """
    least, largest = sums[LEAST], sums[LARGEST]
    size, step, best = max(fabs(least), fabs(largest)), 1.0 / (grids * GRID_INTERVALS), -inf
    at = 0.0
    for k in range(PEAKS):
        if peaks[k * PEAK_ROW] >= peaks[0] - PEAK_MARGIN * (largest - least):
            value, share = top_of(curve, orbit, sought, sign, peaks[k * PEAK_ROW : (k + 1) * PEAK_ROW], step, size)
            if value != value:
                return value, share
            if sign * value > best:
                best, at = sign * value, share
    return best, at


@Inner
def extreme(curve, orbit, sought, sign, max_grids):  # type: ignore[no-untyped-def]
    """Return the largest (``sign`` 1) or smallest (-1) V or contact force on an orbit, and the share of `find_peaks`'s
    grid at which it is; `is_loop` explains ``sought``.

    Parabolas through three points are repeated with smaller and smaller steps. At an extreme the function is flat, so
    its value is accurate to all digits as soon as the place has half of them. The parabolas are fitted to V**2, because
    V has a kink where the body almost stops. In an even well, V is largest in the middle. The value is NaN if a grid
    that consists of ``max_grids`` grids of the first size is too coarse.
    """
    force = sought[0] != V2
    meets_turn = orbit.v2 == 0.0 or not (orbit.circulates or orbit.leaves == orbit.direction)
    if meets_turn and not (force or sign > 0.0):
        return 0.0, 0.0
    sums, peaks = sum_buffer(), peak_buffer()
    if orbit.even and not (orbit.circulates or force):
        points, frame = point_buffer(), frame_buffer()
        points[0] = 0.5
        sample_loads(curve, orbit, sought, points, 1, sums, frame, False)
        return sqrt(sums[0]), 0.5
    grids = 1
    while grids <= max_grids:
        find_peaks(curve, orbit, sought, sign, grids, sums, peaks)
        if is_resolved(sums, grids * GRID_INTERVALS, force):
            best, share = highest_top(curve, orbit, sought, sign, grids, sums, peaks)
            if best == best:
                return sign * best if sought[0] == FORCE else sqrt(sign * best), share
        grids *= REFINEMENT
    return np.nan, 0.0
