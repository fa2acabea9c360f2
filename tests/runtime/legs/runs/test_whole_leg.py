"""Legs from turn to turn as one polynomial agree with closed forms with 28 digits."""

from functools import partial
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import generated.circle_coulomb
from gqm_sym.runtime.legs.panels.polynomials import COUNT, SHARES, TO_COEFFICIENTS
from gqm_sym.runtime.legs.runs import whole_leg

# The tolerance includes that tables, and sums with them, are rounded.
TABLE = 2e-15


def _power(n: int, phi: mpf) -> mpf:
    return mp.sin(phi / 2) ** (2 * n)


def test_tables() -> None:
    """The tables are those of integrals of powers; V**2 = y**n - y**(n + 1) vanishes at both turns."""
    y, k = SHARES, np.arange(1, whole_leg.TERMS)
    for n in range(1, 16):
        force = n * y ** (n - 1) - (n + 1) * y**n
        ends = whole_leg._end_terms().T @ force
        binomial = [float(mp.binomial(n, m) - mp.binomial(n + 1, m)) for m in k]
        assert ends[0] == pytest.approx(0.0, abs=TABLE * n)
        assert ends[1:] == pytest.approx(binomial, rel=1e-8, abs=1e-8)  # derivatives lose digits
        assert whole_leg._factors().T @ force == pytest.approx(y ** (n - 1), abs=TABLE * n)
        with mp.workdps(30):
            halves = [mp.quad(partial(_power, n), (a, a + mp.pi / 2), method="gauss-legendre") for a in (0, mp.pi / 2)]
        assert whole_leg._half_times().T @ y**n == pytest.approx([float(half) for half in halves], abs=TABLE)
        for table, begin, end in (
            (whole_leg.TURN_PART, 0.0, whole_leg.JOINT),
            (whole_leg.MIDDLE_PART, whole_leg.JOINT, 1.0),
        ):
            shares = 0.5 * (begin + (end - begin) * y) ** 2
            assert table.T @ y**n == pytest.approx(shares**n, abs=TABLE)
    assert np.abs(TO_COEFFICIENTS @ np.ones(COUNT) - np.eye(COUNT)[0]).max() <= TABLE


class Pendulum:
    """A pendulum of length 1 with friction of its contact force, whose V**2 on a leg is elementary."""

    def __init__(self, mu: float) -> None:
        self.mu, self.g = mpf(mu), mpf("9.81")

    def v2(self, start: mpf) -> Any:
        """Return V**2 on the leg from rest at an angle, by W' = -2 g sin - k (W + g cos) with k = 2 mu v."""
        k = 2 * self.mu * (-1 if start > 0 else 1)
        b = -3 * k * self.g / (1 + k * k)
        a = 2 * self.g + k * b
        c = -(a * mp.cos(start) + b * mp.sin(start)) * mp.exp(k * start)
        return lambda x: a * mp.cos(x) + b * mp.sin(x) + c * mp.exp(-k * x)

    def turns(self, start: float) -> list[mpf]:
        """Return the launch and all turning points, by Newton's method on V**2 over the distance from the last one."""
        places = [mpf(start)]
        while abs(mp.tan(places[-1])) > self.mu:
            here, w = places[-1], self.v2(places[-1])
            x = -here + 2 * self.mu * mp.sign(here)
            for _ in range(60):
                x -= (step := w(x) / (mp.diff(w, x) - w(x) / (x - here)))
                if abs(step) < mpf(10) ** -24:
                    break
            places.append(x)
        return places

    def time(self, start: mpf, stop: mpf, x: mpf) -> mpf:
        """Return the time from one turn to a place before the next, with the roots at both ends substituted away."""
        w, middle, half = self.v2(start), (start + stop) / 2, (stop - start) / 2
        phi = mp.acos(min(max((middle - x) / half, -1), 1))
        return mp.quad(
            lambda p: abs(half) * mp.sin(p) / mp.sqrt(w(middle - half * mp.cos(p))),
            [0, phi / 2, phi],
            method="gauss-legendre",
        )


@pytest.mark.parametrize(("start", "mu"), [(1.4, 0.05), (-0.8, 0.04), (0.03, 0.004), (1.1, 0.2)])
def test_a_pendulum_with_friction(start: float, mu: float) -> None:
    """The place and the time of rest, the legs, and places on the first and the last of them agree with the closed
    form.
    """
    module: ModuleType = generated.circle_coulomb
    swept = {
        q: float(module.sweep(q, [start], 0.0, mu=mu, mu_static=mu, L=1).values[0])
        for q in ("rest_position", "t_end", "v_max")
    }
    with mp.workdps(28):
        pendulum = Pendulum(mu)
        turns = pendulum.turns(start)
        times = [pendulum.time(a, b, b) for a, b in pairwise(turns)]
        w = pendulum.v2(turns[0])
        fastest = mp.findroot(lambda x: mp.diff(w, x), 0.0)
        expected = {"rest_position": turns[-1], "t_end": mp.fsum(times), "v_max": mp.sqrt(w(fastest))}
        places = [a + (b - a) * share for a, b in pairwise(turns) for share in map(mpf, ("0.01", "0.3", "0.7", "0.98"))]
        some = [0, 1, 2, 3, -4, -3, -2, -1]
        starts = [t for k in range(len(times)) for t in [mp.fsum(times[:k])] * 4]
        legs = [pair for pair in pairwise(turns) for _ in range(4)]
        when = [float(starts[i] + pendulum.time(*legs[i], places[i])) for i in some]
        there = [float(places[i]) for i in some]
    ulp = float(np.spacing(abs(start)))
    for quantity, value in swept.items():
        assert value == pytest.approx(float(expected[quantity]), rel=2e-15, abs=1.5 * len(times) * ulp)
    motion = module.solve(start, 0.0, mu=mu, mu_static=mu, L=1)
    assert [leg.lam_end for leg in motion.legs] == pytest.approx([float(x) for x in turns[1:]], abs=9.0 * ulp)
    assert motion.lam(when) == pytest.approx(there, abs=9.0 * ulp)
    assert (np.abs(motion.lam(when) - there) <= motion.error_bound(when)).all()
