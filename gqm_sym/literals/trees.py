"""Trees of arithmetic, and their evaluation in any algebra.

A tree consists of ``ast`` nodes: BinOp, UnaryOp, Call with one argument, Name, and Constant with a Fraction.
"""

import ast
from collections.abc import Callable
from fractions import Fraction
from typing import Any, Protocol, TypeVar, cast

from gqm_sym.budgets import check_budget
from gqm_sym.errors import ExpressionError
from gqm_sym.literals import rationals

T = TypeVar("T")
N = TypeVar("N", bound=ast.expr)


class Algebra(Protocol[T]):
    """The operations that `evaluate` needs.

    A method raises ``ValueError`` or ``ArithmeticError`` for operations that it cannot compute; ``evaluate`` adds the
    place. Sums and products are passed as a whole, since adding term by term takes quadratic time in some algebras.
    """

    def number(self, value: Fraction, /) -> T:
        """Return the value of a literal."""

    def name(self, name: str, /) -> T:
        """Return the value of a constant of the grammar (``pi`` or ``e``) or of a name."""

    def negate(self, value: T, /) -> T:
        """Return ``-value``."""

    def total(self, terms: list[T], /) -> T:
        """Return the sum of two or more terms."""

    def product(self, factors: list[T], /) -> T:
        """Return the product of two or more factors."""

    def reciprocal(self, value: T, /) -> T:
        """Return ``1/value``."""

    def power(self, base: T, exponent: T, /) -> T:
        """Return ``base**exponent``."""

    def call(self, function: str, argument: T, /) -> T:
        """Return the value of one of the functions of the grammar."""


def evaluate(tree: ast.expr, algebra: Algebra[T], *, where: str) -> T:
    """Return the value of a tree in an algebra.

    A loop evaluates the terms of sums and products, so that only nesting needs stack.

    Raises
    ------
    ExpressionError
        If the algebra refuses an operation, or the tree has a node that is not arithmetic.
    """

    def at(node: ast.expr, operation: Callable[..., T], *operands: object) -> T:
        check_budget()
        try:
            return operation(*operands)
        except (ValueError, ArithmeticError) as error:
            raise ExpressionError(f"{where}: {_place(node)}{error}") from None

    match tree:
        case ast.Constant():
            value: object = tree.value
            if isinstance(value, Fraction):
                return at(tree, algebra.number, value)
        case ast.Name(id=name):
            return at(tree, algebra.name, name)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return at(tree, algebra.negate, evaluate(operand, algebra, where=where))
        case ast.Call(func=ast.Name(id=function), args=[inner]):
            return at(tree, algebra.call, function, evaluate(inner, algebra, where=where))
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            base = evaluate(left, algebra, where=where)
            return at(tree, algebra.power, base, evaluate(right, algebra, where=where))
        case ast.BinOp(op=ast.Add() | ast.Sub()):
            sums: list[T] = []
            for node, inverse in _chain(tree, ast.Add, ast.Sub):
                term = evaluate(node, algebra, where=where)
                sums.append(at(node, algebra.negate, term) if inverse else term)
            return at(tree, algebra.total, sums)
        case ast.BinOp(op=ast.Mult() | ast.Div()):
            factors: list[T] = []
            for node, inverse in _chain(tree, ast.Mult, ast.Div):
                factor = evaluate(node, algebra, where=where)
                factors.append(at(node, algebra.reciprocal, factor) if inverse else factor)
            return at(tree, algebra.product, factors)
    raise ExpressionError(f"{where}: {type(tree).__name__} is not part of arithmetic")


def check_exponents(tree: ast.expr, *, where: str) -> None:
    """Refuse constant powers that are too large, such as ``9**9**9**9``, before anything is computed."""
    evaluate(tree, _Exponents(), where=where)


def constant(value: Fraction, column: int | None = None) -> ast.Constant:
    """Return a leaf of a tree; ``column`` is its place in the text, if it was read from text."""
    # A Constant may hold any object; the type stubs allow only what Python's parser makes.
    leaf = ast.Constant(cast(Any, value))
    return leaf if column is None else at_column(leaf, column)


def at_column(node: N, column: int) -> N:
    """Return the same node with its column, counted from 0."""
    node.lineno, node.col_offset = 1, column
    return node


def _chain(tree: ast.expr, direct: type[ast.operator], inverse: type[ast.operator]) -> list[tuple[ast.expr, bool]]:
    """Return the operands of a chain of operators of one precedence, in order, each with whether it is inverted."""
    operands = []
    while isinstance(tree, ast.BinOp) and isinstance(tree.op, direct | inverse):
        operands.append((tree.right, isinstance(tree.op, inverse)))
        tree = tree.left
    operands.append((tree, False))
    return operands[::-1]


def _place(node: ast.expr) -> str:
    """Return ``column n: `` for a node that was read from text, and an empty text for others."""
    column = getattr(node, "col_offset", None)
    return "" if column is None else f"column {column + 1}: "


class _Exponents:
    """The algebra of rational numbers, in which every other value is None."""

    def number(self, value: Fraction) -> Fraction | None:
        return value

    def name(self, name: str) -> Fraction | None:
        return None

    def negate(self, value: Fraction | None) -> Fraction | None:
        return None if value is None else -value

    def total(self, terms: list[Fraction | None]) -> Fraction | None:
        known = [term for term in terms if term is not None]
        return rationals.total(known) if len(known) == len(terms) else None

    def product(self, factors: list[Fraction | None]) -> Fraction | None:
        known = [factor for factor in factors if factor is not None]
        return rationals.product(known) if len(known) == len(factors) else None

    def reciprocal(self, value: Fraction | None) -> Fraction | None:
        return None if value is None else rationals.reciprocal(value)

    def power(self, base: Fraction | None, exponent: Fraction | None) -> Fraction | None:
        if exponent is None:
            return None
        rationals.check_exponent(exponent)
        if base is None or exponent.denominator != 1:
            return None
        return rationals.power(base, exponent.numerator)

    def call(self, function: str, argument: Fraction | None) -> Fraction | None:
        return None
