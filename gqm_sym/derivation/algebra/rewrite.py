"""The policy of simplification: which of several equal forms is used.

A short form must also be accurate: products stay products, so that a form that vanishes is accurate near its zero, and
a sum of squares is multiplied out only if no terms of different sign appear. Expressions beyond a fixed size are left
as they are.
"""

from collections.abc import Iterable
from itertools import combinations
from math import prod

import sympy as sp
from sympy.simplify.fu import TR8

from gqm_sym.budgets import check_budget
from gqm_sym.derivation.algebra.algebra import Algebra, Fraction, Polynomial
from gqm_sym.derivation.algebra.factors import factors
from gqm_sym.derivation.algebra.normal_form import MAX_SPELLED, in_multiple_angles, minus_signs, shortest, spell
from gqm_sym.derivation.algebra.signs import Signs
from gqm_sym.errors import DerivationError

# An expression with more operations than this is left as it is.
MAX_TIDIED = 400

# The largest number of terms for which a product of sums is multiplied out.
MAX_EXPANDED = 16

# The largest number of factors that are tried together as one multiple angle.
MAX_MERGED = 5

# Waves up to which products of sines and cosines are written as sums.
MAX_WAVES = 8
Power = tuple[sp.Expr, int]
"""A factor and its exponent."""


def tidy(expression: sp.Expr) -> sp.Expr:
    """Return the expression, or itself with common factors taken out if that is shorter."""
    if sp.count_ops(expression) > MAX_TIDIED:
        return expression
    return shortest([expression, sp.factor_terms(expression)])


def without_waves(expression: sp.Expr) -> sp.Expr:
    """Replace sin(u)**2 + cos(u)**2 by 1 in every sum, also if the two squares have common factors.

    Such sums are frequent in forces along polar curves, because x**2 + z**2 is r**2*cos(u)**2 + r**2*sin(u)**2. Each
    step makes a sum shorter by one term, and nothing else is rewritten.
    """
    known: dict[sp.Basic, sp.Basic] = {}

    def visit(node: sp.Basic) -> sp.Basic:
        if not (node.args and node.has(sp.sin)):
            return node
        if node not in known:
            check_budget()
            args = [visit(part) for part in node.args]
            if isinstance(node, sp.Add):
                known[node] = _without_unit(args)
            else:
                known[node] = node if list(node.args) == args else node.func(*args)
        return known[node]

    return visit(expression)


def _without_unit(terms: list[sp.Expr]) -> sp.Expr:
    """Add terms, and replace each pair w*sin(u)**2 + w*cos(u)**2 by w."""
    left = dict.fromkeys(terms)
    for term in terms:
        for base, power in term.as_powers_dict().items():
            if not (isinstance(base, sp.sin) and power.is_Integer and power >= 2) or term not in left:
                continue
            shared = term / base**2
            partner = shared * sp.cos(base.args[0]) ** 2
            if partner in left and partner != term:
                del left[term], left[partner]
                return _without_unit([*left, shared])
    return sp.Add(*terms)


def multiplied_out(expression: sp.Expr) -> sp.Expr:
    """Multiply out sums of products if squares of sines and cosines then add up to a shorter form."""
    terms = sum(prod(len(f.args) for f in sp.Mul.make_args(part) if f.is_Add) for part in sp.Add.make_args(expression))
    if terms > MAX_EXPANDED * MAX_EXPANDED or sp.count_ops(expression) > MAX_TIDIED:
        return expression
    return shortest([expression, tidy(without_waves(sp.expand_mul(expression)))])


def in_single_waves(expression: sp.Expr, place: sp.Symbol) -> sp.Expr:
    """Write products of sines and cosines, whose arguments are linear in a place, as sums of such waves.

    The second divided difference of a product has three terms, which may cancel, and that of a wave has one. Forms of
    other functions of the place, or of too many waves, are left as they are.
    """

    def is_wave(factor: sp.Expr) -> bool:
        base, power = factor.as_base_exp()
        linear = isinstance(base, (sp.sin, sp.cos)) and not base.args[0].diff(place).has(place)
        return bool(linear and power.is_Integer and power.is_positive)

    if sp.count_ops(expression) > MAX_TIDIED:
        return expression
    waves = []
    for term in sp.Add.make_args(sp.expand_mul(expression)):
        fixed, moving = term.as_independent(place, as_Add=False)
        if moving != 1 and not all(map(is_wave, sp.Mul.make_args(moving))):
            return expression
        waves += sp.Add.make_args(sp.expand_mul(fixed * TR8(moving)))
    return sp.Add(*waves) if len(waves) <= MAX_WAVES else expression


