"""An even well in a coordinate in which the time of an orbit is an algebraic integral (MATHS, section 3).

About an axis of symmetry, d away from it, waves of one rate k are rational functions of Y = tan(k d/4)**2, hyperbolic
ones of Y = tanh(k d/4)**2, and even powers are powers of Y = d**2. Between turning points, where Y = top, y = sqrt(Y)
swings as sqrt(top)*sin(u), and V**2 = (top - Y)*D with the divided difference D = climb[Y, top]. So the time is the
integral over u of sqrt(pace), pace = (ds/dy)**2/D, which holds no sine. Of a pendulum it is the elliptic integral after
Landen's transformation: the trapezoidal rule needs no more nodes for it than in the angle itself. Where 1/pace is
linear in the square of the sine, as it is there and for Duffing's oscillator, the integral is a complete elliptic one
of the first kind, and Gauss's arithmetic-geometric mean its value.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import gcd, inf, lcm

import sympy as sp

from gqm_sym.derivation.algebra.difference import Differences
from gqm_sym.derivation.wells.symmetry import MAX_OPERATIONS, Symmetry, is_half_turn

# A wave of so many times the slowest one's rate is written by powers of that one.
MAX_MULTIPLE = 8


def _symbol(name: str) -> sp.Symbol:
    return sp.Symbol(f"_{name}", real=True)


# Of one place of an orbit: Y, 1 - Y, top - Y, 1 - Y*top.
SQUARE, LACK, GAP, APART = (_symbol(name) for name in ("square", "lack", "gap", "apart"))

# Of the whole orbit: half its width, Y at its ends, 1 - top, 1 - top**2; the square of the sine there, and the fourth
# power of the cosine of half that argument.
HALF, TOP, TOP_LACK, TOP_APART = (_symbol(name) for name in ("half", "top", "top_lack", "top_apart"))
TOP_SINE, STRETCH = _symbol("top_sine"), _symbol("stretch")

# Of a launch: how far from the axis, and V**2 there.
OFFSET, LAUNCH = _symbol("offset"), _symbol("launch")

# In between: the square of a wave's sine at half its argument, and that of its cosine.
_SINE, _COSINE = _symbol("sine"), _symbol("cosine")


@dataclass(frozen=True, slots=True)
class Swing:
    """The time of an orbit about an axis of symmetry, by half a turn of u.

    Attributes
    ----------
    pace
        (dt/du)**2 by the symbols of this module and the run-time parameters.
    factor
        What pace is divided by: next to a barrier it all but vanishes somewhere, and with it the digits.
    ends
        The symbols of the whole orbit, each with its value by HALF.
    crest
        Of a launch by OFFSET and LAUNCH: half the orbit's width; by how much the climb grows with the square it is
        written in, which is that of a sine or of the distance, so that it is positive about a well; the square of the
        sine at the turning point, which is above 1 where the body passes over the top (0 of other squares). None where
        the climb is of a third power of that square, or no polynomial.
    means
        Squares of two numbers by HALF: the half period is pi over their arithmetic-geometric mean. None where it is no
        complete elliptic integral of the first kind.
    """

    pace: sp.Expr
    factor: sp.Expr
    ends: tuple[tuple[sp.Symbol, sp.Expr], ...]
    crest: tuple[sp.Expr, sp.Expr, sp.Expr] | None
    means: tuple[sp.Expr, sp.Expr] | None


@dataclass(frozen=True, slots=True)
class _Waves:
    """Heads with cosine**2 = 1 + sign*sine**2."""

    sine: type[sp.Function]
    cosine: type[sp.Function]
    sign: int


_CIRCULAR, _HYPERBOLIC = _Waves(sp.sin, sp.cos, -1), _Waves(sp.sinh, sp.cosh, 1)


def swing(climb: sp.Expr, ds: sp.Expr, lam: sp.Symbol, symmetry: Symmetry | None) -> Swing | None:
    """Return the time of an orbit about an axis in such a coordinate; None where there is none."""
    forms = (climb, ds**2)
    if symmetry is None or any(form.count_ops() > MAX_OPERATIONS for form in forms):
        return None
    d = sp.Dummy("d", real=True)
    forms = tuple(form.xreplace({lam: symmetry.place + d}) for form in forms)
    heads = {type(call) for form in forms for call in form.atoms(sp.Function) if call.has(d)}
    if not heads:
        height, metric = (_even(form, d, SQUARE) for form in forms)
        if height is None or metric is None:
            return None
        drop = _drop(height, SQUARE, TOP, GAP)
        if not drop:
            return None
        square, growth = _turn(height, SQUARE, OFFSET**2)
        return _swing(metric / drop, drop, ((TOP, HALF**2),), square and (sp.sqrt(square), growth, sp.S.Zero))
    waves = next((waves for waves in (_CIRCULAR, _HYPERBOLIC) if heads <= {waves.sine, waves.cosine}), None)
    found = None if waves is None else _of_waves(forms, d, waves)
    if waves is None or found is None or (waves.sign < 0 and not is_half_turn(symmetry.step, found[0])):
        return None  # beyond half a turn Y falls again
    rate, height, metric = found
    less, more = (LACK, 1 + SQUARE) if waves.sign < 0 else (1 + SQUARE, LACK)
    # V**2 = (TOP_SINE - _SINE)*drop, and both factors of that difference are known by Y.
    sine_gap = 4 * GAP * APART * STRETCH / more**2
    height = height.xreplace({_COSINE: 1 + waves.sign * _SINE})
    drop = _drop(height, _SINE, TOP_SINE, sine_gap)
    if not drop:
        return None
    by_square = {_SINE: 4 * SQUARE / more**2, _COSINE: less**2 / more**2}
    factor = sp.together(drop.xreplace(by_square)) * APART  # one division each
    pace = 4 * sp.together(metric.xreplace(by_square)) / (rate**2 * STRETCH * factor)
    sine, cosine = waves.sine(rate * HALF / 4), waves.cosine(rate * HALF / 4)
    beyond = waves.cosine(rate * HALF / 2)
    ends = (
        (TOP, (sine / cosine) ** 2),
        (TOP_LACK, (beyond if waves.sign < 0 else 1) / cosine**2),
        (TOP_APART, beyond / cosine**4),
        (TOP_SINE, waves.sine(rate * HALF / 2) ** 2),
        (STRETCH, cosine**4),
    )
    square, growth = _turn(height, _SINE, waves.sine(rate * OFFSET / 2) ** 2)
    if square is None:
        return _swing(pace, factor, ends, None)
    turn, share = 2 * sp.asinh(sp.sqrt(square)) / abs(rate), sp.S.Zero
    if waves.sign < 0:
        turn, share = 4 * sp.atan(sp.sqrt(square) / (1 + sp.sqrt(1 - square))) / abs(rate), square
    return _swing(pace, factor, ends, (turn, growth, share))


def _turn(height: sp.Expr, square: sp.Symbol, start: sp.Expr) -> tuple[sp.Expr | None, sp.Expr]:
    """The square at which V**2 is used up, and the climb's growth up to there; None where no root gives it."""
    if not 0 < _degree(height, {square}) <= 2:
        return None, sp.S.Zero
    growth, bend = (height.diff(square, k).xreplace({square: sp.S.Zero}) / k for k in (1, 2))
    if bend:
        growth += 2 * bend * start
        growth = (growth + sp.sqrt(growth**2 + 4 * bend * LAUNCH)) / 2
    return start + LAUNCH / growth, growth


