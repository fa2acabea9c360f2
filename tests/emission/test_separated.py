"""Potentials as sums of products add up to the potential, and no part has a parameter of its own."""

import pytest
import sympy as sp

import gqm_sym as gqm
from gqm_sym.derivation.algebra.separate import separate
from gqm_sym.emission.context import Lowering
from gqm_sym.emission.separated import separated_terms

S, X, Z = sp.Symbol("s", real=True), sp.Function("x"), sp.Function("z")
A, B, G, K = sp.symbols("a b g k", real=True)


@pytest.mark.parametrize(
    ("form", "held", "count"),
    [
        (G * Z(S), set(), 1),
        (G / (1 + B) * (Z(S) + 2 * X(S)), set(), 1),
        (G * (Z(S) - 3) - K**2 * X(S) ** 2 / 2, set(), 3),
        (K * Z(S) * (A * X(S) + B + Z(S)) * sp.exp(K), set(), 3),
        (K * (X(S) - A) ** 2 / 2 + G * Z(S), {A}, 2),
        (-K / sp.sqrt((X(S) - A) ** 2 + (Z(S) - B) ** 2), {A, B}, 1),
        (G * Z(S) * (A + sp.cos(A * X(S))), {A}, 2),
        (sp.exp(K * Z(S)) + K * Z(S), {K}, 2),
    ],
)
def test_parts_times_factors_are_the_form(form: sp.Expr, held: set[sp.Symbol], count: int) -> None:
    """Factors do not depend on the place, and parts depend only on parameters that are held fixed."""
    found: set[sp.Symbol] = set()
    for _ in range(2):  # the beginning of a form may have what its end lacks
        parts = separate(form, (S,), found)
    assert found == held
    assert len(parts) <= count
    assert sp.expand(sum(part * factor for part, factor in parts.items()) - form) == 0
    assert all(part.free_symbols <= {S, *held} and not factor.has(S) for part, factor in parts.items())


def test_only_charts_are_separated() -> None:
    """A curve with formulas has batches instead; bodies that lose energy have no table."""
    circle, ring = gqm.families.circle(), gqm.Curve.implicit("x**2 + z**2 - 1", start=(0, -1))
    assert separated_terms(Lowering(gqm.derive(circle, gqm.Gravity()))) is None
    assert separated_terms(Lowering(gqm.derive(ring, gqm.Gravity() + gqm.CoulombFriction()))) is None
    terms = separated_terms(Lowering(gqm.derive(ring, gqm.Gravity() + gqm.RotatingFrame())))
    assert terms is not None
    assert (terms.potentials, len(terms.factors.outputs), terms.function.parameters) == (2, 4, ())
