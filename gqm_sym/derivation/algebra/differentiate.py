"""Exact derivatives of the expressions of the grammar, written so that they can be evaluated.

SymPy's own ``diff`` writes the derivative of ``u**p`` as ``p*u**p/u``, which is 0/0 where ``u`` vanishes, and brings in
``sign`` and ``Derivative``. Here every result consists of functions that the emitter can write.
"""

from collections.abc import Callable, Sequence

import sympy as sp

from gqm_sym.budgets import check_budget
from gqm_sym.errors import DerivationError
from gqm_sym.sympy_charts import SpaceFunction, TrainLoad

# The largest number of factors for which the product rule is written out in one sum.
MAX_FLAT_FACTORS = 4

# Outer derivatives f'(u), by the name of f.
_OUTER: dict[type[sp.Basic], Callable[[sp.Expr], sp.Expr]] = {
    sp.sin: sp.cos,
    sp.cos: lambda u: -sp.sin(u),
    sp.tan: lambda u: sp.cos(u) ** -2,
    sp.asin: lambda u: 1 / sp.sqrt(1 - u**2),
    sp.acos: lambda u: -1 / sp.sqrt(1 - u**2),
    sp.atan: lambda u: 1 / (1 + u**2),
    sp.sinh: sp.cosh,
    sp.cosh: sp.sinh,
    sp.tanh: lambda u: sp.cosh(u) ** -2,
    sp.asinh: lambda u: 1 / sp.sqrt(1 + u**2),
    # This has two roots and not the root of a product, because acosh is real only where both roots are.
    sp.acosh: lambda u: 1 / (sp.sqrt(u - 1) * sp.sqrt(u + 1)),
    sp.atanh: lambda u: 1 / (1 - u**2),
    sp.exp: sp.exp,
    sp.log: lambda u: 1 / u,
    # The sign of u in terms of the grammar's functions; it is undefined at a kink, as it must be.
    sp.Abs: lambda u: sp.Abs(u) / u,
}


def differentiate(expression: sp.Expr, variable: sp.Symbol) -> sp.Expr:
    """Return the derivative of ``expression`` with respect to ``variable``.

    Raises
    ------
    DerivationError
        If the expression contains a function that the grammar does not have.
    """
    known: dict[sp.Basic, sp.Expr] = {}

    def visit(node: sp.Basic) -> sp.Expr:
        if variable not in node.free_symbols:
            return sp.S.Zero
        if node not in known:
            check_budget()
            known[node] = _rule(node, variable, visit)
        return known[node]

    return visit(expression)


def _product_rule(factors: Sequence[sp.Basic], variable: sp.Symbol, visit: Callable[[sp.Basic], sp.Expr]) -> sp.Expr:
    moving = [place for place, factor in enumerate(factors) if variable in factor.free_symbols]
    if len(moving) > MAX_FLAT_FACTORS:
        # A term for each factor would square the length of the expression, and cube it in the second derivative.
        middle = moving[len(moving) // 2]
        first, second = factors[:middle], factors[middle:]
        return sp.Add(
            sp.Mul(_product_rule(first, variable, visit), *second),
            sp.Mul(*first, _product_rule(second, variable, visit)),
        )
    return sp.Add(*(sp.Mul(*factors[:place], visit(factors[place]), *factors[place + 1 :]) for place in moving))


def _rule(node: sp.Basic, variable: sp.Symbol, visit: Callable[[sp.Basic], sp.Expr]) -> sp.Expr:
    if node == variable:
        return sp.S.One
    if isinstance(node, sp.Add):
        return sp.Add(*(visit(term) for term in node.args))
    if isinstance(node, sp.Mul):
        return _product_rule(node.args, variable, visit)
    if isinstance(node, sp.Pow):
        base, exponent = node.args
        result = sp.S.Zero
        if variable in base.free_symbols:
            result += exponent * base ** (exponent - 1) * visit(base)
        if variable in exponent.free_symbols:
            result += node * sp.log(base) * visit(exponent)
        return result
    if isinstance(node, sp.atan2):
        # This is the angle of a tangent, which occurs in the laws of some curves.
        up, along = node.args
        return (along * visit(up) - up * visit(along)) / (along**2 + up**2)
    if isinstance(node, SpaceFunction | TrainLoad):
        rates = ((place, visit(argument)) for place, argument in enumerate(node.args, start=1))
        return sp.Add(*(node.fdiff(place) * rate for place, rate in rates if rate != 0))
    outer = _OUTER.get(node.func)
    if outer is None:
        raise DerivationError(
            f"{node.func.__name__}: no derivative is known for this function; "
            "write the expression with the functions of the grammar"
        )
    (inner,) = node.args
    return outer(inner) * visit(inner)
