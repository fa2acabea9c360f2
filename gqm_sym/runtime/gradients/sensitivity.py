"""Derivatives of states at given times with respect to launch and parameters, after any number of periods.

At a fixed phase angle everything changes smoothly. When a variable changes, the body reaches a phase angle earlier or
later, by the changes of the time along the orbit, of the time of the launch on it, and of the elapsed periods. Below,
``delay`` is the time by which the body is further along the changed orbit.
"""

from collections.abc import Sequence
from math import pi, sin
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.runtime.compiled.calls import call_path_and_contact_force
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.double_double.interpreter import BLOCK as LANES
from gqm_sym.runtime.double_double.interpreter import ERROR, LOW, ROW, call_interpreter
from gqm_sym.runtime.gradients.evaluation import CUBE, PROGRAM, begin
from gqm_sym.runtime.gradients.formula_orbit import FormulaOrbitDerivatives
from gqm_sym.runtime.gradients.orbit import OrbitDerivatives
from gqm_sym.runtime.gradients.path import DS, POTENTIAL, PathRows, fill_changed, path_changes
from gqm_sym.runtime.gradients.series import PanelSeries, Series, add_series, fill_waves
from gqm_sym.runtime.inversion.records import FUNCTIONS, find_phases, section

# The rows of launch place and speed among the variables (`programs.Source`).
LAM0, V0 = -3, -2

# The rows of points on an orbit (`records.phases_along`): the phase angle, the velocity, the sign of the change of the
# phase angle with time, the numbers of half periods (or laps) and of laps before the point, and the place in the lap.
PHASE, SPEED, SENSE, TURNS, LAPS, PLACE, POINT_ROWS = range(7)

# The rows of the constants of an orbit, with a number for each variable: the changes of the half period (or the time of
# a lap), of the time at which the phase begins, of the arc length from launch at that time, of the arc length of a lap,
# of the length of a lap in lam, and of both turning points; and the relative change of the width.
DURATION, LAUNCH_DELAY, LAUNCH_ARC, LAP_ARC, LAP, LOWER, UPPER, WIDENING, CONSTANTS = range(9)

# The number of points that are evaluated together; for more of them the system would provide memory anew each time.
BLOCK = 2048

# The number of times from which on a thread is worth starting.
MIN_TIMES_PER_THREAD = 2048

# The rows of changes of states.
LAM, S, X, V, N, Y, STATE_ROWS = 0, 1, 2, 4, 5, 6, 7


class Sensitivity(NamedTuple):
    """The derivatives of a state at given times.

    Each array has one row for each name in ``wrt``, of the shape of the times.

    Attributes
    ----------
    wrt : tuple of str
        The variables of differentiation: run-time parameters, the launch place ``lam0`` and the launch speed ``v0``.
    lam, s, x, z, v, normal_force, y : array
        Derivatives of the curve parameter, of arc length from launch, of the coordinates, of the velocity ds/dt and of
        the contact force, at fixed times. That of y is 0 along a planar curve.
    """

    wrt: tuple[str, ...]
    lam: Array
    s: Array
    x: Array
    z: Array
    v: Array
    normal_force: Array
    y: Array


@Inner
def fill_shares(points, scale, share, upper):  # type: ignore[no-untyped-def]
    """Fill the shares of the phase at points, and those by which places move with the upper turning point."""
    for i in range(share.size):
        share[i] = points[PHASE, i] / scale
        upper[i] = sin(pi * share[i]) ** 2


@Inner
def fill_at_phase(orbit, j, share, upper, place):  # type: ignore[no-untyped-def]
    """Fill the changes with the j-th variable of places within the lap, at fixed phase angles."""
    lap, lower, high = orbit[LAP, j], orbit[LOWER, j], orbit[UPPER, j]
    for i in range(share.size):
        place[i] = lap * share[i] + lower * (1.0 - upper[i]) + high * upper[i]


@Inner
def fill_delays(points, orbit, j, later, scale, delay):  # type: ignore[no-untyped-def]
    """Fill the delays with the j-th variable, given the changes of the time along the orbit."""
    launch, duration, turns, sense = orbit[LAUNCH_DELAY, j], orbit[DURATION, j], points[TURNS], points[SENSE]
    for i in range(delay.size):
        delay[i] = launch - turns[i] * duration - sense[i] * scale * later[i]


