"""Numbers of the form p + q*pi with rational p and q, enclosed by fractions without mpmath: the common angles."""

import ast
from fractions import Fraction

from gqm_sym.errors import ExpressionError
from gqm_sym.literals.trees import evaluate

# The first 100 decimal digits of pi.
_DIGITS = int("31415926535897932384626433832795028841971693993751058209749445923078164062862089986280348253421170679")
_PI = (Fraction(_DIGITS, 10**100), Fraction(_DIGITS + 1, 10**100))
Pair = tuple[Fraction, Fraction]


def enclose_angle(tree: ast.expr, *, where: str) -> Pair | None:
    """Return bounds of the value of a tree from a hundred digits of pi, or None if the tree has another form."""
    try:
        rational, turns = evaluate(tree, _Angles(), where=where)
    except ExpressionError:
        return None
    low, high = sorted(rational + turns * pi for pi in _PI)
    return low, high


class _Angles:
    """The algebra of pairs (p, q). An operation whose result is not such a pair is refused, and the caller then uses
    `enclose`.
    """

    def number(self, value: Fraction) -> Pair:
        return value, Fraction(0)

    def name(self, name: str) -> Pair:
        if name != "pi":
            raise ValueError(name)
        return Fraction(0), Fraction(1)

    def negate(self, value: Pair) -> Pair:
        return -value[0], -value[1]

    def total(self, terms: list[Pair]) -> Pair:
        return sum((p for p, _ in terms), Fraction(0)), sum((q for _, q in terms), Fraction(0))

    def product(self, factors: list[Pair]) -> Pair:
        p, q = Fraction(1), Fraction(0)
        for a, b in factors:
            if q and b:
                raise ValueError("pi**2")
            p, q = p * a, p * b + q * a
        return p, q

    def reciprocal(self, value: Pair) -> Pair:
        if value[1]:
            raise ValueError("1/pi")
        return 1 / value[0], Fraction(0)

    def power(self, base: Pair, exponent: Pair) -> Pair:
        raise ValueError("a power")

    def call(self, function: str, argument: Pair) -> Pair:
        raise ValueError(function)
