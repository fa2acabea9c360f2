"""Divided differences of an expression, built by exact rules that never subtract nearly equal numbers.

For ``u`` along a curve with parameter lam, ``u[x, y] = (u(y) - u(x))/(y - x)`` and the second difference ``u[a,
lam, b]``
follow from the expression's tree (MATHS, section 3). A function of the tree's nodes contributes its own divided
differences, as calls of small helpers of the runtime: ``divdiff1_sin(x, y, h)`` is sin[x, y] with h = y - x, and
``divdiff2_sin(x, y, w, h1, h2)`` is sin[x, y, w]. The gaps h are formed from the given offsets, never from the values.
"""

from dataclasses import dataclass, field

import sympy
from sympy import Expr, Function, Integer, Rational, S, Symbol

from gqm_sym.budgets import check_budget
from gqm_sym.derivation.algebra.cotangents import Cotangent, cotangent_of, with_cotangents
from gqm_sym.derivation.algebra.quotients import Quotient, quotient_of
from gqm_sym.errors import EmissionError
from gqm_sym.sympy_charts import MEAN_HEIGHT, MEAN_PARTS, SPACE, chart_alpha, chart_x, chart_z

# Functions that have the helpers `divdiff1_<name>` and `divdiff2_<name>` in the runtime.
HELPERS = {
    sympy.sin: "sin",
    sympy.cos: "cos",
    sympy.tan: "tan",
    sympy.asin: "asin",
    sympy.acos: "acos",
    sympy.atan: "atan",
    sympy.sinh: "sinh",
    sympy.cosh: "cosh",
    sympy.tanh: "tanh",
    sympy.asinh: "asinh",
    sympy.acosh: "acosh",
    sympy.atanh: "atanh",
    sympy.exp: "exp",
    sympy.log: "log",
    sympy.Abs: "abs",
    chart_x: "chart_x",
    chart_z: "chart_z",
    chart_alpha: "chart_alpha",
    **{head: head.__name__ for head in (*SPACE, MEAN_HEIGHT[0], *(heads[0] for heads in MEAN_PARTS))},
}


@dataclass(slots=True)
class Differences:
    """Values and divided differences of expressions over the places ``points``, whose gaps are given.

    Attributes
    ----------
    parameter : Symbol
        The curve's parameter.
    points : tuple of Symbol
        Two or three places: (x, y) or (a, lam, b).
    gaps : dict
        Gap ``points[j] - points[i]`` for i < j, as an expression in the given offsets.
    """

    parameter: Symbol
    points: tuple[Symbol, ...]
    gaps: dict[tuple[int, int], Expr]
    _first: dict[tuple[Expr, int, int], Expr] = field(default_factory=dict)
    _second: dict[Expr, Expr] = field(default_factory=dict)

    def value(self, u: Expr, i: int) -> Expr:
        """Return ``u`` at place i."""
        return u.xreplace({self.parameter: self.points[i]})

    def first(self, u: Expr, i: int, j: int) -> Expr:
        """Return ``u[points[i], points[j]]``."""
        key = (u, i, j)
        if key not in self._first:
            check_budget()
            self._first[key] = self._build_first(with_cotangents(u, self.parameter), i, j)
        return self._first[key]

    def second(self, u: Expr) -> Expr:
        """Return ``u[a, lam, b]``."""
        if u not in self._second:
            check_budget()
            self._second[u] = self._build_second(with_cotangents(u, self.parameter))
        return self._second[u]

    def gap(self, u: Expr, i: int, j: int) -> Expr:
        """Return ``u(points[j]) - u(points[i])`` without a subtraction."""
        return self.gaps[i, j] * self.first(u, i, j)

    def _build_first(self, u: Expr, i: int, j: int) -> Expr:
        if not u.has(self.parameter):
            return S.Zero
        if u == self.parameter:
            return S.One
        if u.is_Add:
            return sympy.Add(*[self.first(term, i, j) for term in u.args])
        outermost = _outermost(u, self.parameter)
        if outermost is None:
            left, right = _halves(u, self.parameter)
            return self.first(left, i, j) * self.value(right, j) + self.value(left, i) * self.first(right, i, j)
        outer, inner = outermost
        return outer.first(self.value(inner, i), self.value(inner, j), self.gap(inner, i, j)) * self.first(inner, i, j)

    def _build_second(self, u: Expr) -> Expr:
        if not u.has(self.parameter) or u == self.parameter:
            return S.Zero
        if u.is_Add:
            return sympy.Add(*[self.second(term) for term in u.args])
        outermost = _outermost(u, self.parameter)
        if outermost is None:
            left, right = _halves(u, self.parameter)
            return (
                self.second(left) * self.value(right, 2)
                + self.first(left, 0, 1) * self.first(right, 1, 2)
                + self.value(left, 0) * self.second(right)
            )
        outer, inner = outermost
        at = [self.value(inner, k) for k in range(3)]
        low, high = self.gap(inner, 0, 1), self.gap(inner, 1, 2)
        second = outer.second(at[0], at[1], at[2], low, high) * self.first(inner, 0, 1) * self.first(inner, 0, 2)
        curved = self.second(inner)
        if curved != 0:
            second += outer.first(at[1], at[2], high) * curved
        return second


