"""Divided differences of a formula over a turning point and a place, recorded without cancellation.

The rules for sums, products and compositions are exact (MATHS, section 3).
"""

from typing import Any

from gqm_sym.runtime.double_double.recording import TapeNumber
from gqm_sym.runtime.gradients.lanes.differences import HALF, NumberOverPlaces, PlacesBase
from gqm_sym.runtime.gradients.lanes.operations import LaneRecorder


class TwoPlaces(PlacesBase):
    """A turning point a and a place, and the namespace of operations for numbers over both.

    Parameters
    ----------
    op : LaneRecorder
        The tape.
    ends : pair of numbers
        Both turning points, a and b.
    share : number
        The share of the way from a to b at the place.
    """

    def __init__(self, op: LaneRecorder, ends: tuple[TapeNumber, TapeNumber], share: TapeNumber) -> None:
        a, b = ends
        self.op, self.gap = op, (b - a) * share
        self.pi, self.e, self.mpf = self.spread(op.pi), self.spread(op.e), self.spread
        self.place = FirstDifference(self, (a, a + self.gap), op.number(1))

    def spread(self, value: Any) -> "FirstDifference":
        """Return a number over both places; a constant is the same at both."""
        if isinstance(value, FirstDifference):
            return value
        number = self.op.number(value)
        return FirstDifference(self, (number, number), self.op.number(0))

    def _wave(self, u: "FirstDifference", function: Any, derivative: Any, sign: int) -> "FirstDifference":
        """Return a wave with its derivative, given as functions; those of hyperbolic ones have the ``sign`` -1."""
        if u.is_constant:
            return self.spread(function(u.at[1]))
        beyond = self.gap * u.first * HALF
        slope = derivative(u.at[0] + beyond) * self.op.sinc(beyond, sign)
        return FirstDifference(self, tuple(function(value) for value in u.at), slope * u.first)

    def sin(self, u: Any) -> "FirstDifference":
        """Record a sine."""
        return self._wave(self.spread(u), self.op.sin, self.op.cos, 1)

    def cos(self, u: Any) -> "FirstDifference":
        """Record a cosine."""
        return self._wave(self.spread(u), self.op.cos, lambda value: -self.op.sin(value), 1)

    def sinh(self, u: Any) -> "FirstDifference":
        """Record a hyperbolic sine."""
        return self._wave(self.spread(u), self.op.sinh, self.op.cosh, -1)

    def cosh(self, u: Any) -> "FirstDifference":
        """Record a hyperbolic cosine."""
        return self._wave(self.spread(u), self.op.cosh, self.op.sinh, -1)

    def exp(self, u: Any) -> "FirstDifference":
        """Record an exponential."""
        return self._wave(self.spread(u), self.op.exp, self.op.exp, -1)

    def sqrt(self, u: Any) -> "FirstDifference":
        """Record a square root."""
        number = self.spread(u)
        a, x = (self.op.sqrt(value) for value in number.at)
        if number.is_constant:
            return self.spread(x)
        return FirstDifference(self, (a, x), number.first / (a + x))


class FirstDifference(NumberOverPlaces):
    """A number that depends on the place, over a turning point and a place.

    Attributes
    ----------
    at : pair of numbers
        The values at both.
    first : number
        The divided difference over both.
    """

    __slots__ = ("at", "first", "places")

    def __init__(self, places: TwoPlaces, at: Any, first: TapeNumber) -> None:
        self.places, self.at, self.first = places, tuple(at), first

    @property
    def is_constant(self) -> bool:
        """Whether the number does not depend on the place."""
        return bool(self.first.known == 0)

    @property
    def constant(self) -> TapeNumber:
        """The value of a number that does not depend on the place."""
        found: TapeNumber = self.at[1]
        return found

    def _linear(self, other: Any, sign: int) -> "FirstDifference":
        v = self.places.spread(other)
        at = [one + sign * two for one, two in zip(self.at, v.at, strict=True)]
        return FirstDifference(self.places, at, self.first + sign * v.first)

    def __mul__(self, other: Any) -> "FirstDifference":
        v = self.places.spread(other)
        (a, x), (p, y) = self.at, v.at
        return FirstDifference(self.places, (a * p, x * y), self.first * y + a * v.first)

    def inverse(self) -> "FirstDifference":
        """Return the reciprocal."""
        a, x = (1 / value for value in self.at)
        return FirstDifference(self.places, (a, x), -(a * x) * self.first)
