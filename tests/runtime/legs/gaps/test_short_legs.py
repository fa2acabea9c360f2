"""Short last legs past a break of the curve, where friction almost balances the weight, and times next to turns.

The true numbers were found in 33 digits by a program of its own: Gauss-Legendre collocation with 26 nodes on each piece
of the chart, whose polynomials are exact data, with turns by Newton's method and the time in the root of the distance
from them. With 32 nodes they agree in 27 digits. One unit in the last place of the launch changes none of them by more
than 3e-16 of itself. But the polynomials of a track through points have roundings that depend on the processor: one
unit in the last place of its points changes the time of such a track by 5e-15 of itself.
"""

from pathlib import Path

import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.runtime.legs.driver import Driver

U = np.linspace(-2, 2, 201)
POINTS = np.column_stack([U, 0.5 * U * U + 0.01 * np.cos(3 * U)])


def rail() -> gqm.Curve:
    """Return a track whose frame turns at rates that jump at its lowest place."""
    ends, halves = (
        gqm.transition(length="1"),
        [gqm.transition(length="4", yaw=yaw, pitch="pi/8") for yaw in (".1", "-.1")],
    )
    return gqm.Curve.piecewise([ends, *halves, ends], start=("0", "0", "4"), heading=("0", "-pi/2"))


def swept(curve: gqm.Curve, folder: Path, quantity: str, **given: float) -> float:
    """Return a quantity of one launch with friction, and perhaps drag."""
    law = gqm.Gravity() + gqm.CoulombFriction()
    law = law + gqm.QuadraticDrag(b="c") if "c" in given else law
    module = gqm.build(gqm.derive(curve, law), name="short_legs", folder=folder)
    return float(module.sweep(quantity, mu=0.05, **given).values)


@pytest.mark.parametrize(
    ("lam0", "v0", "true"),
    [
        (3.39368944656934, 1.538350041301514, 6.73312810211268772694912622),
        (4.763988374687564, 0.0, 12.5878773891324771092586914),
    ],
)
def test_short_last_legs_past_a_break(tmp_path: Path, lam0: float, v0: float, true: float) -> None:
    """The last legs are 0.5 to 0.9 mm long and take over a second."""
    end = swept(gqm.Curve.sampled(POINTS), tmp_path, "t_end", lam0=lam0, v0=v0, t_max=200.0)
    np.testing.assert_allclose(end, true, rtol=3e-14)


@pytest.mark.extended
def test_a_short_last_leg_past_a_joint(tmp_path: Path) -> None:
    """Half a unit in the last place of the slopes of the chart changes the time by 2.4e-14 of itself."""
    given = {"lam0": 0.8410518694745593, "v0": 0.877659026302221, "c": 0.05, "t_max": 200.0}
    np.testing.assert_allclose(swept(rail(), tmp_path, "t_end", **given), 13.2525304937809238528573765, rtol=2.4e-14)


@pytest.mark.parametrize(
    ("lam0", "true"),
    [(0.6659280652432628, 0.284236206522400915516905359), (0.7763391917230594, 0.322332505599290658700934508)],
)
def test_early_times_on_an_implicit_curve(tmp_path: Path, lam0: float, true: float) -> None:
    """Next to the turn V**2 is a product with the distance, without differences of the rows that are kept."""
    curve = gqm.Curve.implicit("x**4+z**4-1.0*x*z/5-1", start=(0, -1))
    found = swept(curve, tmp_path, "time_at", lam0=lam0, lam=0.5449999999999999, t_max=10.0)
    np.testing.assert_allclose(found, true, rtol=1e-15)


def test_the_place_at_the_last_time_needs_no_leg_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A leg that is passed by gaps has a panel where the last time is, from which its place then is read."""
    law = gqm.Gravity() + gqm.QuadraticDrag(b="1/5")
    module = gqm.build(gqm.derive(gqm.Curve.sampled(POINTS), law), name="last_place", folder=tmp_path)
    with_panels, followed = Driver.with_panels, []
    monkeypatch.setattr(Driver, "with_panels", lambda *given: followed.append(given) or with_panels(*given))
    motion = module.solve(3.0, t_max=10.0)
    last = motion.legs[-1]
    assert (last.end, followed) == ("horizon", [])
    np.testing.assert_allclose(last.lam_end, motion.lam(10.0), rtol=1e-14)