def at_share(ends: Mapping[sp.Symbol, sp.Expr], fall: sp.Expr, rise: sp.Expr) -> dict[sp.Symbol, sp.Expr]:
    """The symbols of one place, where Y = ``fall``*TOP and ``fall + rise`` = 1: by sums of what cannot cancel."""
    return {
        SQUARE: ends.get(TOP, TOP) * fall,
        GAP: ends.get(TOP, TOP) * rise,
        LACK: rise + ends.get(TOP_LACK, TOP_LACK) * fall,
        APART: rise + ends.get(TOP_APART, TOP_APART) * fall,
    }


def _degree(form: sp.Expr, symbols: set[sp.Symbol]) -> float:
    """The degree of a polynomial as it stands, for writing it out may take very long; infinite for other forms."""
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


def _swing(
    pace: sp.Expr,
    factor: sp.Expr,
    ends: tuple[tuple[sp.Symbol, sp.Expr], ...],
    crest: tuple[sp.Expr, sp.Expr, sp.Expr] | None,
) -> Swing:
    fall, rise = _symbol("fall"), _symbol("rise")
    inverse = 1 / pace.xreplace(at_share({}, fall, rise))
    means = None
    if _degree(inverse, {fall, rise}) <= 1:
        shares, by_end = ({rise: sp.S.One, fall: sp.S.Zero}, {rise: sp.S.Zero, fall: sp.S.One}), dict(ends)
        means = tuple(inverse.xreplace(share).xreplace(by_end) for share in shares)
    return Swing(pace, factor, ends, crest, means)


