"""Places inside a curve at which its formulas have no continuous tangent or curvature, and powers that are real on one
side only.

At a corner a rule is needed for the behaviour of a body, and at an infinite curvature the contact force is infinite;
formulas cannot describe either. Where the curvature jumps, so does the contact force, and a motion must be computed up
to the joint and from there on. A cusp is allowed: the tangent reverses its direction, and a motion ends there. At
places where the argument of an absolute value changes its sign, or the base of a root has a zero of even order, the
tangents and curvatures on both sides are compared.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import combinations, pairwise
from math import isfinite

import sympy as sp

from gqm_sym.budgets import check_budget
from gqm_sym.declare import Curve
from gqm_sym.derivation.algebra.algebra import Algebra
from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.algebra.factors import factors
from gqm_sym.derivation.algebra.generators import Angle, OverBudget
from gqm_sym.derivation.algebra.rewrite import product, spell_factors
from gqm_sym.derivation.algebra.signs import Signs
from gqm_sym.errors import DeclarationError
from gqm_sym.parameters import Value, tried_values

# The number of places of a range that are examined, and their distance if the range has no ends.
PLACES = 120
STEP = sp.Rational(37, 100)
# The distances of places on both sides of a place, relative to its size, and the number of digits with which they are
# distinguished.
NEAR, NEARER, DIGITS = sp.Float("1e-12", 90), sp.Float("1e-24", 90), 90
# Unit tangents that differ by less than this are equal; curvatures that grow by more than this factor towards a place
# are infinite there.
MAX_TANGENT_DIFFERENCE, MAX_CURVATURE_GROWTH = 1e-3, 10
# At a cusp a derivative is at most this share of its values nearby.
MAX_DERIVATIVE = 1e-10

Function = Callable[[float], float]
Vector = tuple[sp.Expr, ...]


def check_corners(curve: Curve, defaults: Mapping[str, Value | None], *, with_radius: bool = False) -> None:
    """Refuse a curve whose tangent or curvature jumps inside the domain, or whose curvature is infinite there; if a
    body rolls on it ``with_radius``, a curve with a cusp inside the domain too.

    Raises
    ------
    DeclarationError
        If there is such a place; the message names it for the defaults. Parameters without a default are taken to be of
        the order of 1.
    """
    lam, values = curve.parameter, tried_values(defaults)
    for zero in dict.fromkeys(_zeros(curve.point, lam)):
        check_budget()
        for low, high in _changes(_function(zero, lam, values), curve, values):
            _compare(curve, values, zero, _root(zero.xreplace(values), lam, low, high))
    if with_radius:
        check_cusps(curve, values)


def check_cusps(curve: Curve, values: Mapping[sp.Symbol, sp.Expr]) -> None:
    """Refuse a curve with a cusp inside the domain, where the path of the centre of a body with a radius jumps.

    Raises
    ------
    DeclarationError
        If both derivatives vanish where one of them changes its sign.
    """
    from scipy.optimize import brentq

    lam = curve.parameter
    first = [_function(differentiate(form, lam), lam, values) for form in (curve.x, curve.z)]
    for one, other in (first, first[::-1]):
        for low, high in _changes(one, curve, values):
            check_budget()
            try:
                at = brentq(one, low, high, disp=False)  # at a jump the search does not converge
                beside = abs(other(at))
            except (ArithmeticError, TypeError, ValueError):
                continue
            if beside <= MAX_DERIVATIVE * max(abs(other(low)), abs(other(high))):
                place = f"{lam.name} = {round(at, 9) + 0.0:.6g}"
                raise DeclarationError(
                    f"rolling: the {curve.kind} curve has a cusp at {place}, where the centre of a body with "
                    "a radius has no path beside it; end the domain there, or leave the radius out"
                )


def check_powers(
    forms: Iterable[tuple[str, sp.Expr]],
    curve: Curve,
    defaults: Mapping[str, Value | None],
) -> None:
    """Refuse u**n with an exponent that is given at run time if u is negative somewhere, because it may not be real
    there.

    Raises
    ------
    DeclarationError
        If there is such a power; the message names the form, the power and a remedy.
    """
    lam, values = curve.parameter, tried_values(defaults)
    for label, form in forms:
        for power in sorted(form.atoms(sp.Pow), key=sp.default_sort_key):
            base, exponent = power.args
            if exponent.is_number or lam in exponent.free_symbols or lam not in base.free_symbols:
                continue
            check_budget()
            negative = [at for at, value in _sampled(_function(base, lam, values), curve, values) if value < 0.0]
            if negative:
                given = ", ".join(sorted(symbol.name for symbol in exponent.free_symbols))
                raise DeclarationError(
                    f"{label}: {power}: {base} is negative at {lam.name} = {negative[0]:.3g}, where the power is real "
                    f"for some values of {given} only; write the exponent as a number, or give a domain on which "
                    f"{base} is positive"
                )


def without_known_absolute_values(form: sp.Expr, signs: Signs) -> sp.Expr:
    """Replace |u| by u or -u if u has one sign on the domain."""
    known = {bar: signs.sign(bar.args[0]) for bar in form.atoms(sp.Abs)}
    return form.xreplace({bar: sign * bar.args[0] for bar, sign in known.items() if sign is not None})


def _zeros(forms: Iterable[sp.Expr], lam: sp.Symbol) -> Iterator[sp.Expr]:
    """Yield the expressions that may change sign inside an absolute value, or in even powers under a root."""
    for form in forms:
        for node in sorted(form.atoms(sp.Abs, sp.Pow), key=sp.default_sort_key):
            inner = node.args[0]
            if lam not in inner.free_symbols:
                continue
            if isinstance(node, sp.Abs):
                yield inner
            elif not node.exp.is_Integer:
                yield from _even_factors(inner, lam)


def _even_factors(form: sp.Expr, lam: sp.Symbol) -> list[sp.Expr]:
    halved: frozenset[Angle] = frozenset()
    try:
        while True:
            algebra = Algebra((form,), lam, halved)
            fraction = algebra.fraction(form)
            uneven = algebra.uneven((fraction.top,)) - halved
            if not uneven:
                break
            halved |= uneven
        found = [(factor, 1) for factor, power in factors(algebra, fraction.top)[1] if power % 2 == 0]
        written = [product([power]) for power in spell_factors(algebra, found)[1]]
    except OverBudget:
        return []
    return [factor for factor in written if lam in factor.free_symbols]


def _function(form: sp.Expr, lam: sp.Symbol, values: Mapping[sp.Symbol, sp.Expr]) -> Function:
    return sp.lambdify(lam, form.xreplace(values), "math")  # type: ignore[no-any-return]


def _sampled(function: Function, curve: Curve, values: Mapping[sp.Symbol, sp.Expr]) -> Iterator[tuple[float, float]]:
    """Return places inside the domain and the values there, as far as these are real numbers."""
    low, high = (None if end is None else end.xreplace(values) for end in curve.domain)
    if low is not None and high is not None:
        places = [low + (high - low) * sp.Rational(2 * k + 1, 2 * PLACES) for k in range(PLACES)]
    elif low is not None:
        places = [low + STEP * (k + sp.Rational(1, 7)) for k in range(PLACES)]
    elif high is not None:
        places = [high - STEP * (k + sp.Rational(1, 7)) for k in range(PLACES)]
    else:
        places = [STEP * (k + sp.Rational(1, 7)) for k in range(-PLACES // 2, PLACES // 2)]
    for place in sorted(map(float, places)):
        try:
            value = float(function(place))
        except (ArithmeticError, TypeError, ValueError):
            continue
        if isfinite(value):
            yield place, value


def _changes(function: Function, curve: Curve, values: Mapping[sp.Symbol, sp.Expr]) -> Iterator[tuple[float, float]]:
    """Return pairs of places between which a function changes its sign."""
    pairs = pairwise(_sampled(function, curve, values))
    found = [(low, high) for (low, before), (high, after) in pairs if before * after < 0.0]
    # Places near 0 come first, because readers look there.
    yield from sorted(found, key=lambda ends: abs(ends[0] + ends[1]))


def _root(form: sp.Expr, lam: sp.Symbol, low: float, high: float) -> sp.Expr:
    """Halve an interval until it is a single place, to many digits."""
    a, b = sp.Float(low, DIGITS), sp.Float(high, DIGITS)
    rising = form.xreplace({lam: b}).evalf(DIGITS) > 0
    while abs(b - a) > sp.Float("1e-80", DIGITS):
        check_budget()
        middle = (a + b) / 2
        value = form.xreplace({lam: middle}).evalf(DIGITS)
        if not value.is_real or value == 0:
            return middle
        a, b = (a, middle) if bool(value > 0) == bool(rising) else (middle, b)
    return (a + b) / 2


def _compare(curve: Curve, values: Mapping[sp.Symbol, sp.Expr], zero: sp.Expr, at: sp.Expr) -> None:
    """Compare the tangents on both sides of a place, and the curvatures at decreasing distances from it."""
    lam = curve.parameter
    first = [differentiate(form, lam) for form in curve.point]
    forms = [form.xreplace(values) for form in (*first, *(differentiate(form, lam) for form in first))]
    size = 1 + abs(at)
    sides = [_tangent_and_curvature(forms, lam, at + sign * step * size) for sign in (-1, 1) for step in (NEAR, NEARER)]
    if None in sides:
        return
    (_, left_far), (left, left_near), (_, right_far), (right, right_near) = (side for side in sides if side)
    gap = sum(abs(a - b) for a, b in zip(left, right, strict=True))
    turned = sum(abs(a + b) for a, b in zip(left, right, strict=True))
    if turned < MAX_TANGENT_DIFFERENCE:
        return
    shown = 0.0 if abs(at) < NEARER else float(at)
    place = f"at {lam.name} = {shown:.6g}, where {zero} changes its sign"
    if gap > MAX_TANGENT_DIFFERENCE:
        degrees = float(sp.acos(sum(a * b for a, b in zip(left, right, strict=True))) * 180 / sp.pi)
        raise DeclarationError(
            f"{curve.kind} curve: the tangent turns by {degrees:.3g} degrees {place}: a corner, for which formulas "
            "have no rule; end the domain there, round it off, as sqrt(x**2 + r**2) for abs(x), or stitch planes by "
            "Curve.sampled(points, kind='linear'), at whose corners the speed is kept"
        )
    near, far = (max(map(abs, pair)) for pair in ((*left_near, *right_near), (*left_far, *right_far)))
    if near > MAX_CURVATURE_GROWTH * far and near > 1:
        raise DeclarationError(
            f"{curve.kind} curve: the curvature, and with it the contact force, is infinite {place}, though the "
            "tangent is continuous; end the domain there, or round it off, as (x**2 + r**2)**p for (x**2)**p"
        )

    jump, before = (
        max(abs(a - b) for a, b in zip(*pair, strict=True)) for pair in ((left_near, right_near), (left_far, right_far))
    )
    if jump > MAX_TANGENT_DIFFERENCE and jump > before / 2:
        if curve.in_space:
            raise DeclarationError(f"space curve: the curvature jumps {place}; end the domain there, or round it off")
        raise DeclarationError(
            f"{curve.kind} curve: the curvature jumps {place}, from {float(left_near[0]):.4g} to "
            f"{float(right_near[0]):.4g}; join the two sides, each with its domain, by Curve.piecewise, which knows of "
            "joints"
        )


def _tangent_and_curvature(forms: list[sp.Expr], lam: sp.Symbol, place: sp.Expr) -> tuple[Vector, Vector] | None:
    """Return the unit tangent and the curvature for each pair of coordinates; None if they are not real numbers."""
    values = [form.xreplace({lam: place}).evalf(DIGITS) for form in forms]
    if not all(value.is_real and value.is_finite for value in values):
        return None
    first, second = values[: len(values) // 2], values[len(values) // 2 :]
    speed = sp.sqrt(sum(part**2 for part in first)).evalf(DIGITS)
    if speed == 0:
        return None
    pairs = combinations(range(len(first)), 2)
    bends = tuple((first[i] * second[j] - first[j] * second[i]) / speed**3 for i, j in pairs)
    return tuple(part / speed for part in first), bends
