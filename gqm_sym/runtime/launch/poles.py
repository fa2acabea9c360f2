"""Centres of force on a curve, into which a body falls: poles of the potential."""

from math import fabs

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.launch.ends import starting_step
from gqm_sym.runtime.launch.equilibria import Potential
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.zeros import POLE_GAIN, POLE_RATIO

# The potential has a pole at a place if V**2 gains there as `launch.zeros` says, beginning at the first share of the
# first step; a pole is close ahead if it is no farther than the second share.
POLE_BEGIN, POLE_REACH = 2.0**-8, 2.0**-4


def pole_ahead(problem: Problem, direction: int, place: float) -> float | None:
    """Return the pole of the potential at a place or close ahead of it, where a body falls into a centre of force; None
    if there is none (`zeros.is_pole`).
    """
    potential, step = Potential(problem.formulas, problem.p), starting_step(problem)

    def attracts(lam: float) -> bool:
        return direction * potential.slope(lam) < 0.0

    distance = ULP * (fabs(place) + step)
    near, far = place, place + direction * distance
    while attracts(far) and distance < POLE_REACH * step:
        distance = 2.0 * distance
        near, far = far, place + direction * distance
    while near != (middle := 0.5 * (near + far)) != far:
        near, far = (middle, far) if attracts(middle) else (near, middle)
    pole = far
    before = pole - direction * POLE_BEGIN * step / POLE_RATIO ** np.arange(3)
    fallen = -np.diff(potential.rows(before)[0])
    return pole if fallen[1] >= POLE_GAIN * fallen[0] > 0.0 else None
