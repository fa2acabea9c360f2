"""Elementary solutions of W' + Q W = P, by undetermined coefficients.

If ∫ E P dλ with E = exp(∫ Q dλ) is elementary, it is E times a function U of the field that contains P and Q
(Liouville's theorem, for an exponential), and U itself is a solution. So U is assumed to be a sum of products of the
functions in P and Q, with coefficients that do not depend on λ; these obey linear equations. Whether the equations have
a solution is decided modulo a prime at random values of the parameters, and the solution is computed exactly only if
there is one. All sizes are bounded, and nothing depends on a clock.
"""

from collections.abc import Iterable, Sequence
from itertools import product as every
from math import prod
from random import Random
from typing import Any, TypeAlias

import sympy as sp

from gqm_sym.derivation.algebra.algebra import Algebra, Fraction, Polynomial
from gqm_sym.derivation.algebra.generators import OverBudget, Pair
from gqm_sym.derivation.algebra.rewrite import product, spell_quotient
from gqm_sym.errors import DerivationError

# The largest number of products that may appear in the solution, and of those that must cancel.
MAX_UNKNOWNS = 60
MAX_EQUATIONS = 240

# The largest number of coefficients that do not vanish; a form with more would be unreadable.
MAX_KEPT = 8

# The excess of the degree in each function over the degree in P and Q.
EXCESS_DEGREE = 1
PRIME = 2**61 - 1
Monomial = tuple[int, ...]
FieldElement: TypeAlias = Any
"""A quotient of polynomials, as SymPy has it, without type information."""


def particular_solution(
    source: sp.Expr, decay: sp.Expr, variable: sp.Symbol, signs: Sequence[sp.Symbol] = ()
) -> sp.Expr | None:
    """Return a solution of W' + decay*W = source, or None if there is none of the assumed form.

    Parameters
    ----------
    source, decay
        P and Q. With Q = 0 the solution is an antiderivative of P.
    variable
        λ.
    signs
        Symbols whose squares are 1.
    """
    if not source:
        return sp.S.Zero
    try:
        return _Search(source, decay, variable, signs).solution()
    except (OverBudget, DerivationError):
        return None


