"""Legs followed back from their turns, and bodies that lift off where they are launched."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import gqm_sym as gqm


@pytest.mark.extended
def test_n_may_change_its_sign_where_all_forces_vanish(tmp_path: Path) -> None:
    """A leg was refused on which N changes its sign at an inflection in the centre of a central force.

    The place at which the run ahead ended and that of the change differed by a rounding, on which noise is all there is
    of the force. Truth is the motion by SciPy's integrator: u'' from the tangential force, with friction.
    """
    mu = 1 / 20
    curve = gqm.Curve.parametric(x="sin(2*u)", z="-cos(u)", parameter="u")
    force = gqm.Potential("5*(x**2 + z**2)") + gqm.CoulombFriction(mu="1/20")
    module = gqm.build(gqm.derive(curve, force), name="central", folder=tmp_path)
    motion = module.solve(-1.0026783029956134, 0.0, 1, t_max=5.0)

    def rates(_t: float, state: np.ndarray) -> list[float]:
        u, rate = state
        x, z, dx, dz = np.sin(2 * u), -np.cos(u), 2 * np.cos(2 * u), np.sin(u)
        d2x, d2z = -4 * np.sin(2 * u), np.cos(u)
        ds = np.hypot(dx, dz)
        along = -10 * (x * dx + z * dz) / ds
        n = (dx * d2z - dz * d2x) / ds**3 * (ds * rate) ** 2 - 10 * (x * dz - z * dx) / ds
        friction = -mu * abs(n) * np.sign(rate)
        return [rate, ((along + friction) - (dx * d2x + dz * d2z) / ds * rate**2) / ds]

    start = float(motion.legs[11].t_end)  # the turn at -2.1167
    times = np.array([3.2, 3.5, 3.8, 4.0])
    begin = [float(motion.lam(start)), 1e-12]
    true = solve_ivp(rates, (start, 4.0), begin, "DOP853", times, rtol=1e-11, atol=1e-12, max_step=1e-3).y[0]
    np.testing.assert_allclose(motion.lam(times), true, rtol=1e-8)
    assert [leg.end for leg in motion.legs].count("contact-sign") == 15


@pytest.mark.parametrize("quantity", ["normal_force_min", "normal_force_max"])
def test_a_body_that_lifts_off_at_once_has_the_load_of_its_launch(quantity: str, tmp_path: Path) -> None:
    """Next to a cusp the swept load was that of a place nearby, which differs by a factor of three."""
    force = gqm.Gravity() + gqm.QuadraticDrag(b="1/20")
    module = gqm.build(gqm.derive(gqm.families.cycloid(R=1), force), name="cusp", folder=tmp_path)
    theta, v = 0.11070409429889683, 0.6088859237948512
    swept = module.sweep(quantity, theta, v, -1, t_max=5.0, contact="above")
    # At the angle theta from the cusp kappa = -1/(4 sin(theta/2)), and the track is inclined by pi/2 - theta/2.
    load = -(v**2) / (4 * np.sin(theta / 2)) + 9.81 * np.sin(theta / 2)
    assert float(swept.values) == pytest.approx(load, rel=1e-12)
