"""The angle of a curve's tangent in closed form, without jumps where that can be proved."""

from collections.abc import Iterator

import sympy as sp

from gqm_sym.derivation.algebra.algebra import Algebra, Polynomial
from gqm_sym.derivation.algebra.generators import Pair
from gqm_sym.derivation.algebra.rewrite import product, spell_ratio
from gqm_sym.derivation.algebra.signs import Signs

# Frames that rotate with up to so many times an angle of the curve are tried.
MAX_TURNS = 4


def tangent_angle(algebra: Algebra, parts: tuple[Polynomial, ...], weight: Polynomial, signs: Signs) -> sp.Expr:
    """Return the angle of two parts over a weight, up to a constant.

    If one component in a uniformly rotating frame never vanishes, the result is the angle of that frame plus an arc
    tangent; otherwise it is an ``atan2``, whose jumps by 2π must be removed when it is evaluated.
    """
    first, second = parts
    u, v = (product(spell_ratio(algebra, part, weight)) for part in parts)
    for part, other, text, sign in ((first, second, u, 1), (second, first, v, -1)):
        if signs.nonzero(text) and signs.sign(text) is not None:
            return sign * sp.atan(product(spell_ratio(algebra, other, part)))
    for turn, along, across in in_turning_frames(algebra, first, second):
        for part, other, sign in ((along, across, 1), (across, along, -1)):
            if _is_definite(algebra, signs, part):
                return turn + sign * sp.atan(product(spell_ratio(algebra, other, part)))
    return sp.atan2(v, u)


def in_turning_frames(
    algebra: Algebra, first: Polynomial, second: Polynomial
) -> Iterator[tuple[sp.Expr, Polynomial, Polynomial]]:
    """Yield (u, v) in frames that rotate with multiples of an angle of the curve."""
    parts = (first, second)
    used = [pair for pair in algebra.pairs if any(pair.degree(monomial) for part in parts for monomial in part)]
    # With several angles such a frame is not known to help.
    for pair in used if len(used) == 1 else ():
        if pair.sign < 0:
            continue
        for times in range(1, MAX_TURNS + 1):
            sine, cosine = algebra.multiple(pair, times)
            products = [algebra.times(part, wave) for part in parts for wave in (cosine, sine)]
            for sign in (1, -1):
                along = algebra.normal(products[0] + sign * products[3])
                across = algebra.normal(products[2] - sign * products[1])
                yield sign * times * pair.angle, along, across


def _is_definite(algebra: Algebra, signs: Signs, polynomial: Polynomial) -> bool:
    """Return whether a form such as a s² + b c² is proved to vanish nowhere by the signs of its terms."""
    return any(_definite_in(algebra, pair, signs, polynomial) for pair in algebra.pairs)


def _definite_in(algebra: Algebra, pair: Pair, signs: Signs, polynomial: Polynomial) -> bool:
    found = set()
    pure = set()
    for monomial, coefficient in polynomial.terms():
        sines, cosines = monomial[pair.sine], monomial[pair.cosine]
        remainder = sp.Mul(
            int(coefficient),
            *(
                name**power
                for place, (name, power) in enumerate(zip(algebra.names, monomial, strict=True))
                if power and place not in (pair.sine, pair.cosine)
            ),
        )
        if sines % 2 or cosines % 2 or not signs.nonzero(remainder):
            return False
        found.add(signs.sign(remainder))
        if not (sines and cosines):
            pure |= {"sine"} if sines else {"cosine"} if cosines else {"sine", "cosine"}
    return len(found) == 1 and None not in found and len(pure) == 2
