"""Forms in waves whose rates are multiples of one rate, as functions of the square of a sine (MATHS, section 3)."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import gcd, lcm

import sympy as sp

# A sine or cosine is written in powers of the slowest one if its rate is at most this multiple of the slowest rate.
MAX_MULTIPLE = 8

# The squares of the sine and of the cosine of half the argument.
SINE, COSINE = sp.Symbol("_sine", real=True), sp.Symbol("_cosine", real=True)


@dataclass(frozen=True, slots=True)
class Waves:
    """A pair of functions with cosine**2 = 1 + sign*sine**2."""

    sine: type[sp.Function]
    cosine: type[sp.Function]
    sign: int


CIRCULAR, HYPERBOLIC = Waves(sp.sin, sp.cos, -1), Waves(sp.sinh, sp.cosh, 1)


def even(form: sp.Expr | None, root: sp.Symbol, square: sp.Expr) -> sp.Expr | None:
    """Return a form that has only even powers of ``root`` in terms of its square; None if it has other powers."""
    for f in () if form is None else (form, sp.expand(form)):
        found = f.replace(
            lambda t: t.is_Pow and t.base == root and t.exp.is_Integer and t.exp % 2 == 0,
            lambda t: square ** (t.exp / 2),
        )
        if not found.has(root):
            return found
    return None


def of_waves(forms: Sequence[sp.Expr], d: sp.Symbol, waves: Waves) -> tuple[sp.Expr, sp.Expr, sp.Expr] | None:
    """Return a rate for which the forms are functions of the square of a sine, and these functions; None if there is
    none.

    Parameters
    ----------
    forms
        Twice the effective potential, and (ds/dd)**2.
    d
        The distance from the axis of symmetry.
    waves
        The only functions of ``d`` in the forms.

    Returns
    -------
    rate, height, metric
        The rate in the unit of 1/``d``, and both forms as functions of SINE and COSINE, whose argument is half the
        product of the rate and ``d``.
    """
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
    by_sine = [even(form.xreplace(by_first), s, s2) for form in forms]
    squares = [even(form, c, c2) for form in by_sine]
    # If only squares appear, they are functions of twice the rate.
    if None in squares:
        rate, found, names = common * first, by_sine, {c: COSINE + waves.sign * SINE, s2: 4 * SINE * COSINE}
    else:
        rate, found, names = 2 * common * first, squares, {c2: COSINE, s2: SINE}
    height, metric = (form if form is None else form.xreplace(names) for form in found)
    # A form may hold powers of the distance beside its waves, such as those of a rotating frame on a catenary.
    if height is None or metric is None or height.has(d) or metric.has(d):
        return None
    return rate, height, metric
