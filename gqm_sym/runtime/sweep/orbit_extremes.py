"""The smallest and largest speed or contact force on one of many orbits: the best point of a grid, refined."""

from math import pi, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.elementary import sin
from gqm_sym.runtime.compiled.calls import call_path_and_contact_force, call_potential_divdiff1
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.interface import PATH_ROWS

# Intervals of the first grid, in equal steps of the phase angle; how often the best point is refined; and the factor by
# which the step shrinks each time.
GRID_INTERVALS, REFINEMENTS, STEP_RATIO = 64, 2, 16.0

# The grid as shares of a lap, and as shares of a libration's width.
LAP_SHARES = np.arange(GRID_INTERVALS + 1) / GRID_INTERVALS
WIDTH_SHARES = np.sin(0.5 * pi * LAP_SHARES) ** 2
GRID_POINTS = GRID_INTERVALS + 1
line_buffer, pair_buffer, frame_buffer, point_buffer = (
    on_stack(n) for n in (GRID_POINTS, 2 * GRID_POINTS, PATH_ROWS * GRID_POINTS, 3)
)


@Inner
def sample_loads(fns, p, orbit, force, shares, n, out):  # type: ignore[no-untyped-def]
    """Fill V, or the contact force where ``force`` is set, at n shares of an orbit's width from its lower end.

    V**2 is its value at launch less what it loses from there. Next to a turning point this has the digits of the
    largest V**2 on the orbit, not those of the small value itself.
    """
    offsets, lam, rows, frame = line_buffer(), line_buffer(), pair_buffer(), frame_buffer()
    width = orbit.high - orbit.low
    for i in range(n):
        offsets[i] = orbit.low + width * shares[i]
        lam[i] = orbit.lam0 + offsets[i]
    call_potential_divdiff1(fns.potential_divdiff1, n, orbit.lam0, lam, offsets, p, rows)
    for i in range(n):
        out[i] = max(orbit.v2 - 2.0 * offsets[i] * rows[i], 0.0)
    if force:
        call_path_and_contact_force(fns.path_and_contact_force, n, lam, out, p, frame)
        for i in range(n):
            out[i] = frame[4 * n + i]
    else:
        for i in range(n):
            out[i] = sqrt(out[i])


@Inner
def extreme(fns, p, orbit, force, sign):  # type: ignore[no-untyped-def]
    """The largest (``sign`` 1) or smallest (-1) V on an orbit, or contact force where ``force`` is set.

    Parabolas through three points are laid again and again with a smaller step. At an extreme the function is flat, so
    its value has all digits as soon as the place has half of them. In a well that is even, V is largest in the middle.
    """
    if not (orbit.circulates or force or sign > 0.0):
        return 0.0  # at a turning point
    out, points, found = line_buffer(), point_buffer(), point_buffer()
    if orbit.even and not (orbit.circulates or force):
        points[0] = 0.5
        sample_loads(fns, p, orbit, force, points, 1, found)
        return found[0]
    sample_loads(fns, p, orbit, force, LAP_SHARES if orbit.circulates else WIDTH_SHARES, GRID_POINTS, out)
    best = 0
    for i in range(GRID_POINTS):
        if sign * out[i] > sign * out[best]:
            best = i
    # A libration passes the grid there and back, so that a turning point has the same neighbour on both sides.
    cycle = GRID_INTERVALS if orbit.circulates else 2 * GRID_INTERVALS
    before, after = (best - 1) % cycle, (best + 1) % cycle
    f0, f1, f2 = out[min(before, cycle - before)], out[best], out[min(after, cycle - after)]
    if orbit.circulates:
        f0, f2 = out[before], out[after]
    share, step, value = best / GRID_INTERVALS, 1.0 / GRID_INTERVALS, out[best]
    for k in range(REFINEMENTS + 1):
        curvature = sign * (f0 - 2.0 * f1 + f2)
        move = 0.5 * sign * (f0 - f2) / curvature if curvature < 0.0 else 0.0
        share += step * min(max(move, -1.0), 1.0)
        step /= STEP_RATIO
        points[0], points[1], points[2] = share, share - step, share + step
        if not orbit.circulates:
            for i in range(3):
                points[i] = sin(0.5 * pi * points[i]) ** 2
        sample_loads(fns, p, orbit, force, points, 3 if k < REFINEMENTS else 1, found)
        f1, f0, f2 = found[0], found[1], found[2]
        value = max(value, f1) if sign > 0.0 else min(value, f1)
    return value
