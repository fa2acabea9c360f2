"""Gradients of single numbers of a periodic motion: its period, its turning points, its extremes, its action."""

from collections.abc import Iterable, Mapping
from functools import lru_cache
from math import isfinite
from types import MappingProxyType
from typing import Any

import numpy as np

from gqm_sym.arguments import names, one_of, unknown_argument
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.orbit import OrbitDerivatives
from gqm_sym.runtime.gradients.path import squared_force_rate
from gqm_sym.runtime.gradients.second_programs import pairs_of
from gqm_sym.runtime.launch.kinds import EXTREMES, FINAL_QUANTITIES

# The quantities that have second derivatives.
PERIODS = ("half_period", "period")

# An extreme that is nearer to a turning point than this share of the orbit's width counts as being there. The place of
# any other extreme is improved by Newton's method, whose steps may be at most this share of the width.
AT_TURN, MAX_STEP, NEWTON_STEPS = 1e-12, 1e-5, 3

# Where V**2 is below this share of its largest value, extremes of a contact force that depends on the direction of
# motion are improved in time; their second derivative is a difference over this share of the period.
SLOW, STEP_IN_TIME = 1e-6, 1e-4

# An extreme that is nearer to a break of the curve than the first share of the orbit's width counts as being there. At
# a distance of the second share, a place is on one side of the break.
AT_BREAK, SIDE_SHARE = 1e-12, 1e-13


def selected(parameters: Iterable[str], wrt: Any) -> Mapping[str, int]:
    """Return the names of the variables of differentiation, each with its row among all variables.

    Raises
    ------
    InputError
        If a name is neither a run-time parameter nor ``lam0`` or ``v0``.
    """
    is_plain = wrt is None or type(wrt) is str or type(wrt) is tuple
    try:
        return (_known_rows if is_plain else _rows)(tuple(parameters), wrt)
    except TypeError:  # what is in the tuple cannot be looked up
        return _rows(tuple(parameters), wrt)


def _rows(parameters: tuple[str, ...], wrt: Any) -> Mapping[str, int]:
    """Return what `selected` does."""
    rows = {name: row for row, name in enumerate((*parameters, "lam0", "v0"))}
    wanted = ("lam0", "v0", *parameters) if wrt is None else names(wrt, where="wrt")
    for name in wanted:
        if name not in rows:
            raise InputError(unknown_argument("wrt", name, rows, what="parameter"))
    return MappingProxyType({name: rows[name] for name in wanted})


# The same names occur again and again.
_known_rows = lru_cache(maxsize=256)(_rows)


def gradient(derivatives: OrbitDerivatives, motion: Any, quantity: str, wrt: Any) -> dict[str, Any]:
    """Return the derivatives of a quantity of a motion, with respect to the names of the variables.

    Parameters
    ----------
    derivatives : OrbitDerivatives
        The orbit of the motion.
    motion : motion.periodic.PeriodicMotion
        The motion.
    quantity : str
        One of `launch.kinds.QUANTITIES`.
    wrt : name, sequence of names, or None
        The variables of differentiation.
    """
    rows = selected(motion.problem.formulas.parameters, wrt)
    if quantity in ("half_period", "turning_points") and motion.kind != "libration":
        raise SolutionError(f"gradient: only a libration has {quantity}; this motion is of kind {motion.kind!r}")
    if quantity == "turning_points":
        low, high = derivatives.ends.T
        in_order = (low, high) if motion.turning_points[0] < motion.turning_points[1] else (high, low)
        return {name: tuple(float(end[row]) for end in in_order) for name, row in rows.items()}
    if quantity == "t_end" and isfinite(motion.t_end):
        return dict.fromkeys(rows, 0.0)
    if quantity in FINAL_QUANTITIES:
        raise SolutionError(f"gradient: this motion goes on for ever and has no {quantity}")
    if quantity in EXTREMES:
        found = extreme_gradient(derivatives, motion, quantity)
    elif quantity == "action":
        found = derivatives.action_gradient
    else:
        found = derivatives.duration_gradient if quantity == "half_period" else derivatives.period_gradient
    return {name: float(found[row]) for name, row in rows.items()}


def second_gradient(derivatives: OrbitDerivatives, motion: Any, quantity: str, wrt: Any) -> dict[str, dict[str, float]]:
    """Return the second derivatives of a half period or a period, with respect to two names.

    Parameters
    ----------
    derivatives, motion, quantity, wrt
        As for `gradient`.
    """
    rows = selected(motion.problem.formulas.parameters, wrt)
    one_of(quantity, PERIODS, where="gradient: order=2: quantity")
    if quantity == "half_period" and motion.kind != "libration":
        raise SolutionError(f"gradient: only a libration has {quantity}; this motion is of kind {motion.kind!r}")
    chosen = tuple(dict.fromkeys(rows.values()))
    share = 2.0 if quantity == "period" and motion.kind == "libration" else 1.0
    found = dict(zip(pairs_of(chosen), (share * derivatives.second_durations(chosen)).tolist(), strict=True))
    both = found | {(j, i): value for (i, j), value in found.items()}
    return {one: {other: both[rows[one], rows[other]] for other in rows} for one in rows}


