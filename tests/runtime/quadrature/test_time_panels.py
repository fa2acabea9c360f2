"""The quadrature rule, and panels of time and arc length, are right on segments with known times."""

import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.runtime.arithmetic.clenshaw import legendre_growth, legendre_sum
from gqm_sym.runtime.launch.problem import bind
from gqm_sym.runtime.launch.request import LaunchRequest, read_launch
from gqm_sym.runtime.quadrature.integrands import speeds_at
from gqm_sym.runtime.quadrature.kronrod import GAUSS_WEIGHTS, KRONROD_WEIGHTS, NODES
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR, TO_EQUILIBRIUM, TURN_TURN, phase_angles_of
from gqm_sym.runtime.quadrature.time_panels import (
    CONVERGED,
    COUNT,
    DEGREE,
    EXHAUSTED,
    FAILED,
    ILL_CONDITIONED,
    MIN_FIRST_PANEL_SHARE,
    antiderivative,
    lay_panels,
    read_off_many,
)

ModuleOf = Callable[[str], ModuleType]

ULP = 2.0**-52
# Nodes and weights are rounded once each.
RULE = ULP
# The error of the rule for the first polynomial beyond its degree, of norm about 0.2. Measured: 1.9e-3.
BEYOND = 1e-3
# The tolerance of interpolation at 21 nodes: each coefficient is a sum of 21 products of values up to 1. Worst
# measured: 1.2e-16.
INTERPOLATION = 4 * ULP
# The tolerance of a whole segment and of any part of it, as a share of the whole. Worst measured: 2.9e-16.
TIME = 4 * ULP
# The tolerance of speeds, which are found without a difference of heights. Worst measured: 3.3e-16.
SPEED = 4 * ULP

NODES_BOTH = np.concatenate([-NODES[:0:-1], NODES])
G = 9.81


def rule(weights: Any, degree: int) -> mpf:
    """Return a rule's sum for a Legendre polynomial, without rounding."""
    both = np.concatenate([weights[:0:-1], weights])
    with mp.workdps(40):
        pairs = zip(both, NODES_BOTH, strict=True)
        return mp.fsum(mpf(float(w)) * mp.legendre(degree, mpf(float(x))) for w, x in pairs)


class Laid:
    """Panels over a segment of a module, as the runtime lays them."""

    def __init__(self, module: ModuleType, kind: int, a: float, b: float, **given: Any) -> None:
        ref, w, stop = given.pop("ref", a), given.pop("w", 0.0), given.pop("stop", 1.0)
        formulas = module.MODEL
        values = tuple((formulas.parameters | given).values())
        numbers = formulas.numbers(values)
        launch = read_launch(formulas, numbers, LaunchRequest(a))
        functions = bind(formulas, numbers, launch)
        self.at = (functions.addresses, functions.p, kind, a, b, ref, w)
        panels = lay_panels(*self.at, np.array([0.0, stop]))
        self.edges, self.marks, self.lengths, self.time_terms, self.length_terms = panels[:5]
        self.error, self.balance, self.status = panels[5:]

    @property
    def whole(self) -> float:
        """Return the time of the whole segment."""
        return float(self.marks[-1])

    def times(self, phi: Any) -> Any:
        """Return times at phase angles."""
        return read_off_many(self.edges, self.marks, self.time_terms, np.asarray(phi, dtype=float))

    def arcs(self, phi: Any) -> Any:
        """Return arc lengths at phase angles."""
        return read_off_many(self.edges, self.lengths, self.length_terms, np.asarray(phi, dtype=float))

    def speeds(self, phi: Any) -> Any:
        """Return speeds at phase angles."""
        return speeds_at(*self.at, np.asarray(phi, dtype=float))


def share(actual: float, truth: mpf, of: float) -> float:
    """Return a difference relative to a number."""
    return float(abs(mpf(float(actual)) - truth) / mpf(of))


@pytest.fixture(scope="session")
def slope(generated_folder: Any) -> ModuleType:
    """Return a straight line by arc length, at an angle from the horizontal."""
    curve = gqm.Curve.parametric(x="s*cos(angle)", z="s*sin(angle)", parameter="s")
    return gqm.build(gqm.derive(curve, gqm.Gravity()), name="slope", folder=generated_folder)


