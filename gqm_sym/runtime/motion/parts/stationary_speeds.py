"""Speeds where the potential is stationary and its terms cancel, as in a flat well.

There V**2 in doubles, which divided differences of the potential give, consists mostly of roundings. Such a place is
found from the slope of the potential, on which the speed does not depend to first order, and V**2 there in extended
precision.
"""

from typing import TYPE_CHECKING

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.speed import potential_at
from gqm_sym.runtime.multiprecision.exact_panels import DIGITS

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.problem import Problem
    from gqm_sym.runtime.motion.segments.segment import Segment

# The steps beside a place at which speeds are compared, as shares of the distance between samples: they are so small
# that sixth differences of the speeds are roundings. The share of the largest speed that these reach where doubles keep
# their digits.
STEPS, MAX_SIXTH_DIFFERENCE = 0.04 * np.arange(-6.0, 7.0), 128.0 * ULP

# The number of points of each grid on which a zero of the slope is sought, and of these grids.
POINTS, GRIDS = 33, 9


def exact_speed(
    problem: "Problem", segment: "Segment", samples: Array, found: tuple[float, float], sign: int
) -> tuple[float, float]:
    """Return the phase angle and the speed where it is extreme, as they are in extended precision if doubles have lost
    digits there.

    Parameters
    ----------
    problem : Problem
        The launch.
    segment : Segment
        A segment of the motion.
    samples : array
        Phase angles in increasing order, between neighbours of which there is at most one extreme.
    found : (angle, speed)
        The same in doubles.
    sign : int
        1 for a largest speed, -1 for a least.
    """
    f, exact, formulas = problem.functions, problem.functions.exact, problem.formulas
    k = min(max(int(np.searchsorted(samples, found[0])), 1), samples.size - 1)
    near = np.clip(found[0] + STEPS * (samples[k] - samples[k - 1]), samples[0], samples[-1])
    speeds = segment.speeds(near)
    noise = float(np.abs(np.diff(speeds, 6)).max())
    known = exact is not None and formulas.chart is None and formulas.dissipation is None
    if not known or noise <= MAX_SIXTH_DIFFERENCE * float(speeds.max()):
        return found
    assert exact is not None
    places = segment.places(samples)
    turn = sign if places[-1] > places[0] else -sign  # the slope changes from this sign's opposite to it
    for _ in range(GRIDS):
        slopes = turn * potential_at(f.addresses, f.p, places)[1]
        changes = np.flatnonzero((slopes[:-1] <= 0.0) & (slopes[1:] >= 0.0))
        if not changes.size:
            return found
        at = int(changes[np.abs(changes - k).argmin()])
        places, k = np.linspace(places[at], places[at + 1], POINTS), POINTS // 2
    scale, place = exact.at(DIGITS), float(places[POINTS // 2])
    v2 = scale.speed_squared(scale.mpf(place))
    return (float(segment.phase_angles_of(np.array([place]))[0]), float(scale.sqrt(v2))) if v2 > 0 else found
