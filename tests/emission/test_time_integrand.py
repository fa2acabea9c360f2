"""Of the divisor of a time integrand only ratios along an orbit are asked for."""

import sympy as sp

import gqm_sym as gqm
from gqm_sym.derivation.wells.symmetric_orbits import Y
from gqm_sym.emission.time_integrand import _without_constant_divisors


def test_nothing_constant_divides_a_divisor() -> None:
    """A ball on a parabola has the divisor g*(...)/(1 + beta); what is emitted differs by a positive constant."""
    orbits = gqm.derive(gqm.families.parabola(), gqm.Gravity() + gqm.Rolling(radius="rho")).symmetric_orbits
    assert orbits is not None
    emitted = _without_constant_divisors(orbits.divisor, {Y})
    beta = next(symbol for symbol in orbits.divisor.free_symbols if symbol.name == "beta")
    assert sp.simplify(emitted / orbits.divisor - (1 + beta) ** 2) == 0
    assert not any(power.exp.is_negative and power.has(beta) for power in emitted.atoms(sp.Pow))