@Inner
def find_changes(points, orbit, series, path, scale, found):  # type: ignore[no-untyped-def]
    """Fill the changes of states at fixed times.

    Parameters
    ----------
    points : (POINT_ROWS, n) array
        The points of the orbit.
    orbit : (CONSTANTS, variables) array
        The constants of the orbit.
    series : (2, functions, n) array
        `OrbitDerivatives.series` there.
    path : (k, m + 2, n) array
        The path there (`path.PathRows`).
    scale : float
        The phase angle of a whole turn of a libration, or 1 for a circulation.
    found : (STATE_ROWS, variables, n) array
        The changes of lam within the lap, s, x, z, v, N and y, which are filled.
    """
    variables, n, swings = orbit.shape[1], points.shape[1], scale != 1.0
    share, upper, acceleration, delay = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    ds, fall, v = path[DS, 0], path[POTENTIAL, path.shape[1] - 1], points[SPEED]
    laps, rate = points[LAPS], series[0, 0]
    fill_shares(points, scale, share, upper)
    for i in range(n):
        acceleration[i] = -fall[i] / ds[i]
    for j in range(variables):
        widening, launch_arc, lap_arc = orbit[WIDENING, j], orbit[LAUNCH_ARC, j], orbit[LAP_ARC, j]
        place, arc, faster = found[LAM, j], found[S, j], found[V, j]
        slower, longer = series[0, 1 + j], series[1, 1 + variables + j]
        fill_at_phase(orbit, j, share, upper, place)
        fill_changed(path[DS], j, place, faster)
        fill_delays(points, orbit, j, series[1, 1 + j], scale, delay)
        for i in range(n):
            faster[i] = v[i] * (widening + faster[i] / ds[i] - slower[i] / rate[i]) + acceleration[i] * delay[i]
            arc[i] = launch_arc + laps[i] * lap_arc + scale * longer[i] + v[i] * delay[i]
            if swings:
                arc[i] += ds[i] * place[i]
            place[i] += v[i] / ds[i] * delay[i]
    path_changes(path, points[SPEED], found[LAM], found[X:STATE_ROWS])


@entry(types.void(MATRIX, MATRIX, CUBE, CUBE, REAL, CUBE), checked=False)
def fill_changes(points, orbit, series, path, scale, found):  # type: ignore[no-untyped-def]
    """Call `find_changes` from Python."""
    find_changes(points, orbit, series, path, scale, found)


@entry(
    types.void(
        *(types.UniTuple(VECTOR, 3), types.Tuple((PROGRAM, VECTOR, MATRIX, types.int64[:, ::1]))),
        *(types.Tuple((MATRIX, CUBE, REAL)), CUBE),
    ),
    checked=False,
    nogil=True,
)
def fill_sensitivities(motion, along, orbit, found):  # type: ignore[no-untyped-def]
    """Fill the changes of states at times along a curve with formulas, with respect to some variables.

    Parameters
    ----------
    motion : tuple of arrays
        The record, the run-time parameters and the times, as for `records.find_phases`.
    along : tuple
        The program of the path (`programs.path_program`), its work space, its inputs, and an array of the registers of
        each quantity of the path, its changes with each variable, and that with the place; these are negative where a
        variable does not change the path.
    orbit : tuple
        The constants of the orbit for these variables, the factors of the series, and the scale of the phase.
    found : (STATE_ROWS, variables, n) array
        The changes of lam, s, x, z, v, N and y, which are filled.
    """
    (record, p, t), (program, work, inputs, outputs) = motion, along
    (constants, table, scale), (kinds, width) = orbit, outputs.shape
    address, operations, first, count, _ = program
    size = min(LANES, t.size)
    begin(program, work, inputs, size)
    variables, functions, terms = found.shape[1], table.shape[1], table.shape[2]
    rows = POINT_ROWS + terms + 2 * functions + kinds * width + STATE_ROWS * variables + 1
    space, shares = np.empty(rows * size), np.empty(size)
    for start in range(0, t.size, LANES):
        n = min(LANES, t.size - start)
        ends = POINT_ROWS * n, (POINT_ROWS + terms) * n, (POINT_ROWS + terms + 2 * functions) * n
        points, waves = space[: ends[0]].reshape(POINT_ROWS, n), space[ends[0] : ends[1]].reshape(terms, n)
        series = space[ends[1] : ends[2]].reshape(2, functions, n)
        path = space[ends[2] : ends[2] + kinds * width * n].reshape(kinds, width, n)
        changes = space[ends[2] + kinds * width * n :][: STATE_ROWS * variables * n].reshape(STATE_ROWS, variables, n)
        find_phases(record, p, t[start : start + n], points)
        for i in range(n):
            shares[i] = points[PHASE, i] / scale
            at = count * ROW + i
            work[at], work[at + LOW], work[at + ERROR] = points[PLACE, i], 0.0, 0.0
        fill_waves(shares[:n], waves)
        add_series(table, waves, series)
        call_interpreter(address, operations, first, operations.shape[0], work, n)
        for k in range(kinds):
            for j in range(width):
                at = outputs[k, j]
                for i in range(n):
                    path[k, j, i] = work[at + i] if at >= 0 else 0.0
        find_changes(points, constants, series, path, scale, changes)
        for j in range(variables):
            for i in range(n):
                changes[LAM, j, i] += points[LAPS, i] * constants[LAP, j]
        found[:, :, start : start + n] = changes


