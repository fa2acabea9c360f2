"""How a lowered loop names the place that it stands at."""

from sympy import Expr, Function, Symbol


def at(array: str) -> Expr:
    """The element of an array that the loop stands at."""
    return Function("at")(Symbol(array, real=True))
