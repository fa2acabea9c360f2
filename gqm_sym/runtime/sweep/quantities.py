"""The quantities that a sweep can be asked for, and the codes that say what became of each launch.

The codes are plain integers, because compiled functions compare them.
"""

from collections.abc import Callable
from math import isfinite, nan
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.types import MATRIX, Array
from gqm_sym.runtime.launch.rider import LOADS

# The quantities that compiled code computes. SPANS is asked of batches only, on the way to another quantity: the
# offsets of both turning points from the launch, or for a circulation the length of a lap and NaN.
HALF_PERIOD, PERIOD, TURNING_POINTS, ARRIVAL_TIME, MIN_SPEED, MAX_SPEED, MIN_FORCE, MAX_FORCE, SPANS, END_TIME = range(
    10
)

# The code of a quantity that compiled code does not compute.
NOT_COMPILED = -1

# The status of a launch, and a sentence for each. While a launch is being answered it is UNDECIDED, or SPAN_KNOWN once
# a batch has found its turning points.
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
SPAN_KNOWN = -1

# The route by which a launch was answered, and a name for each: in a batch of orbits side by side, alone in a compiled
# loop, or solved as `solve` does it.
BATCH, SINGLE, SOLVE = range(3)
ROUTES = ("batch", "single", "solve")


class Answers(NamedTuple):
    """The arrays that compiled code fills: a row, a status and a route for each launch."""

    values: Array
    status: NDArray[np.int8]
    route: NDArray[np.int8]

    def part(self, which: Any) -> "Answers":
        """The same of some of the launches: views for a slice, copies for indices."""
        return Answers(self.values[which], self.status[which], self.route[which])

    def put(self, which: Any, some: "Answers") -> None:
        """Set the answers of some of the launches."""
        self.values[which], self.status[which], self.route[which] = some


ANSWERS = types.NamedTuple((MATRIX, types.int8[::1], types.int8[::1]), Answers)


class Quantity(NamedTuple):
    """How one quantity of a sweep is found.

    Attributes
    ----------
    code : int
        The number by which compiled code knows it, or NOT_COMPILED.
    width : int
        How many numbers compiled code fills in for each launch.
    columns : slice or int
        Which of these numbers are the quantity; a slice gives the values one more axis.
    of_motion : callable
        ``of_motion(motion, lam)`` is the quantity of one solved motion.
    """

    code: int
    width: int
    columns: slice | int
    of_motion: Callable[[Any, Any], Any]


def _turning_points(motion: Any, _: Any) -> Any:
    return sorted(motion.turning_points) if motion.kind == "libration" else (nan, nan)


def _rest_position(motion: Any, _: Any) -> float:
    if motion.kind == "rest":
        return float(motion.problem.lam0)
    rests = motion.kind == "dissipative" and isfinite(motion.t_end) and motion.legs[-1].end == "rest"
    return motion.legs[-1].lam_end if rests else nan


def _extreme(name: str) -> Callable[[Any, Any], float]:
    """The value of one of a motion's extremes."""

    def of_motion(motion: Any, _: Any) -> float:
        return float(getattr(motion, name).value)

    return of_motion


LOAD_EXTREMES = tuple(f"n_{load}_{which}" for load in LOADS for which in ("min", "max"))
"""The extremes of what a rider feels, which only banked tracks have."""

QUANTITIES = {
    "half_period": Quantity(HALF_PERIOD, 1, 0, lambda motion, _: motion.half_period),
    "period": Quantity(PERIOD, 1, 0, lambda motion, _: motion.period),
    "turning_points": Quantity(TURNING_POINTS, 2, slice(0, 2), _turning_points),
    "v_min": Quantity(MIN_SPEED, 1, 0, _extreme("v_min")),
    "v_max": Quantity(MAX_SPEED, 1, 0, _extreme("v_max")),
    "normal_force_min": Quantity(MIN_FORCE, 1, 0, _extreme("normal_force_min")),
    "normal_force_max": Quantity(MAX_FORCE, 1, 0, _extreme("normal_force_max")),
    **{name: Quantity(NOT_COMPILED, 1, 0, _extreme(name)) for name in LOAD_EXTREMES},
    "time_at": Quantity(ARRIVAL_TIME, 1, 0, lambda motion, lam: motion.time_at(lam)),
    "t_end": Quantity(END_TIME, 1, 0, lambda motion, _: motion.t_end if isfinite(motion.t_end) else nan),
    "rest_position": Quantity(NOT_COMPILED, 1, 0, _rest_position),
}
