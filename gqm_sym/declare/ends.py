"""The ends of a curve's parameter: read, and checked as far as they are numbers."""

from collections.abc import Iterable
from typing import TypeAlias

import sympy as sp

from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import Source, read_expression

Ends: TypeAlias = tuple[sp.Expr | None, sp.Expr | None]


def read_ends(domain: Iterable[Source | None] | None, kind: str) -> Ends:
    """Read both ends of a domain, each None where it is open.

    Raises
    ------
    DeclarationError
        If it is no pair.
    """
    if domain is None:
        return (None, None)
    ends = None if isinstance(domain, str) else tuple(domain)
    if ends is None or len(ends) != 2:
        raise DeclarationError(
            f"{kind}: domain: must be two ends (lo, hi), either of them None where it is open; got {domain!r}"
        )
    low, high = (None if end is None else read_expression(end, where=f"{kind}: domain") for end in ends)
    return (low, high)


def check_ends(kind: str, domain: Ends, period: sp.Expr | None, parameter: sp.Symbol) -> None:
    """Refuse ends that depend on the curve's parameter or are out of order, and a period that is not positive."""
    for label, end in (("domain", domain[0]), ("domain", domain[1]), ("period", period)):
        if end is not None and parameter in end.free_symbols:
            raise DeclarationError(
                f"{kind}: {label}: {end} contains the curve's parameter {parameter.name!r}; "
                "only numbers and run-time parameters may stand there"
            )
    low, high = domain
    if low is not None and high is not None and (high - low).is_number and not high > low:
        raise DeclarationError(f"{kind}: domain: must have lo < hi, got ({low}, {high})")
    if period is not None and period.is_number and not period > 0:
        raise DeclarationError(f"{kind}: period: must be positive, got {period}")