def without_poles(expression: sp.Expr) -> sp.Expr:
    """Multiply out a product of sums if that cancels a denominator: (b/s - a)*s is b - a*s.

    Nothing else is multiplied out, because (a - b)*(a + b) is more accurate than a**2 - b**2.
    """
    terms = prod(len(factor.args) for factor in expression.args if factor.is_Add)
    if not expression.is_Mul or terms > MAX_EXPANDED:
        return expression
    expanded = sp.expand_mul(expression)
    if _poles(expanded) < _poles(expression):
        return shortest([expression, expanded])
    return expression


def _poles(expression: sp.Expr) -> int:
    return sum(1 for power in expression.atoms(sp.Pow) if power.exp.is_negative)


def check_real(expression: sp.Basic, *, where: str) -> None:
    """Refuse a closed form that is not real and finite."""
    for bad in (sp.nan, sp.zoo, sp.oo, -sp.oo, sp.I):
        if expression.has(bad):
            raise DerivationError(
                f"{where}: the closed form {expression} contains {bad}; "
                "declare a curve and a potential that are real and finite"
            )


def product(powers: Iterable[Power]) -> sp.Expr:
    """Multiply factors with their powers; u**p/u becomes u**(p - 1), and -(a - b) becomes b - a."""
    listed = [(base, exponent) for base, exponent in powers if base != 1]
    number = sp.Mul(*(base**exponent for base, exponent in listed if base.is_Rational))
    remainder = [(base, exponent) for base, exponent in listed if not base.is_Rational]
    if number.is_negative:
        for place, (base, exponent) in enumerate(remainder):
            odd = exponent % 2 == 1
            if base.is_Add and odd and minus_signs(-base) <= minus_signs(base):
                remainder[place] = (-base, exponent)
                number = -number
                break
    result = sp.Mul(number, *(base**exponent for base, exponent in remainder))
    if any(not power.exp.is_number for power in result.atoms(sp.Pow)):
        return sp.powsimp(result, combine="exp")
    return result


def spell_quotient(algebra: Algebra, top: Polynomial, bottom: Polynomial) -> list[Power]:
    """Write a quotient as factors, or with its numerator as one sum if that is shorter."""
    if not top:
        return [(sp.S.Zero, 1)]
    factored = spell_product(algebra, top, bottom)
    if len(top) > MAX_SPELLED:
        return factored
    number, form = _content(spell(algebra, top))
    whole = [(number, 1), (form, 1), *spell_product(algebra, algebra.one, bottom)]
    texts = [product(factored), product(whole)]
    return factored if shortest(texts) == texts[0] else whole


def spell_ratio(algebra: Algebra, top: Polynomial, bottom: Polynomial) -> list[Power]:
    """Write a quotient that may have common factors."""
    fraction = algebra.reduced(Fraction(top, bottom))
    return spell_quotient(algebra, fraction.top, fraction.bottom)


def spell_product(algebra: Algebra, top: Polynomial, bottom: Polynomial) -> list[Power]:
    """Write a quotient as factors with powers, its number first."""
    content_top, above = factors(algebra, top)
    content_bottom, under = factors(algebra, bottom)
    number, written = spell_factors(algebra, [*above, *((factor, -power) for factor, power in under)])
    return [(number * sp.Rational(content_top, content_bottom), 1), *written]


