"""Speeds and times of swings with losses that are small beside their place, in sweeps.

Of such a swing, places in doubles have few digits, and so has the force, a difference of terms that almost cancel. The
bodies are driven by their distances from the equilibrium, in the frame in which `solve` follows them (`legs.frames`).
One frame serves all bodies with the same run-time parameters, and is kept with these. It depends on the equilibrium
alone, which is known to all digits, and not on the launch by which it was found.
"""

from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.strided import DIRECTION, LAM0, TARGET, V0, lay_out
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.ends import starting_step
from gqm_sym.runtime.launch.problem import Problem, bind_all
from gqm_sym.runtime.launch.request import LaunchRequest, read_launch
from gqm_sym.runtime.legs.answers import Track
from gqm_sym.runtime.legs.body import FIRST_STEP, PLACE, PLACE_LOW, RETRY_WIDTH, launched
from gqm_sym.runtime.legs.conditions import SMOOTH, conditions_of
from gqm_sym.runtime.legs.driver import SWINGS_AHEAD
from gqm_sym.runtime.legs.frames.entering import Entry, entry_near
from gqm_sym.runtime.legs.frames.local_frame import PLACE as PLACE_OF_FRAME
from gqm_sym.runtime.legs.frames.local_frame import PLACE_LOW as LOW_OF_FRAME
from gqm_sym.runtime.legs.frames.local_frame import SMALL_SHARE, Frame, force_at_rest
from gqm_sym.runtime.sweep import quantities
from gqm_sym.runtime.sweep.dissipative_loop import (
    CHUNK,
    MIN_BODIES_PER_THREAD,
    TRIED,
    Question,
    answer_driven,
    drive_bodies,
    enter_answers,
)
from gqm_sym.runtime.sweep.quantities import Answers

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues

# The largest number of equilibria that are looked for; bodies near others are driven by their places.
MAX_EQUILIBRIA = 32

# The number of times that an interval with an equilibrium is halved.
HALVINGS = 60


class Equilibrium(NamedTuple):
    """An equilibrium near launches.

    Attributes
    ----------
    place : float
        Its place, rounded.
    frame : Frame or None
        Its frame; None if bodies do not swing about it, or cannot be followed in one.
    """

    place: float
    frame: Frame | None


def answer_small_swings(
    formulas: "Formulas",
    p: "ParameterValues",
    asked: Question,
    track: Track,
    columns: list[Array],
    answers: Answers,
) -> None:
    """Fill the answers of launches with the status NEAR_EQUILIBRIUM, as far as compiled code decides them; their values
    are the distances within which compiled code has seen that the force changes its sign.

    Parameters
    ----------
    formulas : Formulas
    p : ParameterValues
        The run-time parameters of all launches.
    asked : Question
    track : Track
        The curve.
    columns : list of arrays
        The launches, in the order of `compiled.strided`.
    answers : Answers
        Filled in.
    """
    left, by_places = np.flatnonzero(answers.status == quantities.NEAR_EQUILIBRIUM), list[NDArray[np.intp]]()
    size, around = answers.status.size, answers.values[:, 0].copy()
    lines = lay_out(columns, 0, size)
    lam0, v0, direction, target = (np.broadcast_to(lines[k], size) for k in (LAM0, V0, DIRECTION, TARGET))
    known: list[Equilibrium] = p.conditions.setdefault("equilibria", [])
    number = 0
    while left.size and number < MAX_EQUILIBRIA:
        if number == len(known):
            known.append(_equilibrium_near(formulas, p, float(lam0[left[0]]), float(around[left[0]])))
        place, frame = known[number]
        number += 1
        near = np.abs(lam0[left] - place) <= around[left]
        some, left = left[near], left[~near]
        if frame is None:
            by_places.append(some)
            continue
        distance, low = _distances(frame, lam0[some])
        sizes, largest = np.abs(distance), min(SMALL_SHARE * abs(place), frame.reach)
        within = np.flatnonzero(sizes <= largest)
        sizes[within] = _sizes(frame, distance[within], v0[some[within]])
        fit = sizes <= largest
        by_places.append(some[~fit])
        some = some[fit]
        ahead, _ = _distances(frame, target[some])
        launches = np.stack([distance[fit], low[fit], sizes[fit], v0[some], direction[some], ahead])
        found = answers.part(some)
        found.status.fill(quantities.UNDECIDED)
        run_in_threads(partial(_drive_in_frame, asked, frame, launches, found), some.size, MIN_BODIES_PER_THREAD)
        answers.put(some, found)
    plain = np.concatenate([left, *by_places])
    if plain.size:
        found = answers.part(plain)
        found.status.fill(quantities.UNDECIDED)
        of_plain = [line if line.size == 1 else line[plain] for line in lines]
        work = partial(answer_driven, formulas, asked, track, of_plain, found, by_places=True)
        run_in_threads(work, plain.size, MIN_BODIES_PER_THREAD)
        answers.put(plain, found)


