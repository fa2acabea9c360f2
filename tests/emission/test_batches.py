"""What depends on the place of an orbit in a batch takes few operations, because it is evaluated at every node."""

import sympy as sp
from mpmath import cos, mp, mpf, sin, sqrt
from sympy.core.function import AppliedUndef

from gqm_sym.derivation.algebra.difference import Differences
from gqm_sym.emission.batches import _with_constant_factors

A, PLACE, B, DA, DB = sp.symbols("a y b da db", real=True)

# The helpers of the runtime by their definitions.
DEFINITIONS = {
    "divdiff1_cos_in_square": lambda h1, h2: (cos((h1 - h2) / 2) - cos((h1 + h2) / 2)) / (-h1 * h2),
    "divdiff1_sinc_in_square": lambda h1, h2: (
        (sin((h1 - h2) / 2) / ((h1 - h2) / 2) - sin((h1 + h2) / 2) / ((h1 + h2) / 2)) / (-h1 * h2)
    ),
    "divdiff1_sin": lambda x, y, h: (sin(y) - sin(x)) / h,
    "divdiff1_cos": lambda x, y, h: (cos(y) - cos(x)) / h,
    "sinc_near": lambda h: sin(h) / h,
}


def test_a_root_of_waves_takes_no_sine_of_the_place() -> None:
    """For a spring from a place beside a circle to the body, the first differences over the place and either end of
    the orbit follow from the second ones, and the value is that of the definition.
    """
    length = sp.sqrt((sp.cos(PLACE) - 3) ** 2 + sp.sin(PLACE) ** 2 + sp.sin(PLACE) / 5)
    differences = Differences(PLACE, (A, PLACE, B), {(0, 1): DA, (1, 2): DB, (0, 2): B - A})
    (form,) = _with_constant_factors([differences.second(length**2 + length)], PLACE, (A, B), (DA, DB))
    waves = [call for call in form.atoms(AppliedUndef, sp.sin, sp.cos) if call.free_symbols & {PLACE, DA, DB}]
    assert {call.func.__name__ for call in waves} == {"divdiff1_cos_in_square", "divdiff1_sinc_in_square"}
    with mp.workdps(50):
        a, y, b = mpf("-0.4"), mpf("0.7"), mpf("1.1")
        value = sp.lambdify((A, PLACE, B, DA, DB), form, modules=[DEFINITIONS, "mpmath"])(a, y, b, y - a, b - y)
        ua, uy, ub = (r * r + r for r in (sqrt((cos(t) - 3) ** 2 + sin(t) ** 2 + sin(t) / 5) for t in (a, y, b)))
        truth = ((ub - uy) / (b - y) - (uy - ua) / (y - a)) / (b - a)
        assert abs(value / truth - 1) < mpf("1e-45")
