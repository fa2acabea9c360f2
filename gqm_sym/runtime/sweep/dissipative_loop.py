"""One quantity for each of many launches where forces dissipate, by driving all bodies in compiled code."""

from collections.abc import Iterator, Sequence
from math import inf, nan
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.errors import GQMError
from gqm_sym.literals.namespaces import ARRAYS
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.problem import bind_all
from gqm_sym.runtime.launch.request import ONLY_SIGN
from gqm_sym.runtime.legs import answers as legs
from gqm_sym.runtime.legs.advance import Joints, room_ahead
from gqm_sym.runtime.legs.body import STATUS, VALUE, launched
from gqm_sym.runtime.legs.leg_record import COLUMNS
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE
from gqm_sym.runtime.sweep import quantities
from gqm_sym.runtime.sweep.quantities import Answers

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas

# How many panels the record of a leg has space for, how many bodies are driven at a time, and from how many on a thread
# is worth starting.
MAX_PANELS, CHUNK, MIN_BODIES_PER_THREAD = 128, 2**12, 2**5

# What the driver is asked for each quantity, by its name. Motions that lose energy have no period.
QUESTIONS = {
    "t_end": legs.END_TIME,
    "rest_position": legs.REST_PLACE,
    "time_at": legs.ARRIVAL,
    "v_min": legs.LEAST_SPEED,
    "v_max": legs.MOST_SPEED,
    "normal_force_min": legs.LEAST_LOAD,
    "normal_force_max": legs.MOST_LOAD,
}


class Asked(NamedTuple):
    """What is asked of all launches.

    Attributes
    ----------
    question : int
        A code of `legs.answers`.
    horizon : float
        The last time in s, infinite if there is none.
    only_sign : int
        The only sign that N can have; 0 if it can have both.
    """

    question: int
    horizon: float
    only_sign: int


class Group(NamedTuple):
    """Launches on the same curve.

    Attributes
    ----------
    members : array of int
        Their indices.
    parameters : array or None
        The row of parameters that all of them have, the chart behind them; None where each has its own.
    domain : tuple
        The ends of the curve parameter's range and its period, numbers or an array over all launches.
    breaks, corners : arrays
        As of `legs.advance.Joints`.
    """

    members: NDArray[np.int64]
    parameters: Array | None
    domain: tuple[Any, Any, Any]
    breaks: Array
    corners: Array


def is_driven(formulas: "Formulas", quantity: str, t_max: Any) -> bool:
    """Whether a quantity is found by driving bodies in compiled code; bodies that must fit their track are not."""
    if formulas.dissipation is None or formulas.rolling_radius or quantity not in QUESTIONS:
        return False
    return t_max is None or bool(read_number(t_max, where="t_max").value > 0.0)


def answer_driven(
    formulas: "Formulas",
    quantity: str,
    launches: tuple[Sequence[Any], Sequence[Array]],
    t_max: Any,
    contact: str,
    answers: Answers,
) -> None:
    """Answer all launches that compiled code decides.

    Parameters
    ----------
    quantity : str
        A name in QUESTIONS.
    launches : (sequence, sequence)
        Places, speeds, directions, targets and parameters as they were given, and as arrays of one shape or of one
        number.
    t_max, contact
        As of `launch.request.LaunchRequest`.
    answers : Answers
        Filled in.
    """
    horizon = inf if t_max is None else read_number(t_max, where="t_max").value
    asked = Asked(QUESTIONS[quantity], horizon, ONLY_SIGN[contact])
    given, columns = launches[0], [column.reshape(-1) for column in launches[1]]
    for group in _groups(formulas, given, columns, answers.status.size):

        def drive(part: slice, group: Group = group) -> None:
            for begin in range(part.start, part.stop, CHUNK):
                which = group.members[begin : min(begin + CHUNK, part.stop)]
                _drive(formulas, asked, group, columns, which, answers)

        run_in_threads(drive, group.members.size, MIN_BODIES_PER_THREAD)


def _groups(formulas: "Formulas", given: Sequence[Any], columns: Sequence[Array], size: int) -> Iterator[Group]:
    """Launches by the curve that they are on; those that no motion begins with are left out."""
    possible = np.ones(size, dtype=bool)
    for column in columns:
        possible &= np.isfinite(_lines(column, slice(None)))
    members = np.flatnonzero(possible)
    if formulas.chart is None:
        domain = formulas.ends(ARRAYS, tuple(columns[4:]))
        low, high, period = (
            default if end is None else np.asarray(end, dtype=np.float64)
            for end, default in zip(domain, (-inf, inf, 0.0), strict=True)
        )
        inside = (columns[0] >= low) & (columns[0] <= high)
        members = members[np.broadcast_to(_lines(np.asarray(inside), slice(None)), size)[members]]
        yield Group(members, None, (low, high, period), NOWHERE, NOWHERE)
        return
    varied = [k for k, column in enumerate(columns[4:]) if column.size > 1]
    rows = np.column_stack([_lines(columns[4 + k], members) for k in varied]) if varied else np.zeros((members.size, 0))
    kinds, which = np.unique(rows, axis=0, return_inverse=True) if varied else (rows[:1], np.zeros(members.size, int))
    for number, kind in enumerate(kinds):
        values = list(given[4:])
        for k, value in zip(varied, kind.tolist(), strict=True):
            values[k] = value
        try:
            p = formulas.numbers(tuple(values))
            ends, f = formulas.domain(p).numbers, bind_all(formulas, p)
        except GQMError:
            continue  # each of them is refused by itself
        here = members[which.reshape(-1) == number]
        places = _lines(columns[0], here)
        here = here[np.broadcast_to((places >= ends.low) & (places <= ends.high), here.shape)]
        yield Group(here, f.p, (ends.low, ends.high, ends.period), f.breaks, f.corners)


def _lines(column: Any, which: Any) -> Any:
    """The numbers of some launches, or the one number that all of them have."""
    line = np.asarray(column).reshape(-1)
    return line if line.size == 1 else line[which]


def _drive(
    formulas: "Formulas", asked: Asked, group: Group, columns: Sequence[Array], which: Any, answers: Answers
) -> None:
    """Drive some bodies of a group, and enter what is found."""
    lam0, v0, direction, target, *parameters = (_lines(column, which) for column in columns)
    low, high, period = (_lines(end, which) for end in group.domain)
    bodies = launched(
        which.size, *(lam0, low, high, period, direction, asked.only_sign, asked.horizon, target), v0 * v0
    )
    if group.parameters is not None:
        rows = group.parameters.reshape(1, -1)
    else:
        count = max((column.size for column in parameters), default=1)
        rows = np.empty((count, len(parameters)))
        for k, column in enumerate(parameters):
            rows[:, k] = column
    joints = Joints(group.breaks, group.corners, np.empty(room_ahead(group.breaks.size)))
    loss, record = formulas.dissipation, np.empty(MAX_PANELS * COLUMNS)
    legs.drive(loss, rows, joints, asked.question, bodies, record)
    values, found = bodies[:, VALUE], bodies[:, STATUS]
    if asked.question in (legs.LEAST_LOAD, legs.MOST_LOAD):
        values = values * parameters[list(formulas.parameters).index("m")]
    none = quantities.NEVER_THERE if asked.question == legs.ARRIVAL else quantities.NOT_PERIODIC
    decided = found != legs.LEFT
    there = which[decided]
    answers.values[there, 0] = np.where(found == legs.FOUND, values, nan)[decided]
    answers.status[there] = np.where(found == legs.FOUND, quantities.ANSWERED, none)[decided]
    answers.route[there] = quantities.SINGLE