@pytest.fixture(scope="session")
def vee(generated_folder: Any) -> ModuleType:
    """Return two straight lines with a corner at the origin, which a user's formula may not have."""
    curve = gqm.Curve.graph("abs(x)", parameter="x")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gqm_sym.derivation.pipeline.check_corners", lambda *_, **__: None)
        model = gqm.derive(curve, gqm.Gravity())
    return gqm.build(model, name="vee", folder=generated_folder)


@pytest.mark.parametrize(("weights", "degree"), [(GAUSS_WEIGHTS, 19), (KRONROD_WEIGHTS, 31)])
def test_a_rule_is_exact_to_its_degree_and_not_beyond(weights: Any, degree: int) -> None:
    """Ten Gauss nodes integrate polynomials up to degree 19 exactly, and with eleven Kronrod nodes up to degree 31."""
    assert abs(rule(weights, 0) - 2) <= RULE
    assert all(abs(rule(weights, k)) <= RULE for k in range(1, degree + 1))
    assert abs(rule(weights, degree + 1)) >= BEYOND


def test_the_gauss_rule_uses_every_second_node() -> None:
    """Gauss' nodes are the zeros of the tenth Legendre polynomial, and between each two of them is one of Kronrod's."""
    zeros = np.polynomial.legendre.leggauss(10)[0]
    assert np.allclose(NODES_BOTH[1::2], zeros, rtol=0, atol=ULP)
    assert not GAUSS_WEIGHTS[0::2].any()


@pytest.mark.parametrize("degree", range(COUNT))
def test_values_at_the_nodes_become_the_integral_s_legendre_series(degree: int) -> None:
    """The integral of a Legendre polynomial from -1 is (P[n+1] - P[n-1])/(2n+1), up to the highest that 21 values
    determine.
    """
    with mp.workdps(40):
        values = np.array([float(mp.legendre(degree, mpf(float(x)))) for x in NODES_BOTH])
    half, out = 0.75, np.empty(DEGREE)
    size, tail, middle = antiderivative(values, half, np.empty(DEGREE + 1), out)
    truth = np.zeros(DEGREE)
    if degree == 0:
        truth[:2] = 1.0, 1.0
    else:
        truth[[degree - 1, degree + 1]] = -1.0 / (2 * degree + 1), 1.0 / (2 * degree + 1)
    assert np.abs(out - half * truth).max() <= INTERPOLATION
    assert abs(size - 1.0) <= INTERPOLATION
    assert (tail > 0.5) == (degree >= 18)
    assert (middle > 0.5) == (12 <= degree <= 14)


def test_a_legendre_series_is_summed_as_its_terms_say() -> None:
    """Clenshaw's recurrence gives the sum of the polynomials, up to the ends of the interval."""
    terms = np.array([(-1.0) ** k / (k + 1) ** 2 for k in range(DEGREE)])
    for x in (-1.0, -0.75, 0.0, 0.3125, 0.9990234375, 1.0):
        with mp.workdps(40):
            truth = mp.fsum(mpf(float(c)) * mp.legendre(k, mpf(x)) for k, c in enumerate(terms))
        # Rounding is amplified by at most the number of terms.
        assert share(legendre_sum(terms, x), truth, np.abs(terms).sum()) <= DEGREE * ULP


@pytest.mark.parametrize("ratio", [1.5, 4.0])
def test_a_legendre_series_near_its_beginning(ratio: float) -> None:
    """The growth of a series from -1 keeps its digits however near the place is."""
    terms = (-ratio) ** -np.arange(24.0)
    for way in (1e-12, 1e-7, 1e-3, 0.5, 1.25, 2.0):
        with mp.workdps(40):
            parts = [mpf(float(c)) * (mp.legendre(k, mpf(way) - 1) - (-1) ** k) for k, c in enumerate(terms)]
            truth, size = mp.fsum(parts), mp.fsum(abs(part) for part in parts)
        assert share(legendre_growth(terms, way), truth, float(size)) <= 4 * ULP


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.25, -0.75])
def test_a_straight_line_from_place_to_place(angle: float, slope: ModuleType) -> None:
    """With the initial speed v0 uphill, the time to s is (v0 - V)/(g sin), or s/v0 on the level."""
    v0, a, b = 16.0, 1.5, 5.5
    laid = Laid(slope, REGULAR, a, b, w=v0**2, angle=angle)
    phi = np.linspace(0.0, 1.0, 23)
    assert laid.status == CONVERGED
    speeds = laid.speeds(phi)
    with mp.workdps(40):
        pull = mpf("9.81") * mp.sin(angle)
        for k, s in enumerate((b - a) * phi):
            v = mp.sqrt(v0**2 - 2 * pull * mpf(s))
            truth = 2 * mpf(s) / (v0 + v)
            assert share(laid.times(phi)[k], truth, laid.whole) <= TIME
            assert share(laid.arcs(phi)[k], mpf(s), b - a) <= TIME
            assert share(speeds[k], v, float(v)) <= SPEED


