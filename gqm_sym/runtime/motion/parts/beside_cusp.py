"""The contact force just beside a cusp at which the body is at rest."""

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.passages.launch_limit import limit_at_launch
from gqm_sym.runtime.launch.ends import starting_step
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.speed import path_and_force_at


def force_beside_cusp(problem: Problem, cusp: float, direction: int) -> float:
    """Return the limit of the contact force in N towards a cusp at which V**2 vanishes, on one side of it.

    It is that of a body at rest there: the curvature is infinite at the cusp, but V**2 decreases faster than the radius
    of curvature.
    """
    f = problem.functions

    def at_rest(distances: Array) -> Array:
        places = cusp + direction * distances
        forces: Array = path_and_force_at(f.addresses, f.p, places, np.zeros_like(places))[4:]
        return forces

    return float(limit_at_launch(at_rest, starting_step(problem))[0])
