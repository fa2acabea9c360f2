"""The functions of a batch for orbits about an axis of symmetry, whose time is an integral without sines."""

from collections.abc import Iterable
from dataclasses import replace

from sympy import Expr, Function, S, Symbol, cos, cosh, sin, sinh

from gqm_sym.derivation.algebra.angles import is_power_of_two, of_sum
from gqm_sym.derivation.wells.symmetric_orbits import HALF, LAUNCH, OFFSET, SymmetricOrbits, at_place
from gqm_sym.emission.context import Lowering
from gqm_sym.emission.ir import ExactIR, FunctionIR
from gqm_sym.emission.sharing import hoist
from gqm_sym.emission.subscripts import at

AGM_DOC = "a**2, b**2: the half period (paper, eq. 17) is pi over the arithmetic-geometric mean of a and b (Gauss)."
INTEGRAND_DOC = "(dt/du)**2 at sine2 = sin(u)**2, and its divisor; dt/du integrates to the half period (paper, eq. 17)."


def axis_orbits_batch(lowering: Lowering) -> tuple[FunctionIR, ...]:
    """Return the functions for times of orbits about an axis, by an arithmetic-geometric mean or an integrand, and for
    their turning points.
    """
    orbits = lowering.model.symmetric_orbits
    if orbits is None:
        return ()
    times: tuple[FunctionIR, ...] = ()
    if orbits.agm_arguments is not None:
        times = (_agm_arguments(lowering, orbits.agm_arguments),)
    elif orbits.time_integrand is not None:
        times = _time_integrand(lowering, orbits, orbits.time_integrand)
    model = lowering.model
    if orbits.turning_point is None or model.cusp is not None or model.force.radius:
        return times
    return (*times, _turning_point(lowering, orbits.turning_point))


def exact_axis_orbits(lowering: Lowering) -> tuple[ExactIR, ...]:
    """Return the same arguments of the mean, or the same integrand, over a namespace of operations, for gradients."""
    orbits, names = lowering.model.symmetric_orbits, lowering.names
    if orbits is None or orbits.time_integrand is None:
        return ()
    half = names.symbol("half")
    if orbits.agm_arguments is not None:
        forms = tuple(square.xreplace({HALF: half}) for square in orbits.agm_arguments)
        return (
            ExactIR(
                name="exact_agm_arguments",
                doc=AGM_DOC,
                places=(half.name,),
                parameters=lowering.used(forms),
                inside=(),
                outputs=forms,
            ),
        )
    sine2, cosine2 = names.symbol("sine2"), names.symbol("cosine2")
    here = at_place({}, sine2, cosine2)
    ends = {symbol: end.xreplace({HALF: half}) for symbol, end in orbits.invariants}
    forms = tuple(form.xreplace(here).xreplace(ends) for form in (orbits.time_integrand, orbits.divisor))
    return (lowering.exact_function("time_integrand", INTEGRAND_DOC, forms, (half, sine2, cosine2)),)


def _turning_point(lowering: Lowering, forms: tuple[Expr, ...]) -> FunctionIR:
    names = lowering.names
    offset, launch = names.symbol("offset"), names.symbol("launch")
    offsets, launches = names("offsets"), names("launches")
    return lowering.function(
        "turning_point_batch",
        (offsets, launches),
        "From V**2 at an offset: half the orbit's width (paper, eq. 14), -dV**2/dq, and a sine's square q at the turn.",
        inside=[(offset, at(offsets)), (launch, at(launches))],
        outputs=tuple(form.xreplace({OFFSET: offset, LAUNCH: launch}) for form in forms),
        batch=True,
    )


def _agm_arguments(lowering: Lowering, squares: tuple[Expr, Expr]) -> FunctionIR:
    half = lowering.names.symbol("half")
    return _of_widths(lowering, "agm_arguments_batch", AGM_DOC, [square.xreplace({HALF: half}) for square in squares])


def _of_widths(lowering: Lowering, name: str, doc: str, values: Iterable[Expr]) -> FunctionIR:
    """Return a function for terms that follow from half the width of an orbit, given as the sum of two numbers."""
    half, rest, halves = lowering.names.symbol("half"), lowering.names.symbol("rest"), lowering.names("halves")
    found = lowering.function(
        name,
        (halves,),
        doc,
        inside=[(half, at(halves, 0)), (rest, at(halves, 1))],
        outputs=tuple(_with_rest(value, half, rest) for value in values),
        batch=True,
    )
    (_, n), *views = found.views
    return replace(found, views=((halves, f"(2, {n})"), *views))


def _without_constant_divisors(form: Expr, moving: set[Symbol]) -> Expr:
    """Multiply a form by the square of what it is divided by and what does not depend on the place.

    Only ratios of the form at places of one orbit are asked for, and a division takes as long as many products.
    """
    constant, rest = form.as_independent(*moving, as_Add=False)
    above, below = constant.as_numer_denom()
    return above * below * rest


def _with_rest(value: Expr, half: Symbol, rest: Symbol) -> Expr:
    """Write a term that is constant along an orbit by half the orbit's width as a sum of two numbers.

    All nodes of an orbit have the rounding of its width in common: near a hilltop or a pole of the curve, and on walls
    that are much steeper than those of a parabola, it is several roundings of the time. Multiples of the width inside
    of hyperbolic sines are exact for the same reason.
    """

    def moved(call: Expr) -> Expr:
        rate = call.args[0] / half
        above, below = rate.as_numer_denom()
        exact = call if rate.has(half) or is_power_of_two(rate) else Function("sinh_of_ratio")(above, half, below)
        return exact + rest * call.args[0].diff(half) * cosh(call.args[0])

    value = value.replace(lambda t: isinstance(t, sin | cos), lambda t: of_sum(t, (half,), (half, rest, S.Zero)))
    return value.replace(lambda t: isinstance(t, sinh), moved).xreplace({half**2: half * (half + 2 * rest)})


def _time_integrand(lowering: Lowering, orbits: SymmetricOrbits, integrand: Expr) -> tuple[FunctionIR, ...]:
    names = lowering.names
    sine2, cosine2 = names.symbol("sine2"), names.symbol("cosine2")
    own = {symbol: names.symbol(symbol.name.removeprefix("_")) for symbol in (HALF, *dict(orbits.invariants))}
    here = own | at_place(own, sine2, cosine2)
    forms = integrand.xreplace(here), _without_constant_divisors(orbits.divisor.xreplace(here), {sine2, cosine2})
    outputs, calls = hoist(forms, {sine2, cosine2})
    ends = {own[symbol]: end.xreplace(own) for symbol, end in orbits.invariants}
    used = set().union(*(form.free_symbols for form in outputs))
    held = [*ends.items(), *((symbol, call.xreplace(ends)) for symbol, call in calls)]
    held = [(symbol, value) for symbol, value in held if symbol in used]
    behind = len(lowering.order)
    emitted = lowering.function(
        "time_integrand_batch",
        (sine2, cosine2),
        INTEGRAND_DOC,
        inside=[(symbol, at(names("p"), behind + row)) for row, (symbol, _) in enumerate(held)],
        outputs=tuple(outputs),
        batch=True,
        rows_behind=len(held),
    )
    if not held:
        return (emitted,)
    doc = "Terms that are constant along an orbit; ``time_integrand_batch`` reads them after the parameters."
    return emitted, _of_widths(lowering, "integrand_invariants_batch", doc, [value for _, value in held])
