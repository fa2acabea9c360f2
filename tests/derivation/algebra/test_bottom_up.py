"""Parts of expressions are visited and rewritten once each, with the results of SymPy's own functions."""

import sympy as sp

from gqm_sym.derivation.algebra.bottom_up import (
    distinct_parts,
    from_the_leaves_up,
    parts_in_order,
    symbols_of,
    with_replaced,
)

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


def test_parts_that_occur_often_are_visited_once() -> None:
    """A form of 2**40 parts, of which only forty are different, is searched and rewritten at once."""
    shared = X
    for _ in range(40):
        shared = sp.Function("f")(shared, shared)
    assert len(list(parts_in_order([shared]))) == 41
    assert symbols_of([shared]) == {X}
    assert symbols_of(with_replaced([shared], {X: Y})) == {Y}


def test_with_replaced() -> None:
    """The result is that of ``xreplace``, which leaves what it has put in as it is."""
    known = {sp.sin(Y): X, X: Y, sp.sin(X + sp.sin(Y)): sp.S.One}
    assert with_replaced([FORM, X], known) == (FORM.xreplace(known), Y)