class _Search:
    """The equations for the coefficients of one solution."""

    def __init__(self, source: sp.Expr, decay: sp.Expr, variable: sp.Symbol, signs: Sequence[sp.Symbol]) -> None:
        self.algebra = algebra = Algebra((source, decay, variable), variable)
        self.variable = variable
        self.moving = [place for place, name in enumerate(algebra.names) if variable in name.free_symbols]
        self.signs = [place for place, name in enumerate(algebra.names) if name in signs]
        self.source, self.decay = algebra.fraction(source), algebra.fraction(decay)

    def solution(self) -> sp.Expr | None:
        """Return the solution as an expression."""
        candidates = self._candidates()
        rows = self._rows(candidates)
        columns = _support(rows)
        if columns is None or len(columns) > MAX_KEPT:
            return None
        values = self._solved([[row[c] for c in (*columns, len(candidates))] for row in rows])
        return None if values is None else self._written([candidates[c] for c in columns], values)

    def _candidates(self) -> list[Polynomial]:
        """Return the products of functions whose sum the solution may be."""
        algebra = self.algebra
        sines = {pair.sine for pair in algebra.pairs}
        ranges = []
        for place in self.moving:
            name = algebra.names[place]
            polynomials = (self.source.top, self.source.bottom, self.decay.top, self.decay.bottom)
            highest = max(_degree(polynomial, place) for polynomial in polynomials)
            for pair in algebra.pairs:
                if place in (pair.sine, pair.cosine):
                    highest = max(_pair_degree(polynomial, pair) for polynomial in polynomials)
            root = isinstance(name, sp.Pow) and name.exp.is_Rational
            lone = place in sines or isinstance(name, sp.Abs)
            ranges.append(range(name.exp.q if root else 2 if lone else highest + EXCESS_DEGREE + 1))
        if prod(len(powers) for powers in ranges) > MAX_UNKNOWNS:
            raise OverBudget(f"more than {MAX_UNKNOWNS} candidates for a closed form")
        found = []
        for powers in every(*ranges):
            monomial = [0] * len(algebra.names)
            for place, power in zip(self.moving, powers, strict=True):
                monomial[place] = power
            found.append(algebra.ring({tuple(monomial): 1}))
        return found

    def _rows(self, candidates: Iterable[Polynomial]) -> list[list[Polynomial]]:
        """Return one equation for each monomial in λ, as the coefficients of the candidates and the right-hand side."""
        algebra = self.algebra
        sides = []
        for candidate in candidates:
            change = algebra.derivative(candidate)
            pulled = algebra.multiply(self.decay, Fraction(candidate, algebra.one))
            sides.append(algebra.add(change, pulled))
        sides.append(self.source)
        below = algebra.one
        for side in sides:
            _, own, _ = side.bottom.cofactors(below)
            below = algebra.times(below, own)
        rows: dict[Monomial, list[Polynomial]] = {}
        for column, side in enumerate(sides):
            scaled = algebra.times(side.top, below.quo(side.bottom))
            for monomial, coefficient in self._canonical(scaled).terms():
                moving = tuple(monomial[place] for place in self.moving)
                fixed = tuple(0 if place in self.moving else power for place, power in enumerate(monomial))
                row = rows.setdefault(moving, [algebra.ring.zero] * len(sides))
                row[column] = row[column] + algebra.ring({fixed: coefficient})
        if len(rows) > MAX_EQUATIONS:
            raise OverBudget(f"more than {MAX_EQUATIONS} equations for a closed form")
        return list(rows.values())

    def _canonical(self, polynomial: Polynomial) -> Polynomial:
        """Return the canonical form of a polynomial, without squares of sines, of square roots or of signs."""
        algebra = self.algebra
        for pair in algebra.pairs:
            cosine = algebra.generators[pair.cosine]
            polynomial = algebra.replace_squares(polynomial, pair.sine, (1 - cosine**2) * pair.sign)
        for place, square in algebra.squares:
            polynomial = algebra.replace_squares(polynomial, place, square)
        return self._reduced(polynomial)

    def _reduced(self, polynomial: Polynomial) -> Polynomial:
        for place in self.signs:
            polynomial = self.algebra.replace_squares(polynomial, place, self.algebra.one)
        return polynomial

    def _solved(self, rows: list[list[Polynomial]]) -> list[Fraction] | None:
        """Solve equations exactly, of which as many are independent as there are unknowns; return None if they
        contradict each other.
        """
        field = self.algebra.ring.to_field()
        waiting = [[field(polynomial) for polynomial in row] for row in rows if any(row)]
        done: list[list[FieldElement]] = []
        for column in range(len(rows[0]) - 1):
            # The shortest equation is used first, because the others grow by it.
            usable = [row for row in waiting if row[column]]
            if not usable:
                return None
            leading = min(usable, key=lambda row: sum(len(value.numer) + len(value.denom) for value in row))
            waiting.remove(leading)
            leading = [value / leading[column] for value in leading]
            for row in (*waiting, *done):
                if factor := row[column]:
                    row[:] = [a - factor * b for a, b in zip(row, leading, strict=True)]
                    for value in row:
                        self.algebra.bounded(value.numer)
                        self.algebra.bounded(value.denom)
            done.append(leading)
        if any(self._reduced(row[-1].numer) for row in waiting):
            return None
        return [Fraction(row[-1].numer, row[-1].denom) for row in done]

    def _written(self, candidates: Sequence[Polynomial], values: Sequence[Fraction]) -> sp.Expr:
        algebra = self.algebra
        total = Fraction(algebra.ring.zero, algebra.one)
        for candidate, value in zip(candidates, values, strict=True):
            total = algebra.add(total, Fraction(algebra.times(candidate, value.top), value.bottom))
        total = algebra.reduced(Fraction(self._reduced(total.top), self._reduced(total.bottom)))
        return product(spell_quotient(algebra, total.top, total.bottom))


def _degree(polynomial: Polynomial, place: int) -> int:
    return max((monomial[place] for monomial in polynomial), default=0)


def _pair_degree(polynomial: Polynomial, pair: Pair) -> int:
    return max((pair.degree(monomial) for monomial in polynomial), default=0)


def _support(rows: list[list[Polynomial]]) -> list[int] | None:
    """Return the indices of the unknowns that are not zero, found at random values of the parameters.

    The result is None if the equations have no solution. Unknowns that remain free are taken as zero.
    """
    if not rows:
        return []
    width = len(rows[0]) - 1
    random = Random(len(rows))
    point = [random.randrange(1, PRIME) for _ in range(rows[0][0].ring.ngens)]
    waiting = [[_at(polynomial, point) for polynomial in row] for row in rows]
    done: dict[int, list[int]] = {}
    for column in range(width):
        leading = next((row for row in waiting if row[column]), None)
        if leading is None:
            continue
        waiting.remove(leading)
        inverse = pow(leading[column], -1, PRIME)
        leading = [value * inverse % PRIME for value in leading]
        for row in (*waiting, *done.values()):
            if factor := row[column]:
                row[:] = [(a - factor * b) % PRIME for a, b in zip(row, leading, strict=True)]
        done[column] = leading
    if any(row[width] for row in waiting):
        return None
    return [column for column, row in done.items() if row[width]]


def _at(polynomial: Polynomial, point: Sequence[int]) -> int:
    total = 0
    for monomial, coefficient in polynomial.terms():
        term = int(coefficient)
        for value, power in zip(point, monomial, strict=True):
            if power:
                term = term * pow(value, power, PRIME) % PRIME
        total += term
    return total % PRIME