@entry(types.void(types.UniTuple(VECTOR, 3), types.Tuple((MATRIX, CUBE, REAL)), MATRIX), checked=False, nogil=True)
def fill_place_changes(motion, orbit, found):  # type: ignore[no-untyped-def]
    """Fill the changes of the places alone, with a row for each variable.

    The arguments are those of `fill_sensitivities`, but the series are those of the changes of the time along the orbit
    alone.
    """
    (record, p, t), (constants, table, scale) = motion, orbit
    address, (functions, terms) = section(record, FUNCTIONS).view(np.int64)[0], table.shape[1:]
    size = min(LANES, t.size)
    space, rest = np.empty((POINT_ROWS + terms + 2 * functions) * size), np.empty((5 + 4) * size)
    for start in range(0, t.size, LANES):
        n = min(LANES, t.size - start)
        ends = POINT_ROWS * n, (POINT_ROWS + terms) * n, (POINT_ROWS + terms + 2 * functions) * n
        points, waves = space[: ends[0]].reshape(POINT_ROWS, n), space[ends[0] : ends[1]].reshape(terms, n)
        series, path = space[ends[1] : ends[2]].reshape(2, functions, n), rest[: 5 * n].reshape(5, n)
        share, upper, delay, v2 = rest[5 * n : 6 * n], rest[6 * n : 7 * n], rest[7 * n : 8 * n], rest[8 * n : 9 * n]
        find_phases(record, p, t[start : start + n], points)
        v, laps = points[SPEED], points[LAPS]
        for i in range(n):
            v2[i] = v[i] * v[i]
        call_path_and_contact_force(address, n, points[PLACE], v2, p, path)
        fill_shares(points, scale, share, upper)
        fill_waves(share, waves)
        add_series(table, waves, series)
        for j in range(functions):
            place, lap = found[j, start : start + n], constants[LAP, j]
            fill_at_phase(constants, j, share, upper, place)
            fill_delays(points, constants, j, series[1, j], scale, delay)
            for i in range(n):
                place[i] += v[i] / path[2, i] * delay[i] + laps[i] * lap


def points_of(found: Any, lam: Array, v: Array) -> Array:
    """Return points on an orbit in the form that `fill_changes` takes.

    Parameters
    ----------
    found : motion.trajectory.PhasePoints
        The points.
    lam, v : array
        The places within the lap, and the velocities.
    """
    points, laps = np.zeros((POINT_ROWS, lam.size)), found.laps
    points[SPEED], points[LAPS], points[PLACE] = v, laps, lam
    points[SENSE], points[TURNS] = 1.0, laps
    first, period = found.trajectory.segments[0], found.trajectory.period
    swings = len(found.trajectory.segments) > 1
    for timed, mask, phi in found.segments:
        points[PHASE, mask] = phi
        if swings:
            before = timed.t_start[0] - timed.sense * timed.r_start[0] + first.sense * first.r_start[0]
            points[SENSE, mask] = timed.sense
            points[TURNS, mask] = 2.0 * laps[mask] + round(before / (0.5 * period[0]))
    return points


