"""The stretches that motions are made of, by what lies at their ends."""

from math import exp, pi
from typing import Any

from gqm_sym.runtime.functions import Functions
from gqm_sym.runtime.panels import FROM_TURN, REGULAR, TO_EQUILIBRIUM, TURN_TURN
from gqm_sym.runtime.stretch import Stretch


def toward_equilibrium(functions: Functions, start: float, top: float, duration: float) -> Stretch:
    """A stretch from ``start`` that comes as close to an equilibrium as takes at least ``duration``."""
    stop = 8.0
    while True:
        stretch = Stretch(functions=functions, kind=TO_EQUILIBRIUM, a=start, b=top, stop=stop)
        if stretch.duration > duration or exp(-stop) * abs(start - top) < 1e-300:
            return stretch
        stop *= 2.0


def between_turns(
    functions: Functions,
    a: float,
    b: float,
    known: float | None = None,
    ends: tuple[Any, Any] = (None, None),
) -> Stretch:
    """A stretch between two turning points."""
    return Stretch(functions=functions, kind=TURN_TURN, a=a, b=b, stop=pi, known=known, ends=ends)


def from_turn(functions: Functions, turn: float, end: float) -> Stretch:
    """A stretch from a turning point to a place where the speed is not zero."""
    return Stretch(functions=functions, kind=FROM_TURN, a=turn, b=end)


def through(
    functions: Functions,
    start: float,
    end: float,
    ref: float,
    w: float,
    *,
    known: float | None = None,
    hints: tuple[float, ...] = (),
) -> Stretch:
    """A stretch without special ends; ``w`` is V**2 at ``ref``."""
    return Stretch(functions=functions, kind=REGULAR, a=start, b=end, ref=ref, w=w, known=known, hints=hints)
