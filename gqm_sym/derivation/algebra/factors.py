"""Factors of polynomials in sines and cosines, within a budget."""

from math import prod

from gqm_sym.derivation.algebra.algebra import Algebra, Polynomial
from gqm_sym.derivation.algebra.generators import Pair

# Factoring takes far longer than arithmetic, above all in many variables. Polynomials with more possible monomials than
# the first number are only made square-free, and even larger ones are left as they are.
MAX_FACTORED = 600
MAX_SQUARE_FREE = 6000


def factors(algebra: Algebra, polynomial: Polynomial) -> tuple[int, list[tuple[Polynomial, int]]]:
    """Return the integer content of a polynomial and its factors with their multiplicities."""
    content, remainder = polynomial.primitive()
    found: list[tuple[Polynomial, int]] = []
    lowest = tuple(min(powers) for powers in zip(*remainder, strict=True))
    for place, power in enumerate(lowest):
        if power:
            found.append((algebra.generators[place], power))
    remainder = remainder.quo(algebra.ring({lowest: 1}))
    if remainder.is_ground:
        return int(content) * int(remainder.LC), found
    # With c = 1 in every pair a homogeneous form has one variable less and keeps its factors.
    flat, pairs = _flattened(algebra, remainder)
    size = prod(max(powers) + 1 for powers in zip(*flat, strict=True))
    if size <= MAX_FACTORED:
        number, parts = flat.factor_list()
    elif size <= MAX_SQUARE_FREE:
        number, parts = flat.sqf_list()
    else:
        number, parts = 1, [(flat, 1)]
    content = int(content) * int(number)
    for part, power in parts:
        whole = _raised(algebra, part, pairs)
        if whole.LC < 0:
            whole = -whole
            content *= (-1) ** power
        found.append((whole, power))
    return content, found


def _flattened(algebra: Algebra, polynomial: Polynomial) -> tuple[Polynomial, list[Pair]]:
    done = []
    for pair in algebra.pairs:
        if len({pair.degree(monomial) for monomial in polynomial}) == 1:
            polynomial = algebra.ring(
                {_with_cosine(monomial, pair, 0): coefficient for monomial, coefficient in polynomial.terms()}
            )
            done.append(pair)
    return polynomial, done


def _raised(algebra: Algebra, polynomial: Polynomial, pairs: list[Pair]) -> Polynomial:
    for pair in pairs:
        highest = max(monomial[pair.sine] for monomial in polynomial)
        polynomial = algebra.ring(
            {
                _with_cosine(monomial, pair, highest - monomial[pair.sine]): coefficient
                for monomial, coefficient in polynomial.terms()
            }
        )
    return polynomial


def _with_cosine(monomial: tuple[int, ...], pair: Pair, power: int) -> tuple[int, ...]:
    return (*monomial[: pair.cosine], power, *monomial[pair.cosine + 1 :])
