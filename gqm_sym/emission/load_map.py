"""The function of a load map, which fills all rows in one call, with V**2 by subtraction and the size of its rounded
terms.
"""

from collections.abc import Callable
from math import prod

from sympy import Abs, Expr, Function, Pow, S, Symbol, cos, cosh, exp, ordered, sin, sinh
from sympy.core.function import AppliedUndef

from gqm_sym.derivation.algebra.angles import is_power_of_two
from gqm_sym.emission.context import Lowering
from gqm_sym.emission.ir import FunctionIR
from gqm_sym.emission.subscripts import at
from gqm_sym.sympy_charts import TERMS_SIZES, SpaceFunction


def load_map(lowering: Lowering) -> tuple[FunctionIR, ...]:
    """Return the function of a load map; none if the size of the terms of the effective potential is not known."""
    model, names = lowering.model, lowering.names
    potential = _without_constant(model.effective_potential, lowering.place)
    (accurate,) = lowering.accurate([potential])
    size = rounded_size(accurate, lowering.place)
    if size is None or (model.curve.charted and not model.curve.in_space):
        return ()
    w0, level, places = names.symbol("w0"), names.symbol("level"), names("places")
    v2 = Function("speed_squared_from_potential")(w0, potential, level)
    contact = lowering.contact(v2)
    # In a rotating frame the contact force depends on the direction of motion, which this function does not know.
    force = S.Zero if model.coriolis else contact.size
    in_space = () if not model.curve.in_space or model.coriolis else (model.y, *contact.vector)
    rows = (model.x, model.z, model.ds, contact.kappa, v2, force, size, *in_space)
    grown, outputs = with_named_exponentials(lowering.accurate(rows), names.symbol)
    return (
        lowering.function(
            "load_map",
            (w0, level, places),
            f"x, z, ds/d{lowering.place}, kappa, V**2 = w0 - 2*(U - level), {'0' if model.coriolis else 'N'} (paper, "
            f"eqs. 8, 13, 15), size of U's terms{', y, N along x, y and z' if in_space else ''}.",
            inside=[(lowering.place, at(places)), *grown],
            outputs=outputs,
        ),
    )


def with_named_exponentials(
    forms: tuple[Expr, ...], symbol: Callable[[str], Symbol]
) -> tuple[list[tuple[Symbol, Expr]], tuple[Expr, ...]]:
    """Give names to exponentials whose reciprocals occur as well; return the names and the forms that use them.

    SymPy writes 1/exp(u) as exp(-u). A division costs a third of a second exponential.
    """
    calls = {call for form in forms for call in form.atoms(exp)}
    both = [call for call in ordered(calls) if exp(-call.exp) in calls and not call.exp.could_extract_minus_sign()]
    named = [(symbol(f"e{k}"), call) for k, call in enumerate(both)]
    by_name = {call: name for name, call in named} | {exp(-call.exp): 1 / name for name, call in named}
    return named, tuple(form.xreplace(by_name) for form in forms)


def _without_constant(potential: Expr, place: Symbol) -> Expr:
    """Return the potential without its constant term, which would only add rounding."""
    factor, remainder = potential.as_independent(place, as_Add=False)
    return factor * remainder.as_independent(place, as_Add=True)[1]


def rounded_size(form: Expr, place: Symbol) -> Expr | None:
    """Return the size to which the rounding errors of a form are relative: its own size if nothing cancels in it; None
    if unknown.
    """
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
    """Return the size of a form, given the sizes of its parts."""
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
    if isinstance(form, SpaceFunction) and form.order == 0 and form.axis in TERMS_SIZES:
        return TERMS_SIZES[form.axis](place)
    if isinstance(form, exp | cosh):
        return form  # SymPy would write the real part of an exponent that it does not know to be real
    if isinstance(form, sinh):
        return Abs(form)
    if isinstance(form, AppliedUndef):  # a sine or cosine of an exact angle
        return Abs(form)
    if isinstance(form, sin | cos):
        return Abs(form) if is_power_of_two(form.args[0] / place) else Abs(form) + sizes[0]
    return None