@pytest.mark.parametrize("angle", [0.5, 1e-6, -0.75, 1.5])
@pytest.mark.parametrize("start", [0.0, 100.0])
def test_free_fall_from_rest(angle: float, start: float, slope: ModuleType) -> None:
    """Released on a slope, t = sqrt(2 s/(g sin)), s = g sin t**2/2 and V = g sin t, on either side."""
    end = start - math.copysign(7.0, angle)
    laid = Laid(slope, FROM_TURN, start, end, angle=angle)
    phi = np.linspace(0.0, 1.0, 23)
    assert laid.status == CONVERGED
    times, arcs, speeds = laid.times(phi), laid.arcs(phi), laid.speeds(phi)
    with mp.workdps(40):
        pull = mpf("9.81") * mp.sin(abs(angle))
        for k, u in enumerate(phi):
            s = 7 * mpf(u) ** 2
            t = mp.sqrt(2 * s / pull)
            assert share(times[k], t, laid.whole) <= TIME
            assert share(arcs[k], s, 7) <= TIME
            assert share(speeds[k], pull * t, float(pull * laid.whole)) <= SPEED


@pytest.mark.parametrize("end", [2.0, 0.25, 1e-3, 1e-7])
def test_the_tautochrone_between_its_turns(end: float, module_of: ModuleOf) -> None:
    """On x = R(u + sin u), z = R(1 - cos u), the arc length 4 R sin(u/2) oscillates harmonically at any amplitude."""
    laid = Laid(module_of("cycloid_plus"), TURN_TURN, -end, end, stop=math.pi, R="2")
    phi = np.linspace(0.0, math.pi, 23)
    assert laid.status == CONVERGED
    times, arcs, speeds = laid.times(phi), laid.arcs(phi), laid.speeds(phi)
    with mp.workdps(40):
        frequency, reach = mp.sqrt(mpf("9.81") / 8), 8 * mp.sin(mpf(end) / 2)
        assert share(laid.whole, mp.pi / frequency, laid.whole) <= TIME
        for k, phase_angle in enumerate(phi[:-1]):
            s = 8 * mp.sin(-mpf(end) * mp.cos(mpf(phase_angle)) / 2)
            assert share(times[k], mp.acos(-s / reach) / frequency, laid.whole) <= TIME
            assert share(arcs[k], s + reach, float(2 * reach)) <= TIME
            assert share(speeds[k], frequency * mp.sqrt(reach**2 - s**2), float(frequency * reach)) <= SPEED


@pytest.mark.parametrize("start", [0.0, -1.0, 3.0])
def test_the_separatrix_of_the_pendulum(start: float, module_of: ModuleOf) -> None:
    """Towards the hilltop the remaining angle is 4 atan(exp(-w t)), and the time grows with its logarithm."""
    laid = Laid(module_of("circle"), TO_EQUILIBRIUM, start, math.pi, stop=64.0, L="1")
    phi = np.linspace(0.0, 64.0, 23)
    times, speeds = laid.times(phi), laid.speeds(phi)
    assert laid.status == CONVERGED
    with mp.workdps(40):
        w, whole = mp.sqrt(mpf("9.81")), mpf(math.pi) - start
        for k, phase_angle in enumerate(phi):
            left = whole * mp.exp(-mpf(phase_angle))
            truth = (mp.log(mp.tan(whole / 4)) - mp.log(mp.tan(left / 4))) / w
            assert share(times[k], truth, laid.whole) <= TIME
            v = 2 * w * mp.sin(left / 2)
            # The exponential of a phase angle of 64 has a rounding of its own, in units in the angle's last place.
            assert share(speeds[k], v, float(v)) <= SPEED + math.ulp(phase_angle)


