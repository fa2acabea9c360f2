"""The tracer of implicit curves agrees with closed forms, elliptic integrals and the corpus of famous curves."""

import json
import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf
from naive import error, ulps
from paths import DATA
from traced import ROUNDING, hold, trace

# The tolerance relative to the largest curvature, as for every sample of the corpus.
SAMPLE = 1e-13
PERIOD_ULPS = 2.0


@pytest.mark.parametrize("tangent", [1, -1])
def test_circle(tangent: int) -> None:
    """In both directions round a circle the period is right to an ulp, and alpha and kappa have the sign of the
    direction.
    """
    chart = trace("x**2 + z**2 - 4", (2.0, 0.0), tangent=tangent)
    assert ulps(chart.period, 4 * mp.pi) <= 1.0
    assert chart.high - chart.low == chart.period
    assert chart.low < -1.0
    assert chart.breaks.size == chart.corners.size == 0
    places = np.linspace(0.0, 4.0 * math.pi, 37)

    def truth(k: int) -> tuple[Any, ...]:
        angle = tangent * mpf(float(places[k])) / 2
        return 2 * mp.cos(angle), 2 * mp.sin(angle), angle + tangent * mp.pi / 2, tangent * mpf("0.5")

    hold(chart, places, truth)
    assert abs(chart.points([places[-1]])[2, 0] - chart.points([0.0])[2, 0] - tangent * 2.0 * math.pi) <= 1e-14


def test_ellipse() -> None:
    """The arc length of an ellipse is an elliptic integral of the eccentric angle."""
    with mp.workdps(40):
        chart = trace("x**2/9 + z**2 - 1", (3.0, 0.0))
        assert ulps(chart.period, 4 * 3 * mp.ellipe(mpf(8) / 9)) <= PERIOD_ULPS
        angles = [2 * mp.pi * k / 29 for k in range(30)]
        # From the end of the long axis on, ds = sqrt(9 - 8 cos(t)**2) dt.
        quarter = mp.ellipe(mpf(8) / 9)
        places = [3 * (quarter - mp.ellipe(mp.pi / 2 - t, mpf(8) / 9)) for t in angles]
        sizes = [mp.sqrt(9 * mp.sin(t) ** 2 + mp.cos(t) ** 2) for t in angles]

        def truth(k: int) -> tuple[Any, ...]:
            t = angles[k]
            # The place is rounded to a double, and the curve is sampled there.
            off = mpf(float(places[k])) - places[k]
            along, across = -3 * mp.sin(t) / sizes[k], mp.cos(t) / sizes[k]
            kappa = 3 / sizes[k] ** 3
            return 3 * mp.cos(t) + off * along, mp.sin(t) + off * across, mp.atan2(across, along) + kappa * off, kappa

        hold(chart, [float(s) for s in places], truth)


def test_superellipse() -> None:
    """x**4 + z**4 = 1 is flat at four points: the period agrees with quadrature, and the flat points lie at its
    quarters.
    """
    chart = trace("x**4 + z**4 - 1", (1.0, 0.0))
    with mp.workdps(30):
        quarter = 2 * mp.quad(
            lambda t: mp.sqrt(mp.cos(t) ** 6 + mp.sin(t) ** 6) / (mp.cos(t) ** 4 + mp.sin(t) ** 4) ** mpf("1.25"),
            [0, mp.pi / 4],
        )
        assert ulps(chart.period, 4 * quarter) <= PERIOD_ULPS
    rows = chart.points(float(quarter) * np.arange(4))
    flat = np.array([[1.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, -1.0], np.pi / 2 * np.arange(1, 5), np.zeros(4)])
    assert np.abs(rows - flat).max() <= 4e-15
    # Two or three times as many pieces would resolve it as well, in twice the time.
    assert chart.edges.size <= 60


