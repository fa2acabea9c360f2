"""Expressions as fractions of polynomials in which sines and cosines are algebraic.

A polynomial in a pair (s, c) of sine and cosine is kept homogeneous: a term of too low a degree is
multiplied by s² + c² = 1 (hyperbolic: c² - s²) until all terms have one degree, for which the base
angle is halved where degrees differ by an odd number. Homogeneous forms factor without side
conditions, so that 1 - cos u is found to be 2 sin²(u/2), and a perfect square to be one, by plain
factoring.

Nothing here depends on a clock: expressions that are too large are refused by counting terms (`OverBudget`), so that
the outcome is the same on every machine.
"""

from collections.abc import Iterable
from copy import copy
from dataclasses import dataclass
from math import comb
from typing import Any, TypeAlias

import sympy as sp
from sympy.polys.rings import ring

from gqm_sym.derivation.algebra.generators import (
    EXPONENTIAL,
    Angle,
    OverBudget,
    Pair,
    angle_of,
    collect,
    is_integer_power,
    is_real_power,
    kind_of,
    root_of,
    slope,
    waves,
)

Polynomial: TypeAlias = Any
"""SymPy's sparse polynomials, which have no type information."""
MAX_TERMS = 160
MAX_DEGREE = 40


@dataclass(frozen=True, slots=True)
class Fraction:
    """A quotient of two polynomials of one ring."""

    top: Polynomial
    bottom: Polynomial


