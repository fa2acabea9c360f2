"""Gradients of half periods, times of laps and turning points of many launches, by the fastest program that keeps its
digits.

Where a derivative is a multiple of the half period, it takes no program (`scaling`).
About an axis of symmetry that is an arithmetic-geometric mean or an integral without divided differences. For other
librations and for laps it is an integral in double precision, and for what remains one in double-double arithmetic, for
the smallest swings with divided differences.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from math import inf, nan
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.arithmetic.elementary import HALF_PI
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.nodes import trapezoidal_nodes
from gqm_sym.runtime.gradients.evaluation import MAX_LAP_CHANGE
from gqm_sym.runtime.gradients.formula_orbit import source_of
from gqm_sym.runtime.gradients.lanes.assembly import LaneProgram
from gqm_sym.runtime.gradients.lanes.evaluation import (
    ANSWERED,
    LEFT,
    OPEN,
    PASSES,
    fill_lane_gradients,
)
from gqm_sym.runtime.gradients.lanes.exact_differences import exact_swing_program
from gqm_sym.runtime.gradients.lanes.launches import ABOUT_ONE_AXIS, AROUND_AXIS, EVEN, FROM_AXIS, Launches
from gqm_sym.runtime.gradients.lanes.machine_code import CodedProgram, coded
from gqm_sym.runtime.gradients.lanes.operations import LaneRecorder
from gqm_sym.runtime.gradients.lanes.pairs import fill_mean_gradients, fill_pair_gradients, fill_turn_gradients
from gqm_sym.runtime.gradients.lanes.programs import (
    Orbits,
    axis_program,
    end_programs,
    exact_axis_program,
    lap_program,
    mean_program,
    moved_variables,
    swing_program,
    turn_program,
)
from gqm_sym.runtime.gradients.lanes.scaling import Plan, plan_of, scalings
from gqm_sym.runtime.gradients.passages.slow_orbits import MAX_SHARE, slow_gradients
from gqm_sym.runtime.gradients.programs import Program, Source, circulation_program, libration_program
from gqm_sym.runtime.launch.formulas import Formulas
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION, MAX_CHANGE_BEFORE, MIN_INTERVALS

# The number of launches from which on a thread is worth starting. Machine code for a program takes up to 0.2 s, and is
# worth making for so many launches of one call, or of all calls so far.
MIN_LAUNCHES_PER_THREAD, MIN_LAUNCHES_FOR_CODE, MIN_LAUNCHES_IN_ALL = 64, 2000, 20_000

# The number of programs whose machine code is kept, which is up to 1 MB each. A sweep needs three of them.
MAX_CODED = 48

# The ranges of phases of half periods and laps, as two doubles.
PHASES = {LIBRATION: (2.0 * HALF_PI[0], 2.0 * HALF_PI[1]), CIRCULATION: (1.0, 0.0)}

# The largest change by the last level but one of the trapezoidal rule.
MAX_BEFORE = {LIBRATION: MAX_CHANGE_BEFORE, CIRCULATION: MAX_LAP_CHANGE}

# A program without results, and its work space.
NO_PROGRAM = (0, np.zeros((0, 4), dtype=np.int64), 0, 0, np.zeros(0, dtype=np.int64))
NO_WORK: Array = np.empty(0)


class Stage(NamedTuple):
    """A program that may answer some of the launches.

    Attributes
    ----------
    serves : (m,) array
        Whether it may answer each launch.
    make, given
        The function that returns the program (None if there is none), and its arguments.
    launched : (k, m) array
        The launches as compiled code takes them for this program.
    inputs : int
        The number of columns that are inputs of the program.
    has_turns : bool
        Whether it also needs the turning points.
    kind : int
        LIBRATION or CIRCULATION.
    """

    serves: NDArray[np.bool_]
    make: Callable[..., Program | LaneProgram | None]
    given: tuple[Any, ...]
    launched: Array
    inputs: int
    has_turns: bool
    kind: int = LIBRATION


@lru_cache(maxsize=MAX_CODED)
def machine_code(make: Callable[..., Program | LaneProgram], *given: Any) -> CodedProgram:
    """Return a program with machine code for it, which is made once and kept until many others have been used."""
    return coded(make(*given))


@lru_cache(maxsize=MAX_CODED)
def launches_so_far(make: Callable[..., Program | LaneProgram], *given: Any) -> list[int]:
    """Return the number of launches for which a program has been carried out, as a list so that it can be changed."""
    return [0]


def end_program(end: int, source: Source, rows: tuple[int, ...]) -> Program:
    """Return one of `end_programs`."""
    return end_programs(source, rows)[end]


def period_gradients(formulas: Formulas, launches: Launches, values: Array, rows: tuple[int, ...]) -> Array:
    """Return the derivatives of half periods, or of times of laps, with NaN where no program keeps its digits.

    Parameters
    ----------
    formulas : Formulas
        The model of a generated module.
    launches : Launches
        The launches.
    values : (m,) array
        The half periods; those of laps are not used.
    rows : tuple of int
        The variables of differentiation.
    """
    found = np.full((launches.kinds.size, len(rows)), nan)
    source, circulates = source_of(formulas), launches.circulates
    if not rows:
        return found
    for group in groups_of(source, launches, rows, ~circulates):
        direct, plan = plan_of(source, rows, at_rest=group.at_rest, is_scaled=group.is_scaled)
        which: Any = slice(None) if group.serves.all() else group.serves
        for position, k, exponent in direct.scaled:
            line = launches.lines[k]
            found[which, position] = values[which] * float(exponent) / (line if line.size == 1 else line[which])
        for position in direct.zeros:
            found[which, position] = 0.0
        if plan.wanted:
            fill_by_stages(stages(formulas, launches, group, plan), launches, direct.others, group.serves, found)
    if circulates.any():
        direct, plan = plan_of(source, rows, at_rest=False, is_scaled=False)
        for position in direct.zeros:
            found[circulates, position] = 0.0
        if plan.wanted:
            fill_by_stages(lap_stages(source, launches, plan), launches, direct.others, circulates, found)
    if np.isnan(found.sum()):  # one sum is much faster than one for each
        fill_slow_orbits(source, launches, rows, found)
    return found


def fill_slow_orbits(source: Source, launches: Launches, rows: tuple[int, ...], found: Array) -> None:
    """Fill the derivatives that are NaN by panels of the phase, which serve orbits beside hilltops."""
    left, directions = np.isnan(found).any(axis=1), np.where(launches.circulates, launches.directions, 0.0)
    for direction in (0, 1, -1):
        which = np.flatnonzero(left & (directions == direction))
        if which.size:
            launched = laps_of(source, launches) if direction else launches.table
            slopes = slow_gradients(source, direction, rows, launched[np.newaxis, :, which])
            found[which] = np.where(np.isnan(found[which]), slopes, found[which])


class Group(NamedTuple):
    """Librations whose derivatives are found in the same way.

    Attributes
    ----------
    serves : (m,) array
        Which of the launches they are.
    at_rest : bool
        Whether they are launched from rest.
    is_scaled : bool
        Whether derivatives follow from others (`scaling`).
    """

    serves: NDArray[np.bool_]
    at_rest: bool
    is_scaled: bool


def groups_of(source: Source, launches: Launches, rows: tuple[int, ...], swings: NDArray[np.bool_]) -> Iterator[Group]:
    """Yield the groups of librations that are not empty."""
    at_rest, is_scaled = launches.lines[-1] == 0.0, np.array([True])
    for k in scalings(source, rows):
        is_scaled = is_scaled & (launches.lines[k] != 0.0)
    for are_scaled in (True, False):
        for are_at_rest in (True, False):
            is_like_this = (at_rest == are_at_rest) & (is_scaled == are_scaled)
            serves = swings & is_like_this if is_like_this.any() else is_like_this
            if serves.any():
                yield Group(serves, are_at_rest, are_scaled)


def fill_by_stages(
    programs: Iterator[Stage],
    launches: Launches,
    columns: tuple[int, ...],
    serves: NDArray[np.bool_],
    found: Array,
) -> None:
    """Fill derivatives of some of the launches by the first program that keeps its digits.

    Parameters
    ----------
    programs : iterator of Stage
        The programs.
    launches : Launches
        The launches.
    columns : tuple of int
        The positions of the derivatives among all.
    serves : (m,) array
        Which of the launches are asked for.
    found : (m, n) array
        The derivatives of all launches.
    """
    is_open, first, stop = serves.copy(), columns[0], columns[-1] + 1
    enough = np.zeros(serves.size, dtype=np.int64)
    which: Any = slice(first, stop) if stop - first == len(columns) else list(columns)
    while is_open.any():
        stage = next(programs, None)
        if stage is None:
            break
        chosen = np.flatnonzero(stage.serves & is_open)
        program = stage.make(*stage.given) if chosen.size else None
        has_levels = isinstance(program, LaneProgram) and stage.make is not mean_program
        if stage.make is exact_swing_program:
            enough[:] = 0  # its errors are shares of the derivatives themselves
        numbers = enough[chosen]
        if has_levels or program is None:
            attempts: Sequence[int] = PASSES if has_levels else ()
        else:
            attempts = np.unique(numbers).tolist() if numbers.any() else [0]  # sorting takes long
        for most in attempts:
            part = chosen if has_levels or len(attempts) == 1 else chosen[numbers == most]
            if not part.size:
                break
            out, states = carried_out(stage, program, len(columns), (part, launches.kinds[part] >= EVEN), most)
            left = np.flatnonzero(states != ANSWERED)
            out[left] = nan
            if part.size == len(found):
                found[:, which], is_open[:] = out, False
            else:
                found[part if isinstance(which, slice) else part[:, np.newaxis], which] = out
                is_open[part] = False
            is_open[part[left]] = True
            if has_levels:
                levels = np.maximum(states[left].astype(np.int64) - LEFT, 0)
                enough[part[left]] = np.where(levels > 0, MIN_INTERVALS << levels, 0)
                chosen = part[left[states[left] == OPEN]]


def stages(formulas: Formulas, launches: Launches, group: Group, plan: Plan) -> Iterator[Stage]:
    """Yield the programs for the half periods of a group, the fastest first."""
    source, serves, at_rest = source_of(formulas), group.serves, group.at_rest
    about_axis = serves & (launches.kinds == ABOUT_ONE_AXIS)
    has_form = source.formulas.agm_arguments is not None or source.formulas.time_integrand is not None
    if has_form and formulas.axes_of is not None and about_axis.any():
        given = (Orbits(source, formulas.axes_of, at_rest, plan),)
        launched = launches.laid_out(FROM_AXIS if at_rest else AROUND_AXIS)
        inputs = source.variables if at_rest else source.variables + 1
        for make in (mean_program, axis_program, exact_axis_program):
            yield Stage(about_axis, make, given, launched, inputs, not at_rest)
    uneven = serves if source.formulas.time_integrand is None else serves & ~about_axis
    table, inputs = launches.table, source.variables
    yield Stage(uneven, swing_program, (source, plan), table, inputs, True)
    yield Stage(serves, libration_program, (source, plan.wanted, LaneRecorder), table, inputs, True)
    yield Stage(serves, exact_swing_program, (source, plan), table, inputs, True)


def laps_of(source: Source, launches: Launches) -> Array:
    """Return the inputs of the program of laps, which begin at lam0, a column for each launch."""
    table = launches.table
    return np.vstack([table[: source.variables], table[source.parameters]])


def lap_stages(source: Source, launches: Launches, plan: Plan) -> Iterator[Stage]:
    """Yield the programs for the times of laps."""
    laps, inputs = laps_of(source, launches), source.variables + 1
    for direction in (1, -1):
        chosen = launches.circulates & (launches.directions == direction)
        yield Stage(chosen, lap_program, (source, direction, plan), laps, inputs, False, CIRCULATION)
        given = source, direction, plan.wanted
        yield Stage(chosen, circulation_program, given, laps, inputs, False, CIRCULATION)


def moves_of(stage: Stage) -> tuple[Source, tuple[int, ...]]:
    """Return the source of a program, and the variables by which turning points are differentiated for it."""
    source, *given = stage.given
    if isinstance(source, Orbits):
        return source.source, moved_variables(source.source, source.plan)
    plan = given[0]
    return source, moved_variables(source, plan) if isinstance(plan, Plan) else plan


def programs_for(makers: Sequence[tuple[Any, ...]], size: int) -> tuple[list[Any], list[Any]]:
    """Return programs, and the same as machine code if it is worth making for so many launches.

    The code lives as long as the second list. Each maker is a function with its arguments.
    """
    programs = [make(*given) for make, *given in makers]
    so_far = launches_so_far(*makers[-1])
    so_far[0] += size
    if size >= MIN_LAUNCHES_FOR_CODE or so_far[0] >= MIN_LAUNCHES_IN_ALL:
        return programs, [machine_code(*maker) for maker in makers]
    return programs, programs


def turn_gradients(formulas: Formulas, launches: Launches, rows: tuple[int, ...]) -> Array:
    """Return the derivatives of both turning points of each launch, of shape (m, 2, k), with NaN where there are none.

    Parameters
    ----------
    formulas : Formulas
        The model of a generated module.
    launches : Launches
        The launches, which are librations.
    rows : tuple of int
        The variables of differentiation.
    """
    source, table = source_of(formulas), launches.table
    count = table.shape[1]
    found = np.empty((count, 2, len(rows)))
    programs, in_code = programs_for([(end_program, end, source, rows) for end in range(2)], count)
    ends, out = tuple(one.operands for one in in_code), found.reshape(count, -1)

    def work(part: slice) -> None:
        some = np.ascontiguousarray(table[:, part])
        fill_turn_gradients(ends, tuple(one.work.copy() for one in programs), some, out[part])

    run_in_threads(work, count, MIN_LAUNCHES_PER_THREAD)
    if not np.isfinite(found.sum()):
        found[~np.isfinite(found)] = nan
    return found


def carried_out(
    stage: Stage, program: Any, count: int, which: tuple[NDArray[np.intp], NDArray[np.bool_]], most: int
) -> tuple[Array, NDArray[np.int8]]:
    """Return the derivatives of some launches, and the states of their orbits.

    Parameters
    ----------
    stage : Stage
        The program.
    program : Program or LaneProgram
        The program itself.
    count : int
        The number of derivatives.
    which : pair of arrays
        The launches, and whether each orbit is a mirror image of itself.
    most : int
        For a program in double precision, the largest number of intervals of the trapezoidal rule; for another one, the
        number with which the rule has converged, or 0 if it is not known.
    """
    (chosen, mirrored), (source, moved) = which, moves_of(stage)
    launched = stage.launched if chosen.size == stage.launched.shape[1] else stage.launched[:, chosen]
    out, states = np.empty((chosen.size, count)), np.full(chosen.size, ANSWERED, dtype=np.int8)
    turns: list[tuple[Any, ...]] = []
    if stage.has_turns and isinstance(program, LaneProgram):
        turns = [(turn_program, source, moved)]
    elif stage.has_turns:
        turns = [(end_program, end, source, moved) for end in range(2)]
    programs, in_code = programs_for([*turns, (stage.make, *stage.given)], chosen.size)
    *ends, addressed = [one.operands for one in in_code] if turns else [NO_PROGRAM, NO_PROGRAM, in_code[0].operands]

    def work(part: slice) -> None:
        *spaces, own = [one.work.copy() for one in programs] if turns else [NO_WORK, NO_WORK, programs[0].work.copy()]
        some, answers = np.ascontiguousarray(launched[:, part]), (out[part], states[part])
        if stage.make is mean_program:
            fill_mean_gradients(ends[0], spaces[0], addressed, own, stage.inputs, some, answers)
        elif isinstance(program, LaneProgram):
            limits = stage.inputs, most, PASSES[-1], MAX_BEFORE[stage.kind]
            fill_lane_gradients(ends[0], spaces[0], addressed, own, limits, some, mirrored[part], answers)
        else:
            max_error = MAX_SHARE if stage.make is exact_swing_program else inf
            rule = stage.inputs, PHASES[stage.kind], trapezoidal_nodes(stage.kind), max_error, most
            given = tuple(ends), tuple(spaces), addressed, own
            fill_pair_gradients(*given, rule, some, mirrored[part], out[part])

    run_in_threads(work, chosen.size, MIN_LAUNCHES_PER_THREAD)
    if isinstance(program, Program) and np.isnan(out.sum()):  # one sum is much faster than one for each
        states[np.isnan(out).any(axis=1)] = LEFT
    return out, states
