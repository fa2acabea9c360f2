"""The derivatives of the first time at a place of a libration that passes an equilibrium slowly, or turns near one.

At a fixed phase angle places move with both turning points, and the time changes by what the slow passage takes, even
if the way to the place does not contain it. From a turning point away from the equilibrium nothing of the kind cancels.
"""

from math import inf
from typing import Any

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.formula_orbit import FormulaOrbitDerivatives
from gqm_sym.runtime.gradients.passages.passage import PassageChanges

# The largest number of nodes of an orbit for which its changes at fixed phase angles keep their digits.
MAX_NODES = 64


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
    ends, moves = derivatives.turning_points, np.abs(derivatives.ends[-1])
    heading, lam0, at_rest = motion.direction, motion.problem.lam0, motion.problem.w0 == 0.0
    ahead = int(heading > 0)
    has_turned = not at_rest and heading * (place - lam0) < 0.0
    # The motion begins or turns at one of the ends. On its direct way to the place, times may be counted from either:
    # from the one that moves less, or is nearer.
    least, most = min(lam0, place), max(lam0, place)
    base = 1 - ahead if at_rest else ahead
    if not at_rest and not has_turned:
        base = int(moves[1] * (ends[1] - least) < moves[0] * (most - ends[0]))
    sign = -1 if base != ahead and not at_rest else 1
    changes = PassageChanges(motion.problem, sign * heading, ends[base], inf, has_asymptote=False)
    try:
        return sign * changes.time_slopes(place, sign * v, np.zeros_like(derivatives.ends[:, 0]), has_turned=has_turned)
    except SolutionError:  # the way contains the slow passage
        return None
