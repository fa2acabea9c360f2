"""Second divided differences of a formula over both turning points and a place, recorded without cancellation.

A formula is called with a number that is its chord, the linear function with its values at both turning points a and b,
plus ``(lam - a) (lam - b)`` times its second divided difference over a, the place and b. With the distance y from the
middle of the orbit and half its width h, that is

    f = mean + slope y + (y**2 - h**2) f[a, lam, b].

Mean and slope of the chord do not depend on the place. The rules for sums, products, quotients, roots and compositions
are exact (MATHS, section 3), and odd parts cancel exactly in an even well.
"""

from abc import ABC, abstractmethod
from fractions import Fraction
from typing import Any, Self

from gqm_sym.runtime.double_double.recording import TapeNumber
from gqm_sym.runtime.gradients.lanes.operations import WithoutRuleError

HALF = Fraction(1, 2)


class PlacesBase(ABC):
    """Places over which divided differences are recorded, and the namespace of operations for numbers over them.

    Attributes
    ----------
    op : LaneRecorder or SeriesRecorder
        The tape.
    place : NumberOverPlaces
        The place itself.
    """

    op: Any
    place: Any

    @abstractmethod
    def spread(self, value: Any) -> Any:
        """Return a number over the places; a constant is the same at all of them."""

    def tan(self, u: Any) -> Any:
        """Record a tangent."""
        return self.sin(u) / self.cos(u)

    def tanh(self, u: Any) -> Any:
        """Record a hyperbolic tangent."""
        return self.sinh(u) / self.cosh(u)

    def of(self, formula: Any, p: Any) -> Any:
        """Return a formula ``f(op, lam, p)`` over the places."""
        return self.spread(formula(self, self.place, [self.spread(number) for number in p]))

    def __getattr__(self, name: str) -> Any:
        function = getattr(self.op, name)

        def of_constant(u: Any) -> Any:
            number = self.spread(u)
            if not number.is_constant:
                raise WithoutRuleError
            return self.spread(function(number.constant))

        return of_constant


