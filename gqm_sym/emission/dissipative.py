"""The functions of a model that is not conservative: what changes V**2 along a leg, and what holds a body at rest."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import sympy
from sympy import Expr, Symbol

from gqm_sym.derivation.forces.dissipation import LOAD, PUSH, SIGMA, TILT, TURN, Dissipation
from gqm_sym.emission.ir import Assignment, FunctionIR
from gqm_sym.emission.subscripts import at
from gqm_sym.kernels.base import CONTACT_SIGN, DIRECTION, KAPPA, W

if TYPE_CHECKING:
    from gqm_sym.emission.context import Lowering

_NAMES = {SIGMA: "ds", KAPPA: "kappa", TURN: "turn", LOAD: "n0", PUSH: "push", TILT: "dxds"}
"""What emitted code calls that which a force law takes of a curve."""


def drive(lowering: "Lowering", loss: Dissipation) -> FunctionIR:
    """P and Q of dW/dλ = P - Q W, beside what the contact force needs."""
    names = lowering.names
    speeds, v, nu = names("speeds"), names.symbol("v"), names.symbol("nu")
    law = "dV**2/d{0} = P - Q*V**2" + ("" if loss.linear else ", linearised at V**2 = w")
    return _in_pieces(
        lowering,
        loss,
        "drive",
        (speeds, v.name, nu.name),
        f"ds/d{{0}}, P, Q, n0 and kappa: {law}, N/m = kappa*V**2 + n0; v = sgn(ds/dt), nu = sgn(N).",
        begin=[] if loss.linear else [(names.symbol("w"), at(speeds))],
        outputs=(SIGMA, loss.drive, loss.decay, LOAD, KAPPA),
        symbols={DIRECTION: v, CONTACT_SIGN: nu, W: names.symbol("w")},
    )


def hold(lowering: "Lowering", loss: Dissipation) -> FunctionIR:
    """The accelerations of a body at rest that is about to move forwards, and backwards."""
    doc = "Acceleration from rest forwards, and backwards: a body rests where the first is <= 0 and the second >= 0."
    return _in_pieces(lowering, loss, "hold", (), doc, begin=[], outputs=loss.holds, symbols={})


def _in_pieces(
    lowering: "Lowering",
    loss: Dissipation,
    name: str,
    arguments: tuple[str, ...],
    doc: str,
    *,
    begin: list[tuple[Symbol, Expr]],
    outputs: Sequence[Expr],
    symbols: dict[Symbol, Expr],
) -> FunctionIR:
    """A function that works out what a law takes of the curve, by name, and then the law as it is written."""
    names, place = lowering.names, lowering.place
    values = {piece: form for piece, form in loss.pieces if any(piece in o.free_symbols for o in outputs)}
    named = {piece: names.symbol(_NAMES[piece]) for piece, form in values.items() if not form.is_number}
    numbers = {piece: form for piece, form in values.items() if form.is_number}
    law = [form.xreplace({**symbols, **named, **numbers}) for form in outputs]
    places = names("places")
    starts = [(place, at(places)), *begin]
    function = lowering.function(
        name,
        name.upper(),
        (places, *arguments),
        doc,
        views=tuple((view, names("n")) for view in (places, *(a.args[0].name for _, a in begin))),
        inside=starts,
        outputs=tuple(values[piece] for piece in named),
    )
    shared: list[tuple[Symbol, Expr]] = []
    if not loss.linear:
        shared, law = sympy.cse(law, symbols=sympy.numbered_symbols("_u", real=True), order="canonical")
    function = _with_names(function, tuple(named.values()))
    made = [*zip(named.values(), function.outputs, strict=True), *shared]
    made = [(symbol, value) for symbol, value in made if symbol != value]
    needed = set[Symbol]().union(*(form.free_symbols for form in (*law, *(value for _, value in made))))
    kept = {a.name for a in function.inside} | {symbol.name for symbol in needed}
    begun = {symbol.name for symbol, _ in starts}
    inside = [
        *(Assignment(name=s.name, value=value) for s, value in starts if s.name in kept),
        *(a for a in function.inside if a.name not in begun),
        *(Assignment(name=s.name, value=value) for s, value in made),
    ]
    *views, (out, _) = function.views
    return replace(
        function,
        parameters=lowering.used([*values.values(), *outputs]),
        views=(*views, (out, f"({len(law)}, {names('n')})")),
        inside=tuple(inside),
        outputs=tuple(law),
    )


def _with_names(function: FunctionIR, names: tuple[Symbol, ...]) -> FunctionIR:
    """Call a shared subexpression that is the first of the outputs by that one's name."""
    temporary = function.outputs[0] if names else None
    if not any(Symbol(a.name, real=True) == temporary for a in function.inside):
        return function
    name = {temporary: names[0]}
    return replace(
        function,
        inside=tuple(
            Assignment(name=names[0].name if a.name == str(temporary) else a.name, value=a.value.xreplace(name))
            for a in function.inside
        ),
        outputs=tuple(form.xreplace(name) for form in function.outputs),
    )
