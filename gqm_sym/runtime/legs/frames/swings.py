"""Small swings that one call of compiled code has followed by their distance from an equilibrium."""

from math import fabs, inf

from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import add
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import INTEGER, REAL, VECTOR, Array
from gqm_sym.runtime.legs.body import LEAST_SWING
from gqm_sym.runtime.legs.frames.entering import LAST_DIGIT
from gqm_sym.runtime.legs.frames.local_frame import PLACE, PLACE_LOW, Frame
from gqm_sym.runtime.legs.leg_record import CHANGE_COUNT, END, MIDDLE, START, USED, change_at

# The number of swings that are followed in one call for a motion with a horizon.
SWINGS_PER_CALL = 32


@entry(types.void(VECTOR, INTEGER, REAL, REAL))
def _move(line, count, place, low):  # type: ignore[no-untyped-def]
    at = 0
    for _ in range(count):
        record = line[at : at + int(line[at + USED])]
        for k in (START, END, MIDDLE):
            record[k], record[k + 1] = add(record[k], record[k + 1], place, low)
        for k in range(int(record[CHANGE_COUNT])):
            record[change_at(record, k)] += place
        at += record.size


@entry(REAL(VECTOR, INTEGER))
def _nearest_turn(line, count):  # type: ignore[no-untyped-def]
    nearest, at = inf, 0
    for _ in range(count):
        nearest = min(nearest, fabs(line[at + END]))
        at += int(line[at + USED])
    return nearest


def swings_per_call(frame: Frame) -> int:
    """Return how many swings may be followed in one call: one if something may have to be decided after each."""
    loss = frame.dissipation
    return 1 if loss.friction or loss.kinked or frame.breaks.size else SWINGS_PER_CALL


def move_swings(frame: Frame, line: Array, count: int) -> None:
    """Replace distances by places in the records of legs, as `Frame.move` does."""
    _move(line, count, float(frame.p[PLACE]), float(frame.p[PLACE_LOW]))


def may_have_died_away(frame: Frame, line: Array, count: int) -> bool:
    """Return whether the motion may have ended after one of some legs, because its place does not show the swing."""
    nearest: float = _nearest_turn(line, count)
    shown = LAST_DIGIT * (abs(float(frame.p[PLACE])) + nearest)
    return nearest < max(LEAST_SWING, shown)
