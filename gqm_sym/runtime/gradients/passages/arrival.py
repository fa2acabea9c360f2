"""The derivatives of the first time at a place of a libration that passes an equilibrium slowly, or turns near one.

At a fixed phase angle places move with both turning points, and the time changes by what the slow passage takes, even
if the way to the place does not contain it. From a turning point away from the equilibrium nothing of the kind cancels.
"""

from math import inf
from typing import Any

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.formula_orbit import FormulaOrbitDerivatives
from gqm_sym.runtime.gradients.passages.passage import PassageChanges

# The largest number of nodes of an orbit for which its changes at fixed phase angles keep their digits.
MAX_NODES = 64


@Inner
def counts_from_upper(lam0, direction, rests, place, turns, moves):  # type: ignore[no-untyped-def]
    """Return whether times on the direct way to a place are counted from the upper turning point.

    A launch at rest is one of the turning points. The way may turn at one; else that is taken which moves less, or is
    nearer.

    Parameters
    ----------
    lam0, direction, rests
        The launch place, the sign of ds/dt there, and whether the body is released at rest.
    place : float
        The place.
    turns, moves : pairs of float
        The lower and the upper turning point, and how much each moves with the variables.
    """
    (below, above), (lower, upper) = turns, moves
    if rests:
        return above - lam0 < lam0 - below
    if direction * (place - lam0) < 0.0:
        return direction > 0.0
    return upper * (above - min(lam0, place)) < lower * (max(lam0, place) - below)


def arrival_slopes(motion: Any, derivatives: FormulaOrbitDerivatives, place: float, v: float) -> Array | None:
    """Return the derivatives of the first time at a place with respect to all variables; None if the orbit has no slow
    passage, or the way to the place contains it.

    Parameters
    ----------
    motion : motion.periodic.PeriodicMotion
        The libration.
    derivatives : FormulaOrbitDerivatives
        Its orbit.
    place : float
        The place.
    v : float
        The velocity ds/dt there, at that time.
    """
    if 0 < derivatives.nodes <= MAX_NODES:
        return None
    turns, moves = derivatives.turning_points, np.abs(derivatives.ends[-1]).tolist()
    heading, lam0, at_rest = motion.direction, motion.problem.lam0, motion.problem.w0 == 0.0
    has_turned = not at_rest and heading * (place - lam0) < 0.0
    is_upper = counts_from_upper.py_func(lam0, heading, at_rest, place, turns, moves)
    sign = 1 if at_rest or is_upper == (heading > 0) else -1
    changes = PassageChanges(motion.problem, sign * heading, turns[is_upper], inf, has_asymptote=False)
    try:
        return sign * changes.time_slopes(place, sign * v, np.zeros_like(derivatives.ends[:, 0]), has_turned=has_turned)
    except SolutionError:  # the way contains the slow passage
        return None
