"""The shape of a curve in closed form: σ, tangent, signed curvature and turning angle.

Both components of dr/dλ are divided by everything that they have in common: dr/dλ = H·(u, v), with
(u, v) nowhere zero. Then σ = |H| √(u² + v²), so that a cusp is a zero of the factor H alone, the
tangent is (u, v)/√(u² + v²), and dΘ/dλ = (u v' - v u')/(u² + v²), whatever H is. For a polar
curve (u, v) are the components along and across the radius, whose own turning adds 1 to dΘ/dλ.

In space dr/dλ = H·p with three components, and σ = |H| |p|. The turning of the tangent is a vector
along the binormal, p × p'/|p|², whose components are those of dΘ/dλ for each pair of coordinates; its
length is |κ| σ. A curve in a vertical plane is a planar curve of z and the distance along the plane.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import sympy as sp

from gqm_sym.declare import Curve
from gqm_sym.derivation.algebra.algebra import Fraction
from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.algebra.generators import OverBudget
from gqm_sym.derivation.algebra.normal_form import shortest
from gqm_sym.derivation.algebra.rewrite import (
    Power,
    combine_absolute_values,
    direction,
    magnitudes,
    product,
    spell_quotient,
    spell_ratio,
)
from gqm_sym.derivation.algebra.signs import Signs
from gqm_sym.derivation.geometry.direction import (
    Direction,
    Root,
    change_of,
    direction_of,
    inverse_of,
    length_of,
    primitive,
    root_of_sum,
)
from gqm_sym.derivation.geometry.turning_angle import tangent_angle
from gqm_sym.sympy_charts import AXES, SPACE_ROWS, chart_alpha, chart_kappa

Heading = tuple[sp.Expr, sp.Expr]
AHEAD: Heading = (sp.S.One, sp.S.Zero)
"""The plane of x and z."""
PAIRS = ((1, 2), (2, 0), (0, 1))
"""The coordinates in the components of a vector product."""


def cross(one: Sequence[sp.Expr], other: Sequence[sp.Expr]) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Return the vector product of two vectors."""
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
        σ, the components of the unit tangent, and the signed curvature.
    turning_rate, angle
        dΘ/dλ, and an angle of the tangent, without jumps if that could be proved.
    cusp
        A factor of σ that vanishes at the cusps and changes sign there, or None.
    positive
        Parameters that are declared or taken to be positive.
    notes
        Remarks on forms that were not simplified, with the reason.
    heading
        Cosine and sine of the angle from the x axis to the plane of a curve in a vertical plane; ``along`` and ``dxds``
        are measured along that plane. None for a curve that lies in no vertical plane.
    sideways, dyds, turning
        For a curve in no vertical plane: dy/dλ = size·sideways, dy/ds, and the components of t × dt/dλ. ``kappa`` and
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
        """The unit normal to the left of the tangent in a vertical plane, along x, y and z; empty for a curve in no
        vertical plane.
        """
        if self.heading is None:
            return ()
        cosine, sine = self.heading
        return -self.dzds * cosine, -self.dzds * sine, self.dxds

    @property
    def curvature_binormal(self) -> tuple[sp.Expr, ...]:
        """The components of t × dt/ds, the curvature as a vector along the binormal; empty in a vertical plane."""
        return tuple(part / self.ds for part in self.turning)


