"""Emission of a model as the text of a Python module."""

import keyword

import sympy
from sympy import Expr

from gqm_sym.arguments import instance
from gqm_sym.budgets import budget
from gqm_sym.derivation import Model
from gqm_sym.emission.lower import lower
from gqm_sym.emission.render import body_digests, render
from gqm_sym.errors import InputError

__all__ = ["body_digests", "emit"]


@budget("emission", 60.0, "declare the curve and the forces by shorter expressions")
def emit(model: Model, *, name: str) -> str:
    """Return the text of a model's module; the same model and name give the same bytes.

    Parameters
    ----------
    model : Model
        The model that `derive` returned.
    name : str
        The module's name, a Python identifier.

    Returns
    -------
    str

    Raises
    ------
    InputError
        If the name is not allowed.
    EmissionError
        If an expression has no form in emitted code; the message names it.
    BudgetError
        If it takes more than a minute of processor time, or is nested too deeply.
    """
    if not (isinstance(name, str) and name.isascii() and name.isidentifier()) or keyword.iskeyword(name):
        raise InputError(
            f"name: {name!r} cannot be a module's; write a Python identifier of ASCII letters, digits and _"
        )
    instance(model, Model, where="emit: model", what="a model, as derive(curve, kernel) returns one")
    return render(lower(model, name=name, forms=model.closed_forms()), source=_source(model, name))


def _source(model: Model, name: str) -> str:
    """Return everything from which the module is made, as one canonical text."""

    def exact(e: Expr | None) -> str:
        return "-" if e is None else sympy.srepr(e)

    curve = model.curve
    parts = [name, model.title, model.parameter.name, *(exact(form) for form in curve.point)]
    parts += [
        exact(e)
        for e in (*curve.domain, curve.period, model.effective_potential, model.static_normal_load, model.inertia)
    ]
    parts += [repr(model.defaults), repr(model.positive)]
    if model.at_least:
        parts.append(repr(model.at_least))
    if (loss := model.dissipation) is not None:
        parts += [exact(e) for e in (loss.drive, loss.decay, *loss.holds, *(form for _, form in loss.pieces))]
    if curve.banking is not None:
        parts += [
            "banked",
            *(exact(form) for form in (curve.banking.angle, curve.banking.speed, curve.banking.heartline)),
            *(exact(form) for form in curve.banking.up),
        ]
    if curve.charted:
        parts.append(repr(curve.definition))
    return "\n".join(parts)
