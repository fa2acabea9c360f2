"""The shape of a curve in closed form: σ, tangent, signed curvature and turning angle.

Both components of dr/dλ are divided by everything that they have in common: dr/dλ = H·(u, v), with
(u, v) nowhere zero. Then σ = |H| √(u² + v²), so that a cusp is a zero of the factor H alone, the
tangent is (u, v)/√(u² + v²), and dΘ/dλ = (u v' - v u')/(u² + v²), whatever H is. For a polar
curve (u, v) are the components along and across the radius, whose own turning adds 1 to dΘ/dλ.

In space dr/dλ = H·p with three components, and σ = |H| |p|. The turning of the tangent is a vector
along the binormal, p × p'/|p|², whose components are those of dΘ/dλ for each pair of coordinates; its
length is |κ| σ. A curve in a vertical plane is a planar curve of z and the distance along the plane.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import sympy as sp

from gqm_sym.declare import Curve
from gqm_sym.derivation.algebra.algebra import Algebra, Fraction, Polynomial
from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.algebra.factors import factors
from gqm_sym.derivation.algebra.generators import Angle, OverBudget
from gqm_sym.derivation.algebra.normal_form import shortest
from gqm_sym.derivation.algebra.rewrite import (
    Power,
    absorb_bars,
    direction,
    is_safe,
    known_sign,
    magnitudes,
    product,
    spell_factors,
    spell_product,
    spell_quotient,
    spell_ratio,
    without_waves,
)
from gqm_sym.derivation.algebra.signs import Signs
from gqm_sym.derivation.geometry.turning_angle import tangent_angle, turned
from gqm_sym.errors import DeclarationError
from gqm_sym.sympy_charts import AXES, SPACE_ROWS, chart_alpha, chart_kappa

Heading = tuple[sp.Expr, sp.Expr]
AHEAD: Heading = (sp.S.One, sp.S.Zero)
"""The plane of x and z."""
PAIRS = ((1, 2), (2, 0), (0, 1))
"""The coordinates in the components of a vector product."""


def cross(one: Sequence[sp.Expr], other: Sequence[sp.Expr]) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """The vector product of two vectors."""
    along_x, along_y, along_z = (one[i] * other[j] - one[j] * other[i] for i, j in PAIRS)
    return along_x, along_y, along_z


@dataclass(frozen=True, slots=True, kw_only=True)
class Geometry:
    """Closed forms of a curve in its parameter λ.

    Attributes
    ----------
    along, across, size, per_length
        dx/dλ = size·along, dz/dλ = size·across, dx/ds = along·per_length, dz/ds likewise.
    ds, dxds, dzds, kappa
        σ, the unit tangent and the signed curvature.
    turning_rate, angle
        dΘ/dλ, and an angle of the tangent, without jumps where that could be proved.
    cusp
        A factor of σ that vanishes at the cusps and changes sign there, or None.
    positive
        Parameters promised or taken to be positive.
    notes
        What was left unsimplified, and why.
    heading
        Cosine and sine of the angle from the x axis to the plane of a curve in a vertical plane; ``along`` and ``dxds``
        are measured along that plane. None for a curve that lies in no vertical plane.
    sideways, dyds, turning
        Of a curve in no vertical plane: dy/dλ = size·sideways, dy/ds, and the components of t × dt/dλ. ``kappa`` and
        ``turning_rate`` are then the lengths of t × dt/ds and t × dt/dλ, and there is no ``angle``.
    """

    along: sp.Expr
    across: sp.Expr
    size: sp.Expr
    per_length: sp.Expr
    ds: sp.Expr
    dxds: sp.Expr
    dzds: sp.Expr
    kappa: sp.Expr
    turning_rate: sp.Expr
    angle: sp.Expr | None
    cusp: sp.Expr | None
    positive: tuple[str, ...]
    notes: tuple[str, ...] = ()
    heading: Heading | None = AHEAD
    sideways: sp.Expr = sp.S.Zero
    dyds: sp.Expr = sp.S.Zero
    turning: tuple[sp.Expr, ...] = ()

    @property
    def tangent(self) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
        """The components of the unit tangent along x, y and z."""
        if self.heading is None:
            return self.dxds, self.dyds, self.dzds
        cosine, sine = self.heading
        return cosine * self.dxds, sine * self.dxds, self.dzds

    @property
    def normal(self) -> tuple[sp.Expr, ...]:
        """The unit normal to the left of the tangent in a vertical plane, along x, y and z; empty outside of one."""
        if self.heading is None:
            return ()
        cosine, sine = self.heading
        return -self.dzds * cosine, -self.dzds * sine, self.dxds

    @property
    def bend(self) -> tuple[sp.Expr, ...]:
        """The components of the curvature as a vector along the binormal, t × dt/ds; empty in a vertical plane."""
        return tuple(part / self.ds for part in self.turning)


def geometry(curve: Curve, *, may_be_positive: tuple[str, ...], heading: Heading | None = AHEAD) -> Geometry:
    """Derive the shape of a curve.

    Parameters
    ----------
    curve
        The declaration.
    may_be_positive
        Parameters that may be taken as positive where |parameter| would stand otherwise.
    heading
        Of a space curve: the vertical plane that it is in (`vertical_plane`); None for a shape in space.
    """
    if curve.charted:
        return _charted_in_space(curve) if curve.in_space else _charted(curve)
    if curve.in_space and heading is not None:
        # In the plane: the distance along it, which is a coordinate over the cosine or the sine, and the height.
        cosine, sine = heading
        distance = curve.x / cosine if cosine else curve.y / sine
        flat = replace(curve, kind="parametric", x=distance, y=sp.S.Zero)
        return replace(geometry(flat, may_be_positive=may_be_positive), heading=heading)
    signs = Signs(
        parameter=curve.parameter,
        domain=curve.domain,
        positive=curve.positive,
        may_be_positive=may_be_positive,
    )
    try:
        return _in_space(curve, signs) if curve.in_space else _factored(curve, signs)
    except OverBudget as reason:
        return _plain(curve, signs, f"ds and kappa are left unsimplified: {reason}")


def vertical_plane(curve: Curve) -> Heading | None:
    """Cosine and sine of the angle from the x axis to the vertical plane that a curve is in.

    None where it is in none, or that cannot be seen: it is too long, or known by numbers only.
    """
    if curve.charted:
        return None
    rates = [differentiate(form, curve.parameter) for form in (curve.x, curve.y)]
    if rates[1] == 0:
        return AHEAD
    if rates[0] == 0:
        return sp.S.Zero, sp.S.One
    try:
        way = _primitive(curve, rates, sp.S.Zero)
    except OverBudget:
        return None
    u, v = (product(spell_ratio(way.algebra, part, way.algebra.one)) for part in way.parts)
    if curve.parameter in u.free_symbols | v.free_symbols:
        return None
    if u.could_extract_minus_sign():
        u, v = -u, -v
    length = sp.sqrt(u**2 + v**2)
    return u / length, v / length


def _charted(curve: Curve) -> Geometry:
    """Read the shape from the chart: its parameter is arc length."""
    s = curve.parameter
    angle, kappa = chart_alpha(s), chart_kappa(s)
    along, across = sp.cos(angle), sp.sin(angle)
    return Geometry(
        along=along,
        across=across,
        size=sp.S.One,
        per_length=sp.S.One,
        ds=sp.S.One,
        dxds=along,
        dzds=across,
        kappa=kappa,
        turning_rate=kappa,
        angle=angle,
        cusp=None,
        positive=curve.positive,
    )


def _charted_in_space(curve: Curve) -> Geometry:
    """Read the shape from the charts of three coordinates."""
    first, second = ([SPACE_ROWS[axis][order](curve.parameter) for axis in AXES] for order in (1, 2))
    kappa = sp.sqrt(sp.Add(*(part**2 for part in second)))
    return Geometry(
        along=first[0],
        sideways=first[1],
        across=first[2],
        size=sp.S.One,
        per_length=sp.S.One,
        ds=sp.S.One,
        dxds=first[0],
        dyds=first[1],
        dzds=first[2],
        kappa=kappa,
        turning_rate=kappa,
        turning=cross(first, second),
        angle=None,
        cusp=None,
        positive=curve.positive,
        heading=None,
    )


def _plain(curve: Curve, signs: Signs, note: str) -> Geometry:
    """Write the definitions down as they are."""
    lam = curve.parameter
    if curve.in_space:
        return _plain_in_space(curve, signs, note)
    dx, dz = differentiate(curve.x, lam), differentiate(curve.z, lam)
    square = dx**2 + dz**2
    ds = sp.sqrt(square)
    rate = (dx * differentiate(dz, lam) - dz * differentiate(dx, lam)) / square
    return Geometry(
        along=dx,
        across=dz,
        size=sp.S.One,
        per_length=1 / ds,
        ds=ds,
        dxds=dx / ds,
        dzds=dz / ds,
        kappa=rate / ds,
        turning_rate=rate,
        angle=sp.atan2(dz, dx),
        cusp=None,
        positive=signs.positive,
        notes=(note,),
    )


def _plain_in_space(curve: Curve, signs: Signs, note: str) -> Geometry:
    """The same for a space curve."""
    lam = curve.parameter
    first = [differentiate(form, lam) for form in curve.point]
    second = [differentiate(form, lam) for form in first]
    square = sp.Add(*(part**2 for part in first))
    ds = sp.sqrt(square)
    turning = tuple(part / square for part in cross(first, second))
    rate = sp.sqrt(sp.Add(*(part**2 for part in turning)))
    return Geometry(
        along=first[0],
        sideways=first[1],
        across=first[2],
        size=sp.S.One,
        per_length=1 / ds,
        ds=ds,
        dxds=first[0] / ds,
        dyds=first[1] / ds,
        dzds=first[2] / ds,
        kappa=rate / ds,
        turning_rate=rate,
        turning=turning,
        angle=None,
        cusp=None,
        positive=signs.positive,
        notes=(note,),
        heading=None,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Direction:
    """A vector that is common/below times its ``parts``, which have no common factors, in a frame turned by ``frame``.

    ``square`` is the sum of the squares of the parts.
    """

    algebra: Algebra
    frame: sp.Expr
    parts: tuple[Polynomial, ...]
    square: Polynomial
    common: Polynomial
    below: Polynomial

    def scale(self, root: "_Root") -> list[Power]:
        """What stands before the parts over the weight of the root."""
        one = self.algebra.one
        return spell_product(self.algebra, self.common, self.below if root.weight == one else one)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Root:
    """The length of the parts of a direction over a weight, as factors.

    ``square`` is what stands under the root if that is one piece, else None. ``weight`` is what the parts were divided
    by: a denominator of r' that then is no part of H.
    """

    powers: list[Power]
    square: sp.Expr | None
    weight: Polynomial


def _factored(curve: Curve, signs: Signs) -> Geometry:
    lam = curve.parameter
    way = _direction(curve)
    algebra = way.algebra
    root = _root_of_sum(way, signs)
    scale = way.scale(root)
    ds = [*magnitudes(signs, scale), *root.powers]
    rate = _turning_rate(way, root, (0, 1))
    inverse = _inverse(root.powers)
    per_length = product([*direction(signs, scale), *inverse])
    along, across = _in_plane(way, root)
    turning_rate = product(rate)
    return Geometry(
        along=product(along),
        across=product(across),
        size=product(scale),
        per_length=per_length,
        ds=product(ds),
        dxds=absorb_bars(product([*along, (per_length, 1)])),
        dzds=absorb_bars(product([*across, (per_length, 1)])),
        kappa=product([*rate, *_inverse(ds)]),
        turning_rate=turning_rate,
        angle=turning_rate * lam
        if lam not in turning_rate.free_symbols
        else way.frame + tangent_angle(algebra, way.parts, root.weight, signs),
        cusp=_cusp(signs, scale, lam),
        positive=signs.positive,
    )


def _in_space(curve: Curve, signs: Signs) -> Geometry:
    lam = curve.parameter
    way = _direction(curve)
    algebra, root = way.algebra, _root_of_sum(way, signs)
    scale = way.scale(root)
    ds = [*magnitudes(signs, scale), *root.powers]
    per_length = product([*direction(signs, scale), *_inverse(root.powers)])
    along, sideways, across = (product(spell_ratio(algebra, part, root.weight)) for part in way.parts)
    square = [(base, 2 * power) for base, power in root.powers]
    weight = product(spell_ratio(algebra, root.weight, algebra.one))
    rate = [*_length([_change(way, pair) for pair in PAIRS], algebra, signs), *_inverse([*square, (weight, 2)])]
    dxds, dyds, dzds = (absorb_bars(part * per_length) for part in (along, sideways, across))
    return Geometry(
        along=along,
        sideways=sideways,
        across=across,
        size=product(scale),
        per_length=per_length,
        ds=product(ds),
        dxds=dxds,
        dyds=dyds,
        dzds=dzds,
        kappa=product([*rate, *_inverse(ds)]),
        turning_rate=product(rate),
        turning=tuple(product(_turning_rate(way, root, pair)) for pair in PAIRS),
        angle=None,
        cusp=_cusp(signs, scale, lam),
        positive=signs.positive,
        heading=None,
    )


def _length(components: list[Fraction], algebra: Algebra, signs: Signs) -> list[Power]:
    """The length of a vector with these components."""
    if not any(component.top for component in components):
        return [(sp.S.Zero, 1)]
    vector = _without_common_factor(algebra, components, sp.S.Zero)
    root = _root_of_sum(vector, signs)
    return [*magnitudes(signs, vector.scale(root)), *root.powers]


def _direction(curve: Curve) -> _Direction:
    lam = curve.parameter
    if curve.radius is not None:
        return _primitive(curve, (differentiate(curve.radius, lam), curve.radius), lam)
    return _primitive(curve, [differentiate(form, lam) for form in curve.point], sp.S.Zero)


def _primitive(curve: Curve, components: Sequence[sp.Expr], frame: sp.Expr) -> _Direction:
    """Some components, of which one is not zero, without their common factor."""
    lam = curve.parameter
    halved: frozenset[Angle] = frozenset()
    while True:
        algebra = Algebra((*components, sp.sin(frame)), lam, halved)
        fractions = [algebra.fraction(component) for component in components]
        if not any(fraction.top for fraction in fractions):
            told = " and ".join(f"{name} = {form}" for name, form in curve.coordinates)
            raise DeclarationError(f"{curve.kind} curve: {told} do not change with {lam.name}: a point, not a curve")
        parts = [part for fraction in fractions for part in (fraction.top, fraction.bottom)]
        uneven = algebra.uneven(parts) - halved
        if not uneven:
            break
        halved |= uneven
    return _without_common_factor(algebra, fractions, frame)


def _without_common_factor(algebra: Algebra, fractions: Sequence[Fraction], frame: sp.Expr) -> _Direction:
    """A vector of fractions, not all of them zero, as a direction."""
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
    return _Direction(
        algebra=algebra,
        frame=frame,
        parts=tuple(parts),
        square=algebra.normal(reduce(lambda total, square: total + square, (algebra.times(p, p) for p in parts))),
        common=common,
        below=below,
    )


def _root_of_sum(way: _Direction, signs: Signs) -> _Root:
    """Choose how to write the length of a vector of polynomials."""
    algebra, one = way.algebra, way.algebra.one
    content, found = factors(algebra, way.square)
    number, written = spell_factors(algebra, found)
    whole = magnitudes(signs, [(factor, power // 2) for factor, power in written if power > 1])
    number *= content
    odd = [factor for factor, power in written if power % 2]
    if odd and number.is_negative:
        # Both signs under one root: (a - x)*(a + x), not -(x - a)*(x + a).
        number, odd[0] = -number, -odd[0]
    known = [factor for factor in odd if known_sign(signs, factor) == 1]
    unknown = sp.Mul(*(factor for factor in odd if factor not in known))
    whole += [(sp.sqrt(part), 1) for part in (number, *known, unknown)]
    if not odd:
        return _Root(powers=whole, square=None, weight=one)
    text = sp.count_ops(product(whole))
    parts = way.parts
    sums = [_sum_of_squares(algebra, parts, one)]
    if len(parts) == 2:
        # Components at 45 degrees may be simpler.
        halves = (parts[0] + parts[1], parts[0] - parts[1])
        sums.append(_sum_of_squares(algebra, [algebra.normal(half) for half in halves], one) / 2)
    else:
        # So may components in a frame that turns about the z axis: the one with the fewest terms is written out.
        frames = [(along, across, parts[2]) for _, along, across in turned(algebra, parts[0], parts[1])]
        frame = min(frames, key=lambda frame: sum(map(len, frame)), default=parts)
        if sum(map(len, frame)) < sum(map(len, parts)):
            sums.append(without_waves(_sum_of_squares(algebra, frame, one)))
    kept = shortest(sums)
    if all(is_safe(signs, factor) for factor in odd) and text <= sp.count_ops(sp.sqrt(kept)):
        return _Root(powers=whole, square=None, weight=one)
    for part in parts:
        # A graph: 1 + (dz/dx)², which also overflows later than with its denominator cleared.
        if way.below != one and algebra.reduced(Fraction(part, way.below)).top.is_ground:
            square = _sum_of_squares(algebra, parts, way.below)
            return _Root(powers=[(sp.sqrt(square), 1)], square=square, weight=way.below)
    return _Root(powers=[(sp.sqrt(kept), 1)], square=kept, weight=one)


def _sum_of_squares(algebra: Algebra, parts: Sequence[Polynomial], weight: Polynomial) -> sp.Expr:
    return sp.Add(*(product(spell_ratio(algebra, part, weight)) ** 2 for part in parts))


def _inverse(powers: Iterable[Power]) -> list[Power]:
    return [(base, -power) for base, power in powers]


def _change(way: _Direction, pair: tuple[int, int]) -> Fraction:
    """Write u v' - v u' of two parts, and in a frame that turns what that adds."""
    algebra, one = way.algebra, way.algebra.one
    first, second = (way.parts[k] for k in pair)
    change = algebra.add(
        algebra.multiply(Fraction(first, one), algebra.derivative(second)),
        algebra.multiply(Fraction(-second, one), algebra.derivative(first)),
    )
    if way.frame != 0:
        change = algebra.add(change, Fraction(way.square, one))
    return algebra.reduced(change)


def _turning_rate(way: _Direction, root: _Root, pair: tuple[int, int]) -> list[Power]:
    """Write dΘ/dλ = frame' + (u v' - v u')/(u² + v²), with the parts of a pair above."""
    algebra = way.algebra
    change = _change(way, pair)
    rate = algebra.reduced(Fraction(change.top, algebra.times(change.bottom, way.square)))
    reduced = spell_quotient(algebra, rate.top, rate.bottom)
    if root.square is None or rate.bottom.is_ground or not rate.top:
        return reduced
    # Over the very piece that stands in σ, so that both powers become one.
    weight = algebra.times(root.weight, root.weight)
    part = algebra.reduced(Fraction(change.top, algebra.times(change.bottom, weight)))
    shared = [*spell_quotient(algebra, part.top, part.bottom), (root.square, -1)]
    texts = [product([*powers, *_inverse(root.powers)]) for powers in (shared, reduced)]
    return shared if shortest(texts) == texts[0] else reduced


def _in_plane(way: _Direction, root: _Root) -> tuple[list[Power], list[Power]]:
    """Write the components of (u, v) along x and z."""
    algebra = way.algebra
    first, second = (spell_ratio(algebra, part, root.weight) for part in way.parts)
    if way.frame == 0:
        return first, second
    sine, cosine = sp.sin(way.frame), sp.cos(way.frame)
    u, v = product(first), product(second)
    s, c = (algebra.fraction(wave).top for wave in (sine, cosine))
    one, two = way.parts
    tops = (
        algebra.times(one, c) - algebra.times(two, s),
        algebra.times(one, s) + algebra.times(two, c),
    )
    chosen = []
    for text, top in zip((u * cosine - v * sine, u * sine + v * cosine), tops, strict=True):
        powers = spell_ratio(algebra, algebra.normal(top), root.weight)
        short = shortest([text, product(powers)])
        chosen.append([(text, 1)] if short == text else powers)
    return chosen[0], chosen[1]


def _cusp(signs: Signs, scale: list[Power], lam: sp.Symbol) -> sp.Expr | None:
    found = [
        factor for factor, power in scale if power > 0 and lam in factor.free_symbols and not signs.nonzero(factor)
    ]
    return sp.Mul(*found) if found else None
