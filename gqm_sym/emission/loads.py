"""What a load map calls: all its rows at once, V**2 by subtracting heights, and the size of what is rounded there."""

from collections.abc import Callable
from math import prod
from typing import TYPE_CHECKING

from sympy import Abs, Expr, Function, Pow, Rational, Symbol, cos, cosh, exp, ordered, sin, sinh

from gqm_sym.emission.ir import FunctionIR
from gqm_sym.emission.subscripts import at

if TYPE_CHECKING:
    from gqm_sym.emission.context import Lowering


def loads(lowering: "Lowering") -> tuple[FunctionIR, ...]:
    """The function of a load map; none where it is not known how far heights are rounded."""
    model, names = lowering.model, lowering.names
    climb = _without_constant(model.climb, lowering.place)
    size = rounded_size(climb, lowering.place)
    if size is None:
        return ()
    w0, level, places = names.symbol("w0"), names.symbol("level"), names("places")
    v2 = Function("left_of")(w0, climb, level)
    force = Symbol("m", real=True) * (model.kappa * v2 + model.reaction)
    grown, outputs = rising((model.x, model.z, model.ds, model.kappa, v2, force, size), names.symbol)
    function = lowering.function(
        "loads",
        "LOADS",
        (w0.name, level.name, places),
        "x, z, ds/d{0}, signed curvature, V**2, contact force (paper, eq. 15), and the size of the heights in V**2.",
        views=((places, names("n")),),
        inside=[(lowering.place, at(places)), *grown],
        outputs=outputs,
        later=True,
    )
    return (function,)


def rising(
    forms: tuple[Expr, ...], symbol: Callable[[str], Symbol]
) -> tuple[list[tuple[Symbol, Expr]], tuple[Expr, ...]]:
    """Exponentials whose reciprocals occur too, by names of their own, and the forms with these.

    A division costs a third of an exponential, and what 1/exp(u) stands for, SymPy writes as exp(-u).
    """
    calls = {call for form in forms for call in form.atoms(exp)}
    both = [call for call in ordered(calls) if exp(-call.exp) in calls and not call.exp.could_extract_minus_sign()]
    named = [(symbol(f"e{k}"), call) for k, call in enumerate(both)]
    by_name = {call: name for name, call in named} | {exp(-call.exp): 1 / name for name, call in named}
    return named, tuple(form.xreplace(by_name) for form in forms)


def _without_constant(climb: Expr, place: Symbol) -> Expr:
    """The climb less what is the same everywhere: that would only be rounded."""
    factor, rest = climb.as_independent(place, as_Add=False)
    return factor * rest.as_independent(place, as_Add=True)[1]


def rounded_size(form: Expr, place: Symbol) -> Expr | None:
    """What the roundings of a form are shares of: its own size where nothing cancels in it; None where not known."""
    if form.is_Symbol or form.is_number:
        return Abs(form)
    if form.is_Pow and not form.base.has(place) and not form.exp.has(place):
        return Abs(form)
    if not form.is_Pow or form.exp.is_number:
        parts = [rounded_size(part, place) for part in form.args]
        sizes = [part for part in parts if part is not None]
        if len(sizes) == len(parts):
            return _composed(form, sizes, place)
    return None


def _composed(form: Expr, sizes: list[Expr], place: Symbol) -> Expr | None:
    """The same, given the sizes of the form's parts."""
    if form.is_Add:
        return sum(sizes[1:], sizes[0])
    if form.is_Mul:
        return prod(sizes[1:], start=sizes[0])
    if form.is_Pow:
        base, exponent = form.args
        if exponent.is_Integer and exponent > 0:
            return Pow(sizes[0], exponent)
        return Pow(Abs(base), exponent - 1) * sizes[0]
    if isinstance(form, Abs):
        return sizes[0]
    if isinstance(form, exp | cosh | sinh):
        return Abs(form)
    if isinstance(form, sin | cos):
        return Abs(form) if _is_exact(form.args[0], place) else Abs(form) + sizes[0]
    return None


def _is_exact(form: Expr, place: Symbol) -> bool:
    """Whether a form is the place times a power of two, and so not rounded."""
    factor = form / place
    return isinstance(factor, Rational) and all(part & (part - 1) == 0 for part in (abs(factor.p), factor.q))