def _drive_in_frame(asked: Question, frame: Frame, launches: Array, answers: Answers, part: slice) -> None:
    """Drive a part of bodies by their distance from an equilibrium. The rows of ``launches`` are the distances as two
    doubles, the sizes of the motions, the speeds, the directions, and the distances of the places that are asked for.
    """
    for begin in range(part.start, part.stop, CHUNK):
        chunk = slice(begin, min(begin + CHUNK, part.stop))
        distance, low, sizes, v0, direction, ahead = launches[:, chunk]
        reach = np.minimum(frame.reach, SWINGS_AHEAD * sizes) if frame.breaks.size else np.full(1, frame.reach)
        ends: list[Any] = [-reach, reach, 0.0]
        bodies = launched(np.empty((distance.size, PLACE)))
        asks = direction, asked.only_sign, asked.horizon, ahead, v0**2
        for k, column in enumerate((distance, *ends, *asks)):  # in the order of `legs.body`
            bodies[:, k] = column
        bodies[:, PLACE_LOW], bodies[:, RETRY_WIDTH] = low, TRIED
        drive_bodies(asked, frame.dissipation, SMOOTH._replace(breaks=frame.breaks), frame.p[None], bodies)
        enter_answers(asked, bodies, answers.part(chunk))


def _equilibrium_near(formulas: "Formulas", p: "ParameterValues", lam0: float, around: float) -> Equilibrium:
    """Return the equilibrium next to a launch place, at a distance ``around`` from which the force has opposite signs
    on both sides.
    """
    launch = read_launch(formulas, p, LaunchRequest(lam0))
    problem = Problem(formulas, launch, p, formulas.domain(p), bind_all(formulas, p))
    loss = problem.functions.dissipation
    assert loss is not None
    ends = np.array([lam0 - around, lam0 + around])
    behind, ahead = np.sign(force_at_rest(loss, problem.functions.p, ends, 1, 1))
    for _ in range(HALVINGS):
        middle = np.array([0.5 * (ends[0] + ends[1])])
        ends[0 if behind * force_at_rest(loss, problem.functions.p, middle, 1, 1)[0] > 0.0 else 1] = middle[0]
    if not behind > 0.0 > ahead:
        return Equilibrium(float(ends[0]), None)
    line = conditions_of(problem).lines[0].copy()
    line[FIRST_STEP], place, frame = starting_step(problem), float(ends[0]), None
    for _ in range(2):  # the second time from the place that double-double arithmetic gives
        line[PLACE] = place
        entry = entry_near(problem, loss, line, None)
        if not isinstance(entry, Entry) or not entry.frame.is_sharp:
            return Equilibrium(place, None)
        frame = entry.frame
        place = float(frame.p[PLACE_OF_FRAME])
    return Equilibrium(place, frame)


def _distances(frame: Frame, places: Array) -> tuple[Array, Array]:
    """Return the distances of places from the equilibrium, as two doubles each."""
    high, rest = two_sum.py_func(places, -float(frame.p[PLACE_OF_FRAME]))
    distances: tuple[Array, Array] = two_sum.py_func(high, rest - float(frame.p[LOW_OF_FRAME]))
    return distances


def _sizes(frame: Frame, distance: Array, v0: Array) -> Array:
    """Return the sizes of motions at launches (`Frame.size`)."""
    if not frame.breaks.size:
        sizes: Array = np.sqrt(distance**2 + 2.0 * v0**2 / -frame.slope)
        return sizes
    return np.array([frame.size(d, v * v) for d, v in zip(distance.tolist(), v0.tolist(), strict=True)])
