"""Sweeps of bodies that leave curves with formulas, each launch with parameters of its own, agree with closed forms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.building import transient
from gqm_sym.runtime.sweep.quantities import ANSWERED, NEVER_THERE, NOT_PERIODIC

# The relative tolerances of elementary closed forms, and of times at which contact is lost.
FEW, AT_LOSS = 4e-15, 2e-14


def loss_in_a_ring(radius: float, g: float, speed: float) -> tuple[float, float]:
    """Return the angle from the lowest place, from which a body is thrown, at which it leaves a ring, and the time."""
    a, energy = mpf(radius), mpf(speed) ** 2

    def rate(angle: Any) -> Any:
        return a / mp.sqrt(energy - 2 * g * a * (1 - mp.cos(angle)))

    lost = mp.acos((2 - energy / (g * a)) / 3)
    return float(lost), float(mp.quad(rate, [0, lost / 2, lost]))


def test_a_body_in_rings_up_to_where_it_leaves(generated_folder: Path) -> None:
    """Thrown up from the lowest place with V0**2 = share * g * L, a body leaves where 3 cos(s) = 2 - share.

    Each launch was solved by itself, which took some milliseconds.
    """
    model = gqm.derive(gqm.families.circle(L="L"), gqm.Gravity())
    ring, share = gqm.build(model, name="liftoff_rings", folder=generated_folder), np.array([1.5, 2.2, 3.0, 4.9, 5.1])
    radius, g, m = np.array([0.8, 0.9, 1.1, 1.3, 1.7]), np.array([9.7, 9.8, 9.9, 1.6, 3.7]), np.array([1, 2, 1, 3, 1.0])
    speed, senses, leaves = np.sqrt(share * g * radius), np.array([1, -1, 1, -1, 1]), slice(1, 4)

    def found(quantity: str, begin: int = 0, contact: str = "above", **asked: float) -> Any:
        own = {"L": radius[begin:], "g": g[begin:], "m": m[begin:]}
        swept = ring.sweep(quantity, 0.0, speed[begin:], senses[begin:], contact=contact, **own, **asked)
        assert swept.route_counts() == {"single": 5 - begin}
        return swept

    assert found("v_max").values == pytest.approx(speed, rel=FEW)
    slowest = np.sqrt((g * radius * (share - 2.0))[leaves] / 3.0)
    assert found("v_min").values[leaves] == pytest.approx(slowest, rel=1e-13)
    assert found("normal_force_max").values == pytest.approx(m * g * (1.0 + share), rel=FEW)
    assert found("normal_force_min").values[leaves] == pytest.approx(np.zeros(3), abs=1e-13)
    ends = found("t_end", t_max=50.0).values
    assert ends[[0, 4]].tolist() == [50.0, 50.0]
    with mp.workdps(25):
        for k in (1, 2, 3):
            place, time = loss_in_a_ring(radius[k], g[k], speed[k])
            assert ends[k] == pytest.approx(time, rel=AT_LOSS)
            beside = [found("time_at", k, lam=float(senses[k] * place * factor)).status[0] for factor in (0.99, 1.01)]
            assert beside == [ANSWERED, NEVER_THERE]
    assert found("half_period").status.tolist() == [ANSWERED, *[NOT_PERIODIC] * 3, NOT_PERIODIC]
    # The bits are those of fewer launches, and from outside the ring nothing holds the body at all.
    assert np.array_equal(found("t_end", 2, t_max=50.0).values, ends[2:])
    assert found("t_end", contact="below").values.tolist() == [0.0] * 5


def loss_on_hills(b: float, start: float, speed: float) -> tuple[float, float]:
    """Return the time at which a body that is thrown to the left leaves the hills z = b sin(x) - x/4 on its way back,
    and its largest speed.
    """
    g = mpf("9.81")

    def slope(x: Any) -> Any:
        return b * mp.cos(x) - mpf(1) / 4

    def v2(x: Any) -> Any:
        return mpf(speed) ** 2 + 2 * g * (b * (mp.sin(start) - mp.sin(x)) - (mpf(start) - x) / 4)

    def rate(root: Any) -> Any:
        return 2 * root * mp.sqrt((1 + slope(turn + root**2) ** 2) / v2(turn + root**2))

    turn = mp.findroot(v2, (-3.2, -4.2), solver="anderson")
    lost = mp.findroot(lambda x: g * (1 + slope(x) ** 2) - b * mp.sin(x) * v2(x), (0.1, 1.3), solver="anderson")
    ways = [mp.quad(rate, mp.linspace(0, mp.sqrt(x - turn), 4), method="gauss-legendre") for x in (start, lost)]
    return float(sum(ways)), float(mp.sqrt(v2(mp.findroot(slope, -1.8))))


@pytest.mark.extended
def test_a_body_that_turns_before_it_leaves(generated_folder: Path) -> None:
    """The left crest is higher than the right one; contact is lost where z'' V**2 = -g (1 + z'**2)."""
    hills = gqm.Curve.graph("b*sin(x) - x/4", parameter="x", domain=(-6, 6))
    module = gqm.build(gqm.derive(hills, gqm.Gravity()), name="liftoff_hills", folder=generated_folder)
    height, start, speed = np.array([1.0, 1.1, 0.95]), np.array([-2.5, -2.3, -2.4]), np.array([6.0, 6.1, 5.8])
    found = {what: module.sweep(what, start, speed, -1, b=height, contact="above") for what in ("t_end", "v_max")}
    assert all(one.route_counts() == {"single": 3} for one in found.values())
    with mp.workdps(25):
        truth = [loss_on_hills(*launch) for launch in zip(height, start, speed, strict=True)]
    assert found["t_end"].values == pytest.approx([time for time, _ in truth], rel=AT_LOSS)
    assert found["v_max"].values == pytest.approx([fastest for _, fastest in truth], rel=FEW)
    assert module.sweep("v_min", start, speed, -1, b=height, contact="above").values.tolist() == [0.0] * 3


@pytest.mark.parametrize("contact", ["above", pytest.param("below", marks=pytest.mark.extended)])
def test_on_a_curve_in_space(contact: str) -> None:
    """The upward direction of riders tells the side of the track; compiled loops answer as each motion does."""
    curve = gqm.Curve.space(x="t", y="sin(2*t)/4", z="sin(t) + t**2/8", parameter="t", roll="1/10")
    module = transient(gqm.derive(curve, gqm.Gravity()))
    lam0, v0 = np.linspace(-2.5, 2.5, 12), np.tile([0.5, 3.0, 5.0, 6.0], 3)
    motions = [module.solve(place, speed, contact=contact) for place, speed in zip(lam0, v0, strict=True)]
    ends, fastest = (module.sweep(name, lam0, v0, contact=contact) for name in ("t_end", "v_max"))
    assert ends.route_counts() == fastest.route_counts() == {"single": lam0.size}
    wanted = np.array([motion.t_end for motion in motions])
    np.testing.assert_allclose(ends.values, np.where(np.isfinite(wanted), wanted, np.nan), rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(fastest.values, [motion.v_max.value for motion in motions], rtol=4e-15)
    assert 2 < np.isfinite(wanted).sum() < lam0.size + (contact == "below")
