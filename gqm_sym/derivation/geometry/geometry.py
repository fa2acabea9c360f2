"""The shape of a curve in closed form: σ, tangent, signed curvature and turning angle.

Both components of dr/dλ are divided by everything that they have in common: dr/dλ = H·(u, v), with
(u, v) nowhere zero. Then σ = |H| √(u² + v²), so that a cusp is a zero of the factor H alone, the
tangent is (u, v)/√(u² + v²), and dΘ/dλ = (u v' - v u')/(u² + v²), whatever H is. For a polar
curve (u, v) are the components along and across the radius, whose own turning adds 1 to dΘ/dλ.
"""

from collections.abc import Sequence
from dataclasses import dataclass

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
)
from gqm_sym.derivation.algebra.signs import Signs
from gqm_sym.derivation.geometry.turning_angle import tangent_angle
from gqm_sym.errors import DeclarationError
from gqm_sym.sympy_charts import chart_alpha, chart_kappa


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
    angle: sp.Expr
    cusp: sp.Expr | None
    positive: tuple[str, ...]
    notes: tuple[str, ...] = ()


def geometry(curve: Curve, *, may_be_positive: tuple[str, ...]) -> Geometry:
    """Derive the shape of a curve.

    Parameters
    ----------
    curve
        The declaration.
    may_be_positive
        Parameters that may be taken as positive where |parameter| would stand otherwise.
    """
    if curve.charted:
        return _charted(curve)
    signs = Signs(
        parameter=curve.parameter,
        domain=curve.domain,
        positive=curve.positive,
        may_be_positive=may_be_positive,
    )
    try:
        return _factored(curve, signs)
    except OverBudget as reason:
        return _plain(curve, signs, f"ds and kappa are left unsimplified: {reason}")


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


def _plain(curve: Curve, signs: Signs, note: str) -> Geometry:
    """Write the definitions down as they are."""
    lam = curve.parameter
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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Direction:
    """(u, v) = (first, second)/weight without common factors, in a frame turned by ``frame``.

    ``square`` is first² + second², and r' is common/below times (first, second).
    """

    algebra: Algebra
    frame: sp.Expr
    first: Polynomial
    second: Polynomial
    square: Polynomial
    common: Polynomial
    below: Polynomial


@dataclass(frozen=True, slots=True, kw_only=True)
class _Root:
    """√(u² + v²) as factors.

    ``square`` is what stands under the root if that is one piece, else None. ``weight`` is what u
    and v were divided by: a denominator of r' that then is no part of H.
    """

    powers: list[Power]
    square: sp.Expr | None
    weight: Polynomial


def _factored(curve: Curve, signs: Signs) -> Geometry:
    lam = curve.parameter
    way = _direction(curve)
    algebra = way.algebra
    root = _root_of_sum(way, signs)
    scale = spell_product(algebra, way.common, way.below if root.weight == algebra.one else algebra.one)
    ds = [*magnitudes(signs, scale), *root.powers]
    rate = _turning_rate(way, root)
    inverse = [(base, -power) for base, power in root.powers]
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
        kappa=product([*rate, *((base, -power) for base, power in ds)]),
        turning_rate=turning_rate,
        angle=turning_rate * lam
        if lam not in turning_rate.free_symbols
        else way.frame + tangent_angle(algebra, way.first, way.second, root.weight, signs),
        cusp=_cusp(signs, scale, lam),
        positive=signs.positive,
    )


def _direction(curve: Curve) -> _Direction:
    lam = curve.parameter
    frame = sp.S.Zero
    components = (differentiate(curve.x, lam), differentiate(curve.z, lam))
    if curve.radius is not None:
        frame = lam
        components = (differentiate(curve.radius, lam), curve.radius)
    halved: frozenset[Angle] = frozenset()
    while True:
        algebra = Algebra((*components, sp.sin(frame)), lam, halved)
        one, two = (algebra.fraction(component) for component in components)
        if not one.top and not two.top:
            raise DeclarationError(
                f"{curve.kind} curve: x = {curve.x} and z = {curve.z} do not change with "
                f"{lam.name}: a point, not a curve"
            )
        uneven = algebra.uneven((one.top, one.bottom, two.top, two.bottom)) - halved
        if not uneven:
            break
        halved |= uneven
    _, lacking_one, lacking_two = one.bottom.cofactors(two.bottom)
    tops = (
        algebra.normal(algebra.times(one.top, lacking_two)),
        algebra.normal(algebra.times(two.top, lacking_one)),
    )
    common, first, second = tops[0].cofactors(tops[1])
    return _Direction(
        algebra=algebra,
        frame=frame,
        first=first,
        second=second,
        square=algebra.normal(algebra.times(first, first) + algebra.times(second, second)),
        common=common,
        below=algebra.times(one.bottom, lacking_two),
    )


def _root_of_sum(way: _Direction, signs: Signs) -> _Root:
    """Choose how to write √(u² + v²)."""
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
    parts = (way.first, way.second)
    sums = [_sum_of_squares(algebra, parts, one)]
    # Components at 45 degrees may be simpler.
    halves = (way.first + way.second, way.first - way.second)
    sums.append(_sum_of_squares(algebra, [algebra.normal(half) for half in halves], one) / 2)
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


def _turning_rate(way: _Direction, root: _Root) -> list[Power]:
    """Write dΘ/dλ = frame' + (u v' - v u')/(u² + v²)."""
    algebra, one = way.algebra, way.algebra.one
    change = algebra.add(
        algebra.multiply(Fraction(way.first, one), algebra.derivative(way.second)),
        algebra.multiply(Fraction(-way.second, one), algebra.derivative(way.first)),
    )
    if way.frame != 0:
        change = algebra.add(change, Fraction(way.square, one))
    change = algebra.reduced(change)
    rate = algebra.reduced(Fraction(change.top, algebra.times(change.bottom, way.square)))
    reduced = spell_quotient(algebra, rate.top, rate.bottom)
    if root.square is None or rate.bottom.is_ground or not rate.top:
        return reduced
    # Over the very piece that stands in σ, so that both powers become one.
    weight = algebra.times(root.weight, root.weight)
    part = algebra.reduced(Fraction(change.top, algebra.times(change.bottom, weight)))
    shared = [*spell_quotient(algebra, part.top, part.bottom), (root.square, -1)]
    inverse = [(base, -power) for base, power in root.powers]
    texts = [product([*powers, *inverse]) for powers in (shared, reduced)]
    return shared if shortest(texts) == texts[0] else reduced


def _in_plane(way: _Direction, root: _Root) -> tuple[list[Power], list[Power]]:
    """Write the components of (u, v) along x and z."""
    algebra = way.algebra
    first, second = (spell_ratio(algebra, part, root.weight) for part in (way.first, way.second))
    if way.frame == 0:
        return first, second
    sine, cosine = sp.sin(way.frame), sp.cos(way.frame)
    u, v = product(first), product(second)
    s, c = (algebra.fraction(wave).top for wave in (sine, cosine))
    tops = (
        algebra.times(way.first, c) - algebra.times(way.second, s),
        algebra.times(way.first, s) + algebra.times(way.second, c),
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
