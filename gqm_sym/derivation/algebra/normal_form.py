"""Polynomials written out as sums, in the shortest of several ways.

The forms tried are powers of sine and cosine, cosines or sines alone, multiple angles, sums of different angles, and
the same again for twice the angle.
"""

from collections.abc import Iterable
from fractions import Fraction
from math import gcd, lcm, prod

import sympy as sp

from gqm_sym.derivation.algebra.algebra import Algebra, Polynomial
from gqm_sym.derivation.algebra.generators import Pair, waves

# Longer sums are written in powers only: no other form would make them readable.
MAX_SPELLED = 24

# The largest number of terms, and of factors in a term, for which sines and cosines of different angles are combined.
MAX_COMBINED_TERMS = 12
MAX_COMBINED_FACTORS = 4

# The largest size of the terms of a form, in units of the smallest of all forms tried.
MAX_CANCELLATION = 8.0
Monomial = tuple[int, ...]
Terms = dict[sp.Expr, dict[Monomial, Fraction]]
"""For each product of sines, cosines and exponentials, the polynomial that multiplies it."""


def shortest(candidates: Iterable[sp.Expr]) -> sp.Expr:
    """Return the form with the fewest operations; ties are broken by SymPy's canonical order.

    A minus sign counts three times: 1 + s² keeps digits that 2 - c² may lose.
    """
    return min(
        candidates,
        key=lambda form: (sp.count_ops(form) + 2 * minus_signs(form), sp.default_sort_key(form)),
    )


def minus_signs(expression: sp.Expr) -> int:
    """Return the number of terms that are subtracted in sums."""
    return sum(1 for total in expression.atoms(sp.Add) for term in total.args if term.could_extract_minus_sign())


def spell(algebra: Algebra, polynomial: Polynomial) -> sp.Expr:
    """Write a polynomial as a sum."""
    if polynomial not in algebra.texts:
        algebra.texts[polynomial] = _spell(algebra, polynomial)
    return algebra.texts[polynomial]


def _spell(algebra: Algebra, polynomial: Polynomial) -> sp.Expr:
    if len(polynomial) > MAX_SPELLED or not algebra.pairs:
        return _in_powers(algebra, polynomial)
    exponential = _as_exponential(algebra, polynomial)
    if exponential is not None:
        return exponential
    candidates = [
        _in_powers(algebra, polynomial),
        *(_in_powers(algebra, _one_sided(algebra, polynomial, keep)) for keep in (True, False)),
        in_multiple_angles(algebra, polynomial),
    ]
    if _may_combine(algebra, polynomial):
        candidates.append(_in_combined_angles(algebra, polynomial))
    for pair in algebra.pairs:
        doubled = algebra.doubled(polynomial, pair)
        if doubled is not None:
            view, form, divisor = doubled
            content, form = form.primitive()
            candidates.append(spell(view, form) * sp.Rational(int(content), divisor))
    return shortest(_without_cancellation(candidates))


def _without_cancellation(candidates: list[sp.Expr]) -> list[sp.Expr]:
    """Return the forms of one sum without those whose terms are so much larger than those of another that digits are
    lost: cos(7u) has the size 1, and in powers of cos(u) its terms have sizes up to 112.
    """
    sizes = [_size(form) for form in candidates]
    return [form for form, size in zip(candidates, sizes, strict=True) if size <= MAX_CANCELLATION * min(sizes)]


def _size(form: sp.Expr) -> float:
    """Return the size of the terms of a form in which all functions and symbols have the size 1."""
    if form.is_Number:
        return abs(float(form))
    if form.is_Add:
        return sum(_size(term) for term in form.args)
    if form.is_Mul:
        return prod(_size(factor) for factor in form.args)
    if form.is_Pow and form.exp.is_Integer and form.exp > 0:
        return float(_size(form.base) ** int(form.exp))
    return 1.0


def _in_powers(algebra: Algebra, polynomial: Polynomial) -> sp.Expr:
    """Write a polynomial in powers of the generators, collected by powers of sines, cosines and exponentials."""
    paired = {place for pair in algebra.pairs for place in (pair.sine, pair.cosine)}
    leads = [place in paired or isinstance(name, sp.exp) for place, name in enumerate(algebra.names)]
    terms: Terms = {}
    for monomial, coefficient in polynomial.terms():
        split = [(power, 0) if lead else (0, power) for power, lead in zip(monomial, leads, strict=True)]
        wave, remainder = zip(*split, strict=True)
        _add(terms, _monomial(algebra, wave), remainder, Fraction(int(coefficient)))
    return _sum(algebra, terms)


def _monomial(algebra: Algebra, powers: Iterable[int]) -> sp.Expr:
    return sp.Mul(*(name**power for name, power in zip(algebra.names, powers, strict=True) if power))


def _add(terms: Terms, wave: sp.Expr, monomial: Monomial, size: Fraction) -> None:
    polynomial = terms.setdefault(wave, {})
    polynomial[monomial] = polynomial.get(monomial, Fraction(0)) + size


def _sum(algebra: Algebra, terms: Terms) -> sp.Expr:
    """Add up products of functions and polynomials, with common factors taken out of the polynomials."""
    parts = []
    for wave, polynomial in terms.items():
        kept = {monomial: size for monomial, size in polynomial.items() if size}
        if not kept:
            continue
        sizes = kept.values()
        content = Fraction(gcd(*(size.numerator for size in sizes)), lcm(*(size.denominator for size in sizes)))
        if all(size < 0 for size in sizes):
            content = -content
        common = tuple(min(powers) for powers in zip(*kept, strict=True))
        remainder = sp.Add(
            *(
                _rational(size / content)
                * _monomial(algebra, (power - low for power, low in zip(monomial, common, strict=True)))
                for monomial, size in kept.items()
            )
        )
        number = _rational(content)
        if wave == 1 and not any(common):
            # In a sum with other terms, 2*(a + b) is written as 2*a + 2*b.
            parts += [number * term for term in sp.Add.make_args(remainder)]
        else:
            # All factors are multiplied at once, because SymPy distributes a single number over a sum.
            parts.append(sp.Mul(number, _monomial(algebra, common), remainder, wave))
    return sp.Add(*parts)


