"""Polynomials in extended precision that are evaluated in integers, which takes a tenth of the time of mpmath's
floats.
"""

from collections.abc import Sequence
from typing import Any

GUARD_BITS = 30


class Polynomials:
    """Polynomials of one argument of size about 1, with two derivatives.

    They are evaluated with the context's current precision, which mpmath raises while it differentiates.

    Parameters
    ----------
    context
        An mpmath context.
    rows : sequence of sequences
        Coefficients of each polynomial, lowest power first.
    """

    def __init__(self, context: Any, rows: Sequence[Sequence[Any]]) -> None:
        self._context, self._terms = context, rows
        self._bits = 0

    def _fix(self, bits: int) -> None:
        self._bits = bits
        sizes = [max(self._context.frexp(term)[1] if term else -bits for term in row) for row in self._terms]
        self._rows = [
            (bits - size, [self._context.to_fixed(term, bits - size) for term in reversed(row)])
            for size, row in zip(sizes, self._terms, strict=True)
        ]

    def __call__(self, at: Any) -> list[tuple[Any, Any, Any]]:
        """Return the value and the first two derivatives of each polynomial."""
        context = self._context
        if context.prec + GUARD_BITS != self._bits:
            self._fix(context.prec + GUARD_BITS)
        bits, out = self._bits, []
        u = context.to_fixed(at, bits)
        for scale, row in self._rows:
            value = first = second = 0
            for term in row:
                second = (second * u >> bits) + 2 * first
                first = (first * u >> bits) + value
                value = (value * u >> bits) + term
            out.append(tuple(context.mpf((number, -scale)) for number in (value, first, second)))
        return out
