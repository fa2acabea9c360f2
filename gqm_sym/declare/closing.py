"""The period of a closed curve, which is found from its formulas if they determine it, and verified if it is given."""

from collections.abc import Iterator, Mapping
from itertools import product
from math import dist, hypot, isfinite

import sympy as sp

from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import common_measure
from gqm_sym.parameters import Value, tried_values

Point = tuple[sp.Expr, ...]

# Places at which a period is verified, and the largest difference of coordinates as a share of their size.
PLACES = (-2.71, -1.3, -0.37, 0.113, 0.59, 1.17, 1.93, 2.83)
MAX_DIFFERENCE = 1e-6
# Fractions of a period that may be a period themselves.
PRIMES = (2, 3, 5, 7, 11, 13)
MOST_TIMES = 10
# Functions that are real and finite for every real argument.
_EVERYWHERE = (sp.sin, sp.cos, sp.exp, sp.sinh, sp.cosh, sp.tanh, sp.atan, sp.asinh, sp.Abs)
_WAVES = (sp.sin, sp.cos)


def found_period(point: Point, lam: sp.Symbol) -> sp.Expr | None:
    """Return the smallest period of a curve whose coordinates consist of sines and cosines of commensurate rates.

    The result is None if there is no period, or if it is not certain that the curve is real and finite everywhere.
    """
    rates: set[sp.Expr] = set()
    if not all(_of_waves(form, lam, rates) for form in point) or not rates:
        return None
    first = min(rates, key=sp.default_sort_key)
    ratios = [sp.cancel(rate / first) for rate in rates]
    if not all(ratio.is_Rational for ratio in ratios):
        return None
    period = 2 * sp.pi / sp.Abs(first * common_measure(ratios))
    unset = sorted(symbol.name for symbol in set().union(*(form.free_symbols for form in point)) - {lam})
    for share in (1, sp.Rational(1, 3)):  # some forms are real for small values only: sqrt(1 - ecc**2)
        values = {symbol: value * share for symbol, value in tried_values(dict.fromkeys(unset)).items()}
        gap = _gap(point, lam, period, values)
        if gap is not None:
            return _least_share(point, lam, period, values) if gap <= MAX_DIFFERENCE else None
    return None


def _least_share(point: Point, lam: sp.Symbol, period: sp.Expr, values: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr | None:
    """Return the smallest fraction of a period after which the curve repeats; None if its point does not move."""
    for prime in PRIMES:
        for _ in range(MOST_TIMES):
            gap = _gap(point, lam, period / prime, values)
            if gap is None or gap > MAX_DIFFERENCE:
                break
            period /= prime
        else:
            return None
    return period


def check_period(
    kind: str, point: Point, lam: sp.Symbol, period: sp.Expr, defaults: Mapping[str, Value | None]
) -> None:
    """Refuse a period after which the curve does not repeat.

    Raises
    ------
    DeclarationError
        If it does not; the message gives the distance, and a period if one is found.
    """
    unset = {sp.Symbol(name, real=True) for name, value in defaults.items() if value is None}
    inside = [argument for form in point for node in form.atoms(sp.Function, sp.Pow) for argument in node.args]
    inner_symbols = {symbol for argument in inside if lam in argument.free_symbols for symbol in argument.free_symbols}
    if unset & (inner_symbols | period.free_symbols):
        return  # this depends on the values at run time
    values = tried_values(defaults)
    gap = _gap(point, lam, period, values)
    if gap is None or gap <= MAX_DIFFERENCE:
        return
    right = found_period(tuple(form.xreplace(values) for form in point), lam)
    remedy = "leave it out: the curve does not close" if right is None else f"give {right}"
    raise DeclarationError(
        f"{kind}: period: after {period} of {lam.name} the curve is {gap:.3g} of its size away from its start; {remedy}"
    )


def _of_waves(form: sp.Expr, lam: sp.Symbol, rates: set[sp.Expr]) -> bool:
    """Return whether a form depends on λ by sines and cosines alone, and is real and finite; add their rates to
    ``rates``.
    """
    if lam not in form.free_symbols:
        return True
    if isinstance(form, _WAVES):
        rate = sp.expand(form.args[0]).coeff(lam)
        rates.add(rate)
        return not sp.expand(form.args[0] - rate * lam).has(lam) and not rate.has(lam)
    if isinstance(form, sp.Pow):
        base, power = form.args
        tame = power.is_Integer and power > 0
        known = _positive(base) if power.is_negative else power.is_Rational and _not_negative(base)
        return bool(tame or known) and _of_waves(base, lam, rates)
    if isinstance(form, (sp.Add, sp.Mul, *_EVERYWHERE)):
        return all(_of_waves(part, lam, rates) for part in form.args)
    return False


def _positive(form: sp.Expr) -> bool:
    terms = sp.Add.make_args(form)
    return all(map(_not_negative, terms)) and any(term.is_number and term.is_positive for term in terms)


def _not_negative(form: sp.Expr) -> bool:
    if form.is_Add or form.is_Mul:
        return all(map(_not_negative, form.args))
    return bool(form.is_nonnegative)


def _gap(point: Point, lam: sp.Symbol, period: sp.Expr, values: Mapping[sp.Symbol, sp.Expr]) -> float | None:
    """Return the largest distance between points of a curve one period apart, as a share of its size; None without
    numbers.
    """
    length = float(period.xreplace(dict(values)))
    functions = [sp.lambdify(lam, form.xreplace(dict(values)), "math") for form in point]

    def at(place: float) -> tuple[float, ...] | None:
        try:
            found = tuple(float(function(place)) for function in functions)
        except (ArithmeticError, TypeError, ValueError):
            return None
        return found if all(map(isfinite, found)) else None

    def pairs() -> Iterator[tuple[tuple[float, ...], tuple[float, ...]]]:
        for share, turns in product(PLACES, (0, 1)):
            here, there = at(share * length / 3 + turns * length), at(share * length / 3 + (turns + 1) * length)
            if here is not None and there is not None:
                yield here, there

    found = list(pairs())
    if not found:
        return None
    size = max(hypot(*there) + hypot(*here) for here, there in found)
    return max(dist(a, b) for a, b in found) / size if size else 0.0
