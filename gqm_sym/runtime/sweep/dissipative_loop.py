"""One quantity for each of many launches with dissipative forces, by driving all bodies in compiled code."""

from math import inf, isfinite, nan
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.compiled.strided import (
    DIRECTION,
    DOMAIN_HIGH,
    DOMAIN_LOW,
    DOMAIN_PERIOD,
    LAM0,
    PARAMETERS,
    TARGET,
    V0,
    lay_out,
)
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.interface import Dissipation
from gqm_sym.runtime.launch.request import MAX_SPEED, ONLY_SIGN
from gqm_sym.runtime.legs import questions
from gqm_sym.runtime.legs.answers import Track, drive_along
from gqm_sym.runtime.legs.body import LEAST_SWING, RETRY_WIDTH, SIZE, STATUS, VALUE
from gqm_sym.runtime.legs.leg_record import COLUMNS
from gqm_sym.runtime.sweep import quantities
from gqm_sym.runtime.sweep.quantities import Answers

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas

# The number of panels for which the record of a leg has space in addition to one for each break; the number of bodies
# that are driven at a time; and the number from which on a thread is worth starting.
MAX_PANELS, CHUNK, MIN_BODIES_PER_THREAD = 128, 2**12, 2**5

# The width of a leg at which driving a body by its distance from an equilibrium counts as tried (`RETRY_WIDTH`).
TRIED = LEAST_SWING

# The quantities of motions that repeat, and the time in s up to which others are followed to know that they do not.
PERIODIC, BEGINNING = ("half_period", "period", "turning_points"), 1e-300

# The question to the driver for each quantity, by its name. Motions that lose energy have no period, so that of these
# quantities only the beginning of a motion is followed, which decides whether there is one.
QUESTIONS = {
    **dict.fromkeys(PERIODIC, questions.END_TIME),
    "t_end": questions.END_TIME,
    "rest_position": questions.REST_PLACE,
    "time_at": questions.ARRIVAL,
    "v_min": questions.LEAST_SPEED,
    "v_max": questions.MOST_SPEED,
    "normal_force_min": questions.LEAST_LOAD,
    "normal_force_max": questions.MOST_LOAD,
}


class Question(NamedTuple):
    """The question for all bodies.

    Attributes
    ----------
    question : int
        A code of `legs.questions`.
    horizon : float
        The last time in s, infinite if there is none.
    only_sign : int
        The only sign that N can have; 0 if it can have both.
    without_answer : bool
        Whether no motion has the quantity, and the question is only whether there is a motion.
    """

    question: int
    horizon: float
    only_sign: int
    without_answer: bool


def is_read_from_vector(formulas: "Formulas") -> bool:
    """Return whether the length of the contact force is that of the vector along a path in space.

    Elsewhere the module has its square, or a law with friction has it in the rows of a leg; on a banked track these
    hold the component along the upward direction of riders.
    """
    loss = formulas.dissipation
    assert loss is not None
    return formulas.path_in_space is not None and loss.squared_contact is None and (formulas.sided or not loss.friction)


def is_length_known(formulas: "Formulas") -> bool:
    """Return whether the length of the contact force is known all along a leg."""
    loss = formulas.dissipation
    assert loss is not None
    is_in_rows = loss.friction and not formulas.sided
    return is_in_rows or loss.squared_contact is not None or is_read_from_vector(formulas)


def asked_of_bodies(formulas: "Formulas", quantity: str, t_max: Any, contact: str) -> Question | None:
    """Return the question to compiled code for a quantity; None if motions must be solved, or no energy is lost."""
    loss = formulas.dissipation
    if loss is None or quantity not in QUESTIONS:
        return None
    question = QUESTIONS[quantity]
    if quantity.startswith("normal_force") and not formulas.signed:
        if not is_length_known(formulas):
            return None
        question = questions.LEAST_LENGTH if question == questions.LEAST_LOAD else questions.MOST_LENGTH
    horizon = inf if t_max is None else read_number(t_max, where="t_max").value
    if not horizon > 0.0:
        return None
    without_answer = quantity in PERIODIC
    return Question(question, BEGINNING if without_answer else horizon, ONLY_SIGN[contact], without_answer)


def answer_driven(
    formulas: "Formulas",
    asked: Question,
    track: Track,
    columns: list[Array],
    answers: Answers,
    part: slice,
    *,
    by_places: bool = False,
) -> None:
    """Fill the answers of a part of launches on one curve, as far as compiled code decides them.

    Parameters
    ----------
    track : legs.answers.Track
        The curve.
    columns : list of arrays
        The launches, in the order of `compiled.strided`.
    answers : Answers
        Filled in for this part.
    by_places : bool
        Whether bodies near equilibria are driven by their places, too.
    """
    for begin in range(part.start, part.stop, CHUNK):
        chunk = slice(begin, min(begin + CHUNK, part.stop))
        lines = lay_out(columns, chunk.start, chunk.stop)
        _answer_lines(formulas, asked, track, lines, answers.part(chunk), by_places=by_places)


