"""Equilibria agree with closed forms: places, stability and frequencies of small oscillations."""

from math import cos, cosh, inf, isnan, pi, sqrt

import pytest

import gqm_sym as gqm
from gqm_sym.derivation import Model
from gqm_sym.errors import ArgumentError, InputError, ParameterError, SolutionError

# The tolerance of places and frequencies. Worst measured: 8e-15.
TOLERANCE = 1e-13


def model(curve: gqm.Curve, force: gqm.Kernel | None = None) -> Model:
    """Derive a motion, under gravity unless another force is given."""
    return gqm.derive(curve, gqm.Gravity() if force is None else force)


def hoop() -> Model:
    """Return a bead on a hoop that rotates about its vertical diameter, with the angle from the bottom."""
    curve = gqm.Curve.parametric(x="R*sin(q)", z="-R*cos(q)", parameter="q", period="2*pi", parameters={"R": "1/2"})
    return model(curve, gqm.Gravity() + gqm.RotatingFrame())


def test_a_pendulum() -> None:
    """The bottom is stable with the frequency sqrt(g/L), and the top is not stable."""
    pendulum = model(gqm.families.circle(L=2))
    bottom, top = pendulum.equilibria(g=4)
    assert bottom.lam == 0.0
    assert bottom.stable
    assert bottom.frequency == pytest.approx(sqrt(2), rel=TOLERANCE)
    assert top.lam == pytest.approx(pi, rel=TOLERANCE)
    assert not top.stable
    assert isnan(top.frequency)


@pytest.mark.extended
@pytest.mark.parametrize("spin", [3.0, 4.0, 5.0, 12.0])
def test_a_rotating_hoop(spin: float) -> None:
    """Below the critical speed the bottom is stable; above it two other places are, with the frequency
    Omega*sin(q0).
    """
    found = hoop().equilibria(Omega=spin, g=8)
    share = 8.0 / (0.5 * spin**2)  # cos(q0)
    stable = [one for one in found if one.stable]
    if share >= 1.0:
        assert [one.lam for one in stable] == pytest.approx([0.0], abs=1e-9)
        expected = sqrt(16.0 - spin**2) if share > 1.0 else 0.0
        assert stable[0].frequency == pytest.approx(expected, rel=TOLERANCE, abs=1e-5)
    else:
        assert [cos(one.lam) for one in stable] == pytest.approx([share] * 2, rel=TOLERANCE)
        expected = spin * sqrt(1.0 - share**2)
        assert [one.frequency for one in stable] == pytest.approx([expected] * 2, rel=TOLERANCE)
    unstable = [one.lam for one in found if not one.stable]
    assert unstable == pytest.approx(([] if share >= 1.0 else [0.0]) + [pi], abs=1e-9)


@pytest.mark.parametrize("height", ["x**2", "(x - 3)**2/7", "1000*x**2 + x", "x**2/1000000"])
def test_a_parabola_on_the_open_line(height: str) -> None:
    """There is one equilibrium, wherever it lies, with the frequency sqrt(g*z'')."""
    (only,) = model(gqm.Curve.graph(height)).equilibria()
    slopes = {"x**2": (0.0, 2.0), "(x - 3)**2/7": (3.0, 2 / 7), "1000*x**2 + x": (-5e-4, 2000.0)}
    place, bend = slopes.get(height, (0.0, 2e-6))
    assert only.lam == pytest.approx(place, rel=TOLERANCE, abs=1e-15)
    assert only.frequency == pytest.approx(sqrt(9.81 * bend), rel=TOLERANCE)


@pytest.mark.extended
def test_a_double_well_and_a_quartic() -> None:
    """Two wells lie beside a hill; with a force of third power, small oscillations become slower without limit."""
    left, hill, right = model(gqm.Curve.graph("x**4 - x**2")).equilibria()
    assert (left.stable, hill.stable, right.stable) == (True, False, True)
    assert (left.lam, right.lam) == pytest.approx((-sqrt(0.5), sqrt(0.5)), rel=TOLERANCE)
    assert (left.frequency, right.frequency) == pytest.approx((sqrt(4 * 9.81),) * 2, rel=TOLERANCE)
    (flat,) = model(gqm.Curve.graph("x**4")).equilibria()
    assert (flat.stable, flat.frequency) == (True, 0.0)
    (inflection,) = model(gqm.Curve.graph("x**3")).equilibria()
    assert inflection.lam == pytest.approx(0.0, abs=1e-6)
    assert not inflection.stable


