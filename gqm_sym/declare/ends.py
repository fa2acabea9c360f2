"""The ends of the range of a curve's parameter, which are read, and checked as far as they are numbers."""

from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

import sympy as sp

from gqm_sym.arguments import several
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import Source, read_expression
from gqm_sym.parameters import Value, exact_value

Ends: TypeAlias = tuple[sp.Expr | None, sp.Expr | None]


def read_ends(domain: Iterable[Source | None] | None, kind: str, unit: str | None) -> Ends:
    """Read both ends of a domain, each of which is None if it is open; ``unit`` is that of the parameter, None if not
    known.

    Raises
    ------
    DeclarationError
        If the domain is not a pair.
    """
    if domain is None:
        return (None, None)
    what = "two ends (lo, hi), either of them None where it is open"
    ends = several(domain, where=f"{kind}: domain", what=what)
    if len(ends) != 2:
        raise DeclarationError(f"{kind}: domain: must be {what}; got {len(ends)} of them")
    low, high = (None if end is None else read_expression(end, where=f"{kind}: domain", unit=unit) for end in ends)
    return (low, high)


def check_ends(kind: str, domain: Ends, period: sp.Expr | None, parameter: sp.Symbol) -> None:
    """Refuse ends that depend on the curve's parameter or are out of order, and a period that is not positive."""
    for label, end in (("domain", domain[0]), ("domain", domain[1]), ("period", period)):
        if end is not None and parameter in end.free_symbols:
            raise DeclarationError(
                f"{kind}: {label}: {end} contains the curve's parameter {parameter.name!r}; "
                "only numbers and run-time parameters may stand there"
            )
    check_order(kind, domain, period, {})


def check_order(kind: str, domain: Ends, period: sp.Expr | None, defaults: Mapping[str, Value | None]) -> None:
    """Refuse ends out of order and a period that is not positive, if they are numbers with the defaults."""
    values = {sp.Symbol(name, real=True): exact_value(value) for name, value in defaults.items() if value is not None}
    low, high, turn = (None if end is None else end.xreplace(values) for end in (*domain, period))
    used = {symbol.name for end in (*domain, period) if end is not None for symbol in end.free_symbols}
    given = ", ".join(f"{name} = {defaults[name]}" for name in sorted(used) if defaults.get(name) is not None)
    suffix = f" with {given}" if given else ""
    if low is not None and high is not None and _is_false(high > low):
        raise DeclarationError(
            f"{kind}: domain: must have lo < hi, got ({domain[0]}, {domain[1]}){suffix}; write the lower end first"
        )
    if turn is not None and _is_false(turn > 0):
        raise DeclarationError(f"{kind}: period: must be positive, got {period}{suffix}")


def _is_false(relation: Any) -> bool:
    # An order that SymPy cannot decide is accepted.
    return relation is False or relation is sp.false
