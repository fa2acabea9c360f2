"""Compiled code that passes changes of a motion with losses on from leg to leg, and reads them off at given times.

Here y, sigma and ``delay`` are the changes of W, of the place and of the time at a given distance from a moving origin
(`equation`). At a given place W changes by ``y - F sigma``, and the time by ``delay - v sigma ds/V`` with v =
sgn(dlam/dt). Both halves of a leg must agree on these in the middle, which determines the change of the turn at the
end. A body that is thrown slowly and speeds up is followed from the place at which it would have been at rest, so that
nothing is divided by its speed.

A change of an origin has ORIGIN_ROWS rows with a number for each variable, which are the run-time parameters, lam0 and
v0: sigma, y, ``delay``, and ``arc``, the change of the arc length from launch, less ds/dlam times that of the place.
"""

from math import fabs, inf, nan, sqrt

import numpy as np
from numba import types

from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, REAL, VECTOR
from gqm_sym.runtime.gradients.path import path_changes
from gqm_sym.runtime.legs.leg_record import AHEAD, BACK, HALF_C, HEADING, LAPS_BEFORE, START_V2
from gqm_sym.runtime.legs.panels.polynomials import COUNT, WIDE
from gqm_sym.runtime.legs.variations.divided import divided, joined_law, states_of_parts
from gqm_sym.runtime.legs.variations.equation import (
    CONTACT_SIGN,
    CUBE,
    MARKS,
    MOVES,
    OUTWARD,
    PANEL_BEGIN,
    PANEL_HEADING,
    PANEL_WIDTH,
    PANELS_OF_RUNS,
    PLACE,
    PLACE_LOW,
    STATE_HEADING,
    STATE_SIGN,
    TO_END,
    TO_START,
    WHOLE,
    W,
    end_speed,
    lay_panels,
    lay_states,
    place_on,
)
from gqm_sym.runtime.legs.variations.solving import jump, solve_panels

SIGMA, Y, DELAY, ARC, ORIGIN_ROWS = range(5)

# At a cusp ds/dlam is no larger than this share of its value in the middle of the first panel.
CUSP_SHARE = 1e-10

# The launch speed, the chosen direction, and the force dW/dlam on a body at rest that moves the other way.
THROWN = types.UniTuple(REAL, 3)

# The solutions on all panels, and the changes of origins and of ends (`follow`).
FOLLOWED = types.Tuple((CUBE, CUBE, CUBE))

# The rows of changes of states.
LAM, S, X, SPEED_ROW, Y_ROW, ARC_ROW, STATE_ROWS = 0, 1, 2, 4, 6, 7, 8


@Inner
def mixed(origin, solutions, begin, step, parameters, variable):  # type: ignore[no-untyped-def]
    """Return the sum of solutions for a variable; on a line they follow each other from an index on, a step apart."""
    n = parameters
    found = origin[SIGMA, variable] * solutions[begin + n * step]
    found += origin[Y, variable] * solutions[begin + (n + 1) * step]
    return found + solutions[begin + variable * step] if variable < n else found


@Inner
def go_ahead(origin, solutions, parameters):  # type: ignore[no-untyped-def]
    """Carry a change from the start of a half to its end, with the solutions on its last panel."""
    n = parameters
    for i in range(n + 2):
        later = mixed(origin, solutions, COUNT, WIDE, n, i)
        origin[Y, i] = mixed(origin, solutions, (n + 2) * WIDE + COUNT, WIDE, n, i)
        origin[DELAY, i] += later
        if i < n:
            origin[ARC, i] += solutions[(2 * n + 4 + i) * WIDE + COUNT]


