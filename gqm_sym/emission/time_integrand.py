"""The functions of a batch for orbits about an axis of symmetry, whose time is an integral without sines."""

from dataclasses import replace

from sympy import Expr, Function, S, Symbol, cos, sin, sinh

from gqm_sym.derivation.algebra.angles import is_power_of_two, of_sum
from gqm_sym.derivation.wells.symmetric_orbits import COSINE_AT_TURN, HALF, LAUNCH, OFFSET, SymmetricOrbits, at_place
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
    names = lowering.names
    half, halves = names.symbol("half"), names("halves")
    return lowering.function(
        "agm_arguments_batch",
        (halves,),
        AGM_DOC,
        inside=[(half, at(halves))],
        outputs=tuple(square.xreplace({HALF: half}) for square in squares),
        batch=True,
    )


def _without_constant_divisors(form: Expr, moving: set[Symbol]) -> Expr:
    """Multiply a form by the square of what it is divided by and what does not depend on the place.

    Only ratios of the form at places of one orbit are asked for, and a division takes as long as many products.
    """
    constant, rest = form.as_independent(*moving, as_Add=False)
    above, below = constant.as_numer_denom()
    return above * below * rest


def _with_exact_arguments(value: Expr, half: Symbol) -> Expr:
    """Let hyperbolic sines of a multiple of half the orbit's width be those of the exact multiple.

    On a wide orbit the rounding of the argument is several roundings of the sine, and all nodes have it in common.
    """

    def exact(call: Expr) -> Expr:
        rate = call.args[0] / half
        above, below = rate.as_numer_denom()
        return call if rate.has(half) or is_power_of_two(rate) else Function("sinh_of_ratio")(above, half, below)

    return value.replace(lambda t: isinstance(t, sinh), exact)


def _with_rest(value: Expr, half: Symbol, rest: Symbol) -> Expr:
    """Let sines and cosines of multiples of half the orbit's width be those of a sum of two numbers.

    Next to a pole of the curve the rounding of the width is many roundings of the cosine.
    """
    return value.replace(lambda t: isinstance(t, sin | cos), lambda t: of_sum(t, (half,), (half, rest, S.Zero)))


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
    halves = names("halves")
    values, inside = [_with_exact_arguments(value, own[HALF]) for _, value in held], [(own[HALF], at(halves))]
    next_to_pole = own.get(COSINE_AT_TURN) in used
    if next_to_pole:
        rest = names.symbol("rest")
        values = [_with_rest(value, own[HALF], rest) for value in values]
        inside = [(own[HALF], at(halves, 0)), (rest, at(halves, 1))]
    invariants = lowering.function(
        "integrand_invariants_batch",
        (halves,),
        "Terms that are constant along an orbit; ``time_integrand_batch`` reads them after the parameters.",
        inside=inside,
        outputs=tuple(values),
        batch=True,
    )
    if next_to_pole:
        (_, n), *views = invariants.views
        invariants = replace(invariants, views=((halves, f"(2, {n})"), *views))
    return emitted, invariants
