"""The potential and the load along a charted curve as sums of products of a factor, which depends on parameters, and a
part, which depends on the place.
"""

from sympy import Expr, S

from gqm_sym.derivation.algebra.difference import Differences
from gqm_sym.derivation.algebra.separate import separate
from gqm_sym.emission.context import Lowering
from gqm_sym.emission.ir import ExactIR, SeparatedIR
from gqm_sym.emission.subscripts import at

# The largest number of terms of the potential and the load for which tables are worth their time.
MAX_TERMS = 12


def separated_terms(lowering: Lowering) -> SeparatedIR | None:
    """Return the function for divided differences of the potential's parts, with path and load; None if there is
    nothing to be gained.
    """
    model, place = lowering.model, lowering.place
    if not model.curve.charted or model.curve.in_space or model.dissipation is not None:
        return None
    forms = [form.xreplace(lowering.trigonometric) for form in (model.effective_potential, model.static_normal_load)]
    path = [form.xreplace(lowering.trigonometric) for form in (model.ds, model.kappa)]
    held = {symbol for form in path for symbol in form.free_symbols} - {place}
    while True:
        before = set(held)
        potential, load = (separate(form, (place,), held) for form in forms)
        if held == before:
            break
    potential.pop(S.One, None)  # a constant changes nothing
    if not potential or not 0 < len(potential) + len(load) <= MAX_TERMS:
        return None
    a, d = lowering.names.symbol("a"), lowering.names.symbol("d")
    places, offsets = lowering.names("places"), lowering.names("offsets")
    differences = Differences(place, (a, place), {(0, 1): d})
    function = lowering.function(
        "separated_terms",
        (a, places, offsets),
        f"Parts of U[a, {place}] and of n0, whose factors are `exact_factors`; between them ds/d{place} and kappa.",
        inside=[(place, at(places)), (d, at(offsets))],
        outputs=(*(differences.first(part, 0, 1) for part in potential), *path, *load),
    )
    factors = lowering.constants(
        "exact_factors",
        "Factors of the parts of U, then of the parts of n0.",
        (*potential.values(), *load.values()),
    )
    return SeparatedIR(
        function=function,
        factors=factors,
        parts=_parts_by_coordinates(lowering, tuple(potential)),
        potentials=len(potential),
    )


def _parts_by_coordinates(lowering: Lowering, parts: tuple[Expr, ...]) -> ExactIR | None:
    """Return the potential's parts in terms of coordinates; None if they depend on more than these."""
    forms = tuple(map(lowering.by_coordinates, parts))
    if any(lowering.place in form.free_symbols for form in forms):
        return None
    return lowering.exact_function("parts", "Parts of U, by coordinates.", forms, lowering.coordinates)
