"""What a sweep calls: the conservative functions again, each place with a launch and parameters of its own."""

from dataclasses import replace
from typing import TYPE_CHECKING

from sympy import Expr, Function
from sympy.core.function import AppliedUndef

from gqm_sym.derivation.difference import Differences
from gqm_sym.emission.ir import FunctionIR
from gqm_sym.emission.places import at

if TYPE_CHECKING:
    from gqm_sym.emission.lower import Lowering

NEAR = frozenset({"cos2", "cosh2", "sin2", "sinh2"})
"""Differences that have a closed form for near points, without the rest: NaN tells a sweep to go another way."""


def _near(form: Expr) -> Expr:
    return form.replace(
        lambda t: isinstance(t, AppliedUndef) and t.func.__name__ in NEAR,
        lambda t: Function(f"near_{t.func.__name__}")(*t.args),
    )


def rise_each(lowering: "Lowering") -> FunctionIR:
    """First divided differences of climbs, ds and slopes of climbs."""
    model, names, place = lowering.model, lowering.names, lowering.place
    a, d = names.symbol("a"), names.symbol("d")
    starts, places, offsets = (names(name) for name in ("starts", "places", "offsets"))
    differences = Differences(place, (a, place), {(0, 1): d})
    return lowering.function(
        "rise_each",
        "RISE_EACH",
        (starts, places, offsets),
        "climb[a, {0}], ds/d{0} and the climb's derivative, each for a launch of its own.",
        views=tuple((name, names("n")) for name in (starts, places, offsets)),
        inside=[(a, at(starts)), (place, at(places)), (d, at(offsets))],
        outputs=(differences.first(model.climb, 0, 1), model.ds, model.climb_slope),
        each=True,
    )


def bend_each(lowering: "Lowering") -> FunctionIR:
    """Second divided differences of climbs, and ds."""
    model, names, place = lowering.model, lowering.names, lowering.place
    a, b, da, db = (names.symbol(s) for s in ("a", "b", "da", "db"))
    arrays = tuple(names(name) for name in ("lows", "highs", "left", "right"))
    differences = Differences(place, (a, place, b), {(0, 1): da, (1, 2): db, (0, 2): b - a})
    return lowering.function(
        "bend_each",
        "BEND_EACH",
        arrays,
        "climb[a, {0}, b] and ds/d{0}, each for an orbit of its own; NaN where the closed form ends.",
        views=tuple((name, names("n")) for name in arrays),
        inside=[
            *((symbol, at(array)) for symbol, array in zip((a, b, da, db), arrays, strict=True)),
            (place, Function("nearest")(a, b, da, db)),
        ],
        outputs=(_near(differences.second(model.climb)), model.ds),
        each=True,
    )


def bounds_each(lowering: "Lowering") -> FunctionIR:
    """Enclosures over many intervals."""
    once, n = lowering.bounds(), lowering.names("n")
    lo, hi, p, out = once.arguments
    return replace(
        once,
        name="bounds_each",
        signature="BOUNDS_EACH",
        arguments=(n, *once.arguments),
        doc=once.doc.replace("Bounds", "Bounds over many intervals").rstrip(".") + ", each for parameters of its own.",
        views=((lo, n), (hi, n), (p, f"({len(lowering.order)}, {n})"), (out, f"(4, {n})")),
        each=True,
    )


def each(lowering: "Lowering") -> tuple[FunctionIR, ...]:
    """All of them; none for a model whose motions are solved one by one."""
    model = lowering.model
    if model.dissipation is not None or model.curve.charted or model.force.radius:
        return ()
    return rise_each(lowering), bend_each(lowering)
