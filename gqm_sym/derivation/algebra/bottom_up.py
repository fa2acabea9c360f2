"""Expressions visited and rewritten from their leaves up, each common part once."""

from collections.abc import Callable, Iterable

from sympy import Basic, Expr


def distinct_parts(forms: Iterable[Expr]) -> set[Basic]:
    """Return all parts of the forms, and the forms themselves."""
    found: set[Basic] = set()
    waiting: list[Basic] = list(forms)
    while waiting:
        part = waiting.pop()
        if part not in found:
            found.add(part)
            waiting += part.args
    return found


def from_the_leaves_up(forms: Iterable[Expr], rule: Callable[[Expr], Expr]) -> tuple[Expr, ...]:
    """Apply a rule to each part of the forms after its arguments, and leave what the rule returns as it is.

    SymPy's ``replace`` visits a part as often as it occurs, which in formulas of space curves is hundreds of times.
    """
    known: dict[Expr, Expr] = {}

    def rewritten(part: Expr) -> Expr:
        if part not in known:
            arguments = [rewritten(argument) for argument in part.args]
            same = all(new is old for new, old in zip(arguments, part.args, strict=True))
            known[part] = rule(part if same else part.func(*arguments))
        return known[part]

    return tuple(map(rewritten, forms))
