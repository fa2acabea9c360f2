"""How a lowered loop names the place that it stands at, and what does not depend on it."""

from collections.abc import Sequence

from sympy import Expr, Function, Integer, Pow, Symbol, ordered


def at(array: str, row: int | None = None) -> Expr:
    """The element of an array, or of one of its rows, that the loop stands at."""
    rows = () if row is None else (Integer(row),)
    return Function("at")(Symbol(array, real=True), *rows)


def hoist(outputs: Sequence[Expr], moving: set[Symbol]) -> tuple[list[Expr], list[tuple[Symbol, Expr]]]:
    """Give calls that do not depend on the place a name of their own, so that the loop need not repeat them."""
    named: list[tuple[Symbol, Expr]] = []
    outputs = list(outputs)
    while outermost := _fixed_calls(outputs, moving | {symbol for symbol, _ in named}):
        new = [(Symbol(f"_c{len(named) + i}", real=True), call) for i, call in enumerate(outermost)]
        replacement = {call: symbol for symbol, call in new}
        outputs = [e.xreplace(replacement) for e in outputs]
        named += new
    return outputs, named


def _fixed_calls(outputs: Sequence[Expr], moving: set[Symbol]) -> list[Expr]:
    """Calls that do not depend on the place and are no part of another such call."""
    calls = {
        call
        for e in outputs
        for call in e.atoms(Function, Pow)
        if not call.free_symbols & moving and call.free_symbols and not (call.is_Pow and isinstance(call.exp, Integer))
    }
    return [c for c in ordered(calls) if not any(c != o and o.has(c) for o in calls)]
