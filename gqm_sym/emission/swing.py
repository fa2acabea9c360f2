"""What a sweep calls for orbits about an axis of symmetry, whose time is an integral without sines."""

from typing import TYPE_CHECKING

from gqm_sym.derivation.swing import APART, GAP, HALF, LACK, SCALE, SQUARE, TOP, TOP_APART, TOP_LACK
from gqm_sym.emission.ir import FunctionIR
from gqm_sym.emission.places import at
from gqm_sym.emission.sharing import hoist

if TYPE_CHECKING:
    from gqm_sym.emission.lower import Lowering


def swing_each(lowering: "Lowering") -> tuple[FunctionIR, ...]:
    """The pace of many orbits at the same share of their swing, and what is the same all along each."""
    names, swing = lowering.names, lowering.model.swing
    if swing is None:
        return ()
    fall, rise = names.symbol("fall"), names.symbol("rise")
    own = {symbol: names.symbol(symbol.name.removeprefix("_")) for symbol in (HALF, SCALE, *dict(swing.ends))}
    # fall + rise = 1: sums of what cannot cancel.
    here = own | {
        SQUARE: own[TOP] * fall,
        GAP: own[TOP] * rise,
        LACK: rise + own.get(TOP_LACK, TOP_LACK) * fall,
        APART: rise + own.get(TOP_APART, TOP_APART) * fall,
    }
    scale = [] if swing.scale is None else [(own[SCALE], swing.scale.xreplace(here))]
    outputs, calls = hoist([form.xreplace(here) for form in (swing.pace, swing.factor)], {fall, rise, own[SCALE]})
    ends = {own[symbol]: end.xreplace(own) for symbol, end in swing.ends}
    used = set().union(*(form.free_symbols for form in (*outputs, *dict(scale).values())))
    held = [*ends.items(), *((symbol, call.xreplace(ends)) for symbol, call in calls)]
    held = [(symbol, value) for symbol, value in held if symbol in used]
    behind = len(lowering.order)
    pace = lowering.function(
        "swing_each",
        "SWING_EACH",
        (fall.name, rise.name),
        "(dt/du)**2 where sin(u)**2 = fall = 1 - rise, and what that is divided by, each for an orbit of its own.",
        views=(),
        inside=[*((symbol, at(names("p"), behind + row)) for row, (symbol, _) in enumerate(held)), *scale],
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
