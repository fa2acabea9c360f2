"""Rigorous values of trees without names: exact fractions, or intervals of any required width.

The precision is raised until every question (Is this number negative? Is it in the domain of asin?) has an answer.
Numbers that agree to 200 digits, the last precision, count as equal: ``sqrt(2)**2 - 2`` is zero.

mpmath is imported when the first irrational number occurs. Its ``libmp`` has no global state, so that this is safe in
threads.
"""

import ast
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import cached_property
from math import isqrt
from types import MappingProxyType
from typing import Any, TypeAlias

from gqm_sym.errors import ExpressionError
from gqm_sym.literals import rationals
from gqm_sym.literals.trees import evaluate

Mpf: TypeAlias = tuple[int, int, int, int]
Interval: TypeAlias = tuple[Mpf, Mpf]
Value: TypeAlias = Fraction | Interval | None  # None if it depends on a name
GUARD_BITS = 32
LAST_BITS = 4096

# Two numbers whose relative difference is below 2**-700 (210 digits) count as equal.
EQUAL_BITS = 700

# Limits on the binary exponents of intermediate results and of the argument of exp, which keep computations short.
MAX_SCALE = 2**21
MAX_EXP_SCALE = 20
_ODD = ("sin", "tan", "asin", "atan", "sinh", "tanh", "asinh", "atanh", "sqrt", "cbrt")
_EXACT: dict[tuple[str, int], int] = {
    **{(name, 0): 0 for name in _ODD},
    **{(name, 0): 1 for name in ("cos", "cosh", "exp", "sec")},
    **{(name, 1): 0 for name in ("log", "acos", "acosh")},
    ("sqrt", 1): 1,
    ("cbrt", 1): 1,
    ("cbrt", -1): -1,
}

# The domain in which a function is real: its ends, and whether they belong to it.
_DOMAINS: dict[str, tuple[int, int | None, bool]] = {
    "asin": (-1, 1, True),
    "acos": (-1, 1, True),
    "atanh": (-1, 1, False),
    "acosh": (1, None, True),
    "log": (0, None, False),
    "sqrt": (0, None, True),
}
_QUOTIENTS = {
    "tan": ("sin", "cos"),
    "cot": ("cos", "sin"),
    "coth": ("cosh", "sinh"),
    "sec": ("", "cos"),
    "csc": ("", "sin"),
}
_STEEP = ("exp", "sinh", "cosh", "tanh")
_GROWING = ("asin", "atan", "sinh", "tanh", "asinh", "atanh", "exp", "log", "sqrt")


def enclose(
    tree: ast.expr, bits: int, *, where: str, values: Mapping[str, ast.expr] = MappingProxyType({})
) -> Fraction | Interval:
    """Return the value of a tree: exact, or an interval whose relative width is at most ``2**-bits``.

    Parameters
    ----------
    tree
        The tree.
    bits
        The required relative precision, in bits.
    where
        The name of the tree in messages of errors.
    values
        Values of the names in the tree, as trees without names. They are used as intervals, so that no exact number
        becomes long.

    Raises
    ------
    ExpressionError
        If the value is not a finite real number, or the tree contains a name that is not in ``values``.
    """
    precision = bits + GUARD_BITS
    last = bits + LAST_BITS
    while True:
        algebra = _Enclosures(min(precision, last), last=precision >= last, values=values)
        try:
            value = evaluate(tree, algebra, where=where)
            assert value is not None  # `name` has refused all unknown names
            if isinstance(value, Fraction) or algebra.is_narrow(value, bits):
                return value
        except _Undecided:
            pass
        if precision >= last:
            raise ExpressionError(f"{where}: its digits cancel; write it in another form")
        precision *= 2


def check_constants(tree: ast.expr, *, where: str) -> None:
    """Refuse a tree if some part of it cannot be a finite real number for any values of its names."""
    precision = 64
    while True:
        algebra = _Enclosures(precision, last=precision >= LAST_BITS, names=True)
        try:
            evaluate(tree, algebra, where=where)
            return
        except _Undecided:
            precision *= 4


class _Undecided(Exception):
    """More bits are needed for a decision."""


