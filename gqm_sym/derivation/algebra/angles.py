"""Sines and cosines of multiples of a place, without the rounding of the multiple."""

from collections.abc import Iterable, Sequence

from sympy import Expr, Function, Rational, S, Symbol, cos, expand, sin

from gqm_sym.derivation.algebra.bottom_up import from_the_leaves_up


def of_sum(call: Expr, points: Sequence[Symbol], sum_of: tuple[Expr, ...]) -> Expr:
    """Rewrite a function of a rate times the mean of some points by the numbers whose sum its argument is.

    Other functions are returned unchanged. Multiplied by the rate of a wave, the rounding of a place far from zero is
    much more than that of the sine, and all nodes of an orbit have it in common. So is the rounding of a rate that is
    no double, as 2/3, which is therefore added to the place if ``sum_of`` has the place as two numbers and an offset.
    """
    argument = call.args[0]
    rates = {argument.diff(point) for point in points}
    if len(rates) > 1 or any(rate.has(point) for rate in rates for point in points):
        return call
    rate = rates.pop()
    phase = expand(argument - rate * sum(points))
    if rate.is_Rational and not is_exact(rate) and len(sum_of) == 3:
        place, rest, offset = sum_of
        lacking = 1 - Rational(rate.p / rate.q) / rate
        sum_of = (place, rest + lacking * (place + offset), offset)
    return Function(f"{call.func.__name__}_of_sum")(phase, len(points) * rate, *sum_of)


def with_exact_angles(forms: Iterable[Expr], place: Symbol) -> tuple[Expr, ...]:
    """Let sines and cosines of multiples of a place, with a phase or none, be those of the exact multiple.

    The rounding of the multiple is up to half an ulp of the angle, which is more than that of the sine.
    """

    def exact(call: Expr) -> Expr:
        if not isinstance(call, sin | cos) or not call.has(place):
            return call
        rate = call.args[0].diff(place)
        phase = expand(call.args[0] - rate * place)
        known = is_exact(rate) or (rate.is_Symbol and rate != place)
        if phase.has(place) or not known or (phase == 0 and is_power_of_two(rate)):
            return call
        return of_sum(call, (place,), (place, S.Zero, S.Zero))

    return from_the_leaves_up(forms, exact)


def is_exact(number: Expr) -> bool:
    """Return whether a number is a double, because its denominator is a power of two."""
    return isinstance(number, Rational) and is_power_of_two(S(number.q))


def is_power_of_two(number: Expr) -> bool:
    """Return whether a number is a power of two, multiplication by which is exact."""
    return isinstance(number, Rational) and all(part & (part - 1) == 0 for part in (abs(number.p), number.q))