@Inner
def go_back(origin, solutions, parameters, force, step, rate):  # type: ignore[no-untyped-def]
    """Carry a change from the middle of a run to its end, with the solutions on the last panel of the half from there.

    The end moves with the middle, and in addition by the amount for which both halves agree in the middle.

    Parameters
    ----------
    force : float
        dW/dlam at the end.
    step : float
        The jump of the force in the middle.
    rate : float
        dt/dlam in the middle.
    """
    n = parameters
    ends = (n + 2) * WIDE + COUNT
    for i in range(n + 2):
        y, origin[Y, i] = origin[Y, i], 0.0
        more = mixed(origin, solutions, ends, WIDE, n, i) - y - step * origin[SIGMA, i]
        more /= force * solutions[ends + (n + 1) * WIDE]
        origin[SIGMA, i] += more
        origin[DELAY, i] += mixed(origin, solutions, COUNT, WIDE, n, i) + rate * more
        if i < n:
            origin[ARC, i] -= solutions[(2 * n + 4 + i) * WIDE + COUNT]


@Inner
def launched(moves, thrown, heading, ds, ds_ahead, force, origin):  # type: ignore[no-untyped-def]
    """Fill the change of the launch, given ds/dlam there and ahead, and dW/dlam; ``moves`` is that of the launch place.

    A body at rest that is thrown the other way comes back with little less speed. At a cusp, where ds/dlam and dW/dlam
    have the limit of their ratio from ahead (`formula_changes.take_from_ahead`), times after a release at rest do not
    change with the place; a body that is thrown the other way leaves the curve, and the change with the speed is NaN.
    """
    (v0, direction, other_force), last = thrown, moves.size - 1
    origin[:, :] = 0.0
    for i in range(moves.size):
        origin[SIGMA, i], origin[ARC, i] = moves[i], -(ds * moves[i])
    origin[Y, last] = 2.0 * v0
    if v0 == 0.0:
        starts_at_cusp = ds <= CUSP_SHARE * ds_ahead
        if starts_at_cusp:
            origin[SIGMA, last - 1], origin[ARC, last - 1] = 0.0, 0.0
        turned = nan if starts_at_cusp else 2.0 * ds / fabs(other_force)
        origin[DELAY, last] = -2.0 * ds / fabs(force) if direction == heading else turned


