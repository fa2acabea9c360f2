"""Expressions visited and rewritten from their leaves up, each common part once."""

from collections.abc import Callable, Iterable, Iterator, Mapping

from sympy import Basic, Expr, Symbol


def distinct_parts(forms: Iterable[Expr]) -> set[Basic]:
    """Return all parts of the forms, and the forms themselves."""
    return set(parts_in_order(forms))


def parts_in_order(forms: Iterable[Basic]) -> Iterator[Basic]:
    """Yield the forms and all their parts, each once, and each form before its parts."""
    found: set[Basic] = set()
    waiting: list[Basic] = list(forms)[::-1]
    while waiting:
        part = waiting.pop()
        if part not in found:
            found.add(part)
            yield part
            waiting += part.args[::-1]


def symbols_of(forms: Iterable[Expr]) -> set[Symbol]:
    """Return the symbols in the forms."""
    return {part for part in parts_in_order(forms) if isinstance(part, Symbol)}


def with_replaced(forms: Iterable[Expr], known: Mapping[Expr, Expr]) -> tuple[Expr, ...]:
    """Return the forms with other expressions in place of some of their parts.

    SymPy's ``xreplace`` visits a part as often as it occurs.
    """
    done: dict[Expr, Expr] = dict(known)

    def replaced(part: Expr) -> Expr:
        if part not in done:
            arguments = [replaced(argument) for argument in part.args]
            same = all(new is old for new, old in zip(arguments, part.args, strict=True))
            done[part] = part if same else part.func(*arguments)
        return done[part]

    return tuple(map(replaced, forms))


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
