"""Gradients of the contact force and of y along space curves agree with the textbook's formula, differentiated by
SymPy.
"""

from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf
from paths import ROOT

from gqm_sym.loading import load

u, v, a, R, c, g, m = sp.symbols("u v a R c g m")
VIVIANI = sp.Matrix([a * (1 + sp.cos(u)), a * sp.sin(u), 2 * a * sp.sin(u / 2)])
HELIX = sp.Matrix([R * sp.cos(u), R * sp.sin(u), c * u])


def generated(name: str) -> ModuleType:
    """Return a module of the repository."""
    return load(str(ROOT / "generated" / f"{name}.py"), name)


def contact_force(point: sp.Matrix) -> sp.Expr:
    """Return the length of m (V**2 dt/ds + g (the upward direction less its part along t))."""
    rate = point.diff(u)
    ds = sp.sqrt(rate.dot(rate))
    t = rate / ds
    vector = m * (v**2 * t.diff(u) / ds + g * (sp.Matrix([0, 0, 1]) - t[2] * t))
    return sp.sqrt(vector.dot(vector))


@pytest.mark.extended
@pytest.mark.parametrize(
    ("name", "launch", "point", "parameters"),
    [
        ("viviani", {"lam0": 0.7, "v0": 1.0, "a": 1.5}, VIVIANI, (a, g, m)),
        ("helix_coulomb", {"lam0": 0.2, "v0": 1.5}, HELIX, (R, c, g, m)),
    ],
)
def test_states(name: str, launch: Any, point: sp.Matrix, parameters: tuple[sp.Symbol, ...]) -> None:
    """Contact force and y change with place, speed and parameters as their formulas do."""
    module, names = generated(name), (*(str(p) for p in parameters), "lam0", "v0")
    known = {key: float(value) for key, value in module.PARAMETERS.items()} | launch
    motion, times = module.solve(**launch), np.array([0.1, 0.45, 0.8])
    found, state = motion.sensitivity(times, names), motion.state(times)
    for form, row in ((contact_force(point), found.normal_force), (point[1], found.y)):
        by = {q: sp.lambdify((u, v, *parameters), form.diff(q), "mpmath") for q in (u, v, *parameters)}
        for i in range(times.size):
            given = (state.lam[i].item(), state.v[i].item(), *(known[str(p)] for p in parameters))
            with mp.workdps(30):  # the terms of a slope may cancel
                slopes = {str(q): float(slope(*map(mpf, given))) for q, slope in by.items()}
            for j, wanted in enumerate(names):
                terms = [slopes["u"] * found.lam[j, i], slopes["v"] * found.v[j, i], slopes.get(wanted, 0.0)]
                assert abs(sum(terms) - row[j, i]) <= 4e-15 * sum(map(abs, terms))


def test_extremes() -> None:
    """Extremes change as the force does at the time at which they are reached."""
    motion, names = generated("viviani").solve(0.7, 1.0, a=1.5), ("a", "g", "m", "lam0", "v0")
    for quantity in ("normal_force_max", "normal_force_min"):
        at = getattr(motion, quantity).t
        wanted = motion.sensitivity(at, names).normal_force
        np.testing.assert_allclose(list(motion.gradient(quantity, names).values()), wanted, rtol=2e-7)
