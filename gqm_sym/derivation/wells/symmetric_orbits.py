"""Orbits about an axis of symmetry, whose time is an algebraic integral in a suitable coordinate (MATHS, section 3).

At the distance d from the axis, sines and cosines of rate k are rational functions of Y = tan(k d/4)**2, hyperbolic
ones of Y = tanh(k d/4)**2, and even powers of d are powers of Y = d**2. With Y = T at the turning points, y = sqrt(Y)
moves as sqrt(T)*sin(u), and V**2 = (T - Y)*D with the divided difference D = U2[Y, T], where U2 is twice the effective
potential. So the time is the integral over u of the square root of (ds/dy)**2/D, which contains no sine of u. For a
pendulum it is the elliptic integral after Landen's transformation, for which the trapezoidal rule needs no more nodes
than in the angle itself. If D/(ds/dy)**2 is linear in the square of the sine, as for the pendulum and for Duffing's
oscillator, the integral is a complete elliptic integral of the first kind, which Gauss's arithmetic-geometric mean
gives.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

import sympy as sp

from gqm_sym.derivation.algebra.difference import Differences
from gqm_sym.derivation.wells.symmetry import MAX_OPERATIONS, Symmetry, is_half_turn
from gqm_sym.derivation.wells.waves import CIRCULAR, COSINE, HYPERBOLIC, SINE, Waves, even, of_waves

# The smallest growth of U2 with a square that must remain at the turning point, as a share of the size of its terms.
MIN_GROWTH = sp.Rational(1, 4)

# The power of the cosine that judges the digits which the rounding of the width takes from the time next to a pole.
POWER_OF_POLE = sp.Rational(3, 2)

# The highest degree of a polynomial in the square of a sine that is evaluated: of higher ones the powers cancel.
MAX_DEGREE = 4


def _symbol(name: str) -> sp.Symbol:
    return sp.Symbol(f"_{name}", real=True)


# Symbols for one place of an orbit: Y, 1 - Y, T - Y, 1 - Y*T, and (1 - Y)**2 - 4*Y, which is the cosine of k d times
# (1 + Y)**2.
Y, ONE_MINUS_Y, T_MINUS_Y, ONE_MINUS_YT = (_symbol(name) for name in ("y", "one_minus_y", "t_minus_y", "one_minus_yt"))
COSINE_TERM = _symbol("cosine_term")

# Symbols for the whole orbit: half its width; T, which is Y at its ends, 1 - T, 1 - T**2, (1 - T)**2 - 4*T; the square
# of the sine there, the fourth power of the cosine of half its argument, and the cosine of twice its argument.
HALF, T, ONE_MINUS_T, ONE_MINUS_TT = (_symbol(name) for name in ("half", "t", "one_minus_t", "one_minus_tt"))
SINE_SQUARED, COSINE_FOURTH, COSINE_AT_TURN = (_symbol(n) for n in ("sine_squared", "cosine_fourth", "cosine_at_turn"))

# Symbols for a launch: the distance from the axis, and V**2 there.
OFFSET, LAUNCH = _symbol("offset"), _symbol("launch")

# Symbol for the cosine of the argument where the curve has a pole at its zero.
_COSINE_OF_POLE = _symbol("cosine_of_pole")

# Functions that are written as ratios of sines and cosines.
_RATIOS = {
    sp.tan: lambda x: sp.sin(x) / sp.cos(x),
    sp.cot: lambda x: sp.cos(x) / sp.sin(x),
}


@dataclass(frozen=True, slots=True)
class SymmetricOrbits:
    """The time of an orbit about an axis of symmetry as an integral over u, and its turning points.

    Attributes
    ----------
    time_integrand
        (dt/du)**2 in the symbols of this module and the run-time parameters. None where its terms cancel, so that
        second divided differences have more digits.
    divisor
        The divisor of ``time_integrand``. Next to a barrier it nearly vanishes at some places, and digits are lost.
        Of a pole of the curve it has `POWER_OF_POLE`.
    invariants
        The symbols of the whole orbit, each with its value as a function of HALF.
    turning_point
        As functions of OFFSET and LAUNCH: half the orbit's width; the growth of U2 per unit of the square in which it
        is written, that of a sine or of the distance; and the square of the sine at the turning point, which is above 1
        if the body passes over the barrier (0 for other squares). If the second is positive, U2 grows all the way from
        the axis to the turning point. None if U2 has a third or higher power of that square, or is not a polynomial.
    agm_arguments
        Squares of two numbers as functions of HALF: the half period is pi over their arithmetic-geometric mean. Both
        are the same if all orbits have the same period. None if the time is not a complete elliptic integral of the
        first kind.
    """

    time_integrand: sp.Expr | None
    divisor: sp.Expr
    invariants: tuple[tuple[sp.Symbol, sp.Expr], ...]
    turning_point: tuple[sp.Expr, sp.Expr, sp.Expr] | None
    agm_arguments: tuple[sp.Expr, sp.Expr] | None


def symmetric_orbits(
    potential: sp.Expr, ds: sp.Expr, lam: sp.Symbol, symmetry: Symmetry | None
) -> SymmetricOrbits | None:
    """Return the time of orbits about an axis of symmetry; None if there is no such axis or coordinate.

    Parameters
    ----------
    potential
        U2, twice the effective potential.
    ds
        ds/dlam.
    lam
        The curve's parameter.
    symmetry
        The axes of symmetry.
    """
    forms = (potential, ds**2)
    if symmetry is None or any(form.count_ops() > MAX_OPERATIONS for form in forms):
        return None
    d = sp.Dummy("d", real=True)
    forms = tuple(form.xreplace({lam: symmetry.place + d}) for form in forms)
    has_ratios = any(form.has(*_RATIOS) for form in forms)
    for function, ratio in _RATIOS.items():
        forms = tuple(form.replace(function, ratio) for form in forms)
    functions = {type(call) for form in forms for call in form.atoms(sp.Function) if call.has(d)}
    if not functions:
        height, metric = (even(form, d, Y) for form in forms)
        if height is None or metric is None:
            return None
        slope = _divided_difference(height, Y, T, T_MINUS_Y)
        if not slope:
            return None
        square, growth = _turn(height, Y, OFFSET**2, symmetry.monotone)
        turning_point = square and (sp.sqrt(square), growth, sp.S.Zero)
        squares = _isochronous(height, metric, Y, 4 * Y)
        return _with_agm(metric / slope, slope, ((T, HALF**2),), turning_point, squares)
    waves = next((waves for waves in (CIRCULAR, HYPERBOLIC) if functions <= {waves.sine, waves.cosine}), None)
    found = None if waves is None else of_waves(forms, d, waves)
    if waves is None or found is None or (waves.sign < 0 and not is_half_turn(symmetry.step, found[0])):
        return None  # beyond half a turn Y decreases
    rate, height, metric = found
    metric = _with_double_roots(metric, waves)
    less, more = (ONE_MINUS_Y, 1 + Y) if waves.sign < 0 else (1 + Y, ONE_MINUS_Y)
    # V**2 = (SINE_SQUARED - SINE)*slope, where the difference is a product of factors without cancellation.
    sine_gap = 4 * T_MINUS_Y * ONE_MINUS_YT * COSINE_FOURTH / more**2
    height = height.xreplace({COSINE: 1 + waves.sign * SINE})
    slope = _divided_difference(height, SINE, SINE_SQUARED, sine_gap)
    if not slope:
        return None
    by_square = {SINE: 4 * Y / more**2, COSINE: less**2 / more**2}
    by_square[_COSINE_OF_POLE] = COSINE_TERM / more**2
    if _with_poles(slope, waves) != slope:
        above, below = sp.together(slope).as_numer_denom()
        slope = _with_poles(sp.expand(above) / below, waves)
    of_pole = _with_poles(metric, waves)
    if has_ratios and not of_pole.has(_COSINE_OF_POLE):
        return None  # second differences keep more digits next to a pole that is elsewhere
    divisor = sp.together(slope.xreplace(by_square)) * ONE_MINUS_YT  # each takes one division
    integrand = 4 * sp.together(of_pole.xreplace(by_square)) / (rate**2 * COSINE_FOURTH * divisor)
    if integrand.has(COSINE_TERM):
        integrand = _with_cosine_term(integrand)
    if of_pole.has(_COSINE_OF_POLE):
        power = sp.degree(sp.together(slope).as_numer_denom()[1], _COSINE_OF_POLE)
        divisor *= by_square[_COSINE_OF_POLE] ** (power + POWER_OF_POLE)
    invariants = _invariants(waves, rate * HALF / 2)
    degrees = [_degree_inside(form.xreplace({COSINE: 1 - SINE}), {SINE}) for form in (height, metric)]
    cancels = waves.sign < 0 and max(degrees) > MAX_DEGREE
    times = None if cancels else integrand, divisor, invariants
    square, growth = _turn(height, SINE, waves.sine(rate * OFFSET / 2) ** 2, symmetry.monotone)
    metric = metric.xreplace({COSINE: 1 + waves.sign * SINE})
    squares = _isochronous(height, metric, SINE, rate**2 * SINE * (1 + waves.sign * SINE))
    if square is None:
        return _with_agm(*times, None, squares)
    turn, share = 2 * sp.asinh(sp.sqrt(square)) / abs(rate), sp.S.Zero
    if waves.sign < 0:
        turn, share = 4 * sp.atan(sp.sqrt(square) / (1 + sp.sqrt(1 - square))) / abs(rate), square
    return _with_agm(*times, (turn, growth, share), squares)


def _invariants(waves: Waves, argument: sp.Expr) -> tuple[tuple[sp.Symbol, sp.Expr], ...]:
    """Return the symbols of the whole orbit as functions of the argument at the turning point.

    Those of a circular wave are the squares of a cosine and a tangent of half the argument, by functions of the
    argument itself, because 1 - T nearly vanishes beside a barrier. Those of a hyperbolic wave follow without
    cancellation from one number, so that its rounding is that of a slightly different orbit.
    """
    if waves.sign > 0:
        square = sp.sinh(argument / 2) ** 2
        more = 1 + square
        return (
            (T, square / more),
            (ONE_MINUS_T, 1 / more),
            (ONE_MINUS_TT, (1 + 2 * square) / more**2),
            (SINE_SQUARED, 4 * square * more),
            (COSINE_FOURTH, more**2),
        )
    sine, cosine = sp.sin(argument), sp.cos(argument)
    return (
        (T, (sine / (1 + cosine)) ** 2),
        (ONE_MINUS_T, 2 * cosine / (1 + cosine)),
        (ONE_MINUS_TT, 4 * cosine / (1 + cosine) ** 2),
        (SINE_SQUARED, sine**2),
        (COSINE_FOURTH, (1 + cosine) ** 2 / 4),
        (COSINE_AT_TURN, sp.cos(2 * argument)),
    )


def _isochronous(
    height: sp.Expr, metric: sp.Expr, square: sp.Symbol, slope_squared: sp.Expr
) -> tuple[sp.Expr, sp.Expr] | None:
    """Return the square of the angular frequency, twice, if it is the same for all orbits, as on a cycloid.

    U2 is then its product with the square of the arc length from the axis. Only linear functions of the square of a
    sine or of the distance are tried.

    Parameters
    ----------
    height, metric
        U2 and (ds/dd)**2 as functions of ``square``.
    square
        The symbol of the square.
    slope_squared
        The square of the derivative of ``square`` with respect to the distance d.
    """
    if _degree(height, {square}) != 1 or _degree(metric, {square}) > 1:
        return None
    growth = height.diff(square)
    found = sp.cancel(growth * slope_squared / (4 * square * metric))
    return None if found.has(square) else (found, found)


def _turn(height: sp.Expr, square: sp.Symbol, start: sp.Expr, monotone: bool) -> tuple[sp.Expr | None, sp.Expr]:
    """Return the square at the turning point, and the growth of U2 per unit of the square; None if that is not the
    solution of a quadratic equation.

    If U2 is not known to be ``monotone``, the growth is the smaller one of those at the axis and at the turning point,
    less a margin within which the root would lose digits; as a linear function, it has its extremes at the ends.
    """
    if not 0 < _degree(height, {square}) <= 2:
        return None, sp.S.Zero
    first, second = (height.diff(square, k).xreplace({square: sp.S.Zero}) / k for k in (1, 2))
    if not second:
        return start + LAUNCH / first, first
    growth = first + 2 * second * start
    growth = (growth + sp.sqrt(growth**2 + 4 * second * LAUNCH)) / 2
    turn = start + LAUNCH / growth
    if monotone:
        return turn, growth
    more = 2 * second * turn
    at_turn = first + more - MIN_GROWTH * (abs(first) + abs(more))
    return turn, (first + at_turn - abs(first - at_turn)) / 2


def at_place(invariants: Mapping[sp.Symbol, sp.Expr], sine2: sp.Expr, cosine2: sp.Expr) -> dict[sp.Symbol, sp.Expr]:
    """Return the symbols of one place, where Y = ``sine2``*T and ``sine2 + cosine2`` = 1, as sums without
    cancellation.

    COSINE_TERM, a sum of terms of one sign, keeps its digits next to a pole, where COSINE_AT_TURN is small.
    """
    y, one_minus_y, one_minus_yt = (
        invariants.get(T, T) * sine2,
        cosine2 + invariants.get(ONE_MINUS_T, ONE_MINUS_T) * sine2,
        cosine2 + invariants.get(ONE_MINUS_TT, ONE_MINUS_TT) * sine2,
    )
    at_turn, sine_squared = (invariants.get(symbol, symbol) for symbol in (COSINE_AT_TURN, SINE_SQUARED))
    return {
        Y: y,
        T_MINUS_Y: invariants.get(T, T) * cosine2,
        ONE_MINUS_Y: one_minus_y,
        ONE_MINUS_YT: one_minus_yt,
        COSINE_TERM: at_turn * (1 + y) ** 2 + 2 * sine_squared * cosine2 * one_minus_yt,
    }


def _degree(form: sp.Expr, symbols: set[sp.Symbol]) -> float:
    """Return the degree of a polynomial as it is written, because expanding it may take very long; infinity for other
    forms.
    """
    if not form.free_symbols & symbols:
        return 0
    if form.is_Symbol:
        return 1
    if form.is_Add:
        return max(_degree(part, symbols) for part in form.args)
    if form.is_Mul:
        return sum(_degree(part, symbols) for part in form.args)
    if form.is_Pow and form.exp.is_Integer and form.exp > 0:
        return int(form.exp) * _degree(form.base, symbols)
    return inf


def _degree_inside(form: sp.Expr, symbols: set[sp.Symbol]) -> float:
    """Return the largest degree of the polynomials in a form."""
    degree = _degree(form, symbols)
    return degree if degree < inf else max(_degree_inside(part, symbols) for part in form.args)


def _with_agm(
    integrand: sp.Expr | None,
    divisor: sp.Expr,
    invariants: tuple[tuple[sp.Symbol, sp.Expr], ...],
    turning_point: tuple[sp.Expr, sp.Expr, sp.Expr] | None,
    squares: tuple[sp.Expr, sp.Expr] | None,
) -> SymmetricOrbits:
    """Return the record, with the arguments of the arithmetic-geometric mean if there are any.

    ``squares`` are these, if they are known.
    """
    if integrand is None:
        return SymmetricOrbits(None, divisor, invariants, turning_point, None)
    sine2, cosine2 = _symbol("sine2"), _symbol("cosine2")
    inverse = 1 / integrand.xreplace(at_place({}, sine2, cosine2))
    arguments = squares
    if arguments is None and _degree(inverse, {sine2, cosine2}) <= 1:
        ends = ({cosine2: sp.S.One, sine2: sp.S.Zero}, {cosine2: sp.S.Zero, sine2: sp.S.One})
        arguments = tuple(inverse.xreplace(end).xreplace(dict(invariants)) for end in ends)
    return SymmetricOrbits(integrand, divisor, invariants, turning_point, arguments)


def _with_double_roots(metric: sp.Expr, waves: Waves) -> sp.Expr:
    """Return (ds/dd)**2 with its sums as products of powers if they are polynomials with double roots, as at cusps.

    Near such a root the terms of the expanded polynomial cancel twice as many digits as those of its root.
    """
    cosine = 1 + waves.sign * SINE

    def rooted(part: sp.Expr) -> sp.Expr:
        form = part.xreplace({COSINE: cosine})
        if not part.is_Add or not form.is_polynomial(SINE) or sp.Poly(form, SINE).domain.is_EX:
            return part
        constant, factors = sp.sqf_list(form, SINE)
        if all(power < 2 for _, power in factors):
            return part
        ratios = [(factor, sp.cancel(factor / cosine), power) for factor, power in factors]
        return sp.Mul(constant, *((f if r.has(SINE) else r * COSINE) ** power for f, r, power in ratios))

    return sp.Mul(*map(rooted, sp.Mul.make_args(metric)))


def _with_poles(form: sp.Expr, waves: Waves) -> sp.Expr:
    """Return a form in which the cosine of the argument has a symbol of its own where it is a divisor.

    In squares of the sine and cosine of half the argument it is a difference that loses its digits next to the pole.
    """
    if waves.sign > 0:
        return form

    def named(power: sp.Expr) -> sp.Expr:
        for square, symbol in ((SINE, _COSINE_OF_POLE), (SINE_SQUARED, COSINE_AT_TURN)):
            ratio = sp.cancel(power.base.xreplace({COSINE: 1 - SINE}) / (1 - 2 * square))
            if not ratio.has(SINE, SINE_SQUARED):
                return (ratio * symbol) ** power.exp
        return power

    return form.replace(lambda t: t.is_Pow and t.exp.is_Integer and t.exp < 0 and t.base.is_Add, named)


def _with_cosine_term(form: sp.Expr) -> sp.Expr:
    """Write multiples of (1 - Y)**2 - 4*Y in sums by COSINE_TERM, whose terms do not cancel."""

    def named(total: sp.Expr) -> sp.Expr:
        count = total.coeff(ONE_MINUS_Y**2)
        found = count and total.coeff(Y) == -4 * count
        return total + count * (COSINE_TERM - ONE_MINUS_Y**2 + 4 * Y) if found else total

    return form.replace(lambda t: t.is_Add, named)


def _divided_difference(height: sp.Expr, square: sp.Symbol, top: sp.Symbol, gap: sp.Expr) -> sp.Expr:
    """Return ``height[square, top]``; 0 if the height is constant."""
    difference = Differences(square, (square, top), {(0, 1): gap}).first(height, 0, 1)
    # Products are expanded, because their terms may cancel, as those of cos**2 and sin**2 do.
    return sp.Mul(*(sp.expand(f) if f.is_polynomial(square, top) else f for f in sp.Mul.make_args(difference)))