def _answer_lines(
    formulas: "Formulas", asked: Question, track: Track, lines: list[Array], found: Answers, *, by_places: bool
) -> None:
    """Do the work of `answer_driven` for all of some launches, given as arrays side by side."""
    assert formulas.dissipation is not None
    dissipation = formulas.dissipation.addresses(has_radius=bool(formulas.rolling_radius))
    if asked.question >= questions.LEAST_LENGTH and is_read_from_vector(formulas):
        assert formulas.path_in_space is not None
        dissipation = dissipation._replace(path_in_space=formulas.path_in_space.address)
    possible = _are_possible(lines, found.status.size)
    chosen = None if possible.all() else np.flatnonzero(possible)
    some = lines if chosen is None else [line if line.size == 1 else line[chosen] for line in lines]
    bodies = np.zeros((found.status.size if chosen is None else chosen.size, SIZE))
    domain = some[DOMAIN_LOW], some[DOMAIN_HIGH], some[DOMAIN_PERIOD]
    asks = some[DIRECTION], asked.only_sign, asked.horizon, some[TARGET]
    launches: list[Any] = [some[LAM0], *domain, *asks, some[V0] * some[V0]]  # in the order of `legs.body`
    for k, column in enumerate(launches):
        bodies[:, k] = column
    bodies[:, RETRY_WIDTH] = TRIED if by_places else 0.0
    drive_bodies(asked, dissipation, track, _rows(some[PARAMETERS:], track.chart), bodies)
    if asked.question >= questions.LEAST_LOAD and not dissipation.path_in_space:
        bodies[:, VALUE] *= some[PARAMETERS + list(formulas.parameters).index("m")]
    enter_answers(asked, bodies, found, chosen)


def drive_bodies(asked: Question, dissipation: Dissipation, track: Track, rows: Array, bodies: Array) -> None:
    """Drive bodies from their launch (`legs.body`); the rows are the parameters of each body, or of all."""
    record = np.empty((1, (MAX_PANELS + track.breaks.size) * COLUMNS))
    drive_along(track, dissipation, rows, asked.question, bodies, record)


def enter_answers(asked: Question, bodies: Array, found: Answers, chosen: NDArray[np.intp] | None = None) -> None:
    """Fill the answers of bodies that have been driven, as far as they are decided.

    Parameters
    ----------
    bodies : array
        The bodies (`legs.body`).
    found : Answers
        Filled in.
    chosen : array of int, optional
        The numbers of the answers, if these are not those of all.
    """
    values, ended = bodies[:, VALUE], bodies[:, STATUS]
    status = np.full(ended.size, quantities.ANSWERED, dtype=np.int8)
    without = ended != questions.FOUND
    if without.any():
        none = quantities.NEVER_THERE if asked.question == questions.ARRIVAL else quantities.NOT_PERIODIC
        near = ended == questions.NEAR
        values[without & ~near], status[without] = nan, none
        status[ended == questions.TOO_LONG], status[near] = quantities.REFUSED, quantities.NEAR_EQUILIBRIUM
        decided = ended != questions.LEFT
        values, status = values[decided], status[decided]
        chosen = np.flatnonzero(decided) if chosen is None else chosen[decided]
    if asked.without_answer:
        no_period = np.int8(quantities.NOT_PERIODIC)
        values, status = np.full(values.size, nan), np.where(status == quantities.ANSWERED, no_period, status)
    there = slice(None) if chosen is None else chosen
    found.values[there, 0], found.status[there], found.route[there] = values, status, quantities.SINGLE


def _are_possible(lines: list[Array], count: int) -> NDArray[np.bool_]:
    """Return which launches consist of finite numbers and lie inside the domain; `solve` refuses the others."""
    possible = np.ones(count, dtype=np.bool_)
    for line in (*lines[: TARGET + 1], *lines[PARAMETERS:]):
        if line.size > 1 or not isfinite(line[0]):
            possible &= np.isfinite(line)
    possible &= (lines[LAM0] >= lines[DOMAIN_LOW]) & (lines[LAM0] <= lines[DOMAIN_HIGH]) & (lines[V0] <= MAX_SPEED)
    return possible


def _rows(parameters: list[Array], chart: Array) -> Array:
    """Return the parameters of each body as a row; a single row, followed by the chart, if all bodies have the same
    parameters.
    """
    count = max((column.size for column in parameters), default=1)
    if chart.size and count == 1:
        return np.concatenate([*parameters, chart]).reshape(1, -1)
    rows = np.empty((count, len(parameters)))
    for k, column in enumerate(parameters):
        rows[:, k] = column
    return rows
