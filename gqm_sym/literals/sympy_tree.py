"""Conversion of a SymPy expression to the tree that the same expression would give as text.

One grammar thus serves for both. SymPy is not imported here: its objects are recognised by the names of their classes.
"""

import ast
import keyword
from fractions import Fraction
from functools import reduce
from typing import Any

from gqm_sym.errors import ExpressionError
from gqm_sym.literals import rationals
from gqm_sym.literals.grammar import CONSTANTS, FUNCTIONS, MAX_DEPTH, NAME
from gqm_sym.literals.trees import constant

# One pair of parentheses in text may be three levels of a tree: 1 + x*sin(...).
_MAX_LEVELS = 3 * MAX_DEPTH
_CONSTANTS = {"Pi": "pi", "Exp1": "e"}
_FUNCTIONS = {"Abs": "abs", **{name: name for name in FUNCTIONS if name != "abs"}}
_NOT_REAL = {
    "ImaginaryUnit": "I is not real",
    "NaN": "nan is not a number",
    "Infinity": "oo is not finite",
    "NegativeInfinity": "-oo is not finite",
    "ComplexInfinity": "zoo is not finite",
}


def is_sympy(value: object) -> bool:
    """Return whether ``value`` is a SymPy object."""
    return any((base.__module__ or "").partition(".")[0] == "sympy" for base in type(value).__mro__)


def tree_of(value: object, *, where: str) -> ast.expr:
    """Return the tree of a SymPy expression; a Float stands for its exact binary value.

    Raises
    ------
    ExpressionError
        If the expression has a part that is not in the grammar; the message names it.
    """
    return _tree(value, where, 0)


def _tree(node: Any, where: str, depth: int) -> ast.expr:
    head = type(node).__name__
    if depth > _MAX_LEVELS:
        raise ExpressionError(f"{where}: nested deeper than {_MAX_LEVELS} levels; name its parts")
    if head in _NOT_REAL:
        raise ExpressionError(f"{where}: {_NOT_REAL[head]}; write real, finite expressions")
    if head in _CONSTANTS:
        return ast.Name(_CONSTANTS[head], ast.Load())
    if getattr(node, "is_Rational", False) or hasattr(node, "_mpf_"):
        return _constant(node, where)
    if head == "Symbol":
        return _symbol(node, where)
    arguments: tuple[Any, ...] = getattr(node, "args", ())
    # An undefined function may have any name, even "sin"; the module of its class distinguishes it from SymPy's
    # functions.
    known = (type(node).__module__ or "").startswith("sympy.")
    if known and head in ("Add", "Mul", "Pow"):
        operator = {"Add": ast.Add, "Mul": ast.Mult, "Pow": ast.Pow}[head]
        parts = [_tree(argument, where, depth + 1) for argument in arguments]
        return reduce(lambda left, right: ast.BinOp(left, operator(), right), parts)
    if known and head in _FUNCTIONS and len(arguments) == 1:
        function = ast.Name(_FUNCTIONS[head], ast.Load())
        return ast.Call(function, [_tree(arguments[0], where, depth + 1)], [])
    if type(type(node)).__name__ == "UndefinedFunction":
        raise ExpressionError(f"{where}: function {head!r} is undefined; write its definition instead")
    raise ExpressionError(
        f"{where}: {head} is not in the grammar; use + - * / **, pi, E and functions of one "
        f"argument: {', '.join(FUNCTIONS)}"
    )


def _constant(node: Any, where: str) -> ast.expr:
    try:
        if hasattr(node, "_mpf_"):
            return constant(rationals.bounded(rationals.from_mpf(node._mpf_)))
        return constant(rationals.bounded(Fraction(int(node.p), int(node.q))))
    except ValueError as error:
        raise ExpressionError(f"{where}: {error}") from None


def _symbol(node: Any, where: str) -> ast.expr:
    if node.name in (*FUNCTIONS, *CONSTANTS) or keyword.iskeyword(node.name):
        raise ExpressionError(
            f"{where}: symbol {node.name!r} has the name of a function, a constant or a keyword of Python; "
            "choose another name"
        )
    if not NAME.fullmatch(node.name):
        raise ExpressionError(
            f"{where}: symbol {node.name!r}: a name consists of ASCII letters, digits and _, and begins with a letter"
        )
    if node.is_real is False:
        raise ExpressionError(f"{where}: symbol {node.name!r} is declared as not real; remove that assumption")
    return ast.Name(node.name, ast.Load())
