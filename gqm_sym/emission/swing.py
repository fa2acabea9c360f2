"""What a sweep calls for orbits about an axis of symmetry, whose time is an integral without sines."""

from typing import TYPE_CHECKING

from sympy import Expr

from gqm_sym.derivation.wells.swing import HALF, LAUNCH, OFFSET, Swing, at_share
from gqm_sym.emission.ir import FunctionIR
from gqm_sym.emission.sharing import hoist
from gqm_sym.emission.subscripts import at

if TYPE_CHECKING:
    from gqm_sym.emission.context import Lowering


def swing_each(lowering: "Lowering") -> tuple[FunctionIR, ...]:
    """The time of many orbits about an axis: by a mean, or else by their pace and what is the same all along each."""
    swing = lowering.model.swing
    if swing is None:
        return ()
    times = (_mean_each(lowering, swing.means),) if swing.means else _pace_each(lowering, swing)
    symmetry = lowering.model.symmetry
    if swing.crest is None or symmetry is None or not symmetry.monotone:
        return times
    return (*times, _crest_each(lowering, swing.crest))


def _crest_each(lowering: "Lowering", crest: tuple[Expr, ...]) -> FunctionIR:
    names = lowering.names
    offset, launch = names.symbol("offset"), names.symbol("launch")
    offsets, launches = names("offsets"), names("launches")
    return lowering.function(
        "crest_each",
        "CREST_EACH",
        (offsets, launches),
        "Half an orbit's width, where V**2 at an offset is used up; how the climb grows; above 1 where it never is.",
        views=((offsets, names("n")), (launches, names("n"))),
        inside=[(offset, at(offsets)), (launch, at(launches))],
        outputs=tuple(form.xreplace({OFFSET: offset, LAUNCH: launch}) for form in crest),
        each=True,
    )


def _mean_each(lowering: "Lowering", means: tuple[Expr, Expr]) -> FunctionIR:
    names = lowering.names
    half, halves = names.symbol("half"), names("halves")
    return lowering.function(
        "mean_each",
        "MEAN_EACH",
        (halves,),
        "Squares of two numbers, each pair for an orbit of its own: its half period is pi over their agm (Gauss).",
        views=((halves, names("n")),),
        inside=[(half, at(halves))],
        outputs=tuple(square.xreplace({HALF: half}) for square in means),
        each=True,
    )


def _pace_each(lowering: "Lowering", swing: Swing) -> tuple[FunctionIR, ...]:
    names = lowering.names
    fall, rise = names.symbol("fall"), names.symbol("rise")
    own = {symbol: names.symbol(symbol.name.removeprefix("_")) for symbol in (HALF, *dict(swing.ends))}
    here = own | at_share(own, fall, rise)
    outputs, calls = hoist([form.xreplace(here) for form in (swing.pace, swing.factor)], {fall, rise})
    ends = {own[symbol]: end.xreplace(own) for symbol, end in swing.ends}
    used = set().union(*(form.free_symbols for form in outputs))
    held = [*ends.items(), *((symbol, call.xreplace(ends)) for symbol, call in calls)]
    held = [(symbol, value) for symbol, value in held if symbol in used]
    behind = len(lowering.order)
    pace = lowering.function(
        "swing_each",
        "SWING_EACH",
        (fall.name, rise.name),
        "(dt/du)**2 where sin(u)**2 = fall = 1 - rise, and what that is divided by, each for an orbit of its own.",
        views=(),
        inside=[(symbol, at(names("p"), behind + row)) for row, (symbol, _) in enumerate(held)],
        outputs=tuple(outputs),
        each=True,
        held=len(held),
    )
    if not held:
        return (pace,)
    halves = names("halves")
    turn = lowering.function(
        "top_each",
        "TOP_EACH",
        (halves,),
        "What is the same all along a swing: ``swing_each`` finds it behind the run-time parameters.",
        views=((halves, names("n")),),
        inside=[(own[HALF], at(halves))],
        outputs=tuple(value for _, value in held),
        each=True,
    )
    return pace, turn