def _drop(height: sp.Expr, square: sp.Symbol, top: sp.Symbol, gap: sp.Expr) -> sp.Expr:
    """``height[square, top]``; 0 for a level one."""
    drop = Differences(square, (square, top), {(0, 1): gap}).first(height, 0, 1)
    # Products are written out: their terms may cancel, as those of cos**2 and sin**2 do.
    return sp.Mul(*(sp.expand(f) if f.is_polynomial(square, top) else f for f in sp.Mul.make_args(drop)))


def _even(form: sp.Expr | None, root: sp.Symbol, square: sp.Expr) -> sp.Expr | None:
    """A form in even powers of ``root``, by its square; None where there are others."""
    for f in () if form is None else (form, sp.expand(form)):
        found = f.replace(
            lambda t: t.is_Pow and t.base == root and t.exp.is_Integer and t.exp % 2 == 0,
            lambda t: square ** (t.exp / 2),
        )
        if not found.has(root):
            return found
    return None


def _of_waves(forms: Sequence[sp.Expr], d: sp.Symbol, waves: _Waves) -> tuple[sp.Expr, sp.Expr, sp.Expr] | None:
    """A rate by which forms of waves are forms of the square of a sine, and these; None where there is none."""
    calls = {call for form in forms for call in form.atoms(waves.sine, waves.cosine) if call.has(d)}
    shifted = {call: call.func(sp.expand(call.args[0])) for call in calls}
    forms = [form.xreplace(shifted) for form in forms]
    calls = {call for form in forms for call in form.atoms(waves.sine, waves.cosine) if call.has(d)}
    rates = {call: call.args[0].diff(d) for call in calls}
    if not calls or any(rate.has(d) or sp.expand(call.args[0] - rate * d) != 0 for call, rate in rates.items()):
        return None
    first = min(rates.values(), key=sp.default_sort_key)
    ratios = {call: sp.cancel(rate / first) for call, rate in rates.items()}
    if not all(ratio.is_Rational for ratio in ratios.values()):
        return None
    common = sp.Rational(gcd(*(int(r.p) for r in ratios.values())), lcm(*(int(r.q) for r in ratios.values())))
    multiples = {call: int(ratio / common) for call, ratio in ratios.items()}
    if max(map(abs, multiples.values())) > MAX_MULTIPLE:
        return None
    c, s, c2, s2 = sp.symbols("c s c2 s2", cls=sp.Dummy, real=True)
    by_first = {
        call: sp.chebyshevt(abs(n), c) if call.func is waves.cosine else sp.sign(n) * s * sp.chebyshevu(abs(n) - 1, c)
        for call, n in multiples.items()
    }
    even = [_even(form.xreplace(by_first), s, s2) for form in forms]
    squares = [_even(form, c, c2) for form in even]
    # Where only squares appear, those are waves of twice the rate.
    if None in squares:
        rate, found, names = common * first, even, {c: _COSINE + waves.sign * _SINE, s2: 4 * _SINE * _COSINE}
    else:
        rate, found, names = 2 * common * first, squares, {c2: _COSINE, s2: _SINE}
    height, metric = (form if form is None else form.xreplace(names) for form in found)
    return None if height is None or metric is None else (rate, height, metric)