@Inner
def follow(laid, law, moves, thrown, lap, breaks, timed):  # type: ignore[no-untyped-def]
    """Solve the variational equation on all panels, and carry the change of the launch from run to run.

    Parameters
    ----------
    laid : PANELS_OF_RUNS
        The runs.
    law : array
        The law in the states of `equation.lay_states`.
    moves : (n + 2,) array
        The change of the launch place.
    thrown : THROWN
    lap : (n + 2,) array
        The change of the period of the curve's parameter.
    breaks : array
        The places at which the force may jump.
    timed : bool
        Whether times are needed. Otherwise the results are complete only as far as SIGMA of ``ends`` depends on them,
        and so does what is needed of the law (`solving.solve_panels`).

    Returns
    -------
    solutions : (panels, 3 * n + 4, WIDE) array
        The solutions.
    origins, ends : (halves, ORIGIN_ROWS, n + 2) and (runs, ORIGIN_ROWS, n + 2) arrays
        The changes where each half begins, and where each run ends: at the turn, or at a place that moves with the
        origin of its last half.
    """
    records, begins, first, panels = laid
    runs, n = begins.size, lap.size - 2
    solutions, origin = np.empty((panels.shape[0], 3 * n + 4, WIDE)), np.empty((ORIGIN_ROWS, n + 2))
    origins, ends = np.empty((2 * runs, ORIGIN_ROWS, n + 2)), np.empty((runs, ORIGIN_ROWS, n + 2))
    rows = solutions.shape[1] * WIDE
    solve_panels(panels, first, law, n, breaks, solutions, timed)
    # Where no times are needed, ds/dlam is not known.
    ahead = law[0, MARKS * runs + COUNT // 2] if timed else -inf
    launched(moves, thrown, records[begins[0] + HEADING], law[0, 0], ahead, law[n + 2, 0], origin)
    forces, laps = law[n + 2, MARKS * runs :], 0.0
    for k in range(runs):
        record, ds = records[begins[k] :], law[0, k]
        v, v2, was_ahead = record[HEADING], record[START_V2], record[AHEAD] > 0.0
        folded, laps = record[LAPS_BEFORE] - laps, record[LAPS_BEFORE]
        begin, middle, end = first[2 * k], first[2 * k + 1], first[2 * k + 2]
        for i in range(n + 2):
            origin[SIGMA, i] -= folded * lap[i]
            origin[ARC, i] += ds * folded * lap[i]
        if was_ahead:
            if k > 0 and begin == first[2 * k - 1]:  # the run begins at the end of the last one
                step = jump(panels, forces, breaks, begin - 1, begin, TO_START)
                for i in range(n + 2):
                    origin[Y, i] += step * origin[SIGMA, i]
            if v2 > 0.0 and record[HALF_C] < inf:
                for i in range(n + 2):
                    moved = -origin[Y, i] / law[n + 2, k]
                    origin[SIGMA, i] += moved
                    origin[DELAY, i] += v * ds * moved / sqrt(v2)
                    origin[Y, i] = 0.0
            origins[2 * k] = origin
            go_ahead(origin, solutions[middle - 1].reshape(rows), n)
            for i in range(n + 2):
                origin[SIGMA, i] *= panels[middle - 1, MOVES]
        if record[BACK] > 0.0:
            speed, step = sqrt(v2), 0.0
            if was_ahead:
                speed = end_speed(panels[middle - 1])
                step = jump(panels, forces, breaks, middle - 1, end - 1, TO_END)
            rate = v * law[0, 2 * runs + k] / speed
            go_back(origin, solutions[end - 1].reshape(rows), n, law[n + 2, runs + k], step, rate)
            origins[2 * k + 1] = origin
        ends[k] = origin
    return solutions, origins, ends


@entry(types.Tuple((WHOLE, MATRIX, MATRIX))(VECTOR, WHOLE), checked=False)
def lay(records, begins):  # type: ignore[no-untyped-def]
    """Return the panels of runs (`equation.lay_panels`), and the states in which the law is needed."""
    first, panels = lay_panels(records, begins)
    return first, panels, lay_states(records, begins, first, panels)


@entry(types.Tuple((WHOLE, MATRIX, WHOLE, MATRIX))(WHOLE, MATRIX, VECTOR), checked=False)
def divide(first, panels, slopes):  # type: ignore[no-untyped-def]
    """Return what `divided.divided` does, and the states at the nodes of the parts."""
    first, panels, before = divided(first, panels, slopes)
    return first, panels, before, states_of_parts(panels, before)


@entry(MATRIX(MATRIX, INTEGER, MATRIX, WHOLE), checked=False)
def join_law(law, marks, of_parts, before):  # type: ignore[no-untyped-def]
    """Return what `divided.joined_law` does."""
    return joined_law(law, marks, of_parts, before)


@entry(FOLLOWED(PANELS_OF_RUNS, MATRIX, VECTOR, THROWN, VECTOR, VECTOR), checked=False)
def follow_changes(laid, law, moves, thrown, lap, breaks):  # type: ignore[no-untyped-def]
    """Return what `follow` does, with times."""
    return follow(laid, law, moves, thrown, lap, breaks, True)


@Inner
def panel_at(first, panels, half, w):  # type: ignore[no-untyped-def]
    """Return the panel of a half at a march variable, by bisection."""
    low, high = first[half], first[half + 1] - 1
    while low < high:
        middle = (low + high + 1) // 2
        if panels[middle, PANEL_BEGIN] <= w:
            low = middle
        else:
            high = middle - 1
    return low


@entry(types.void(PANELS_OF_RUNS, CUBE, CUBE, WHOLE, MATRIX, INTEGER, CUBE, MATRIX), checked=False)
def fill_along(laid, series, origins, halves, points, rows, found, states):  # type: ignore[no-untyped-def]
    """Fill the changes of states at march variables.

    Parameters
    ----------
    laid : PANELS_OF_RUNS
        The runs.
    series : (panels, COUNT, 3 * n + 4) array
        The Chebyshev coefficients of the solutions.
    origins : array
        The changes where each half begins.
    halves : (m,) array of int
        The half that each state is on.
    points : (2, m) array
        The march variables, and V**2.
    rows : int
        The number of solutions that are needed: all, or those of the time.
    found : (ORIGIN_ROWS, n + 2, m) array
        Changes as of origins, at given distances from them, but ``y`` as a share of V**2; they are filled.
    states : (5, m) array
        The states (`law.States`), which are filled.
    """
    first, panels, n = laid[2], laid[3], found.shape[1] - 2
    sums, whole = np.empty(series.shape[2]), rows > n + 2
    for i in range(halves.size):
        half, w = halves[i], points[0, i]
        k, origin = panel_at(first, panels, half, w), origins[half]
        panel = panels[k]
        x = min(max(2.0 * (w - panel[PANEL_BEGIN]) / panel[PANEL_WIDTH] - 1.0, -1.0), 1.0)
        before, wave = x, 1.0
        sums[:] = 0.0
        for j in range(COUNT):
            terms = series[k, j]
            for row in range(rows):
                sums[row] += wave * terms[row]
            before, wave = wave, 2.0 * x * wave - before
        direction = panel[PANEL_HEADING] * panel[OUTWARD]
        for j in range(n + 2):
            found[SIGMA, j, i] = origin[SIGMA, j] * panel[MOVES]
            found[Y, j, i] = mixed(origin, sums, n + 2, 1, n, j) if whole else 0.0
            found[DELAY, j, i] = origin[DELAY, j] + direction * mixed(origin, sums, 0, 1, n, j)
            found[ARC, j, i] = origin[ARC, j] + (sums[2 * n + 4 + j] if whole and j < n else 0.0)
        states[PLACE, i], states[PLACE_LOW, i] = place_on(panel, w)
        states[W, i], states[STATE_HEADING, i], states[STATE_SIGN, i] = (
            points[1, i],
            panel[PANEL_HEADING],
            panel[CONTACT_SIGN],
        )


@entry(types.void(CUBE, MATRIX, CUBE, VECTOR, CUBE), checked=False)
def fill_states(along, law, path, v, found):  # type: ignore[no-untyped-def]
    """Fill the changes of states at given times; at a release from a cusp, where ds/dlam vanishes, nothing moves.

    Parameters
    ----------
    along : (ORIGIN_ROWS, n + 2, m) array
        The results of `fill_along`.
    law, path : arrays
        The law (`law.Law.matrix`) and the path (`gradients.path.PathRows`) there.
    v : (m,) array
        The velocities.
    found : (STATE_ROWS, n + 2, m) array
        Rows of lam, s, x, z, v, N, y, and the change ``arc``; they are filled.
    """
    variables, ds, force = along.shape[1], law[0], law[along.shape[1]]
    for j in range(variables):
        sigma, share, delay, arc = along[SIGMA, j], along[Y, j], along[DELAY, j], along[ARC, j]
        lam, s, faster = found[LAM, j], found[S, j], found[SPEED_ROW, j]
        found[ARC_ROW, j] = arc
        for i in range(v.size):
            rate = 1.0 if v[i] == 0.0 and ds[i] == 0.0 else ds[i]
            lam[i] = sigma[i] - v[i] / rate * delay[i]
            s[i] = (ds[i] * sigma[i] + arc[i]) - v[i] * delay[i]
            faster[i] = 0.5 * v[i] * share[i] - 0.5 * force[i] / rate * delay[i]
    path_changes(path, v, found[LAM], found[X : Y_ROW + 1])
