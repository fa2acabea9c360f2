"""Bounds along splines through scattered points hold against the splines themselves with forty digits."""

from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.building import transient
from gqm_sym.runtime.charts.interpolation import DEGREE
from gqm_sym.runtime.charts.sampled import Sampled, _made

# The number of Chebyshev points on each polynomial of a spline; with 24 the reference is wrong by 2e-9 if points
# scatter by 5 cm.
NODES = 40
SPEED, DRAG = 4, "1/20"


def integrals() -> tuple[list[Any], Any]:
    """Return the nodes on [-1, 1], and the matrix from values there to the integrals from -1 to each node and to 1."""
    angles = [mp.pi * (2 * i + 1) / (2 * NODES) for i in range(NODES)]

    def antiderivative(k: int, angle: Any) -> Any:
        """Return the antiderivative of the Chebyshev polynomial of degree k, at the cosine of an angle."""
        if k < 2:
            return mp.cos(angle) ** (k + 1) / (k + 1)
        return mp.cos((k + 1) * angle) / (2 * (k + 1)) - mp.cos((k - 1) * angle) / (2 * (k - 1))

    gains = [[antiderivative(k, at) - antiderivative(k, mp.pi) for k in range(NODES)] for at in (*angles, mpf(0))]
    series = [[mp.cos(k * at) * (2 if k else 1) / NODES for at in angles] for k in range(NODES)]
    return [mp.cos(at) for at in angles], mp.matrix(gains) * mp.matrix(series)


def rates_of(spline: Any, j: int, u: Any) -> list[Any]:
    """Return the derivatives of the coordinates of a spline between its knots j and j + 1, by de Boor's algorithm."""
    knots, values = spline.t, [[mpf(float(c)) for c in row] for row in spline.c[j - DEGREE : j + 1]]
    rates = [[mpf(0)] * 2 for _ in values]
    for order in range(1, DEGREE + 1):
        for i in range(DEGREE, order - 1, -1):
            left, right = (mpf(float(knots[k])) for k in (j - DEGREE + i, j + 1 + i - order))
            share = (u - left) / (right - left)
            for axis in range(2):
                change = values[i][axis] - values[i - 1][axis]
                before = rates[i - 1][axis]
                rates[i][axis] = before + (rates[i][axis] - before) * share + change / (right - left)
                values[i][axis] = values[i - 1][axis] + change * share
    return rates[DEGREE]


def passages(spline: Any, drag: Any) -> list[tuple[Any, Any, Any]]:
    """Return arc length, time and speed at each knot, for a body that enters the track with SPEED."""
    knots, (nodes, matrix) = [mpf(float(knot)) for knot in spline.t], integrals()
    s, t, work, found = mpf(0), mpf(0), mpf(0), []
    for j in range(DEGREE, len(knots) - DEGREE - 1):
        half, middle = (knots[j + 1] - knots[j]) / 2, (knots[j + 1] + knots[j]) / 2
        rates = [rates_of(spline, j, middle + half * node) for node in nodes]
        ds = [mp.hypot(*rate) for rate in rates]
        lengths = [s + gain for gain in half * (matrix * mp.matrix(ds))]
        # V**2 exp(2 b s) changes by the work of gravity times that factor.
        pulls = [mp.exp(2 * drag * at) * rate[1] for at, rate in zip(lengths, rates, strict=False)]
        works = [work + gain for gain in half * (matrix * mp.matrix(pulls))]
        speeds = [
            mp.sqrt((SPEED**2 - 2 * mpf("9.81") * done) * mp.exp(-2 * drag * at))
            for at, done in zip(lengths, works, strict=True)
        ]
        t += (half * (matrix * mp.matrix([one / v for one, v in zip(ds, speeds, strict=False)])))[NODES]
        s, work = lengths[NODES], works[NODES]
        found.append((s, t, speeds[NODES]))
    return found


@pytest.mark.sample(1)
@pytest.mark.filterwarnings("ignore:.*the points scatter")
@pytest.mark.parametrize(("scatter", "drag"), [(0.01, "0"), (0.05, "0"), (0.05, DRAG)])
def test_bounds_along_a_spline_through_scattered_points(scatter: float, drag: str) -> None:
    """The body is at the places of the polynomials, within useful bounds, however scattered the points are."""
    x = np.linspace(0.0, 9.0, 11)
    points = np.stack([x, 0.4 * np.sin(x) - x / 3.0], axis=1)
    points += np.random.default_rng(3).normal(0.0, scatter, points.shape)
    curve = gqm.Curve.sampled(points)
    force = gqm.Gravity() + gqm.QuadraticDrag(b=drag) if drag != "0" else gqm.Gravity()
    motion = transient(gqm.derive(curve, force)).solve(0, SPEED)
    spline = _made(Sampled(curve.definition.points))[1]
    with mp.workdps(40):
        truth = passages(spline, mpf(1) / 20 if drag == DRAG else mpf(0))
        assert motion.t_end == pytest.approx(float(truth[-1][1]), rel=1e-15)
        for s, t, v in truth[:-1]:
            at = float(t)
            off = abs(mpf(motion.lam(at)) - (s + v * (mpf(at) - t)))
            assert off <= motion.error_bound(at) <= 1e-11