def test_lemniscate_ends_at_its_node() -> None:
    """On (x**2 + z**2)**2 = 2(x**2 - z**2), the length from the vertex to the node is K(1/2) in both directions."""
    chart = trace("(x**2 + z**2)**2 - 2*(x**2 - z**2)", (math.sqrt(2.0), 0.0))
    assert chart.ends == ("singular-point", "singular-point")
    assert chart.period == 0.0
    assert ulps(chart.high, mp.ellipk(0.5)) <= 4
    assert ulps(-chart.low, mp.ellipk(0.5)) <= 4
    rows = chart.points([chart.low, chart.high])
    assert np.abs(rows[:2]).max() <= ROUNDING
    assert np.abs(np.sort(rows[2]) - [-np.pi / 4, 5 * np.pi / 4]).max() <= 1e-9


def test_node_away_from_the_origin() -> None:
    """At a node away from the origin F is a difference of large terms, and its gradient has half of the digits."""
    moved = "((x - 1)**2 + (z - 2)**2)**2 - 2*((x - 1)**2 - (z - 2)**2)"
    chart = trace(moved, (1.0 + math.sqrt(2.0), 2.0))
    assert chart.ends == ("singular-point", "singular-point")
    assert error(chart.high, mp.ellipk(0.5)) <= 1e-8
    assert np.abs(chart.points([chart.high])[:2, 0] - [1.0, 2.0]).max() <= 1e-8


def test_cusp() -> None:
    """On x**3 = z**2 from (1, 1) the length to the cusp, where curvature is infinite, is (13 sqrt(13) - 8)/27."""
    chart = trace("x**3 - z**2", (1.0, 1.0), domain=(None, 5.0))
    assert chart.ends == ("singular-point", "domain-end")
    with mp.workdps(30):
        whole = (13 * mp.sqrt(13) - 8) / 27
        assert error(chart.low, -whole) <= ROUNDING
        assert np.abs(chart.points([chart.low])[:2]).max() <= ROUNDING
        places = [-1.43, -1.3, -0.7, 0.0, 1.1, 4.9]
        # The arc length from the cusp is s = (4 + 9x)**(3/2)/27.
        abscissae = [((27 * (mpf(s) + whole) + 8) ** (mpf(2) / 3) - 4) / 9 for s in places]

        def truth(k: int) -> tuple[Any, ...]:
            x = abscissae[k]
            slope = mpf(3) / 2 * mp.sqrt(x)
            return x, x ** mpf("1.5"), mp.atan(slope), 3 / (4 * mp.sqrt(x)) / (1 + slope**2) ** mpf("1.5")

        hold(chart, places, truth)


def test_curves_that_touch() -> None:
    """At a double point without a crossing both branches have the same tangent, and F does not determine which to
    follow.
    """
    chart = trace("z**2 - x**4", (1.0, 1.0), domain=(-1.0, 4.0))
    assert chart.ends == ("domain-end", "singular-point")
    parabola = mp.asinh(2) / 4 + mp.sqrt(5) / 2
    assert error(chart.high, parabola) <= 4 * ROUNDING
    assert np.abs(chart.points([chart.high])[:2]).max() <= 4 * ROUNDING


def test_folium() -> None:
    """The loop of x**3 + z**3 = 3xz is smooth up to the node, and its places are on it to rounding, in fractions.

    Towards the node there were breaks between its pieces.
    """
    chart = trace("x**3 + z**3 - 3*x*z", (1.5, 1.5))
    assert chart.ends == ("singular-point", "singular-point")
    assert chart.breaks.size == 0
    for x, z in chart.points(np.linspace(0.99 * chart.low, 0.99 * chart.high, 99))[:2].T.tolist():
        a, b = Fraction(x), Fraction(z)
        gradient = math.hypot(3 * (a * a - b), 3 * (b * b - a))
        assert abs(a**3 + b**3 - 3 * a * b) <= ROUNDING * gradient


def test_narrow_waist() -> None:
    """A curve that nearly crosses itself is followed through, and closes."""
    chart = trace("(x**2 + z**2)**2 - 2*(x**2 - z**2) - 1e-6", (math.sqrt(2.0), 0.0))
    assert chart.period > 0.0
    assert error(chart.points([0.5 * chart.period])[0, 0], -chart.points([0.0])[0, 0]) <= 4 * ROUNDING


