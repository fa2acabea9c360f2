"""Divided differences of a formula over three places, recorded without cancellation.

A formula is called with a number that has a value at each of three places, and the divided differences of these. The
rules for sums, products and compositions are exact (MATHS, section 3). They are symmetric in the outer places, so that
odd parts cancel exactly in an even well.
"""

from fractions import Fraction
from typing import Any

from gqm_sym.runtime.double_double.recording import TapeNumber
from gqm_sym.runtime.gradients.lanes.operations import WithoutRuleError


def is_same(a: TapeNumber, b: TapeNumber) -> bool:
    """Return whether two numbers are the same register, or the same constant."""
    return a.register == b.register and a.known == b.known


def mean(a: TapeNumber, b: TapeNumber) -> TapeNumber:
    """Return the mean of two numbers."""
    return a if is_same(a, b) else (a + b) * Fraction(1, 2)


class Places:
    """Both turning points a and b and a place between them, and the namespace of operations for numbers over them.

    Parameters
    ----------
    op : LaneRecorder or SeriesRecorder
        The tape.
    ends, shares : two numbers each
        a and b, and the shares of the way from a and from b at the place.
    """

    def __init__(self, op: Any, ends: tuple[TapeNumber, TapeNumber], shares: tuple[TapeNumber, TapeNumber]) -> None:
        (a, b), (share, rest), half = ends, shares, Fraction(1, 2)
        self.op, self.whole, self.shares = op, b - a, shares
        self.gaps = self.whole * share, self.whole * rest
        # The distances of a, of the place between them, and of b from the middle, which is known to more digits.
        self.middle, self.tilt = (a + b) * half, share - rest
        self.distances = -half * self.whole, half * self.whole * self.tilt, half * self.whole
        self.pi, self.e, self.mpf = self.spread(op.pi), self.spread(op.e), self.spread
        one, zero = op.number(1), op.number(0)
        self.place = Differenced(self, (a, self.middle + self.distances[1], b), (one, one), zero)

    def spread(self, value: Any) -> "Differenced":
        """Return a number over the places; a constant is the same at all of them."""
        if isinstance(value, Differenced):
            return value
        number, zero = self.op.number(value), self.op.number(0)
        return Differenced(self, (number, number, number), (zero, zero), zero)

    def of(self, formula: Any, p: Any) -> "Differenced":
        """Return a formula ``f(op, lam, p)`` over the places."""
        return self.spread(formula(self, self.place, [self.spread(number) for number in p]))

    def _of(self, u: Any, values: Any, parts: Any) -> Any:
        """Return a function of a number over the places.

        Parameters
        ----------
        u : Differenced
            The argument.
        values : three numbers
            The values of the function.
        parts : three numbers
            Its divided differences over the first two, the last two, and all three values of the argument.
        """
        first, last, second = parts
        left, right = u.first
        whole = u.over_ends
        both = mean(first, last) * u.second
        bent = second * (whole * mean(left, right))
        return Differenced(self, values, (first * left, last * right), both + bent)

    def _waves(self, u: "Differenced", sign: int, functions: tuple[Any, Any], turned: bool) -> Any:
        """Return a sine (``turned``) or cosine, or their hyperbolic counterparts (``sign`` -1).

        ``functions`` are the odd and the even function.
        """
        op, half = self.op, Fraction(1, 2)
        odd, even = functions
        if u.is_constant:
            return self.spread((odd if turned else even)(u.at[1]))
        gaps = [gap * rate * half for gap, rate in zip(self.gaps, u.first, strict=True)]
        both, slope = op.sinc_pair(*(sign * (gap * gap) for gap in gaps))
        whole = self.whole * u.over_ends * Fraction(1, 4)
        product = op.sinc(whole, sign) * both * half
        across = even(whole) * ((gaps[1] - gaps[0]) * slope) * sign
        around = self._around(u, sign, functions)
        # The derivative of the cosine is minus the sine; all other derivatives have no sign.
        slope_sign = -1 if sign > 0 and not turned else 1
        is_odd, (left, middle, right) = 0 if turned else 1, self._between(u)
        same, other = around(middle)[is_odd], around(middle)[1 - is_odd]
        second = (slope_sign * (other * across) + (-sign) * (same * product)) * half
        firsts = [
            slope_sign * (around(place)[1 - is_odd] * op.sinc(gap, sign))
            for place, gap in zip((left, right), gaps, strict=True)
        ]
        values = [around(place)[is_odd] for place in (self.distances if u.is_linear else u.at)]
        return self._of(u, values, (*firsts, second))

    def _between(self, u: "Differenced") -> tuple[Any, Any, Any]:
        """Return the middles between a and the place, between all three with the place twice, and between it and b.

        They are distances from the middle of the orbit if the argument is linear in the place, else values of it.
        """
        a, x, b = self.distances if u.is_linear else u.at
        half = Fraction(1, 2)
        if u.is_linear:
            return -half * self.gaps[1], half * x, half * self.gaps[0]
        return mean(a, x), (a + b + 2 * x) * Fraction(1, 4), mean(x, b)

    def _around(self, u: "Differenced", sign: int, functions: tuple[Any, Any]) -> Any:
        """Return a function that gives the odd and the even function at what `_between` gives."""
        odd, even = functions
        if not u.is_linear:
            return lambda value: (odd(value), even(value))
        rate, middle = u.first[0], mean(u.at[0], u.at[2])
        sine, cosine = odd(middle), even(middle)

        def turned(distance: TapeNumber) -> tuple[TapeNumber, TapeNumber]:
            phase = distance * rate
            s, c = odd(phase), even(phase)
            return c * sine + s * cosine, c * cosine - sign * (s * sine)

        return turned

    def sin(self, u: Any) -> Any:
        """Record a sine."""
        return self._waves(self.spread(u), 1, (self.op.sin, self.op.cos), True)

    def cos(self, u: Any) -> Any:
        """Record a cosine."""
        return self._waves(self.spread(u), 1, (self.op.sin, self.op.cos), False)

    def sinh(self, u: Any) -> Any:
        """Record a hyperbolic sine."""
        return self._waves(self.spread(u), -1, (self.op.sinh, self.op.cosh), True)

    def cosh(self, u: Any) -> Any:
        """Record a hyperbolic cosine."""
        return self._waves(self.spread(u), -1, (self.op.sinh, self.op.cosh), False)

    def exp(self, u: Any) -> Any:
        """Record an exponential."""
        number = self.spread(u)
        return self.spread(self.op.exp(number.at[1])) if number.is_constant else self.cosh(u) + self.sinh(u)

    def tan(self, u: Any) -> Any:
        """Record a tangent."""
        return self.sin(u) / self.cos(u)

    def tanh(self, u: Any) -> Any:
        """Record a hyperbolic tangent."""
        return self.sinh(u) / self.cosh(u)

    def sqrt(self, u: Any) -> Any:
        """Record a square root."""
        number = self.spread(u)
        if number.is_constant:
            return self.spread(self.op.sqrt(number.at[1]))
        roots = tuple(self.op.sqrt(value) for value in number.at)
        left, right, ends = roots[0] + roots[1], roots[1] + roots[2], roots[0] + roots[2]
        return self._of(number, roots, (1 / left, 1 / right, -1 / (left * right * ends)))

    def __getattr__(self, name: str) -> Any:
        function = getattr(self.op, name)

        def of_constant(u: Any) -> Any:
            number = self.spread(u)
            if not number.is_constant:
                raise WithoutRuleError
            return self.spread(function(number.at[1]))

        return of_constant