def test_arcs_and_corners() -> None:
    """An arc swings as its circle does; at the corner of two planes the period vanishes with the amplitude."""
    rail = gqm.Curve.piecewise([gqm.line(length=1), gqm.arc(radius="1/2", angle="pi/2")], start=(0, 0), heading="-pi/4")
    (bottom,) = model(rail).equilibria()
    assert bottom.stable
    assert bottom.lam == pytest.approx(1 + pi / 8, rel=1e-12)
    assert bottom.frequency == pytest.approx(sqrt(9.81 / 0.5), rel=1e-10)
    planes = gqm.Curve.sampled([(0, 1), (1, 0), (2, 1)], kind="linear")
    (corner,) = model(planes).equilibria()
    assert (corner.stable, corner.frequency) == (True, inf)
    assert corner.lam == pytest.approx(sqrt(2), rel=1e-12)


def test_losses_do_not_count() -> None:
    """A pendulum with drag, and a bead with friction, have the equilibria that they would have without."""
    for force in (gqm.QuadraticDrag(b="1/10"), gqm.CoulombFriction(mu="1/5")):
        bottom, top = model(gqm.families.circle(L=1), gqm.Gravity() + force).equilibria()
        assert bottom.frequency == pytest.approx(sqrt(9.81), rel=TOLERANCE)
        assert not top.stable


def test_rolling_slows_down() -> None:
    """A rolling ball has the frequency sqrt(g*z''/(1 + beta))."""
    (only,) = model(gqm.Curve.graph("x**2/2"), gqm.Gravity() + gqm.Rolling(beta="2/5")).equilibria()
    assert only.frequency == pytest.approx(sqrt(9.81 / 1.4), rel=TOLERANCE)


@pytest.mark.extended
def test_infinitely_many_want_a_range() -> None:
    """A wave on the open line has too many equilibria to be listed."""
    with pytest.raises(SolutionError, match="between"):
        model(gqm.Curve.graph("sin(x)")).equilibria()


def test_between_two_places() -> None:
    """Those of a wave on the open line are listed between two places, which are checked."""
    wave = model(gqm.Curve.graph("sin(x)"))
    found = wave.equilibria(between=(0, 10))
    assert [one.lam for one in found] == pytest.approx([pi / 2, 3 * pi / 2, 5 * pi / 2], rel=TOLERANCE)
    assert [one.stable for one in found] == [False, True, False]
    with pytest.raises(InputError, match="between"):
        wave.equilibria(between=3)
    with pytest.raises(InputError, match="in order"):
        wave.equilibria(between=(3, 1))


def test_nothing_rests_on_a_slope_and_anything_on_a_plane() -> None:
    """An inclined line has no equilibrium, and a level one none that could be listed."""
    assert model(gqm.Curve.graph("x/2")).equilibria() == ()
    assert model(gqm.Curve.graph("exp(x)")).equilibria() == ()
    with pytest.raises(SolutionError, match="rests anywhere"):
        model(gqm.Curve.parametric(x="u", z="3", parameter="u")).equilibria()


@pytest.mark.extended
def test_a_catenary() -> None:
    """At the bottom of z = c*cosh(x/c) the square of the frequency is g/c, for any c."""
    (only,) = model(gqm.families.catenary(c="1/3")).equilibria()
    assert only.frequency == pytest.approx(sqrt(9.81 * 3), rel=TOLERANCE)
    assert cosh(only.lam) == pytest.approx(1.0)


def test_parameters_are_checked() -> None:
    """An unknown parameter is refused with the list of names, and a missing value is asked for."""
    pendulum = model(gqm.Curve.parametric(x="L*cos(u)", z="L*sin(u)", parameter="u"))
    with pytest.raises(ArgumentError, match="did you mean 'L'"):
        pendulum.equilibria(l=1)
    with pytest.raises(ParameterError, match="pass L="):
        pendulum.equilibria()
