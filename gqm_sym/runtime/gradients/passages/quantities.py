"""Derivatives of single numbers of a motion without losses that does not repeat: turning points, extremes, its end."""

from math import isfinite
from typing import Any

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.passages.passage import NEWTON_STEPS, PassageChanges
from gqm_sym.runtime.launch.kinds import EXTREMES, FINAL_QUANTITIES

# An extreme this near to the end of a motion, as a share of its time, counts as the end; so does one this near to the
# turning point.
AT_END = 1e-12


def gradient(motion: Any, changes: PassageChanges, quantity: str) -> Array:
    """Return the derivatives of a quantity of a motion with respect to all variables; for turning points, a row for
    each.

    Parameters
    ----------
    motion : motion.aperiodic.AperiodicMotion
        The motion.
    changes : PassageChanges
        Its changes.
    quantity : str
        One of `launch.kinds.QUANTITIES`.
    """
    if quantity == "turning_points":
        turns = [changes.turn.moves[0] for _ in motion.turning_points]
        return np.array(turns).reshape(-1, changes.source.variables)
    if quantity in EXTREMES:
        return _extreme(motion, changes, quantity)
    if quantity in FINAL_QUANTITIES and not isfinite(motion.t_end):
        raise SolutionError(f"gradient: this motion goes on for ever and has no {quantity}")
    if quantity != "t_end":
        raise SolutionError(f"gradient: this motion has no {quantity}; it is of kind {motion.kind!r}")
    what, state = motion.legs[-1].end, motion.state(motion.t_end)
    if what == "horizon" or motion.t_end == 0.0:
        return np.zeros(changes.source.variables)
    has_turned = motion._has_turned(motion.t_end)
    moved = changes.end(what, state.lam, changes.direction(has_turned=has_turned))
    return changes.time_slopes(state.lam, state.v, moved, has_turned=has_turned)


def _extreme(motion: Any, changes: PassageChanges, quantity: str) -> Array:
    """Return the derivatives of an extreme.

    Where the quantity is stationary it changes as it does at a fixed place (envelope theorem). At the launch, the
    turning point and the end, the place changes too.
    """
    found, of_speed = getattr(motion, quantity), quantity.startswith("v_")
    if of_speed and found.value == 0.0:
        return np.zeros(changes.source.variables)
    place, end, direction = found.lam, motion.t_end, changes.direction(has_turned=motion._has_turned(found.t))
    rows = changes.extreme_rows(place, direction, of_speed=of_speed)
    if found.t == 0.0:
        moved = changes.launch.moves[0]
    elif isfinite(end) and abs(found.t - end) <= AT_END * end:
        what, state = motion.legs[-1].end, motion.state(end)
        at_horizon = what == "horizon"
        if at_horizon:
            at = np.array([state.lam]), np.array([state.v]), np.array([motion._has_turned(end)])
            moved = changes.states(*at)[0, :, 0]
        else:
            moved = changes.end(what, state.lam, direction)
    elif motion.turning_points and abs(place - changes.turn.high) <= AT_END * abs(place - changes.launch.high):
        moved = changes.turn.moves[0]
    else:
        moved = np.zeros(changes.source.variables)
        for _ in range(NEWTON_STEPS):
            place = place - rows[1] / rows[2] if rows[2] != 0.0 else place
            rows = changes.extreme_rows(place, direction, of_speed=of_speed)
    total: Array = (rows[3:] + rows[1] * moved) / (found.value if of_speed else 1.0)
    return total