def geometry(curve: Curve, *, may_be_positive: tuple[str, ...], heading: Heading | None = AHEAD) -> Geometry:
    """Derive the shape of a curve.

    Parameters
    ----------
    curve
        The declaration.
    may_be_positive
        Parameters that may be taken as positive to avoid their absolute values.
    heading
        For a space curve, the vertical plane in which it lies (`vertical_plane`); None for a shape in space.
    """
    if curve.charted:
        return _charted(curve)
    if curve.in_space and heading is not None:
        # In the plane the coordinates are the height and the distance along the plane, which is x or y divided by the
        # cosine or the sine.
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
    """Return cosine and sine of the angle from the x axis to the vertical plane in which a curve lies.

    The result is None if it lies in none, or if that cannot be decided because the forms are too long or known as
    numbers only.
    """
    if curve.charted:
        return None
    rates = [differentiate(form, curve.parameter) for form in (curve.x, curve.y)]
    if rates[1] == 0:
        return AHEAD
    if rates[0] == 0:
        return sp.S.Zero, sp.S.One
    try:
        tangent = primitive(curve, rates, sp.S.Zero)
    except OverBudget:
        return None
    u, v = (product(spell_ratio(tangent.algebra, part, tangent.algebra.one)) for part in tangent.parts)
    if curve.parameter in u.free_symbols | v.free_symbols:
        return None
    if u.could_extract_minus_sign():
        u, v = -u, -v
    length = sp.sqrt(u**2 + v**2)
    return u / length, v / length


def _charted(curve: Curve) -> Geometry:
    """Read the shape from the chart, whose parameter is arc length."""
    s, one = curve.parameter, sp.S.One
    if curve.in_space:
        first, second = ([SPACE_ROWS[axis][order](s) for axis in AXES] for order in (1, 2))
        kappa = sp.sqrt(sp.Add(*(part**2 for part in second)))
        return _undivided(first, one, kappa, positive=curve.positive, turning=cross(first, second))
    angle = chart_alpha(s)
    tangent = (sp.cos(angle), sp.S.Zero, sp.sin(angle))
    return _undivided(tangent, one, chart_kappa(s), positive=curve.positive, angle=angle)


def _plain(curve: Curve, signs: Signs, *notes: str) -> Geometry:
    """Return the shape by its definitions, without simplification."""
    lam = curve.parameter
    first = [differentiate(form, lam) for form in (curve.x, curve.y, curve.z)]
    second = [differentiate(form, lam) for form in first]
    square = sp.Add(*(part**2 for part in first))
    ds = sp.sqrt(square)
    if curve.in_space:
        turning = tuple(part / square for part in cross(first, second))
        rate = sp.sqrt(sp.Add(*(part**2 for part in turning)))
        return _undivided(first, ds, rate, positive=signs.positive, notes=notes, turning=turning)
    rate = (first[0] * second[2] - first[2] * second[0]) / square
    return _undivided(first, ds, rate, positive=signs.positive, notes=notes, angle=sp.atan2(first[2], first[0]))


def _undivided(
    first: Sequence[sp.Expr],
    ds: sp.Expr,
    rate: sp.Expr,
    *,
    positive: tuple[str, ...],
    notes: tuple[str, ...] = (),
    angle: sp.Expr | None = None,
    turning: tuple[sp.Expr, ...] = (),
) -> Geometry:
    """Return a shape whose components of dr/dλ are not divided by a common factor, given σ and dΘ/dλ."""
    along, sideways, across = first
    return Geometry(
        along=along,
        sideways=sideways,
        across=across,
        size=sp.S.One,
        per_length=1 / ds,
        ds=ds,
        dxds=along / ds,
        dyds=sideways / ds,
        dzds=across / ds,
        kappa=rate / ds,
        turning_rate=rate,
        turning=turning,
        angle=angle,
        cusp=None,
        positive=positive,
        notes=notes,
        heading=None if turning else AHEAD,
    )


def _factored(curve: Curve, signs: Signs) -> Geometry:
    lam = curve.parameter
    tangent = direction_of(curve)
    algebra = tangent.algebra
    root = root_of_sum(tangent, signs)
    if differentiate(curve.x, lam) == 1 and _is_written_out(tangent, root):
        shape = _plain(curve, signs)
        return replace(shape, angle=sp.atan(shape.across))
    scale = tangent.scale(root)
    ds = [*magnitudes(signs, scale), *root.powers]
    rate = _turning_rate(tangent, root, (0, 1))
    inverse = inverse_of(root.powers)
    per_length = product([*direction(signs, scale), *inverse])
    along, across = _in_plane(tangent, root)
    turning_rate = product(rate)
    return Geometry(
        along=product(along),
        across=product(across),
        size=product(scale),
        per_length=per_length,
        ds=product(ds),
        dxds=combine_absolute_values(product([*along, (per_length, 1)])),
        dzds=combine_absolute_values(product([*across, (per_length, 1)])),
        kappa=product([*rate, *inverse_of(ds)]),
        turning_rate=turning_rate,
        angle=turning_rate * lam
        if lam not in turning_rate.free_symbols
        else tangent.frame + tangent_angle(algebra, tangent.parts, root.weight, signs),
        cusp=_cusp(signs, scale, lam),
        positive=signs.positive,
    )


