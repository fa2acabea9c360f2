"""The functions of a model that is not conservative: the law for V**2 along a leg, and the forces that hold a body at
rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import sympy
from sympy import Expr, Symbol

from gqm_sym.derivation import Model
from gqm_sym.derivation.forces.dissipation import (
    CORIOLIS,
    LOAD,
    LOADS,
    PUSH,
    SIGMA,
    TILT,
    TURN,
    TURNS,
    UPRIGHT,
    Dissipation,
)
from gqm_sym.emission.context import Lowering
from gqm_sym.emission.ir import Assignment, ExactIR, FunctionIR
from gqm_sym.emission.subscripts import at
from gqm_sym.kernels.base import CONTACT_SIGN, DIRECTION, KAPPA, W
from gqm_sym.sympy_charts import (
    AXES,
    SPACE_ROWS,
    ChartFunction,
    chart_alpha,
    chart_kappa,
    chart_x,
    chart_z,
    space_roll,
)

_NAMES = {
    **{SIGMA: "ds", KAPPA: "kappa", TURN: "turn", LOAD: "n0", PUSH: "push", TILT: "dxds"},
    **{symbol: f"turn_{axis}" for symbol, axis in zip(TURNS, "xyz", strict=True)},
    **{symbol: f"load_{axis}" for symbol, axis in zip(LOADS, "xyz", strict=True)},
    **dict(zip(UPRIGHT, ("n0_upright", "kappa_upright", "coriolis_upright"), strict=True)),
    **{symbol: f"coriolis_{axis}" for symbol, axis in zip(CORIOLIS, "xyz", strict=True)},
}
"""The names in emitted code of the geometric forms in a force law."""

# The description of a scalar product that the square of a contact force in space is made of.
ALONG_CURVATURE = "c, so that |N|**2 = m**2*(kappa**2*V**4 + 2*c*V**2 + n0**2), where n0 is |N|/m at rest."

# The same in a rotating frame, and what odd powers of the velocity V = ds/dt add to it.
ALONG_CURVATURE_TURNING = (
    "c, where |N|**2 = m**2*(kappa**2*V**4 + 2*c*V**2 + n0**2 + odd powers of V), n0 = |N|/m at rest."
)
CORIOLIS_LOADS = "a and b, so that the odd powers of V = ds/dt in |N|**2 are m**2*2*V*(a + b*V**2)."
UPRIGHT_FORCE = "n0, kappa and perhaps c: N/m is n0 + kappa*V**2 + c*V along the upward direction, with V = ds/dt."
CORIOLIS_VECTOR = "The vector that V = ds/dt adds to t x N/m for each unit of V, t being the tangent."


@dataclass(frozen=True)
class _Law:
    """A force law as an emitted function evaluates it.

    Attributes
    ----------
    outputs
        One form for each row of ``out``, in the symbols of `_NAMES`.
    begin
        The assignments at the beginning of the loop besides the place.
    symbols
        The names of the signs and of V**2 in emitted code.
    """

    outputs: Sequence[Expr]
    begin: tuple[tuple[Symbol, Expr], ...]
    symbols: dict[Symbol, Expr]


def speed_equation(lowering: Lowering, loss: Dissipation) -> FunctionIR:
    """Return the function for P and Q of dW/dλ = P - Q W, and for the terms of the contact force."""
    names, lam = lowering.names, lowering.place
    places, speeds, v, nu = names("places"), names("speeds"), names.symbol("v"), names.symbol("nu")
    linearised = "" if loss.linear else ", linearised at V**2 = w"
    law = _Law(
        outputs=(SIGMA, loss.drive, loss.decay, *loss.contact),
        begin=() if loss.linear else ((names.symbol("w"), at(speeds)),),
        symbols={DIRECTION: v, CONTACT_SIGN: nu, W: names.symbol("w")},
    )
    contact, force = "n0, kappa", ", N = m*(kappa*V**2 + n0)"
    if lowering.model.loads:
        contact, force = ("|n0|, |kappa|" if loss.linear else "|N|/m, 0"), ""
        if UPRIGHT[0] in loss.contact[0].free_symbols:
            contact = "n0 and kappa" if loss.contact[1] else "N/m and 0"
            contact += " along the upward direction of riders"
    doc = (
        f"ds/d{lam}, P, Q, {contact}: dV**2/d{lam} = P - Q*V**2{linearised}{force} (paper, eq. 19); "
        "v = sgn(ds/dt), nu = sgn(N)."
    )
    function = _in_pieces(lowering, loss, "speed_equation", (places, speeds, v, nu), doc, law)
    if law.begin:
        return function
    # A law that is linear in V**2 does not read it.
    return replace(function, views=tuple(view for view in function.views if view[0] != speeds))


def static_balance(lowering: Lowering, loss: Dissipation) -> FunctionIR:
    """Return the function for the accelerations of a body at rest that is about to move forwards or backwards."""
    doc = "Acceleration from rest forwards, and backwards: a body rests where the first is <= 0 and the second >= 0."
    return _in_pieces(lowering, loss, "static_balance", (lowering.names("places"),), doc, _Law(loss.holds, (), {}))


def squared_contact(lowering: Lowering, loss: Dissipation) -> tuple[FunctionIR, ...]:
    """Return the function for the square of the contact force, and for the factor of friction; nothing for other
    laws.
    """
    if not loss.squared_contact:
        return ()
    doc = (
        f"Coefficients of 1, V**2 and V**4 in (N/m)**2, and the factor of -v*|N|/m in dV**2/d{lowering.place}; "
        "v = sgn(ds/dt)."
    )
    law = _Law(loss.squared_contact, (), {})
    return (_in_pieces(lowering, loss, "squared_contact", (lowering.names("places"),), doc, law),)


def speed_slope(lowering: Lowering, loss: Dissipation) -> ExactIR:
    """Return the law itself over a namespace of operations: dW/dλ as a function of the place, W and both signs."""
    w, v, nu = (lowering.names.symbol(name) for name in ("w", "v", "nu"))
    form = loss.along(2 * SIGMA * loss.acceleration).xreplace({W: w, DIRECTION: v, CONTACT_SIGN: nu})
    doc = f"dV**2/d{lowering.place} where V**2 = {w}, {v} = sgn(ds/dt) and {nu} = sgn(N) (paper, eq. 19)."
    return lowering.exact_function("speed_slope", doc, (form,), (lowering.place, w, v, nu))


def contact_products(model: Model) -> tuple[tuple[str, str, tuple[Expr, ...]], ...]:
    """Return the formulas from which ``|N|**2`` follows besides kappa and n0, each with its name and description;
    nothing in a vertical plane.

    With t × N/m = W b + ℓ + V a it is a polynomial in the velocity V.
    """
    if not model.loads:
        return ()
    bend, load, aside = model.curvature_binormal, model.loads, model.coriolis
    if not aside:
        return (("load_along_curvature", ALONG_CURVATURE, (_dot(bend, load),)),)
    even = _dot(bend, load) + _dot(aside, aside) / 2
    return (
        ("load_along_curvature", ALONG_CURVATURE_TURNING, (even,)),
        ("coriolis_loads", CORIOLIS_LOADS, (_dot(load, aside), _dot(bend, aside))),
    )


def _dot(one: Sequence[Expr], other: Sequence[Expr]) -> Expr:
    return sympy.Add(*(a * b for a, b in zip(one, other, strict=True)))


def planar_point(lowering: Lowering) -> tuple[tuple[Symbol, ...], tuple[Expr, ...]]:
    """Return names for coordinates, tangent and curvature at a place of a charted curve in a plane, and their forms."""
    place = lowering.place
    angle = chart_alpha(place)
    forms = (chart_x(place), chart_z(place), sympy.cos(angle), sympy.sin(angle), chart_kappa(place))
    return tuple(map(lowering.names.symbol, ("x", "z", "dxds", "dzds", "kappa"))), forms


def chart_law(lowering: Lowering, loss: Dissipation) -> tuple[ExactIR, ...]:
    """Return contact force and law along a charted curve in terms of the chart's values at a point; nothing if they
    depend on more.
    """
    model, place = lowering.model, lowering.place
    point, forms = point_in_space(lowering) if model.curve.in_space else planar_point(lowering)
    w, v, nu = (lowering.names.symbol(name) for name in ("w", "v", "nu"))
    known = {**dict(zip(forms, point, strict=True)), W: w, DIRECTION: v, CONTACT_SIGN: nu}
    load = model.static_normal_load.xreplace(known)
    slope = loss.along(2 * SIGMA * loss.acceleration).xreplace(known)
    if model.ds != 1 or place in load.free_symbols | slope.free_symbols:
        return ()
    doc = f"dV**2/d{place} where V**2 = {w}, {v} = sgn(ds/dt) and {nu} = sgn(N) (paper, eq. 19)."
    found = (
        lowering.exact_function("static_normal_load", "n0 = N/m of a body at rest (paper, eq. 15).", (load,), point),
        lowering.exact_function("speed_slope", doc, (slope,), (*point, w, v, nu)),
    )
    products = (
        lowering.exact_function(name, text, tuple(form.xreplace(known) for form in forms), point)
        for name, text, forms in contact_products(model)
    )
    return (*found, *products, *upright_along_chart(lowering))


def point_in_space(lowering: Lowering) -> tuple[tuple[Symbol, ...], tuple[Expr, ...]]:
    """Return names for coordinates, tangent and curvature at a place of a charted curve in space, and their forms."""
    named = tuple(f"{d}{axis}{per}" for d, per in (("", ""), ("d", "ds"), ("dd", "ds2")) for axis in AXES)
    forms = tuple(SPACE_ROWS[axis][order](lowering.place) for order in range(3) for axis in AXES)
    return tuple(map(lowering.names.symbol, named)), forms


def upright_force(lowering: Lowering) -> tuple[ExactIR, ...]:
    """Return the formula for the component of N that decides about contact on a banked track; nothing for others."""
    upright = lowering.model.upright
    return (lowering.exact_function("upright_force", UPRIGHT_FORCE, upright, (lowering.place,)),) if upright else ()


def upright_along_chart(lowering: Lowering) -> tuple[ExactIR, ...]:
    """Return the same in terms of the chart's values at a point, the roll angle and the arc length; nothing if it
    depends on more than these.
    """
    place, roll, arc = lowering.place, lowering.names.symbol("roll"), lowering.names.symbol("arc")
    point, forms = point_in_space(lowering)
    known = {**dict(zip(forms, point, strict=True)), space_roll(place): roll}
    upright = tuple(form.xreplace(known).xreplace({place: arc}) for form in lowering.model.upright)
    if not upright or any(form.atoms(ChartFunction) for form in upright):
        return ()
    return (lowering.exact_function("upright_force", UPRIGHT_FORCE, upright, (*point, roll, arc)),)


def _in_pieces(
    lowering: Lowering, loss: Dissipation, name: str, arguments: tuple[str | Symbol, ...], doc: str, law: _Law
) -> FunctionIR:
    """Return a function that evaluates the geometric forms of a law, which have names, and then the law in terms of
    these.
    """
    law = replace(law, outputs=[form.xreplace(lowering.trigonometric) for form in law.outputs])
    turns, loads = lowering.turned_parts
    pieces = {**dict(loss.pieces), **dict(zip(TURNS, turns, strict=False)), **dict(zip(LOADS, loads, strict=False))}
    values = {
        piece: form.xreplace(lowering.trigonometric)
        for piece, form in pieces.items()
        if any(piece in o.free_symbols for o in law.outputs)
    }
    named = {piece: lowering.names.symbol(_NAMES[piece]) for piece, form in values.items() if not form.is_number}
    numbers = {piece: form for piece, form in values.items() if form.is_number}
    forms = [form.xreplace({**law.symbols, **named, **numbers}) for form in law.outputs]
    starts = [(lowering.place, at(lowering.names("places"))), *law.begin]
    function = lowering.function(name, arguments, doc, inside=starts, outputs=tuple(values[piece] for piece in named))
    shared: list[tuple[Symbol, Expr]] = []
    if not loss.linear:
        shared, forms = sympy.cse(forms, symbols=sympy.numbered_symbols("_u", real=True), order="canonical")
    function = _with_names(function, tuple(named.values()))
    made = [*zip(named.values(), function.outputs, strict=True), *shared]
    *views, (out, _) = function.views
    return replace(
        function,
        parameters=lowering.used([*values.values(), *law.outputs]),
        views=(*views, (out, f"({len(forms)}, {lowering.names('n')})")),
        inside=_assembled(function, starts, [(s, value) for s, value in made if s != value], forms),
        outputs=tuple(forms),
    )


def _assembled(
    function: FunctionIR, starts: list[tuple[Symbol, Expr]], made: list[tuple[Symbol, Expr]], forms: list[Expr]
) -> tuple[Assignment, ...]:
    """Return the loop's statements: those at the beginning that are needed, the shared parts, and the named forms made
    of them.
    """
    needed = set[Symbol]().union(*(form.free_symbols for form in (*forms, *(value for _, value in made))))
    kept = {a.name for a in function.inside} | {symbol.name for symbol in needed}
    begun = {symbol.name for symbol, _ in starts}
    return (
        *(Assignment(name=s.name, value=value) for s, value in starts if s.name in kept),
        *(a for a in function.inside if a.name not in begun),
        *(Assignment(name=s.name, value=value) for s, value in made),
    )


def _with_names(function: FunctionIR, names: tuple[Symbol, ...]) -> FunctionIR:
    """Give a shared subexpression that equals an output the name of that output."""
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
