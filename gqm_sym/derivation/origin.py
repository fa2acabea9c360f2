"""The place from which the formulas of a curve measure its parameter, if they contain it only less that place.

A well that is written about a place far from zero, as in cosh(x - 40), is derived as one about zero. Its forms are then
not multiplied out, as the slope of (x - 40)**4 would be to a polynomial whose terms cancel about 40, and a distance
from the place has the digits of the distance (`Model.origin`).
"""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

import sympy as sp
from sympy.core.function import AppliedUndef

from gqm_sym.declare import Curve
from gqm_sym.kernels.base import Kernel, X, Y, Z

if TYPE_CHECKING:
    from gqm_sym.derivation.model import Model

# Fields of a model that are not forms in the parameter, or belong to the declarations.
_KEPT = frozenset({"curve", "force", "parameter", "lam0", "v0", "mass", "symmetric_orbits", "level_set", "origin"})


# The largest distance of the numbers that formulas subtract from the parameter, as a share of the one that is chosen.
MAX_DISTANCE = sp.Rational(1, 8)


def origin_of(curve: Curve, kernel: Kernel) -> sp.Expr:
    """Return the number or run-time parameter c if formulas contain the curve's parameter only less c, or less numbers
    near c; otherwise 0.

    Terms that are linear in it, and sines and cosines of multiples of it, do not count: their differences are known at
    any place.
    """
    lam = curve.parameter
    laws = (kernel.potential, kernel.resistance, kernel.drag, kernel.friction, kernel.tangential_law)
    of_angle = curve.radius is not None  # the parameter of a polar curve is an angle from the x axis
    if of_angle or curve.charted or curve.banking or kernel.spin or any(law.has(X, Y, lam) for law in laws):
        return sp.S.Zero
    linear = not any(sp.diff(law, Z).has(Z) for law in laws)
    zeros = {zero for name, form in curve.coordinates for zero in _zeros(form, lam, linear or name != "z")}
    if all(zero.is_Rational for zero in zeros):
        ranked = sorted(zeros)
        chosen = ranked[len(ranked) // 2] if ranked else sp.S.Zero
        near = all(abs(zero - chosen) <= MAX_DISTANCE * abs(chosen) for zero in ranked)
        return chosen if near else sp.S.Zero
    return zeros.pop() if len(zeros) == 1 and all(zero.is_number or zero.is_Symbol for zero in zeros) else sp.S.Zero


def measured_from(curve: Curve, origin: sp.Expr) -> Curve:
    """Return the same curve with a parameter that is 0 at a place."""
    if not origin:
        return curve
    there = {curve.parameter: curve.parameter + origin}
    forms = {name: form.xreplace(there) for name, form in curve.coordinates}
    low, high = (None if end is None else end - origin for end in curve.domain)
    return replace(curve, **forms, domain=(low, high))


def measured_from_zero(model: "Model", curve: Curve, origin: sp.Expr, places: tuple[sp.Symbol, ...]) -> "Model":
    """Return a model of the curve from the model of that curve with a parameter that is 0 at ``origin``.

    ``places`` are the symbols for places in its forms.
    """
    if not origin:
        return model
    unknown = model.speed_squared.atoms(AppliedUndef)
    there = {**{place: place - origin for place in places}, **{speed: speed for speed in unknown}}
    axes = model.symmetry
    forms = {f.name: _moved(getattr(model, f.name), there) for f in fields(model) if f.name not in _KEPT}
    forms["symmetry"] = None if axes is None else replace(axes, place=axes.place + origin)
    return replace(model, **forms, curve=curve, origin=origin)


def _moved(value: Any, there: dict[sp.Basic, sp.Basic]) -> Any:
    """Replace places in a value and all its parts."""
    if isinstance(value, sp.Eq):
        return sp.Eq(*(side.xreplace(there) for side in value.args), evaluate=False)
    if isinstance(value, sp.Basic):
        return value.xreplace(there)
    if isinstance(value, tuple):
        return tuple(_moved(part, there) for part in value)
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{f.name: _moved(getattr(value, f.name), there) for f in fields(value)})
    return value


def _zeros(form: sp.Expr, lam: sp.Symbol, is_term: bool = False) -> Iterator[sp.Expr]:
    """Yield the zeros of all linear expressions in a form, except those that are terms of a sum or of the whole form
    (``is_term``), or arguments of sines and cosines.
    """
    if not form.has(lam):
        return
    rate = form.diff(lam)
    if not rate.has(lam):
        if not is_term:
            yield sp.cancel(lam - form / rate)
    elif not (isinstance(form, sp.sin | sp.cos) and not form.args[0].diff(lam).has(lam)):
        whole = is_term and form.is_Mul and len([part for part in form.args if part.has(lam)]) == 1
        for part in form.args:
            yield from _zeros(part, lam, form.is_Add or whole)
