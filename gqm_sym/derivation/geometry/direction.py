"""A vector as a factor times a direction without a common factor, and the length of that direction.

Both components of dr/dλ are divided by everything that they have in common: dr/dλ = H·(u, v), with (u, v) nowhere zero.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import reduce

import sympy as sp

from gqm_sym.declare import Curve
from gqm_sym.derivation.algebra.algebra import Algebra, Fraction, Polynomial
from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.algebra.factors import factors
from gqm_sym.derivation.algebra.generators import Angle
from gqm_sym.derivation.algebra.normal_form import shortest
from gqm_sym.derivation.algebra.rewrite import (
    Power,
    is_safe,
    known_sign,
    magnitudes,
    product,
    spell_factors,
    spell_product,
    spell_ratio,
    without_waves,
)
from gqm_sym.derivation.algebra.signs import Signs
from gqm_sym.derivation.geometry.turning_angle import in_turning_frames
from gqm_sym.errors import DeclarationError


@dataclass(frozen=True, slots=True, kw_only=True)
class Direction:
    """A vector that is common/below times its ``parts``, which have no common factors, in a frame rotated by ``frame``.

    ``square`` is the sum of the squares of the parts.
    """

    algebra: Algebra
    frame: sp.Expr
    parts: tuple[Polynomial, ...]
    square: Polynomial
    common: Polynomial
    below: Polynomial

    def scale(self, root: "Root") -> list[Power]:
        """Return the factor of the parts, divided by the weight of the root."""
        one = self.algebra.one
        return spell_product(self.algebra, self.common, self.below if root.weight == one else one)


@dataclass(frozen=True, slots=True, kw_only=True)
class Root:
    """The length of the parts of a direction divided by a weight, as factors.

    ``square`` is the expression under the root if that is one factor, otherwise None. ``weight`` is the divisor of the
    parts: a denominator of r' that is not included in H.
    """

    powers: list[Power]
    square: sp.Expr | None
    weight: Polynomial


def length_of(components: list[Fraction], algebra: Algebra, signs: Signs) -> list[Power]:
    """Return the length of a vector with these components."""
    if not any(component.top for component in components):
        return [(sp.S.Zero, 1)]
    vector = _without_common_factor(algebra, components, sp.S.Zero)
    root = root_of_sum(vector, signs)
    return [*magnitudes(signs, vector.scale(root)), *root.powers]


def direction_of(curve: Curve) -> Direction:
    """Return dr/dλ of a curve; for a polar curve along and across its radius."""
    lam = curve.parameter
    if curve.radius is not None:
        return primitive(curve, (differentiate(curve.radius, lam), curve.radius), lam)
    return primitive(curve, [differentiate(form, lam) for form in curve.point], sp.S.Zero)


def primitive(curve: Curve, components: Sequence[sp.Expr], frame: sp.Expr) -> Direction:
    """Return the vector with the given components, at least one of which is not zero, without their common factor."""
    lam = curve.parameter
    halved: frozenset[Angle] = frozenset()
    while True:
        algebra = Algebra((*components, sp.sin(frame)), lam, halved)
        fractions = [algebra.fraction(component) for component in components]
        if not any(fraction.top for fraction in fractions):
            forms = " and ".join(f"{name} = {form}" for name, form in curve.coordinates)
            raise DeclarationError(f"{curve.kind} curve: {forms} do not change with {lam.name}: a point, not a curve")
        parts = [part for fraction in fractions for part in (fraction.top, fraction.bottom)]
        uneven = algebra.uneven(parts) - halved
        if not uneven:
            break
        halved |= uneven
    return _without_common_factor(algebra, fractions, frame)


def _without_common_factor(algebra: Algebra, fractions: Sequence[Fraction], frame: sp.Expr) -> Direction:
    """Return a vector of fractions, not all of which are zero, as a direction."""
    tops, below = [fractions[0].top], fractions[0].bottom
    for fraction in fractions[1:]:
        _, lacking, lacking_here = below.cofactors(fraction.bottom)
        tops = [*(algebra.times(top, lacking_here) for top in tops), algebra.times(fraction.top, lacking)]
        below = algebra.times(below, lacking_here)
    tops = [algebra.normal(top) for top in tops]
    common, first, second = tops[0].cofactors(tops[1])
    parts = [first, second]
    for top in tops[2:]:
        common, shared, part = common.cofactors(top)
        parts = [*(algebra.times(other, shared) for other in parts), part]
    return Direction(
        algebra=algebra,
        frame=frame,
        parts=tuple(parts),
        square=algebra.normal(reduce(lambda total, square: total + square, (algebra.times(p, p) for p in parts))),
        common=common,
        below=below,
    )


def root_of_sum(direction: Direction, signs: Signs) -> Root:
    """Return the length of the parts of a direction in its simplest form."""
    algebra, one = direction.algebra, direction.algebra.one
    content, found = factors(algebra, direction.square)
    number, written = spell_factors(algebra, found)
    whole = magnitudes(signs, [(factor, power // 2) for factor, power in written if power > 1])
    number *= content
    odd = [factor for factor, power in written if power % 2]
    if odd and number.is_negative:
        # Both signs are put under one root: (a - x)*(a + x), not -(x - a)*(x + a).
        number, odd[0] = -number, -odd[0]
    known = [factor for factor in odd if known_sign(signs, factor) == 1]
    unknown = sp.Mul(*(factor for factor in odd if factor not in known))
    whole += [(sp.sqrt(part), 1) for part in (number, *known, unknown)]
    if not odd:
        return Root(powers=whole, square=None, weight=one)
    text = sp.count_ops(product(whole))
    parts = direction.parts
    sums = [_sum_of_squares(algebra, parts, one)]
    if len(parts) == 2:
        # Components at 45 degrees may be simpler.
        halves = (parts[0] + parts[1], parts[0] - parts[1])
        sums.append(_sum_of_squares(algebra, [algebra.normal(half) for half in halves], one) / 2)
    else:
        # So may components in a frame that rotates about the z axis; the one with the fewest terms is written out.
        frames = [(along, across, parts[2]) for _, along, across in in_turning_frames(algebra, parts[0], parts[1])]
        frame = min(frames, key=lambda frame: sum(map(len, frame)), default=parts)
        if sum(map(len, frame)) < sum(map(len, parts)):
            sums.append(without_waves(_sum_of_squares(algebra, frame, one)))
    kept = shortest(sums)
    if all(is_safe(signs, factor) for factor in odd) and text <= sp.count_ops(sp.sqrt(kept)):
        return Root(powers=whole, square=None, weight=one)
    for part in parts:
        # For a graph this is 1 + (dz/dx)², which also overflows later than with its denominator cleared.
        if direction.below != one and algebra.reduced(Fraction(part, direction.below)).top.is_ground:
            square = _sum_of_squares(algebra, parts, direction.below)
            return Root(powers=[(sp.sqrt(square), 1)], square=square, weight=direction.below)
    return Root(powers=[(sp.sqrt(kept), 1)], square=kept, weight=one)


def _sum_of_squares(algebra: Algebra, parts: Sequence[Polynomial], weight: Polynomial) -> sp.Expr:
    return sp.Add(*(product(spell_ratio(algebra, part, weight)) ** 2 for part in parts))


def inverse_of(powers: Iterable[Power]) -> list[Power]:
    """Return the inverse of a product of powers."""
    return [(base, -power) for base, power in powers]


def change_of(direction: Direction, pair: tuple[int, int]) -> Fraction:
    """Return u v' - v u' for two parts; in a rotating frame, including the contribution of its rotation."""
    algebra, one = direction.algebra, direction.algebra.one
    first, second = (direction.parts[k] for k in pair)
    change = algebra.add(
        algebra.multiply(Fraction(first, one), algebra.derivative(second)),
        algebra.multiply(Fraction(-second, one), algebra.derivative(first)),
    )
    if direction.frame != 0:
        change = algebra.add(change, Fraction(direction.square, one))
    return algebra.reduced(change)