PARABOLA_PLACES = [-2.0, -1.0, -1e-3, 0.0, 1e-9, 0.25, 1.5, 3.0]


def test_parabola() -> None:
    """The parabola z = x**2 is followed within its domain, to the given ends."""
    chart = trace("z - x**2", (0.0, 0.0), tangent=-1, domain=(-2.0, 3.0))
    assert (chart.low, chart.high, chart.period) == (-2.0, 3.0, 0.0)
    assert chart.ends == ("domain-end", "domain-end")
    with mp.workdps(30):
        abscissae = [
            mp.findroot(lambda x, s=s: mp.asinh(2 * x) / 4 + x * mp.sqrt(1 + 4 * x**2) / 2 - mpf(s), s / 2)
            for s in PARABOLA_PLACES
        ]

        def truth(k: int) -> tuple[Any, ...]:
            x = abscissae[k]
            return x, x**2, mp.atan(2 * x), 2 / (1 + 4 * x**2) ** mpf("1.5")

        hold(chart, PARABOLA_PLACES, truth)


def test_open_curve_is_followed_far() -> None:
    """Without a domain an open curve is followed for many times its own size, in both directions, and stays on the
    curve.
    """
    chart = trace("z - x**2", (0.0, 0.0), tangent=-1)
    assert chart.ends == ("domain-end", "domain-end")
    assert chart.low < -1e6
    assert chart.high > 1e6
    x, z, _, _ = chart.points(np.array([-1e6, 1e6]))
    assert np.abs(np.abs(x) - np.sqrt(z)).max() <= ROUNDING * 1e6
    with mp.workdps(30):
        reached = [
            mp.asinh(2 * mp.sqrt(mpf(height))) / 4 + mp.sqrt(mpf(height) * (mpf("0.25") + height)) for height in z
        ]
    assert max(error(1e6, length) for length in reached) <= ROUNDING * 1e6


def test_line() -> None:
    """A straight line has no length scale of its own, and no noise in its curvature."""
    chart = trace("x + z - 1", (1.0, 0.0), domain=(-4.0, 1e6))
    rows = chart.points([-4.0, 0.0, 1e6])
    assert np.abs(rows[0] - (1.0 - np.array([-4.0, 0.0, 1e6]) * math.sqrt(0.5))).max() <= ROUNDING * 1e6
    assert not rows[3].any()


def _corpus() -> list[dict[str, Any]]:
    entries = json.loads((DATA / "curves.json").read_text(encoding="ascii"))
    return [entry for entry in entries if entry["kind"] == "implicit"]


@pytest.mark.parametrize("entry", _corpus(), ids=lambda entry: entry["name"])
def test_corpus(entry: dict[str, Any]) -> None:
    """Period, places and curvature are right at all samples of the corpus."""
    chart = trace(
        entry["F"],
        (float(entry["start"][0]), float(entry["start"][1])),
        tangent=entry["tangent"],
        domain=(None, None) if entry["period"] else (float(entry["domain"][0]), float(entry["domain"][1])),
        given={name: sp.Rational(value) for name, value in entry["params"].items()},
    )
    if entry["period"]:
        assert ulps(chart.period, entry["period"]) <= PERIOD_ULPS
    samples = [row for motion in (entry, *entry.get("also", ())) for row in motion["expect"]["samples"]]
    rows = chart.points([float(row["lam"]) for row in samples])
    extent = max(np.ptp(rows[0]), np.ptp(rows[1]))
    for k, row in enumerate(samples):
        assert error(rows[0, k], row["x"]) <= SAMPLE * extent
        assert error(rows[1, k], row["z"]) <= SAMPLE * extent
        assert error(rows[3, k], row["kappa"]) <= SAMPLE * max(abs(float(r["kappa"])) for r in samples)