class Differenced:
    """A number that depends on the place, over three places.

    Attributes
    ----------
    at : three numbers
        The values.
    first : two numbers
        The divided differences over the first two and the last two places.
    second : number
        The divided difference over all three.
    """

    __slots__ = ("at", "first", "places", "second")

    def __init__(self, places: Places, at: Any, first: Any, second: Any) -> None:
        self.places, self.at, self.first, self.second = places, tuple(at), tuple(first), second

    @property
    def is_constant(self) -> bool:
        """Whether the number does not depend on the place."""
        return all(part.known == 0 for part in self.first)

    @property
    def is_linear(self) -> bool:
        """Whether the number is a linear function of the place."""
        return self.second.known == 0 and is_same(*self.first)

    @property
    def over_ends(self) -> TapeNumber:
        """The divided difference over the first and the last place."""
        (left, right), (share, rest) = self.first, self.places.shares
        found: TapeNumber = left if is_same(left, right) else left * share + right * rest
        return found

    def _linear(self, other: Any, sign: int) -> "Differenced":
        v = self.places.spread(other)

        return Differenced(
            self.places,
            [a + sign * b for a, b in zip(self.at, v.at, strict=True)],
            [a + sign * b for a, b in zip(self.first, v.first, strict=True)],
            self.second + sign * v.second,
        )

    def __add__(self, other: Any) -> "Differenced":
        return self._linear(other, 1)

    __radd__ = __add__

    def __sub__(self, other: Any) -> "Differenced":
        return self._linear(other, -1)

    def __rsub__(self, other: Any) -> "Differenced":
        return self.places.spread(other) - self

    def __neg__(self) -> "Differenced":
        return self * -1

    def __mul__(self, other: Any) -> "Differenced":
        v = self.places.spread(other)
        (a, x, b), (p, y, q) = self.at, v.at
        (left, right), (low, high) = self.first, v.first
        first = (
            left * mean(p, y) + mean(a, x) * low,
            right * mean(y, q) + mean(x, b) * high,
        )
        if self is v:
            first = left * (a + x), right * (x + b)
        outer = self.second * mean(p, q) + mean(a, b) * v.second
        inner = mean(left * high, right * low)
        return Differenced(self.places, (a * p, x * y, b * q), first, outer + inner)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> "Differenced":
        v = self.places.spread(other)
        if v.is_constant:
            return self * self.places.spread(1 / v.at[1])
        return self * v.inverse()

    def __rtruediv__(self, other: Any) -> "Differenced":
        return self.places.spread(other) * self.inverse()

    def inverse(self) -> "Differenced":
        """Return the reciprocal."""
        if self.is_constant:
            return self.places.spread(1 / self.at[1])
        a, x, b = inverses = [1 / value for value in self.at]
        parts = -(a * x), -(x * b), a * (x * b)
        found: Differenced = self.places._of(self, inverses, parts)
        return found

    def __abs__(self) -> "Differenced":
        raise WithoutRuleError

    def __pow__(self, other: Any) -> "Differenced":
        power = self.places.spread(other)
        exponent = power.at[1]
        if not power.is_constant or exponent.known is None or exponent.known.denominator > 2:
            raise WithoutRuleError
        base = self if exponent.known.denominator == 1 else self.places.sqrt(self)
        found = base.to(abs(exponent.known.numerator))
        return found.inverse() if exponent.known < 0 else found

    def __rpow__(self, other: Any) -> "Differenced":
        raise WithoutRuleError

    def to(self, count: int) -> "Differenced":
        """Return the power with a positive integer exponent."""
        if count < 2:
            return self if count else self.places.spread(1)
        half = self.to(count // 2)
        square = half * half
        return square * self if count % 2 else square