def _halves(product: Expr, parameter: Symbol) -> tuple[Expr, Expr]:
    """Split a product into two factors, the first of which does not depend on the parameter if possible."""
    fixed, moving = product.as_independent(parameter, as_Add=False)
    if fixed != 1:
        return fixed, moving
    factors = list(sympy.ordered(moving.args))
    return factors[0], sympy.Mul(*factors[1:])


@dataclass(frozen=True, slots=True)
class _Named:
    """A function that has its own helpers in the runtime."""

    name: str

    def first(self, x: Expr, y: Expr, h: Expr) -> Expr:
        return Function(f"divdiff1_{self.name}")(x, y, h)

    def second(self, x: Expr, y: Expr, w: Expr, h1: Expr, h2: Expr) -> Expr:
        return Function(f"divdiff2_{self.name}")(x, y, w, h1, h2)


@dataclass(frozen=True, slots=True)
class _Power:
    """A power with a constant exponent; small integer powers are written out, others use helpers."""

    exponent: Expr

    def first(self, x: Expr, y: Expr, h: Expr) -> Expr:
        n = self.exponent
        if n == 2:
            return x + y
        if n == 3:
            return x**2 + x * y + y**2
        if n == -1:
            return -1 / (x * y)
        if n == Rational(1, 2):
            return 1 / (sympy.sqrt(x) + sympy.sqrt(y))
        return self._helper(1)(x, y, h, n)

    def second(self, x: Expr, y: Expr, w: Expr, h1: Expr, h2: Expr) -> Expr:
        n = self.exponent
        if n == 2:
            return S.One
        if n == 3:
            return x + y + w
        if n == 4:
            return x**2 + y**2 + w**2 + x * y + x * w + y * w
        if n == -1:
            return 1 / (x * y * w)
        if n == Rational(1, 2):
            root = [sympy.sqrt(t) for t in (x, y, w)]
            return -1 / ((root[0] + root[1]) * (root[1] + root[2]) * (root[2] + root[0]))
        return self._helper(2)(x, y, w, h1, h2, n)

    def _helper(self, order: int) -> Function:
        return Function(f"divdiff{order}_{'ipow' if isinstance(self.exponent, Integer) else 'rpow'}")


def _outermost(u: Expr, parameter: Symbol) -> tuple[_Named | _Power | Quotient | Cotangent, Expr] | None:
    """Return ``u`` as a function of a simpler expression; None if it is a product and no such function."""
    known = quotient_of(u, parameter) or cotangent_of(u, parameter)
    if known is not None or u.is_Mul:
        return known
    if type(u) in HELPERS:
        return _Named(HELPERS[type(u)]), u.args[0]
    if u.is_Pow:
        base, exponent = u.args
        if not exponent.has(parameter):
            if isinstance(exponent, Rational) and exponent.q == 2 and exponent != Rational(1, 2):
                return _Power(Integer(exponent.p)), sympy.Pow(base, Rational(1, 2))
            return _Power(exponent), base
        return _Named("exp"), exponent * sympy.log(base)
    raise EmissionError(f"{u.func.__name__}: no rule for its divided difference; rewrite the curve without it")