def _rational(number: Fraction) -> sp.Rational:
    return sp.Rational(number.numerator, number.denominator)


def _as_exponential(algebra: Algebra, polynomial: Polynomial) -> sp.Expr | None:
    """Write ±(cosh u ± sinh u) as ±exp(±u), in which nothing cancels."""
    for pair in algebra.pairs:
        if pair.sign > 0:
            continue
        s, c = algebra.generators[pair.sine], algebra.generators[pair.cosine]
        for sign in (1, -1):
            for exponent_sign in (1, -1):
                if polynomial == sign * (c + exponent_sign * s):
                    return sign * sp.exp(exponent_sign * pair.angle)
    return None


def _one_sided(algebra: Algebra, polynomial: Polynomial, keep_cosine: bool) -> Polynomial:
    """Replace even powers of the sine (or of the cosine) of every pair."""
    for pair in algebra.pairs:
        s, c = algebra.generators[pair.sine], algebra.generators[pair.cosine]
        if keep_cosine:
            polynomial = algebra.replace_squares(polynomial, pair.sine, (1 - c**2) * pair.sign)
        else:
            polynomial = algebra.replace_squares(polynomial, pair.cosine, 1 - pair.sign * s**2)
    return polynomial


def in_multiple_angles(algebra: Algebra, polynomial: Polynomial) -> sp.Expr:
    """Write a polynomial in sines and cosines of multiple angles."""
    terms: Terms = {}
    for monomial, coefficient in polynomial.terms():
        remainder = list(monomial)
        products = [(sp.S.One, Fraction(int(coefficient)))]
        for pair in algebra.pairs:
            series = _multiple_angles(pair, monomial[pair.sine], monomial[pair.cosine])
            remainder[pair.sine] = remainder[pair.cosine] = 0
            products = [(wave * other, size * factor) for wave, size in products for other, factor in series]
        for wave, size in products:
            _add(terms, wave, tuple(remainder), size)
    return _sum(algebra, terms)


def _multiple_angles(pair: Pair, sines: int, cosines: int) -> list[tuple[sp.Expr, Fraction]]:
    """Write s**sines * c**cosines as a sum of sines or cosines of multiple angles.

    With s = (w - 1/w)/(2i), c = (w + 1/w)/2 (no i for hyperbolic pairs) the product is a Laurent
    polynomial in w whose coefficients are symmetric (even power of s) or antisymmetric (odd).
    """
    row = {0: 1}
    for sign in (-1,) * sines + (1,) * cosines:
        grown: dict[int, int] = {}
        for power, size in row.items():
            grown[power + 1] = grown.get(power + 1, 0) + size
            grown[power - 1] = grown.get(power - 1, 0) + sign * size
        row = grown
    # 1/i**sines is (-1)**(sines//2), times 1/i for an odd power, which gives the sine.
    scale = Fraction((-pair.sign) ** (sines // 2), 2 ** (sines + cosines))
    odd = sines % 2
    return [
        (waves(power * pair.angle, pair.sign)[1 - odd], scale * size * (2 if power else 1))
        for power, size in sorted(row.items())
        if size and power >= odd
    ]


def _may_combine(algebra: Algebra, polynomial: Polynomial) -> bool:
    if len(algebra.pairs) < 2 or len(polynomial) > MAX_COMBINED_TERMS:
        return False
    degrees = (sum(pair.degree(monomial) for pair in algebra.pairs) for monomial in polynomial)
    return max(degrees) <= MAX_COMBINED_FACTORS


def _in_combined_angles(algebra: Algebra, polynomial: Polynomial) -> sp.Expr:
    """Write a polynomial in sines and cosines of sums of different angles, for example sin a cos b - cos a sin b as
    sin(a - b).
    """
    circular = [pair for pair in algebra.pairs if pair.sign > 0]
    terms: Terms = {}
    for monomial, coefficient in polynomial.terms():
        remainder = list(monomial)
        products = [(sp.S.Zero, False, Fraction(int(coefficient)))]
        for pair in circular:
            sines, cosines = monomial[pair.sine], monomial[pair.cosine]
            remainder[pair.sine] = remainder[pair.cosine] = 0
            for is_sine in (True,) * sines + (False,) * cosines:
                products = [new for old in products for new in _times_wave(*old, pair.angle, is_sine)]
        for angle, is_sine, size in products:
            sign, wave = waves(sp.factor_terms(sp.cancel(angle)), 1)[1 - is_sine].as_coeff_Mul()
            _add(terms, wave, tuple(remainder), int(sign) * size)
    return _sum(algebra, terms)


def _times_wave(
    angle: sp.Expr, is_sine: bool, size: Fraction, other: sp.Expr, other_is_sine: bool
) -> list[tuple[sp.Expr, bool, Fraction]]:
    """Multiply size * sin or cos(angle) by sin or cos(other)."""
    half = size / 2
    if is_sine and other_is_sine:
        return [(angle - other, False, half), (angle + other, False, -half)]
    if is_sine:
        return [(angle - other, True, half), (angle + other, True, half)]
    if other_is_sine:
        return [(angle + other, True, half), (angle - other, True, -half)]
    return [(angle - other, False, half), (angle + other, False, half)]
