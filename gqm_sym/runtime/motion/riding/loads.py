"""Loads on the rider at the phase angles of a motion, and their extremes."""

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gqm_sym.arguments import one_of
from gqm_sym.literals.namespaces import FLOATS
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.equilibria import Potential
from gqm_sym.runtime.launch.kinds import LOADS
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.rider import FIELDS, STANDARD_GRAVITY, check_banked, rider_loads
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.motion.extremes import Extreme, Quantity, extreme
from gqm_sym.runtime.motion.locking import kept
from gqm_sym.runtime.motion.trajectory import TimedSegment


def load_of(name: str, problem: Problem) -> Quantity:
    """Return a load, given by its name "vertical", "lateral" or "longitudinal", as a quantity along motions."""
    one_of(name, LOADS, where="load")
    check_banked(problem.formulas, f"n_{name}")
    return Quantity(partial(_at, LOADS.index(name), problem), lambda state: float(getattr(state, f"n_{name}")))


def _at(row: int, problem: Problem, timed: TimedSegment, phi: Array, share: float = 1.0) -> Array:
    segment = timed.segment
    f, places, v2 = segment.functions, segment.places(phi), (share * segment.speeds(phi)) ** 2
    force = path_and_force_at(f.addresses, f.p, places, v2)[4]
    direction = np.full(phi.size, float(timed.direction))
    found: Array = rider_loads(problem.formulas, f.p, places, v2, direction, force)[row]
    return found


def load_extreme(name: str, sign: int) -> Any:
    """Return a property of motions: the largest (sign 1) or least (-1) value of a load."""

    def found(motion: Any) -> Extreme:
        return extreme(motion, load_of(name, motion.problem), sign)

    found.__qualname__ = f"n_{name}_{'max' if sign > 0 else 'min'}"
    return property(kept(found), doc=f"The {'largest' if sign > 0 else 'least'} {name} load on a rider; as `v_max`.")


def loads_on_rider(
    problem: Problem, lam: Array, v: Array, v2: Array, force: Array, resting: NDArray[np.bool_]
) -> Array:
    """Return the rows of `FIELDS` at places and velocities.

    At a turn and at a launch from rest the friction is that of the motion afterwards. Where the body is ``resting`` for
    good, its track carries all of its weight: the loads do not change, and the force that holds the body is a load
    along the track.
    """
    formulas, p = problem.formulas, problem.functions.p
    rows = rider_loads(formulas, p, lam, v2, np.copysign(1.0, v), force)
    if resting.any():
        potential, slope = Potential(formulas, problem.p).rows(lam[resting])[:2]
        inertia = 1.0 if formulas.inertia is None else float(formulas.inertia(FLOATS, problem.p.values.tolist()))
        ds = path_and_force_at(problem.functions.addresses, p, lam[resting], np.zeros(potential.size))[2]
        rows[len(LOADS) : 2 * len(LOADS), resting] = 0.0
        rows[FIELDS.index("n_longitudinal"), resting] = inertia * slope / ds / STANDARD_GRAVITY
    return rows