class Algebra:
    """The ring that contains a few expressions and their derivatives.

    Parameters
    ----------
    expressions
        The expressions that must be representable.
    variable
        The variable of derivatives.
    halved
        Angles whose base is to be halved, as returned by `Algebra.uneven`.
    """

    def __init__(
        self,
        expressions: Iterable[sp.Expr],
        variable: sp.Symbol,
        halved: frozenset[Angle] = frozenset(),
    ) -> None:
        self.variable = variable
        self._found = collect(expressions, variable, halved)
        self.names = self._found.names
        self.pairs = tuple(self._found.pairs.values())
        self.ring, *self.generators = ring([f"q{place}" for place in range(len(self.names))], sp.ZZ)
        self.one = self.ring.one
        self._place = {name: place for place, name in enumerate(self.names)}
        self.squares: list[tuple[int, Polynomial]] = []
        self.squares = self._square_relations()
        # Polynomials that have been written out so far (`normal_form`).
        self.texts: dict[Polynomial, sp.Expr] = {}

    def _square_relations(self) -> list[tuple[int, Polynomial]]:
        """Return y² = polynomial for every square root and absolute value y, outermost first."""
        found = []
        for place, name in enumerate(self.names):
            if isinstance(name, sp.Abs):
                square = self.power(self._convert(name.args[0]), 2)
            elif isinstance(name, sp.Pow) and name.exp == sp.Rational(1, 2):
                square = self._convert(name.base)
            else:
                continue
            if square.bottom == self.one:
                found.append((place, square.top))
        return found

    # Expressions to fractions

    def fraction(self, expression: sp.Expr) -> Fraction:
        """Return ``expression`` as a fraction in lowest terms."""
        return self.reduced(self._convert(expression))

    def _convert(self, node: sp.Basic) -> Fraction:
        if isinstance(node, sp.Rational):
            return Fraction(self.ring(int(node.p)), self.ring(int(node.q)))
        if isinstance(node, sp.Add):
            total = self._convert(node.args[0])
            for term in node.args[1:]:
                total = self.add(total, self._convert(term))
            return total
        if isinstance(node, sp.Mul):
            total = Fraction(self.one, self.one)
            for factor in node.args:
                total = self.multiply(total, self._convert(factor))
            return total
        if is_integer_power(node):
            return self.power(self._convert(node.base), int(node.exp))
        if kind_of(node):
            return self._convert_wave(node)
        root = root_of(node)
        if root not in self._place:
            raise OverBudget(f"{root} came up on the way")
        result = Fraction(self.generators[self._place[root]], self.one)
        return result if root == node else self.power(result, int(node.exp * root.exp.q))

    def _convert_wave(self, node: sp.Basic) -> Fraction:
        factor, angle = angle_of(node)
        times = int(factor / self._found.steps[angle])
        if angle[0] == EXPONENTIAL:
            generator = self.generators[self._found.exponentials[angle]]
            return self.power(Fraction(generator, self.one), times)
        sine, cosine = self.multiple(self._found.pairs[angle], abs(times))
        if times < 0:
            sine = -sine
        if isinstance(node, sp.sin | sp.sinh):
            return Fraction(sine, self.one)
        if isinstance(node, sp.cos | sp.cosh):
            return Fraction(cosine, self.one)
        return Fraction(sine, cosine)

    def multiple(self, pair: Pair, times: int) -> tuple[Polynomial, Polynomial]:
        """Return sine and cosine of a multiple of a base angle by De Moivre's formula, as homogeneous polynomials."""
        if times > MAX_DEGREE:
            raise OverBudget(f"an angle {times} times another")
        s, c = self.generators[pair.sine], self.generators[pair.cosine]
        parts = [self.ring.zero, self.ring.zero]
        for k in range(times + 1):
            # i**k is (-1)**(k//2), times i for the sine; without i for a hyperbolic pair.
            sign = (-pair.sign) ** (k // 2)
            parts[k % 2] += sign * comb(times, k) * s**k * c ** (times - k)
        cosine, sine = parts
        return sine, cosine

    # Arithmetic within the budget

    def bounded(self, polynomial: Polynomial) -> Polynomial:
        """Return a polynomial if it is small enough; otherwise raise OverBudget."""
        if len(polynomial) > MAX_TERMS:
            raise OverBudget(f"a polynomial of more than {MAX_TERMS} terms")
        return polynomial

    def times(self, first: Polynomial, second: Polynomial) -> Polynomial:
        """Return a product; it is refused before it is computed if that would take long."""
        if len(first) * len(second) > 8 * MAX_TERMS:
            raise OverBudget(f"a product of {len(first)} by {len(second)} terms")
        return self.bounded(first * second)

    def add(self, first: Fraction, second: Fraction) -> Fraction:
        """Return the sum, over the least common denominator."""
        if first.bottom == second.bottom:
            return Fraction(self.bounded(first.top + second.top), first.bottom)
        _, own, other = first.bottom.cofactors(second.bottom)
        top = self.times(first.top, other) + self.times(second.top, own)
        return Fraction(self.bounded(top), self.times(first.bottom, other))

    def multiply(self, first: Fraction, second: Fraction) -> Fraction:
        """Return the product, not reduced."""
        return Fraction(self.times(first.top, second.top), self.times(first.bottom, second.bottom))

    def power(self, base: Fraction, exponent: int) -> Fraction:
        """Return an integer power."""
        if abs(exponent) > MAX_DEGREE:
            raise OverBudget(f"the power {exponent}")
        result = Fraction(self.one, self.one)
        factor = base if exponent >= 0 else Fraction(base.bottom, base.top)
        for _ in range(abs(exponent)):
            result = self.multiply(result, factor)
        return result

    def reduced(self, fraction: Fraction) -> Fraction:
        """Return the fraction in lowest terms, with both parts in normal form."""
        top, bottom = self.normal(fraction.top), self.normal(fraction.bottom)
        if not top:
            return Fraction(self.ring.zero, self.one)
        _, top, bottom = top.cofactors(bottom)
        return Fraction(-top, -bottom) if bottom.LC < 0 else Fraction(top, bottom)

    # Normal forms

    def normal(self, polynomial: Polynomial) -> Polynomial:
        """Replace squares of roots, make the polynomial homogeneous if its degrees have one parity, and remove factors
        of 1.
        """
        for place, square in self.squares:
            polynomial = self.replace_squares(polynomial, place, square)
        for pair in self.pairs:
            polynomial = self._homogeneous(polynomial, pair)
        return polynomial

    def replace_squares(self, polynomial: Polynomial, place: int, square: Polynomial) -> Polynomial:
        """Replace the square of a generator by a polynomial."""
        if all(monomial[place] < 2 for monomial in polynomial):
            return polynomial
        result = self.ring.zero
        for monomial, coefficient in polynomial.terms():
            term = self.ring({_with(monomial, place, monomial[place] % 2): coefficient})
            for _ in range(monomial[place] // 2):
                term = self.times(term, square)
            result += term
        return self.bounded(result)

    def _homogeneous(self, polynomial: Polynomial, pair: Pair) -> Polynomial:
        degrees = {pair.degree(monomial) for monomial in polynomial}
        if len({degree % 2 for degree in degrees}) != 1:
            return polynomial
        highest = max(degrees)
        if highest > MAX_DEGREE:
            raise OverBudget(f"degree {highest} in one angle")
        unit = self.generators[pair.cosine] ** 2 + pair.sign * self.generators[pair.sine] ** 2
        parts = dict.fromkeys(degrees, self.ring.zero)
        for monomial, coefficient in polynomial.terms():
            parts[pair.degree(monomial)] += self.ring({monomial: coefficient})
        result = self.ring.zero
        # Horner's scheme in powers of s² + c², from the lowest degree up.
        for degree in range(min(degrees), highest + 1, 2):
            result = self.times(result, unit) + parts.get(degree, self.ring.zero)
        while result and pair.degree(result.LM) >= 2:
            quotient, remainder = result.div(unit)
            if remainder:
                break
            result = quotient
        return self.bounded(result)

    def uneven(self, polynomials: Iterable[Polynomial]) -> frozenset[Angle]:
        """Return the angles that must be halved before these polynomials can be homogeneous."""
        listed = tuple(polynomials)
        return frozenset(
            angle
            for angle, pair in self._found.pairs.items()
            if any(len({pair.degree(monomial) % 2 for monomial in polynomial}) > 1 for polynomial in listed)
        )

    def doubled(self, polynomial: Polynomial, pair: Pair) -> "tuple[Algebra, Polynomial, int] | None":
        """Rewrite a polynomial of even degree in sine and cosine of twice a pair's angle.

        The function returns the same ring with the double angle in place of the angle, the polynomial in it, and the
        number by which the polynomial must be divided.
        """
        degrees = {pair.degree(monomial) for monomial in polynomial}
        if len(degrees) != 1 or degrees == {0} or max(degrees) % 2:
            return None
        s, c = self.generators[pair.sine], self.generators[pair.cosine]
        # 2 s c = S, 2 c² = 1 + C, and 2 s² = 1 - C (circular) or C - 1 (hyperbolic).
        result = self.ring.zero
        for monomial, coefficient in polynomial.terms():
            others = _with(_with(monomial, pair.sine, 0), pair.cosine, 0)
            result += (
                self.ring({others: coefficient})
                * (pair.sign * (1 - c)) ** (monomial[pair.sine] // 2)
                * (1 + c) ** (monomial[pair.cosine] // 2)
                * s ** (monomial[pair.sine] % 2)
            )
        if len(result) > MAX_TERMS:
            return None
        twice = Pair(angle=2 * pair.angle, sine=pair.sine, cosine=pair.cosine, sign=pair.sign)
        view = copy(self)
        view.texts = {}
        view.pairs = tuple(twice if other == pair else other for other in self.pairs)
        names = list(self.names)
        names[pair.sine], names[pair.cosine] = waves(twice.angle, twice.sign)
        view.names = tuple(names)
        return view, result, 2 ** (max(degrees) // 2)

    # Derivatives

    def derivative(self, polynomial: Polynomial) -> Fraction:
        """Return the derivative of a polynomial with respect to the variable."""
        total = Fraction(self.ring.zero, self.one)
        for place, name in enumerate(self.names):
            part = polynomial.diff(self.generators[place])
            if part and self.variable in name.free_symbols:
                step = self.multiply(Fraction(part, self.one), self._derivative_of(place))
                total = self.add(total, step)
        return self.reduced(total)

    def _derivative_of(self, place: int) -> Fraction:
        name = self.names[place]
        if name == self.variable:
            return Fraction(self.one, self.one)
        change = self._convert(slope(name, self.variable))
        factor = self.one
        if kind_of(name) == EXPONENTIAL or is_real_power(name):
            factor = self.generators[place]
        for pair in self.pairs:
            if place == pair.sine:
                factor = self.generators[pair.cosine]
            elif place == pair.cosine:
                factor = -pair.sign * self.generators[pair.sine]
        return self.multiply(Fraction(factor, self.one), change)


def _with(monomial: tuple[int, ...], place: int, power: int) -> tuple[int, ...]:
    return (*monomial[:place], power, *monomial[place + 1 :])