def _is_written_out(tangent: Direction, root: Root) -> bool:
    """Return whether the slope of a graph, z(x), is better left as the derivative of the declared height.

    Over a common denominator the terms of a numerator may grow so much more than the slope that its divided differences
    lose all digits, and powers of an exponential or a hyperbolic cosine overflow. A slope without a denominator, and
    one with which ds needs no root, are left in their normal form.
    """
    along, across = tangent.parts
    if along.is_ground or not any(base.is_Pow and base.exp == sp.S.Half for base, _ in root.powers):
        return False
    slope = spell_ratio(tangent.algebra, across, along)
    divides_sum = any(base.is_Add and power > 0 for base, power in slope)
    return divides_sum or any(base.has(sp.exp, sp.sinh, sp.cosh) for base, power in slope if power < 0)


def _in_space(curve: Curve, signs: Signs) -> Geometry:
    lam = curve.parameter
    tangent = direction_of(curve)
    algebra, root = tangent.algebra, root_of_sum(tangent, signs)
    scale = tangent.scale(root)
    ds = [*magnitudes(signs, scale), *root.powers]
    per_length = product([*direction(signs, scale), *inverse_of(root.powers)])
    along, sideways, across = (product(spell_ratio(algebra, part, root.weight)) for part in tangent.parts)
    square = [(base, 2 * power) for base, power in root.powers]
    weight = product(spell_ratio(algebra, root.weight, algebra.one))
    rate = [
        *length_of([change_of(tangent, pair) for pair in PAIRS], algebra, signs),
        *inverse_of([*square, (weight, 2)]),
    ]
    dxds, dyds, dzds = (combine_absolute_values(part * per_length) for part in (along, sideways, across))
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
        kappa=product([*rate, *inverse_of(ds)]),
        turning_rate=product(rate),
        turning=tuple(product(_turning_rate(tangent, root, pair)) for pair in PAIRS),
        angle=None,
        cusp=_cusp(signs, scale, lam),
        positive=signs.positive,
        heading=None,
    )


def _turning_rate(tangent: Direction, root: Root, pair: tuple[int, int]) -> list[Power]:
    """Write dΘ/dλ = frame' + (u v' - v u')/(u² + v²), with the parts of a pair above."""
    algebra = tangent.algebra
    change = change_of(tangent, pair)
    rate = algebra.reduced(Fraction(change.top, algebra.times(change.bottom, tangent.square)))
    reduced = spell_quotient(algebra, rate.top, rate.bottom)
    if root.square is None or rate.bottom.is_ground or not rate.top:
        return reduced
    # It is divided by the same factor as in σ, so that both powers are combined.
    weight = algebra.times(root.weight, root.weight)
    part = algebra.reduced(Fraction(change.top, algebra.times(change.bottom, weight)))
    shared = [*spell_quotient(algebra, part.top, part.bottom), (root.square, -1)]
    texts = [product([*powers, *inverse_of(root.powers)]) for powers in (shared, reduced)]
    return shared if shortest(texts) == texts[0] else reduced


def _in_plane(tangent: Direction, root: Root) -> tuple[list[Power], list[Power]]:
    """Write the components of (u, v) along x and z."""
    algebra = tangent.algebra
    first, second = (spell_ratio(algebra, part, root.weight) for part in tangent.parts)
    if tangent.frame == 0:
        return first, second
    sine, cosine = sp.sin(tangent.frame), sp.cos(tangent.frame)
    u, v = product(first), product(second)
    s, c = (algebra.fraction(wave).top for wave in (sine, cosine))
    one, two = tangent.parts
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