def extreme_gradient(derivatives: OrbitDerivatives, motion: Any, quantity: str) -> Array:
    """Return the derivatives of an extreme along the motion, with respect to all variables.

    Inside the orbit the extreme changes as the quantity does at a fixed place, because the quantity is stationary there
    (envelope theorem). At a turning point, or where a horizon cuts the motion, the place changes too. At a break of the
    curve the extreme stays there, as the limit from one of its sides. Where the contact force depends on the direction
    of motion, it is smooth in time at turning points but not in the place: there it is stationary in time.
    """
    extreme, of_speed = getattr(motion, quantity), quantity.startswith("v_")
    found = np.zeros(derivatives.source.variables)
    if of_speed and extreme.value == 0.0:
        return found
    place, heading = np.array([extreme.lam]), 1
    if motion.problem.formulas.directed and not of_speed:
        state = motion.state(extreme.t)
        heading = -1 if state.v < 0.0 else 1
        if state.v2 <= SLOW * motion.v_max.value**2:
            return _force_change(derivatives, motion, extreme.t)
    width, moved = abs(motion.problem.period), found
    if not derivatives.direction:
        ends = derivatives.turning_points
        width = ends[1] - ends[0]
        for end, tangent in zip(ends, derivatives.moved_ends.T, strict=True):
            if abs(extreme.lam - end) <= AT_TURN * width:
                moved = tangent
    if moved is found:
        sides = _beside_break(motion, extreme.lam, width)
        if sides is not None:
            rows = derivatives.extreme_rows(sides, of_speed=of_speed, direction=heading)
            wanted = 0.5 * extreme.value**2 if of_speed else extreme.value
            near, far = rows.reshape(-1, 2, 2)[3:, np.abs(rows[0, ::2] - wanted).argmin()].T
            on_side: Array = (2.0 * near - far) / (extreme.value if of_speed else 1.0)
            return on_side
        place, is_stationary = _improved(derivatives, of_speed, heading, place, width)
        if not is_stationary and motion.t_end < motion.period:
            everything = (*motion.problem.formulas.parameters, "lam0", "v0")
            moved = derivatives.relative_change(np.append(motion._sensitivity(extreme.t, everything).lam, 0.0), place)
    (_, slope, _, *partials) = derivatives.extreme_rows(place, of_speed=of_speed, direction=heading)[:, 0]
    total: Array = (np.array(partials) + slope * moved) / (extreme.value if of_speed else 1.0)
    return total


def _force_change(derivatives: OrbitDerivatives, motion: Any, t: float) -> Array:
    """Return the derivatives of the contact force with respect to all variables at a time near ``t`` at which it is
    stationary; at ``t`` itself, if there is none.
    """
    everything, step = (*motion.problem.formulas.parameters, "lam0", "v0"), STEP_IN_TIME * motion.period
    for _ in range(NEWTON_STEPS):
        states = motion.state(t + step * np.array([-1.0, 0.0, 1.0]))
        before, rate, after = squared_force_rate(derivatives.at_places(states.lam), states.v)
        moved = -2.0 * step * rate / (after - before) if after != before else 0.0
        if not abs(moved) <= step or not 0.0 < t + moved < motion.t_end:
            break
        t += moved
    return np.append(motion._sensitivity(t, everything).normal_force, 0.0)


def _beside_break(motion: Any, place: float, width: float) -> Array | None:
    """Return two places before a break of the curve and two after it, if a place is there; else None.

    Of two places on one side, the second one is twice as far from the break.
    """
    breaks, period = motion.problem.functions.breaks, motion.problem.period
    distances = place - breaks
    if period:
        distances -= period * np.round(distances / period)
    nearest = np.abs(distances).argmin() if breaks.size else 0
    if not breaks.size or abs(distances[nearest]) > AT_BREAK * width:
        return None
    step = SIDE_SHARE * width
    sides: Array = place - distances[nearest] + step * np.array([-1.0, -2.0, 1.0, 2.0])
    return sides


def _improved(
    derivatives: OrbitDerivatives, of_speed: bool, direction: int, place: Array, width: float
) -> tuple[Array, bool]:
    """Return the place of an extreme inside an orbit by Newton's method, and whether the quantity is stationary there.

    If the quantity is constant, or nearly so, the place does not matter and is not changed.
    """
    found = place
    for _ in range(NEWTON_STEPS):
        _, slope, curvature, *_ = derivatives.extreme_rows(found, of_speed=of_speed, direction=direction)
        step = np.divide(slope, curvature, where=curvature != 0.0, out=np.zeros(1))
        if not abs(step[0]) <= MAX_STEP * width:
            return place, False
        found = found - step
    return found, True
