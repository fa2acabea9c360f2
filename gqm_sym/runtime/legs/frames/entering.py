"""How a body that is close to an equilibrium comes to be followed by its distance from it."""

from typing import NamedTuple

import numpy as np

from gqm_sym.errors import LaunchError
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.interface import Dissipation, ExactLaw
from gqm_sym.runtime.launch.ends import starting_step
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.legs.body import LEAST_SWING, PLACE_LOW, V2
from gqm_sym.runtime.legs.body import PLACE as BODY_PLACE
from gqm_sym.runtime.legs.frames.fitting import Breaks, TryLater, frame_near, refined, sharpened
from gqm_sym.runtime.legs.frames.local_frame import PLACE, Frame, is_small
from gqm_sym.runtime.legs.panels.breaks import clearance
from gqm_sym.runtime.legs.variations.law_at_rest import law_at_rest

# A swing about an equilibrium has died away when it is below this share of the last digit of its place, or below
# `LEAST_SWING`.
LAST_DIGIT = ULP / 64.0

# The smallest distance from an unstable equilibrium at which a body may be launched from rest, as a share of its place.
# It applies if the resistance is not a factor times V**2 but a difference of forces that agree to a rounding.
NEAREST_SHARE = 1e-20


class Entry(NamedTuple):
    """A body in the frame of an equilibrium.

    Attributes
    ----------
    frame : Frame
    distance, low : float
        The distance of the body from the equilibrium, as two doubles.
    reach : float
        The distance from the equilibrium to which the body is followed.
    """

    frame: Frame
    distance: float
    low: float
    reach: float


def entry_near(problem: Problem, loss: Dissipation, line: Array, lam0: Number | None) -> Entry | TryLater | None:
    """Return a body in the frame of the equilibrium next to it; `TryLater` if there may be one for a smaller motion,
    and None if there is no equilibrium near which it stays for a while.

    Parameters
    ----------
    problem : Problem
        The launch.
    loss : Dissipation
        The forces on the body.
    line : array
        The body (`legs.body`).
    lam0 : Number, optional
        The launch place, if the body is there. Only then it is followed near an unstable equilibrium, where it does not
        stay.
    """
    p = problem.functions.p
    if not is_small(loss, p, problem.functions.corners, line):
        return None
    place, low, v2 = line[[BODY_PLACE, PLACE_LOW, V2]].tolist()
    reach, breaks = _surroundings(problem, place)
    frame = frame_near(loss, p, line, reach, breaks)
    if frame is None or isinstance(frame, TryLater):
        return frame
    if not (frame.is_stable or lam0):
        return None
    law, exact = law_at_rest(problem, has_breaks=frame.breaks.size > 0), problem.formulas.exact
    frame = frame if law is None else sharpened(frame, law)
    distance, low = frame.distance(place, low)
    unknown = LAST_DIGIT * abs(place) if frame.is_stable else frame.error
    if not frame.is_stable:
        reach = min(reach, frame.reach)
        known = refined(frame, exact, problem.p, lam0) if lam0 and isinstance(exact, ExactLaw) else None
        if known is not None:
            (frame, distance), low, unknown = known, 0.0, 0.0
    if v2 == 0.0 and abs(distance) < unknown and not loss.friction:
        distance = 0.0  # the body stays there
    _check_distance(problem, frame.size(distance, v2), frame)
    return Entry(frame, distance, low, reach)


def _surroundings(problem: Problem, place: float) -> tuple[float, Breaks]:
    """Return the distance from a place over which functions are expected to be smooth between breaks, and these."""
    f = problem.functions
    ends = np.abs(np.append(f.corners, (problem.low, problem.high)) - place)
    reach = min(starting_step(problem), float(ends.min()))
    places = f.between(f.breaks, place - reach, place + reach)
    off = clearance.py_func(*f.chart[2:4].tolist()) if f.chart.size else 0.0
    return reach, Breaks(places[~np.isin(places, f.corners)], off)


def _check_distance(problem: Problem, size: float, frame: Frame) -> None:
    """Refuse a launch so near to an unstable equilibrium that doubles cannot represent the force that drives the body
    away.
    """
    place = float(frame.p[PLACE])
    nearest = LEAST_SWING if frame.dissipation.linear else NEAREST_SHARE * abs(place)
    if not frame.is_stable and 0.0 < size < nearest:
        raise LaunchError(
            f"lam0: a motion from so near to the unstable equilibrium at {problem.formulas.parameter} = {place!r} "
            f"cannot be computed; launch at least {nearest:.1g} from it, faster, or, by exact text, at the equilibrium "
            "itself"
        )
