"""Pictures of curves draw the right points, and impossible ones are refused."""

from math import cos, hypot, pi

import pytest

import gqm_sym as gqm
from gqm_sym.errors import ArgumentError, ParameterError


def points(figure: object) -> list[tuple[float, float]]:
    """Return the points of the only line with more than one."""
    (line,) = [line for line in figure.axes[0].lines if len(line.get_xdata()) > 1]  # type: ignore[attr-defined]
    return list(zip(line.get_xdata(), line.get_ydata(), strict=True))


def test_one_round_of_a_closed_curve() -> None:
    """All points of a circle have its radius, and the last point is the first."""
    drawn = points(gqm.families.circle(L=2).plot())
    assert [hypot(x, z) for x, z in drawn] == pytest.approx([2.0] * len(drawn))
    assert drawn[0] == pytest.approx(drawn[-1], abs=1e-12)


def test_domains_and_ranges() -> None:
    """The domain may end at a parameter, a range may be given, and a graph without bounds is drawn from -1 to 1."""
    curve = gqm.Curve.graph("x**2", domain=(0, "w"))
    assert points(curve.plot(w=3))[-1] == (3.0, 9.0)
    assert points(curve.plot((1, "pi"), w=4))[-1] == pytest.approx((pi, pi**2))
    assert points(gqm.Curve.graph("cos(x)").plot())[0] == pytest.approx((-1.0, cos(1.0)))


def test_where_there_is_no_point_there_is_a_gap() -> None:
    """There is a gap where the curve is not real."""
    drawn = points(gqm.Curve.graph("sqrt(x)").plot())
    assert drawn[0][1] != drawn[0][1]
    assert drawn[-1] == (1.0, 1.0)


def test_curves_without_formulas() -> None:
    """A rail is drawn through its chart, for given parameters."""
    rail = gqm.Curve.piecewise([gqm.line(length=2), gqm.arc(radius="R", angle="pi/2")], parameters={"R": 1})
    drawn = points(rail.plot(R=3))
    assert drawn[0] == pytest.approx((0.0, 0.0), abs=1e-12)
    assert drawn[-1] == pytest.approx((5.0, 3.0))


def test_what_cannot_be_drawn() -> None:
    """An unknown parameter and one without a value are refused."""
    curve = gqm.Curve.graph("a*x**2")
    with pytest.raises(ArgumentError, match="did you mean 'a'"):
        curve.plot(A=1)
    with pytest.raises(ParameterError, match="pass a="):
        curve.plot()
