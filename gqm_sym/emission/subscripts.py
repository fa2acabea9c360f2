"""The element of an array that belongs to the current pass of a loop."""

from sympy import Expr, Function, Integer, Symbol


def at(array: str, row: int | None = None) -> Expr:
    """Return the element of an array, or of one of its rows, in the current pass of the loop."""
    rows = () if row is None else (Integer(row),)
    return Function("at")(Symbol(array, real=True), *rows)
