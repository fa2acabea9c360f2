"""How a lowered loop names the place that it stands at."""

from sympy import Expr, Function, Integer, Symbol


def at(array: str, row: int | None = None) -> Expr:
    """The element of an array, or of one of its rows, that the loop stands at."""
    rows = () if row is None else (Integer(row),)
    return Function("at")(Symbol(array, real=True), *rows)
