"""The quantities of sweeps, and the codes for the outcome of each launch.

The codes are plain integers, because compiled functions compare them.
"""

from collections.abc import Callable
from math import isfinite, nan
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.types import MATRIX, Array
from gqm_sym.runtime.launch import kinds
from gqm_sym.runtime.motion.extremes import Extreme

# The quantities that compiled code computes. SPANS serves batches only, as a step towards another quantity: the offsets
# of both turning points from the launch, or for a circulation the length of a lap and NaN.
HALF_PERIOD, PERIOD, TURNING_POINTS, ARRIVAL_TIME, MIN_SPEED, MAX_SPEED, MIN_FORCE, MAX_FORCE, SPANS, END_TIME = range(
    10
)

# The columns for both turning points beside the time of an orbit, where they are asked for. They are NaN where batches
# do not find them, and NaN and infinity for laps.
LOWER_END, UPPER_END = 1, 2

# The code of a quantity that compiled code does not compute.
NOT_COMPILED = -1

# The status of a launch, and a sentence for each. While a launch is being answered it is UNDECIDED, SPAN_KNOWN once a
# batch has found its turning points, or NEAR_EQUILIBRIUM if it is answered by its distance from one (`small_swings`).
ANSWERED, UNDECIDED, NOT_PERIODIC, NOT_FINITE, OUTSIDE_DOMAIN, NEVER_THERE, REFUSED = range(7)
STATUS_SENTENCES = (
    "",
    "left to the exact problem",
    "the motion is not of a kind that has this quantity",
    "the launch or a parameter is not a finite number",
    "the launch place lies outside the domain",
    "the motion is never at the place asked for",
    "the launch is refused; solve says why",
)
SPAN_KNOWN, NEAR_EQUILIBRIUM = -1, -2

# The route by which a launch was answered, and a name for each: in a batch of orbits, alone in a compiled loop, or
# solved as by `solve`.
BATCH, SINGLE, SOLVE = range(3)
ROUTES = ("batch", "single", "solve")


class Answers(NamedTuple):
    """The arrays that compiled code fills: a row, a status and a route for each launch."""

    values: Array
    status: NDArray[np.int8]
    route: NDArray[np.int8]

    def part(self, which: Any) -> "Answers":
        """Return the answers of some of the launches: views for a slice, copies for indices."""
        return Answers(self.values[which], self.status[which], self.route[which])

    def put(self, which: Any, some: "Answers") -> None:
        """Set the answers of some of the launches."""
        self.values[which], self.status[which], self.route[which] = some


ANSWERS = types.NamedTuple((MATRIX, types.int8[::1], types.int8[::1]), Answers)


class Quantity(NamedTuple):
    """The way in which one quantity of a sweep is found.

    Attributes
    ----------
    code : int
        The number of the quantity in compiled code, or NOT_COMPILED.
    width : int
        The number of values that compiled code fills in for each launch.
    columns : slice or int
        The columns of these values that are the quantity; a slice gives the result one more axis.
    of_motion : callable
        ``of_motion(motion, lam)`` is the quantity of one solved motion.
    """

    code: int
    width: int
    columns: slice | int
    of_motion: Callable[[Any, Any], Any]


def _number(name: str) -> Callable[[Any, Any], float]:
    """Return a function for a quantity that is an attribute of a motion or the value of an extreme; NaN if it is
    infinite.
    """

    def of_motion(motion: Any, _: Any) -> float:
        found = getattr(motion, name)
        if isinstance(found, Extreme):
            return float(found.value)  # at a cusp or a pole a force is infinite
        return float(found) if isfinite(found) else nan

    return of_motion


def _turning_points(motion: Any, _: Any) -> Any:
    return sorted(motion.turning_points) if motion.kind == "libration" else (nan, nan)


# The codes of quantities that are one number, an attribute of a motion, by name.
CODES = {
    "half_period": HALF_PERIOD,
    "period": PERIOD,
    "v_min": MIN_SPEED,
    "v_max": MAX_SPEED,
    "normal_force_min": MIN_FORCE,
    "normal_force_max": MAX_FORCE,
    "t_end": END_TIME,
}

_NAMES = (*kinds.QUANTITIES, *kinds.LOAD_EXTREMES)
QUANTITIES = {name: Quantity(CODES.get(name, NOT_COMPILED), 1, 0, _number(name)) for name in _NAMES} | {
    "turning_points": Quantity(TURNING_POINTS, 2, slice(0, 2), _turning_points),
    "time_at": Quantity(ARRIVAL_TIME, 1, 0, lambda motion, lam: motion.time_at(lam)),
}