def spell_factors(algebra: Algebra, found: Iterable[tuple[Polynomial, int]]) -> tuple[sp.Rational, list[Power]]:
    """Write factors one by one, joining those that together are one sine or cosine.

    The function returns a number and the expressions with their powers.
    """
    by_power: dict[int, list[Polynomial]] = {}
    for factor, power in found:
        by_power.setdefault(power, []).append(factor)
    number = sp.S.One
    written: list[Power] = []
    for power, group in by_power.items():
        waves = [factor for factor in group if _is_wave(algebra, factor)]
        for factor in group:
            if not _is_wave(algebra, factor):
                size, form = _content(spell(algebra, factor))
                number *= size**power
                written.append((form, power))
        while waves:
            size, form, used = _merged(algebra, waves)
            number *= size**power
            written.append((form, power))
            waves = [factor for place, factor in enumerate(waves) if place not in used]
    return number, written


def _is_wave(algebra: Algebra, polynomial: Polynomial) -> bool:
    """Return whether a polynomial consists of numbers and the sine and cosine of one pair."""
    touched = {place for monomial in polynomial for place, power in enumerate(monomial) if power}
    return any(touched <= {pair.sine, pair.cosine} for pair in algebra.pairs)


def _merged(algebra: Algebra, waves: list[Polynomial]) -> tuple[sp.Rational, sp.Expr, tuple[int, ...]]:
    """Find the largest subset, with the first factor, whose product is a single sine or cosine.

    The function returns the product's numerical factor, the function, and the indices of the factors used.
    """
    for size in range(min(len(waves), MAX_MERGED), 1, -1):
        for others in combinations(range(1, len(waves)), size - 1):
            whole = waves[0]
            for place in others:
                whole = whole * waves[place]
            if not _is_wave(algebra, whole):
                continue
            number, wave = in_multiple_angles(algebra, whole).as_coeff_Mul()
            if isinstance(wave, sp.sin | sp.cos | sp.sinh | sp.cosh):
                return number, wave, (0, *others)
    return *_content(spell(algebra, waves[0])), (0,)


def _content(form: sp.Expr) -> tuple[sp.Rational, sp.Expr]:
    """Return the numerical factor and the rest of a form, so that signs and numbers are in one place of a product."""
    content, remainder = form.primitive() if form.is_Add else form.as_coeff_Mul()
    if remainder.is_Add and minus_signs(-remainder) < minus_signs(remainder):
        return -content, -remainder
    return content, remainder


def magnitudes(signs: Signs, powers: Iterable[Power]) -> list[Power]:
    """Return the factors of an absolute value, without bars for those whose sign is known."""
    result: list[Power] = []
    for factor, power in powers:
        sign = known_sign(signs, factor) if power % 2 else 1
        result.append((sp.Abs(factor) if sign is None else sign * factor, power))
    return result


def direction(signs: Signs, powers: Iterable[Power]) -> list[Power]:
    """Return the factors of the sign of a product: numbers 1 and -1, and quotients f/|f|."""
    result: list[Power] = []
    for factor, power in powers:
        if power % 2:
            sign = known_sign(signs, factor)
            if sign is None:
                result += [(factor, 1), (sp.Abs(factor), -1)]
            else:
                result.append((sp.Integer(sign), 1))
    return result


def known_sign(signs: Signs, factor: sp.Expr) -> int | None:
    """Return the sign of a factor, with parameters taken as positive if that is allowed."""
    signs.assume(factor)
    return signs.sign(factor)


def combine_absolute_values(expression: sp.Expr) -> sp.Expr:
    """Rewrite u**2/|u| as |u| in a product."""
    powers = expression.as_powers_dict()
    for bar in [base for base in powers if isinstance(base, sp.Abs)]:
        inner = bar.args[0]
        if inner in powers and powers[inner].is_even:
            powers[bar] += powers.pop(inner)
    return sp.Mul(*(base**power for base, power in powers.items()))


def magnitude(form: sp.Expr) -> sp.Expr:
    """Return the absolute value of a real product.

    SymPy does not know that a root in it is real, and would write its absolute value by its complex conjugate.
    """
    return sp.Mul(*(factor if _is_even_root(factor) else sp.Abs(factor) for factor in sp.Mul.make_args(form)))


def _is_even_root(factor: sp.Expr) -> bool:
    return bool(factor.is_Pow and factor.exp.is_Rational and factor.exp.q % 2 == 0)


def is_safe(signs: Signs, expression: sp.Expr) -> bool:
    """Return whether no terms of a sum can cancel."""
    return not expression.is_Add or signs.sign(expression) is not None
