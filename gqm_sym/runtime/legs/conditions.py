"""What all launches with the same run-time parameters and contact share, and the first leg of each."""

from math import inf, nan
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.interface import Dissipation
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.request import ONLY_SIGN
from gqm_sym.runtime.legs.answers import Track, drive_along
from gqm_sym.runtime.legs.body import HORIZON, LAM0, LEAST_SIZE, PREFERRED, V2, launched
from gqm_sym.runtime.legs.leg_record import COLUMNS
from gqm_sym.runtime.legs.questions import FIRST_LEGS
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE

# The number of panels for which a record has space in addition to one for each break; a leg with more is followed again
# with a larger record. The number of legs that are followed in one call for a motion with a horizon, all legs of which
# are needed. The number of lines of a body that may have to be followed again past kinks: records without panels are
# short, so that more of them have space.
FEW_PANELS, LEGS_PER_CALL, LINES_PAST_KINKS = 12, 8, 24

# The size of places along a chart below which their roundings do not decrease, as a share of a piece's mean length.
PIECE_SHARE = 2.0**-6

# Curves with formulas are smooth.
SMOOTH = Track(NOWHERE, NOWHERE, NOWHERE, NOWHERE)


class FirstLegs(NamedTuple):
    """The first leg of a launch, or the first ones, as compiled code has followed them; from there a driver goes on.

    Attributes
    ----------
    body : array
        The lines of the body (`legs.body`).
    what : int
        The code for the end of the last leg (`advance`), or END_NEAR_EQUILIBRIUM.
    records : array
        The records of the legs (`leg_record`), one directly behind the other.
    """

    body: Array
    what: int
    records: Array


class Conditions(NamedTuple):
    """The arguments of compiled code that all launches with the same run-time parameters and contact share.

    Attributes
    ----------
    dissipation : Dissipation
        The forces on the body.
    track : Track
        The curve, with all places at which the curve or its chart is not smooth.
    parameters : (1, n) array
        The run-time parameters, followed by the curve's chart if it has one.
    passes : bool
        Whether legs are followed by the data kept of gaps, or past kinks, and may have to be followed again.
    space : int
        The number of panels for which a record has space.
    lines : array
        The lines of a body (`legs.body`) without its launch.
    """

    dissipation: Dissipation
    track: Track
    parameters: Array
    passes: bool
    space: int
    lines: Array


def conditions_of(problem: Problem) -> Conditions:
    """Return the conditions of a launch, which are kept with the run-time parameters."""
    p, contact = problem.p, problem.launch.contact
    known: Conditions | None = p.conditions.get(contact)
    if known is None:
        f, domain, only_sign = problem.functions, problem.domain, ONLY_SIGN[contact]
        assert f.dissipation is not None
        # With friction in space, a block is kept for an octave of V**2, in which one body passes it once or twice.
        blocks = f.dissipation.linear
        track = Track(f.chart, f.joints, f.corners, f.liftoff_corners(only_sign), blocks) if f.chart.size else SMOOTH
        has_kinks = track.has_kinks(f.dissipation)
        passes = track.is_kept(f.dissipation) or has_kinks
        given = 0.0, domain.low, domain.high, domain.period, 0.0, only_sign, inf, nan, 0.0
        lines = launched((given,), LINES_PAST_KINKS if has_kinks else LEGS_PER_CALL if passes else 0)
        if f.chart.size:
            lines[0, LEAST_SIZE] = PIECE_SHARE * float(f.chart[3] - f.chart[2]) / float(f.chart[1])
        space = FEW_PANELS + (0 if passes else track.breaks.size)
        known = p.conditions[contact] = Conditions(f.dissipation, track, f.p[None], passes, space, lines)
    return known


def follow_first_legs(problem: Problem, horizon: float) -> FirstLegs:
    """Follow a body from its launch along one leg, or along several of a motion of which all legs up to a horizon in s
    are needed.
    """
    dissipation, track, parameters, _, space, lines = conditions_of(problem)
    body, launch, legs = lines.copy(), problem.launch, LEGS_PER_CALL if horizon < inf else 1
    records = np.empty((legs, space * COLUMNS))
    body[0, LAM0], body[0, PREFERRED], body[0, V2] = launch.lam0.value, launch.direction, problem.w0
    if horizon < inf:
        body[0, HORIZON] = horizon
    what = drive_along(track, dissipation, parameters, FIRST_LEGS, body, records)
    # This avoids the constructor of a named tuple, which is slow.
    return tuple.__new__(FirstLegs, (body, what, records))