class OrbitSensitivity:
    """The derivatives of the states of one orbit with respect to all variables.

    Parameters
    ----------
    derivatives : OrbitDerivatives
        The orbit.
    """

    def __init__(self, derivatives: OrbitDerivatives) -> None:
        self._derivatives = derivatives
        self._scale, self._width = 1.0 if derivatives.direction else 2.0 * np.pi, derivatives.width
        self._series, self._lap = derivatives.series
        self._from_launch: tuple[float, PanelSeries] | None = None
        self._orbits: dict[float, Array] = {}
        self._chosen: dict[tuple[float, tuple[int, ...], bool], tuple[Any, Any]] = {}

    def _orbit(self, motion: Any, phi: float) -> Array:
        """Return the constants of the orbit; the launch's phase angle gains digits once the period is known exactly."""
        if phi not in self._orbits:
            self._orbits[phi] = self._constants(motion, phi)
        return self._orbits[phi]

    def _constants(self, motion: Any, phi: float) -> Array:
        derivatives, variables = self._derivatives, self._derivatives.source.variables
        orbit = np.zeros((CONSTANTS, variables))
        orbit[DURATION], orbit[LAP] = derivatives.duration_gradient, self._lap
        if derivatives.direction:
            orbit[WIDENING] = self._lap / self._width
            orbit[LAP_ARC] = self._series(np.ones(1))[1, 1 + variables :, 0]
        else:
            orbit[LOWER], orbit[UPPER] = derivatives.moved_ends.T
            orbit[WIDENING] = (orbit[UPPER] - orbit[LOWER]) / self._width
        # Without a delay of the launch, these are the changes at a fixed phase angle.
        speed = motion.direction * motion.problem.launch.v0.value
        still = np.array([[phi], [speed], [0.0], [0.0], [0.0], [motion.problem.lam0]])
        (series, _), found = self._along(motion, still, phi), np.empty((STATE_ROWS, variables, 1))
        path = derivatives.at_places(still[PLACE])
        fill_changes(still, orbit, series, path.rows, self._scale, found)
        orbit[LAUNCH_ARC] = -self._scale * series[1, 1 + variables :, 0] - path.ds[0, 0] * derivatives.launch_changes
        orbit[LAUNCH_DELAY] = self._launch_delay(
            motion, path, self._scale * series[1, 1 : 1 + variables, 0], found[:, :, 0]
        )
        return orbit

    def _launch_delay(self, motion: Any, path: PathRows, times: Array, at_launch: Array) -> Array:
        """Return the change of the time at which the phase begins.

        Parameters
        ----------
        motion : motion.periodic.PeriodicMotion
            The motion.
        path : PathRows
            The path at the launch.
        times : array
            The change of the time to there.
        at_launch : array
            The changes of the state there at a fixed phase angle (`fill_changes`).
        """
        given, direction, ds = motion.problem.launch, motion.direction, path.ds[0, 0]
        v0, moves = given.v0.value, self._derivatives.launch_changes
        if self._derivatives.direction:
            circulating: Array = direction * ds / v0 * moves
            return circulating
        # It follows from the launch place and also from the launch speed; the speed is used near turning points, the
        # place elsewhere.
        acceleration = -path.rows[POTENTIAL, -1, 0] / ds
        if v0**2 < abs(acceleration) * ds * self._width:
            own: Array = np.zeros_like(times)
            own[V0] = given.direction  # at rest, the direction that a speed would have
            passed: Array = direction * (own - at_launch[V]) / acceleration
        else:
            passed = ds / v0 * (moves - at_launch[LAM])
        delay: Array = direction * (passed + times)
        return delay

    @property
    def has_waves(self) -> bool:
        """Whether the changes along the orbit are a Fourier series, as `at_times` needs it."""
        return isinstance(self._series, Series)

    def at_times(self, motion: Any, record: Array, t: Array, phi: float, rows: tuple[int, ...]) -> Array:
        """Return what `at` does, for times in a record of a motion along a curve with formulas."""
        along, orbit = self._chosen_for(motion, phi, rows, whole=True)
        found, p = np.empty((STATE_ROWS, len(rows), t.size)), motion.problem.functions.p
        if t.size < 2 * MIN_TIMES_PER_THREAD:
            fill_sensitivities((record, p, t), along, orbit, found)
            return found
        program, registers, *inputs = along

        def work(part: slice) -> None:
            out = np.empty((STATE_ROWS, len(rows), part.stop - part.start))
            fill_sensitivities((record, p, t[part]), (program, registers.copy(), *inputs), orbit, out)
            found[:, :, part] = out

        run_in_threads(work, t.size, MIN_TIMES_PER_THREAD)
        return found

    def places_at_times(self, motion: Any, record: Array, t: Array, phi: float, rows: tuple[int, ...]) -> Array:
        """Return the row lam of `at_times`."""
        _, orbit = self._chosen_for(motion, phi, rows, whole=False)
        found, p = np.empty((len(rows), t.size)), motion.problem.functions.p

        def work(part: slice) -> None:
            out = np.empty((len(rows), part.stop - part.start))
            fill_place_changes((record, p, t[part]), orbit, out)
            found[:, part] = out

        run_in_threads(work, t.size, MIN_TIMES_PER_THREAD)
        return found

    def _chosen_for(self, motion: Any, phi: float, rows: tuple[int, ...], *, whole: bool) -> tuple[Any, Any]:
        """Return the arguments of `fill_sensitivities` for some of the variables; unless ``whole``, None and those of
        `fill_place_changes`.
        """
        chosen = self._chosen.get((phi, rows, whole))
        if chosen is None:
            constants, series = np.ascontiguousarray(self._orbit(motion, phi)[:, list(rows)]), self._series
            assert isinstance(series, Series)
            if whole:
                chosen = self._choose(series, constants, rows)
            else:
                table = series.of([1 + row for row in rows])
                table[0] = 0.0
                chosen = None, (constants, table, self._scale)
            self._chosen[phi, rows, whole] = chosen
        return chosen

    def _choose(self, series: Series, constants: Array, rows: tuple[int, ...]) -> tuple[Any, Any]:
        """Return the arguments of `fill_sensitivities`, given the constants for some of the variables."""
        derivatives = self._derivatives
        assert isinstance(derivatives, FormulaOrbitDerivatives)
        variables, count, program = (
            derivatives.source.variables,
            derivatives.source.parameters,
            derivatives.path_program,
        )
        of_path = program.outputs.reshape(-1, count + 2)
        outputs = np.full((len(of_path), len(rows) + 2), -1, dtype=np.int64)
        outputs[:, 0], outputs[:, -1] = of_path[:, 0], of_path[:, -1]
        for j, row in enumerate(rows):
            if row < count:
                outputs[:, 1 + j] = of_path[:, 1 + row]
        functions = [0, *(1 + row for row in rows), *(1 + variables + row for row in rows)]
        along, table = (program.operands, program.work.copy(), derivatives.parameters, outputs), series.of(functions)
        table[0, 1 + len(rows) :], table[1, 0] = 0.0, 0.0  # these are not needed
        return along, (constants, table, self._scale)

    def at(self, motion: Any, points: Array, phi: float, rows: Sequence[int]) -> Array:
        """Return the derivatives of lam, s, x, z, v, N and y at times with respect to some of the variables.

        Parameters
        ----------
        motion : motion.periodic.PeriodicMotion
            The motion.
        points : (POINT_ROWS, n) array
            The points of the orbit at the times.
        phi : float
            The phase angle of the launch.
        rows : sequence of int
            The variables.
        """
        orbit, out = self._orbit(motion, phi), np.empty((STATE_ROWS, len(rows), points.shape[1]))
        for start in range(0, points.shape[1], BLOCK):
            block = slice(start, start + BLOCK)
            some = np.ascontiguousarray(points[:, block])
            out[:, :, block] = self._part(orbit, *self._along(motion, some, phi))[:, rows]
        return out

    def _along(self, motion: Any, points: Array, phi: float) -> tuple[Array, Array]:
        """Return the series at points of the orbit, and these with the number of half periods to which its integrals
        are added.

        The integrals of a Fourier series begin with the phase. Those of a series on panels begin at the launch, and go
        by way of the next turning point to where the body moves the other way, so that a slow passage of a hilltop
        takes no digits from what does not contain it.
        """
        share = points[PHASE] / self._scale
        if not isinstance(self._series, PanelSeries):
            return self._series(share), points
        if self._from_launch is None or self._from_launch[0] != phi:
            self._from_launch = phi, self._series.begun_at(phi / self._scale)
        series, times = self._from_launch[1], slice(1, 1 + self._derivatives.source.variables)
        found, returns = series(share), np.flatnonzero(points[SENSE] == -motion.direction)
        if returns.size and not self._derivatives.direction:
            points, upwards = points.copy(), motion.direction > 0
            found[1, times, returns] -= 2.0 * series(np.array([0.5 if upwards else 0.0]))[1, times].T
            points[TURNS, returns] -= 2.0 if upwards else 0.0
        return found, points

    def _part(self, orbit: Array, series: Array, points: Array) -> Array:
        """Return the derivatives at some of the points by all variables, given the series there."""
        found = np.empty((STATE_ROWS, orbit.shape[1], points.shape[1]))
        path = self._derivatives.at_places(points[PLACE]).rows
        fill_changes(points, orbit, series, path, self._scale, found)
        if self._derivatives.by_arc_length:
            found[S, LAM0] += 1.0  # from the start point of the curve
            found[LAM] = found[S]
        elif self._derivatives.direction:
            found[LAM] += points[LAPS] * self._lap[:, None]
        return found