def test_a_corner_is_narrowed_down_or_owned_up_to(vee: ModuleType) -> None:
    """At a corner inside a segment panels become many, and the stated error is at least the true one."""
    v0 = 10.0
    laid = Laid(vee, REGULAR, -1.0, 1.5, ref=0.0, w=v0**2)
    with mp.workdps(40):
        g = mpf("9.81")
        truth = mp.fsum((v0 - mp.sqrt(v0**2 - 2 * g * s)) * mp.sqrt(2) / g for s in (mpf(1), mpf("1.5")))
    assert laid.status != CONVERGED
    assert share(laid.whole, truth, float(truth)) <= laid.error <= 1e-11


def test_an_end_taken_for_regular_that_is_not(slope: ModuleType) -> None:
    """From rest without the substitution for the root the number of panels does not suffice; the status says so, and
    the error is right.
    """
    laid = Laid(slope, REGULAR, 0.0, -5.0, w=0.0, angle=0.5)
    with mp.workdps(40):
        truth = mp.sqrt(10 / (mpf("9.81") * mp.sin(mpf("0.5"))))
    assert laid.status == EXHAUSTED
    assert np.diff(laid.edges).min() >= MIN_FIRST_PANEL_SHARE / 2
    assert share(laid.whole, truth, float(truth)) <= laid.error <= 1e-6


def test_a_place_out_of_reach_has_no_time(slope: ModuleType) -> None:
    """Uphill from rest V**2 is negative everywhere, so that there is no time and the error is infinite."""
    laid = Laid(slope, FROM_TURN, 0.0, 5.0, angle=0.5)
    assert laid.status == FAILED
    assert math.isinf(laid.error)


def test_next_to_the_separatrix_doubles_give_up(module_of: ModuleOf) -> None:
    """If V**2 nearly vanishes inside, the status asks for extended precision; for an ordinary swing it does not."""
    circle = module_of("circle")
    hard = Laid(circle, TURN_TURN, -math.pi + 1e-10, math.pi - 1e-10, stop=math.pi, L="1")
    fair = Laid(circle, TURN_TURN, -2.0, 2.0, stop=math.pi, L="1")
    assert (hard.status, fair.status) == (ILL_CONDITIONED, CONVERGED)
    assert fair.balance > 0.1


@pytest.mark.parametrize("amplitude", [1e-8, 0.3, 2.0, 3.0, 3.14])
def test_the_stated_error_is_no_less_than_the_true_one(amplitude: float, module_of: ModuleOf) -> None:
    """A pendulum's half period is 2 K(sin(A/2))/w, and the error of quadrature and rounding together is at most the
    stated one.

    The rounding of the ends is no part of quadrature; the condition number includes it.
    """
    laid = Laid(module_of("circle"), TURN_TURN, -amplitude, amplitude, stop=math.pi, L="1")
    with mp.workdps(40):
        truth = 2 * mp.ellipk(mp.sin(mpf(amplitude) / 2) ** 2) / mp.sqrt(mpf("9.81"))
    assert share(laid.whole, truth, float(truth)) <= laid.error + 2 * ULP + ULP / laid.balance


@pytest.mark.parametrize("kind", [TURN_TURN, FROM_TURN, REGULAR, TO_EQUILIBRIUM])
def test_phase_angles_of_places(kind: int) -> None:
    """The phase angles of many places are those by whose closed forms the places were made, from 0 on, both near the
    start of a segment and near its end.
    """
    width, phi = 3.0, np.append(0.0, np.geomspace(1e-9, 0.99, 50))
    shares = {
        TURN_TURN: (np.sin(0.5 * phi) ** 2, np.cos(0.5 * phi) ** 2),
        FROM_TURN: (phi**2, (1.0 - phi) * (1.0 + phi)),
        REGULAR: (phi, 1.0 - phi),
        TO_EQUILIBRIUM: (-np.expm1(-phi), np.exp(-phi)),
    }
    from_a, to_b = (width * share for share in shares[kind])
    found = phase_angles_of(kind, 0.0, from_a, to_b, width)
    # The rounding of 1 where an angle is found from the distance to the end; else of the angle.
    assert np.all(np.abs(found - phi) <= 4 * ULP * (1.0 if kind == TO_EQUILIBRIUM else phi))
