"""Extremes of a quantity along a motion that ends, leg by leg."""

from collections.abc import Callable
from math import isfinite, nan
from typing import TYPE_CHECKING

import numpy as np

from gqm_sym.runtime.compiled.types import Array

if TYPE_CHECKING:
    from gqm_sym.runtime.motion.motion import Motion, State


# Times a leg is looked at, how many of the best of all legs are looked into, and how often, each time 64 times closer.
LOOKS, BEST, CLOSER = 257, 4, 8


def over_legs(motion: "Motion", quantity: Callable[["State"], Array], sign: int) -> float:
    """The largest (sign 1) or least (-1) value from launch to the end; NaN for a motion without one."""
    if motion.kind == "rest":
        return float(quantity(motion.state(0.0)))
    if not isfinite(motion.t_end):
        return nan
    found: list[tuple[float, float, float]] = []
    for leg in motion.legs:
        # Even steps in the angle of a half turn: a body is slow next to a turning point.
        times = leg.t_start + (leg.t_end - leg.t_start) * (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, LOOKS)))
        times[-1] = min(leg.t_end, motion.t_end)
        values = sign * quantity(motion.state(times))
        beside = np.concatenate([[-np.inf], values, [-np.inf]])
        peaks = np.flatnonzero((values >= beside[:-2]) & (values >= beside[2:]))
        found += [(float(values[k]), times[max(k - 1, 0)], times[min(k + 1, LOOKS - 1)]) for k in peaks.tolist()]
    found.sort(reverse=True)
    return sign * max(_closer(motion, quantity, sign, *peak) for peak in found[:BEST])


def _closer(
    motion: "Motion", quantity: Callable[["State"], Array], sign: int, best: float, start: float, stop: float
) -> float:
    """The extreme between two times."""
    for _round in range(CLOSER):
        times = np.linspace(start, stop, 129)
        values = sign * quantity(motion.state(times))
        k = int(np.argmax(values))
        best = max(best, float(values[k]))
        start, stop = times[max(k - 1, 0)], times[min(k + 1, times.size - 1)]
    return best
