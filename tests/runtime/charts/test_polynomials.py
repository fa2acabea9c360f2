"""The chart of a parabola in two polynomial pieces agrees with its closed form."""

import pickle

import numpy as np
import pytest

from gqm_sym.runtime.charts.polynomials import Polynomials, read_pieces

# The track is z = x**2 from -1 to 2, with one piece on each side of the bottom, the second in (x - 1).
PARABOLA = "-1 0 0 1 0 0 0 1\n-1 1 1 1 0 1 2 1"


def arc(x: np.ndarray) -> np.ndarray:
    """Return the arc length of the parabola from its bottom."""
    return 0.5 * x * np.hypot(1, 2 * x) + 0.25 * np.arcsinh(2 * x)


def test_what_is_written() -> None:
    """A track shows the ends and coefficients of both pieces, and can be sent to other processes."""
    first, second = read_pieces(f"\n{PARABOLA}\n")
    assert (first.begin, first.end, first.x, first.z) == ("-1", "0", ["0", "1", "0"], ["0", "0", "1"])
    assert (second.begin, second.end, second.x, second.z) == ("-1", "1", ["1", "1", "0"], ["1", "2", "1"])
    track = Polynomials(PARABOLA, origin=1)
    assert pickle.loads(pickle.dumps(track)) == track
    assert track.chart(()).breaks.size == 0


def test_the_chart_of_a_parabola() -> None:
    """Coordinates, angle and curvature are right at arc lengths from the joint, and at both ends."""
    chart = Polynomials(PARABOLA, origin=1, breaks=(1,)).chart(())
    assert (chart.low, chart.high) == pytest.approx((arc(np.array(-1.0)), arc(np.array(2.0))), rel=4e-16)
    assert chart.breaks.tolist() == [0.0]
    x = np.linspace(-1.0, 2.0, 61)
    rows = chart.points(arc(x))
    assert rows[0] == pytest.approx(x, abs=1e-15)
    assert rows[1] == pytest.approx(x**2, abs=3e-15)
    assert rows[2] == pytest.approx(np.arctan(2 * x), abs=1e-15)
    assert rows[3] == pytest.approx(2 / np.hypot(1, 2 * x) ** 3, rel=1e-14)
