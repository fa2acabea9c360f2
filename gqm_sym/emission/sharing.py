"""The expressions of one function as straight-line code, with common parts computed once and constant parts before the
loop.
"""

from collections.abc import Iterable, Sequence

import sympy
from sympy import Basic, Expr, Function, Integer, Pow, Rational, Symbol, ordered

from gqm_sym.derivation.algebra.bottom_up import from_the_leaves_up, with_replaced
from gqm_sym.emission.ir import Assignment
from gqm_sym.errors import EmissionError

# The largest number of operations of one formula when it is expanded: one of a long curve has some thousands, a load on
# a body with a radius on a torus knot 10**5, and SymPy processes 10**5 in seconds.
MAX_SIZE = 200_000


def check_size(outputs: Iterable[Expr], *, where: str) -> None:
    """Refuse expressions that are too large, because SymPy visits all terms at every step.

    Divided differences share most of their parts, so that one with a thousand parts may have 10**12 when it is
    expanded.
    """
    sizes: dict[Basic, int] = {}

    def size(node: Basic) -> int:
        if node not in sizes:
            sizes[node] = 1 + sum(size(part) for part in node.args)
        return sizes[node]

    largest = max(map(size, outputs), default=0)
    if largest > MAX_SIZE:
        raise EmissionError(
            f"{where}: a formula of {largest} operations, and at most {MAX_SIZE} are emitted; "
            "declare the curve and the forces by shorter expressions"
        )


def straight_line(
    outputs: Iterable[Expr], inside: Sequence[tuple[Symbol, Expr]]
) -> tuple[tuple[Assignment, ...], tuple[Assignment, ...], tuple[Expr, ...]]:
    """Return the assignments before a loop and inside it, and the outputs in terms of these.

    Parameters
    ----------
    inside
        The assignments at the beginning of the loop: each symbol that depends on the place, and its value.
    """
    moving = {symbol for symbol, _ in inside}
    prepared, fixed = hoist(from_the_leaves_up(outputs, _half_power), moving)
    everything = [value for _, value in fixed] + prepared
    replaced, reduced = sympy.cse(everything, symbols=sympy.numbered_symbols("_t", real=True), order="canonical")
    before: list[Assignment] = []
    loop = [Assignment(name=s.name, value=v) for s, v in inside]
    for symbol, value in replaced:
        if value.free_symbols & moving:
            moving.add(symbol)
            loop.append(Assignment(name=symbol.name, value=value))
        else:
            before.append(Assignment(name=symbol.name, value=value))
    before += [Assignment(name=s.name, value=v) for (s, _), v in zip(fixed, reduced, strict=False)]
    needed = {s.name for e in (*reduced, *(a.value for a in before)) for s in e.free_symbols}
    kept: list[Assignment] = []
    for a in reversed(loop):  # an assignment that is needed only by an unused one is unused too
        if a.name in needed:
            kept.insert(0, a)
            needed |= {s.name for s in a.value.free_symbols}
    return _sorted(before), tuple(kept), tuple(reduced[len(fixed) :])


def _sorted(assignments: list[Assignment]) -> tuple[Assignment, ...]:
    """Return assignments in an order in which each name is assigned before it is used."""
    waiting, out = {a.name: a for a in assignments}, []
    while waiting:
        ready = [a for a in waiting.values() if not any(s.name in waiting for s in a.value.free_symbols)]
        for a in ready:
            out.append(waiting.pop(a.name))
    return tuple(out)


def _half_power(e: Expr) -> Expr:
    """Write a half-integer power as a power of a square root, which costs a tenth of a general power."""
    if e.is_Pow and isinstance(e.exp, Rational) and e.exp.q == 2 and abs(e.exp.p) > 1:
        return Function("sqrt")(e.base) ** e.exp.p
    return e


def hoist(outputs: Sequence[Expr], moving: set[Symbol]) -> tuple[list[Expr], list[tuple[Symbol, Expr]]]:
    """Give calls that do not depend on the place names of their own, so that they are not repeated in the loop."""
    named: list[tuple[Symbol, Expr]] = []
    outputs = list(outputs)
    while outermost := _fixed_calls(outputs, moving | {symbol for symbol, _ in named}):
        new = [(Symbol(f"_c{len(named) + i}", real=True), call) for i, call in enumerate(outermost)]
        replacement = {call: symbol for symbol, call in new}
        outputs = list(with_replaced(outputs, replacement))
        named += new
    return outputs, named


def _fixed_calls(outputs: Sequence[Expr], moving: set[Symbol]) -> list[Expr]:
    """Return the outermost calls that do not depend on the place."""
    symbols: dict[Basic, frozenset[Basic]] = {}

    def read_by(part: Basic) -> frozenset[Basic]:
        if part not in symbols:
            of_parts = (read_by(argument) for argument in part.args)
            symbols[part] = frozenset([part]) if part.is_Symbol else frozenset().union(*of_parts)
        return symbols[part]

    for output in outputs:
        read_by(output)
    calls = {
        call
        for call, read in symbols.items()
        if isinstance(call, Function | Pow)
        and not read & moving
        and read
        and not (call.is_Pow and isinstance(call.exp, Integer))
    }
    return [c for c in ordered(calls) if not any(c != o and o.has(c) for o in calls)]
