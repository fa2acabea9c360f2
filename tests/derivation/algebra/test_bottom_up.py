"""Parts of expressions are visited and rewritten once each, with the results of SymPy's own functions."""

import sympy as sp

from gqm_sym.derivation.algebra.bottom_up import distinct_parts, from_the_leaves_up

X, Y = sp.symbols("x y", real=True)
FORM = sp.sqrt(1 + sp.sin(X + sp.sin(Y)) ** 2) ** 3 / (X + sp.sin(Y)) + sp.sin(Y) * sp.cos(X * sp.sin(Y))


def test_distinct_parts() -> None:
    """They are the nodes of the whole tree."""
    assert distinct_parts([FORM, X]) == set(sp.preorder_traversal(FORM))


def test_from_the_leaves_up() -> None:
    """The result is that of ``replace``, also for a wave within a wave, and no part is rewritten twice."""
    seen = []

    def doubled(part: sp.Expr) -> sp.Expr:
        seen.append(part)
        return 2 * sp.cos(part.args[0]) if isinstance(part, sp.sin) else part

    first, second = from_the_leaves_up([FORM, sp.sin(Y)], doubled)
    assert first == FORM.replace(lambda part: isinstance(part, sp.sin), lambda part: 2 * sp.cos(part.args[0]))
    assert second == 2 * sp.cos(Y)
    assert len(set(seen)) == len(seen)