class _Enclosures:
    """The algebra of Fractions and intervals.

    Parameters
    ----------
    bits
        Working precision.
    last
        Whether this is the highest precision, at which every question is decided.
    names
        Whether unknown names are allowed; values that depend on them are None.
    values
        Values of known names.
    """

    def __init__(
        self,
        bits: int,
        *,
        last: bool,
        names: bool = False,
        values: Mapping[str, ast.expr] = MappingProxyType({}),
    ) -> None:
        self.bits = bits
        self.last = last
        self.names = names
        self.values = values

    @cached_property
    def mp(self) -> Any:
        from mpmath import libmp

        return libmp

    # The algebra.

    def number(self, value: Fraction) -> Value:
        return value

    def name(self, name: str) -> Value:
        if name == "pi":
            return self.mp.mpf_pi(self.bits, "f"), self.mp.mpf_pi(self.bits, "c")
        if name == "e":
            return self.mp.mpf_e(self.bits, "f"), self.mp.mpf_e(self.bits, "c")
        if name in self.values:
            value = evaluate(self.values[name], self, where=name)
            return self.interval(value) if isinstance(value, Fraction) else value
        if self.names:
            return None
        raise ValueError(f"{name!r} is not a number; write a number such as 9.81 or pi/2")

    def negate(self, value: Value) -> Value:
        if isinstance(value, tuple):
            return self.mp.mpf_neg(value[1]), self.mp.mpf_neg(value[0])
        return None if value is None else -value

    def total(self, terms: list[Value]) -> Value:
        if any(term is None for term in terms):
            return None
        exact = rationals.total(term for term in terms if isinstance(term, Fraction))
        intervals = [term for term in terms if isinstance(term, tuple)]
        if not intervals:
            return exact
        if exact:
            intervals.append(self.interval(exact))
        low, high = intervals[0]
        for other_low, other_high in intervals[1:]:
            low = self.mp.mpf_add(low, other_low, self.bits, "f")
            high = self.mp.mpf_add(high, other_high, self.bits, "c")
        scale = max(_scale(end) for interval in intervals for end in interval)
        return self.checked((low, high), scale)

    def product(self, factors: list[Value]) -> Value:
        if any(factor is None for factor in factors):
            return None
        exact = rationals.product(factor for factor in factors if isinstance(factor, Fraction))
        intervals = [factor for factor in factors if isinstance(factor, tuple)]
        if not intervals or exact == 0:
            return exact
        result = self.interval(exact)
        for interval in intervals:
            result = self.mp.mpi_mul(result, interval, self.bits)
        return self.checked(result)

    def reciprocal(self, value: Value) -> Value:
        if isinstance(value, tuple):
            self.sign(value)
            return self.checked(self.mp.mpi_div(self.interval(Fraction(1)), value, self.bits))
        return None if value is None else rationals.reciprocal(value)

    def power(self, base: Value, exponent: Value) -> Value:
        if base is None or exponent is None:
            if isinstance(exponent, Fraction):
                rationals.check_exponent(exponent)
            return None
        if isinstance(exponent, Fraction) and exponent.denominator == 1:
            if isinstance(base, Fraction):
                return rationals.power(base, exponent.numerator)
            return self.integer_power(base, exponent.numerator)
        if self.sign(base) < 0:
            raise ValueError("a negative number to a power that is not an integer, which is not real")
        if base == 0:
            if self.sign(exponent) < 0:
                raise ValueError("division by zero")
            return Fraction(0)
        if exponent == Fraction(1, 2):
            return self.call("sqrt", base)
        return self.call("exp", self.product([exponent, self.call("log", base)]))

    def call(self, function: str, argument: Value) -> Value:
        function = {"ln": "log"}.get(function, function)
        if argument is None:
            return None
        if isinstance(argument, Fraction):
            exact = self.exact_call(function, argument)
            if exact is not None:
                return exact
        match function:
            case "abs":
                return self.negate(argument) if self.sign(argument) < 0 else argument
            case "tan" | "cot" | "coth" | "sec" | "csc":
                over, under = _QUOTIENTS[function]
                above = self.call(over, argument) if over else Fraction(1)
                return self.product([above, self.reciprocal(self.call(under, argument))])
            case "acosh":
                # The formula log(x + sqrt(x**2 - 1)) would lose all digits near x = 1.
                x = self.inside(function, argument)
                half = self.product([self.total([x, Fraction(-1)]), Fraction(1, 2)])
                return self.product([Fraction(2), self.call("asinh", self.call("sqrt", half))])
            case "cbrt":
                if self.sign(argument) < 0:
                    return self.negate(self.power(self.negate(argument), Fraction(1, 3)))
                return self.power(argument, Fraction(1, 3))
        low, high = self.interval(self.inside(function, argument))
        return self.checked(self.real_function(function, low, high))

    # Parts of the operations.

    def interval(self, value: Fraction | Interval) -> Interval:
        if isinstance(value, tuple):
            return value
        ends = value.numerator, value.denominator, self.bits
        return self.mp.from_rational(*ends, "f"), self.mp.from_rational(*ends, "c")

    def sign(self, value: Fraction | Interval) -> int:
        if isinstance(value, Fraction):
            return (value > 0) - (value < 0)
        low, high = self.mp.mpf_sign(value[0]), self.mp.mpf_sign(value[1])
        if low != high:
            raise _Undecided
        return int(low)

    def is_narrow(self, value: Interval, bits: int) -> bool:
        low, high = value
        if self.mp.mpf_sign(low) != self.mp.mpf_sign(high):
            return False
        width = self.mp.mpf_sub(high, low, self.bits, "c")
        return width == self.mp.fzero or _scale(width) < min(_scale(low), _scale(high)) - bits

    def checked(self, value: Interval, scale: int = 0) -> Fraction | Interval:
        """Check the size of a value; at the last precision a value that may be zero is zero.

        ``scale`` is the binary exponent of the terms whose sum the value is.
        """
        low, high = value
        if max(abs(_scale(low)), abs(_scale(high))) > MAX_SCALE:
            raise ValueError("a number far outside the range of doubles")
        if not self.last or self.mp.mpf_sign(low) * self.mp.mpf_sign(high) > 0:
            return value
        if _scale(self.mp.mpf_sub(high, low, self.bits, "c")) > scale - EQUAL_BITS:
            raise ValueError("its digits cancel; write it in another form")
        return Fraction(0)

    def integer_power(self, base: Interval, exponent: int) -> Fraction | Interval:
        if exponent == 0:
            return Fraction(1)
        negative = self.sign(base) < 0
        low, high = self.mp.mpi_abs(base, self.bits)
        size = abs(exponent)
        result: Value = self.checked(
            (
                self.mp.mpf_pow_int(low, size, self.bits, "f"),
                self.mp.mpf_pow_int(high, size, self.bits, "c"),
            )
        )
        result = self.negate(result) if negative and exponent % 2 else result
        return self.reciprocal(result) if exponent < 0 else result  # type: ignore[return-value]

    def exact_call(self, function: str, argument: Fraction) -> Fraction | None:
        if function == "abs":
            return abs(argument)
        if function == "sqrt" and argument > 0:
            over, under = isqrt(argument.numerator), isqrt(argument.denominator)
            if over**2 == argument.numerator and under**2 == argument.denominator:
                return Fraction(over, under)
        if argument.denominator == 1 and (function, argument.numerator) in _EXACT:
            return Fraction(_EXACT[function, argument.numerator])
        return None

    def inside(self, function: str, argument: Fraction | Interval) -> Fraction | Interval:
        """Return the argument, or the end of the domain that it equals; refuse it outside the domain."""
        if function not in _DOMAINS:
            return argument
        low, high, closed = _DOMAINS[function]
        for end, inwards in ((low, 1), (high, -1)):
            if end is None:
                continue
            distance = self.total([argument, Fraction(-end)])
            assert distance is not None
            sign = inwards * self.sign(distance)
            if sign < 0 or (sign == 0 and not closed):
                left = f"[{low}" if closed else f"({low}"
                right = "oo)" if high is None else f"{high}]" if closed else f"{high})"
                raise ValueError(f"{function} of a number outside {left}, {right}")
            if sign == 0:
                return Fraction(end)
        return argument

    def real_function(self, function: str, low: Mpf, high: Mpf) -> Interval:
        mp, bits = self.mp, self.bits
        if function in ("sin", "cos"):
            return self.circular(getattr(mp, f"mpf_{function}"), low, high)
        if function in _STEEP and max(_scale(low), _scale(high)) > MAX_EXP_SCALE:
            raise ValueError(f"{function} of a number far outside the range of doubles")
        if function == "cosh":
            low, high = mp.mpi_abs((low, high), bits)
        elif function == "acos":
            low, high = high, low
        elif function not in _GROWING:
            raise ValueError(f"unknown function {function!r}")
        monotone: Callable[..., Mpf] = getattr(mp, f"mpf_{function}")
        return self.widen(monotone(low, bits + 10, "n"), monotone(high, bits + 10, "n"))

    def circular(self, function: Callable[..., Mpf], low: Mpf, high: Mpf) -> Interval:
        """Return sine or cosine of an interval, whose slope is at most 1."""
        mp, bits = self.mp, self.bits
        radius = mp.mpf_sub(high, low, bits, "c")
        if _scale(radius) > -2:
            if self.last:
                raise ValueError("sine or cosine of a number too large for its digits")
            raise _Undecided
        low, high = self.widen(*[function(low, bits + 10, "n")] * 2)
        return mp.mpf_sub(low, radius, bits, "f"), mp.mpf_add(high, radius, bits, "c")

    def widen(self, low: Mpf, high: Mpf) -> Interval:
        """Return an interval widened by its last bit, which mpmath does not guarantee for these functions."""
        mp, bits = self.mp, self.bits
        ulp = mp.mpf_shift(mp.fone, 1 - bits)
        below = mp.mpf_mul(mp.mpf_abs(low), ulp, bits, "c")
        above = mp.mpf_mul(mp.mpf_abs(high), ulp, bits, "c")
        return mp.mpf_sub(low, below, bits, "f"), mp.mpf_add(high, above, bits, "c")


def _scale(value: Mpf) -> int:
    """Return the binary exponent, for which ``|value| < 2**scale``; for zero, the smallest."""
    _, mantissa, exponent, bits = value
    if not mantissa and exponent:
        return MAX_SCALE + 1  # infinite, or not a number
    return exponent + bits if mantissa else -MAX_SCALE