class NumberOverPlaces(ABC):
    """A number that depends on the place, with its divided differences: what follows from sums, products and
    reciprocals.
    """

    __slots__ = ()

    places: Any

    @property
    @abstractmethod
    def is_constant(self) -> bool:
        """Whether the number does not depend on the place."""

    @property
    @abstractmethod
    def constant(self) -> TapeNumber:
        """The value of a number that does not depend on the place."""

    @abstractmethod
    def _linear(self, other: Any, sign: int) -> Self:
        """Return the sum with a multiple of another number."""

    @abstractmethod
    def __mul__(self, other: Any) -> Self: ...

    @abstractmethod
    def inverse(self) -> Self:
        """Return the reciprocal."""

    def __add__(self, other: Any) -> Self:
        return self._linear(other, 1)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Self:
        return self._linear(other, -1)

    def __rsub__(self, other: Any) -> Self:
        found: Self = self.places.spread(other) - self
        return found

    def __neg__(self) -> Self:
        return self * -1

    def __rmul__(self, other: Any) -> Self:
        found: Self = self * other
        return found

    def __truediv__(self, other: Any) -> Self:
        found: Self = self * self.places.spread(other).inverse()
        return found

    def __rtruediv__(self, other: Any) -> Self:
        found: Self = self.places.spread(other) * self.inverse()
        return found

    def __abs__(self) -> Self:
        raise WithoutRuleError

    def __pow__(self, other: Any) -> Self:
        power = self.places.spread(other)
        exponent = power.constant
        if not power.is_constant or exponent.known is None or exponent.known.denominator > 2:
            raise WithoutRuleError
        base: Self = self if exponent.known.denominator == 1 else self.places.sqrt(self)
        found = base.to(abs(exponent.known.numerator))
        return found.inverse() if exponent.known < 0 else found

    def __rpow__(self, other: Any) -> Self:
        raise WithoutRuleError

    def to(self, count: int) -> Self:
        """Return the power with a positive integer exponent."""
        if count < 2:
            one: Self = self.places.spread(1)
            return self if count else one
        half = self.to(count // 2)
        square = half * half
        return square * self if count % 2 else square


class Places(PlacesBase):
    """Both turning points a and b and a place between them, and the namespace of operations for numbers over them.

    Parameters
    ----------
    op : LaneRecorder or SeriesRecorder
        The tape.
    ends : pair of numbers
        a and b.
    tilt, bow : number
        Of the phase angle phi at the place, -cos(phi) and sin(phi)**2.
    """

    def __init__(self, op: Any, ends: tuple[TapeNumber, TapeNumber], tilt: TapeNumber, bow: TapeNumber) -> None:
        a, b = ends
        self.op, self.tilt, self.half = op, tilt, (b - a) * HALF
        self.square = self.half * self.half
        # The distance y from the middle of the orbit, and y**2 - h**2.
        self.distance, self.gap = self.half * tilt, -self.square * bow
        self.pi, self.e, self.mpf = self.spread(op.pi), self.spread(op.e), self.spread
        self.place = Differenced(self, (a + b) * HALF, op.number(1), op.number(0))

    def spread(self, value: Any) -> "Differenced":
        """Return a number over the places; a constant is the same at all of them."""
        if isinstance(value, Differenced):
            return value
        return Differenced(self, self.op.number(value), self.op.number(0), self.op.number(0))

    def _wave(self, u: "Differenced", sign: int, *, is_odd: bool) -> "Differenced":
        """Return the sine (``is_odd``) or cosine of a number, or their hyperbolic counterparts (``sign`` -1)."""
        op = self.op
        odd, even = (op.sin, op.cos) if sign > 0 else (op.sinh, op.cosh)
        if u.is_constant:
            return self.spread((odd if is_odd else even)(u.mean))
        # About the middle, the argument is a constant plus t, which is the phase at the end of the orbit.
        rate, end = u.slope, u.slope * self.half
        squared = sign * (end * end)
        of_even, of_odd = op.wave_differences(squared, self.tilt)
        sine, cosine = odd(u.mean), even(u.mean)
        evens = even(end), op.number(0), sign * (rate * rate) * of_even
        odds = op.number(0), rate * op.sinc(end, sign), sign * (rate * (rate * rate)) * self.distance * of_odd
        # By the theorems of addition; the cosine has the sign that the sine has as its derivative.
        one, other = (sine, cosine) if is_odd else (cosine, sine if sign < 0 else -sine)
        found = Differenced(self, *(one * x + other * y for x, y in zip(evens, odds, strict=True)))
        if u.is_linear:
            return found
        # What the argument has beyond its chord changes the wave by that times a divided difference over both.
        beyond = u.second * self.gap * HALF
        mean = u.chord + beyond
        slope = (even(mean) if is_odd else odd(mean) * (-1 if sign > 0 else 1)) * op.sinc(beyond, sign)
        return Differenced(self, found.mean, found.slope, found.second + u.second * slope)

    def sin(self, u: Any) -> "Differenced":
        """Record a sine."""
        return self._wave(self.spread(u), 1, is_odd=True)

    def cos(self, u: Any) -> "Differenced":
        """Record a cosine."""
        return self._wave(self.spread(u), 1, is_odd=False)

    def sinh(self, u: Any) -> "Differenced":
        """Record a hyperbolic sine."""
        return self._wave(self.spread(u), -1, is_odd=True)

    def cosh(self, u: Any) -> "Differenced":
        """Record a hyperbolic cosine."""
        return self._wave(self.spread(u), -1, is_odd=False)

    def exp(self, u: Any) -> "Differenced":
        """Record an exponential."""
        number = self.spread(u)
        return self.spread(self.op.exp(number.mean)) if number.is_constant else self.cosh(u) + self.sinh(u)

    def sqrt(self, u: Any) -> "Differenced":
        """Record a square root."""
        number, op = self.spread(u), self.op
        if number.is_constant:
            return self.spread(op.sqrt(number.mean))
        left, right = (op.sqrt(value) for value in number.ends)
        mean, slope, root = (left + right) * HALF, number.slope / (left + right), op.sqrt(number.at)
        second = (number.second - slope * slope) / (root + (mean + slope * self.distance))
        return Differenced(self, mean, slope, second, root)


class Differenced(NumberOverPlaces):
    """A number that depends on the place, as its chord and its second divided difference.

    Parameters
    ----------
    places : Places
        The places.
    mean, slope : number
        The mean of the values at both turning points, and the divided difference over these.
    second : number
        The divided difference over both and the place.
    at : number, optional
        The value at the place; otherwise it follows from the others.
    """

    __slots__ = ("_at", "mean", "places", "second", "slope")

    places: Places

    def __init__(self, places: Places, mean: Any, slope: Any, second: Any, at: Any = None) -> None:
        self.places, self.mean, self.slope, self.second, self._at = places, mean, slope, second, at

    @property
    def is_constant(self) -> bool:
        """Whether the number does not depend on the place."""
        return bool(self.slope.known == 0) and self.is_linear

    @property
    def constant(self) -> TapeNumber:
        """The value of a number that does not depend on the place."""
        found: TapeNumber = self.mean
        return found

    @property
    def is_linear(self) -> bool:
        """Whether the number is a linear function of the place."""
        return bool(self.second.known == 0)

    @property
    def chord(self) -> TapeNumber:
        """The value of the chord at the place."""
        found: TapeNumber = self.mean + self.slope * self.places.distance
        return found

    @property
    def at(self) -> TapeNumber:
        """The value at the place."""
        if self._at is None:
            self._at = self.chord + self.second * self.places.gap
        found: TapeNumber = self._at
        return found

    @property
    def ends(self) -> tuple[TapeNumber, TapeNumber]:
        """The values at both turning points."""
        step = self.slope * self.places.half
        return self.mean - step, self.mean + step

    def _linear(self, other: Any, sign: int) -> "Differenced":
        v = self.places.spread(other)
        is_chord = self.is_linear and v.is_linear
        return Differenced(
            self.places,
            self.mean + sign * v.mean,
            self.slope + sign * v.slope,
            self.second + sign * v.second,
            None if is_chord else self.at + sign * v.at,
        )

    def __mul__(self, other: Any) -> "Differenced":
        v, places = self.places.spread(other), self.places
        if self.is_constant or v.is_constant:
            factor, number = (self, v) if self.is_constant else (v, self)
            by = factor.mean
            return Differenced(places, by * number.mean, by * number.slope, by * number.second, by * number.at)
        slopes = self.slope * v.slope
        mean = self.mean * v.mean + slopes * places.square
        if self is v:
            second = slopes + self.second * (self.at + self.chord)
        else:
            second = slopes + (self.second * v.at + self.chord * v.second)
        return Differenced(places, mean, self.mean * v.slope + self.slope * v.mean, second, self.at * v.at)

    def inverse(self) -> "Differenced":
        """Return the reciprocal."""
        if self.is_constant:
            return self.places.spread(1 / self.mean)
        (left, right), inverse = self.ends, 1 / self.at
        share = 1 / (left * right)
        chord = share * (self.mean - self.slope * self.places.distance)
        second = inverse * (self.slope * self.slope * share - chord * self.second)
        return Differenced(self.places, self.mean * share, -(self.slope * share), second, inverse)
