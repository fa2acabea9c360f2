"""Charted curves in extended precision agree with closed forms and with quadrature in the curves' own parameters."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from naive import error, overstatement, pendulum, ulps
from scipy.interpolate import make_interp_spline

import gqm_sym as gqm
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.multiprecision.fixed_point import Polynomials
from gqm_sym.runtime.multiprecision.gauss_legendre import gauss

# The tolerances: a position relative to its scale; a period in its last place; the largest ratio of error_bound to the
# error.
POSITION = 8e-15
PERIOD_ULPS = 0.5
USEFUL = 100
DIGITS = 50

G = "9.81"


def exactly(text: str) -> mpf:
    """Return a number as the package reads it."""
    return read_number(text, where="text").at(mp)


def agrees(text: str, truth: mpf) -> bool:
    """Return whether every digit of a decimal string is right, except for the rounding of the last one."""
    digits = len(text.replace(".", "").lstrip("0"))
    with mp.workdps(digits + 20):
        return bool(abs(mpf(text) - truth) <= abs(truth) * mpf(10) ** (1 - digits))


@pytest.fixture(scope="module")
def ring(generated_folder: Path) -> ModuleType:
    """Return a pendulum's circle as x**2 + z**2 = R**2, with arc length from its lowest point."""
    curve = gqm.Curve.implicit("x**2 + z**2 - R**2", start=(0, "-R"), parameters={"R": 1}, tangent=-1)
    return gqm.build(gqm.derive(curve, gqm.Gravity()), name="exact_ring", folder=generated_folder)


def pendulum_period(angle: mpf, speed: mpf) -> mpf:
    """Return the period, or the time of a round, of a pendulum of length 1 by Legendre's integral."""
    g = mpf(G)
    k2 = (speed**2 + 4 * g * mp.sin(angle / 2) ** 2) / (4 * g)
    return 4 * mp.ellipk(k2) / mp.sqrt(g) if k2 < 1 else 2 * mp.ellipk(1 / k2) / mp.sqrt(g * k2)


# Beside the separatrix, where a period takes many panels, fewer digits are tested.
SWINGS = [
    ({"lam0": "6/5"}, "libration", DIGITS),
    ({"lam0": 0, "v0": "3"}, "libration", DIGITS),
    ({"lam0": "-1/3", "v0": "1"}, "libration", DIGITS),
    ({"lam0": "1e-8"}, "libration", DIGITS),
    ({"lam0": "pi - 1e-12"}, "libration", DIGITS // 2),
    ({"lam0": 0, "v0": "2*sqrt(9.81)*(1 - 1e-14)"}, "libration", DIGITS // 2),
    ({"lam0": 0, "v0": "2*sqrt(9.81)*(1 + 1e-14)"}, "circulation", DIGITS // 2),
    ({"lam0": "pi", "v0": "1e-10"}, "circulation", DIGITS // 2),
    ({"lam0": "5/2", "v0": "8"}, "circulation", DIGITS),
]


@pytest.mark.sample(1)
@pytest.mark.parametrize(("launch", "kind", "digits"), SWINGS, ids=lambda value: str(value))
def test_pendulum(ring: ModuleType, launch: dict[str, Any], kind: str, digits: int) -> None:
    """Kind and period are right to many digits, up to the limits between swings and rounds."""
    motion = ring.solve(**launch)
    assert motion.kind == kind
    with mp.workdps(DIGITS + 20):
        wanted = pendulum_period(exactly(str(launch["lam0"])), exactly(launch.get("v0", "0")))
        assert agrees(motion.period_to(digits), wanted)
        assert ulps(motion.period, wanted) <= PERIOD_ULPS


@pytest.mark.extended
def test_what_does_not_swing(ring: ModuleType) -> None:
    """Rest on top and at the bottom, and the separatrix between swings and rounds, are decided for the given
    numbers.
    """
    assert ring.solve(lam0="pi").kind == ring.solve(lam0=0).kind == "rest"
    assert ring.solve(lam0=float(np.pi)).kind == "libration"
    assert ring.solve(lam0=0, v0="2*sqrt(9.81)").kind == "asymptotic"


@pytest.mark.extended
def test_a_hundred_digits(ring: ModuleType) -> None:
    """A period is computed to as many digits as are asked for."""
    with mp.workdps(130):
        assert agrees(ring.solve(lam0="6/5").period_to(100), pendulum_period(mpf("1.2"), mpf(0)))


def test_late(ring: ModuleType) -> None:
    """After a billion seconds, positions are those of the closed form within a right and useful bound."""
    motion = ring.solve(lam0="6/5", R="7/5")
    with mp.workdps(DIGITS):
        frequency = mp.sqrt(mpf(G) / mpf("1.4"))
        rows = []
        for t in ("0.25", "3", "1e3", "1e6", "1234567.875", "1e9"):
            place = mpf("1.4") * pendulum(mpf("1.2") / mpf("1.4"), frequency, mpf(t))
            rows.append((t, place))
            assert error(motion.lam(t), place) <= POSITION * 2.4
            assert error(motion.lam(t), place) <= motion.error_bound(t)
        assert overstatement(motion, rows, 2.4) <= USEFUL


@pytest.mark.sample(1)
@pytest.mark.parametrize("lam0", ["0", "1/2", "-2"])
def test_towards_the_top(ring: ModuleType, lam0: str) -> None:
    """On the separatrix tan((angle + pi)/4) grows as exp(omega*t), and the bound holds there too."""
    motion = ring.solve(lam0=lam0, v0=f"2*sqrt(9.81)*cos(({lam0})/2)")
    assert motion.kind == "asymptotic"
    with mp.workdps(DIGITS):
        frequency, rows = mp.sqrt(mpf(G)), []
        begun = mp.tan((exactly(lam0) + mp.pi) / 4)
        for t in ("0.1", "0.5", "1", "3", "7", "10", "20"):
            place = 4 * mp.atan(begun * mp.exp(frequency * mpf(t))) - mp.pi
            rows.append((t, place))
            assert error(motion.lam(t), place) <= motion.error_bound(t)
            assert error(motion.lam(t), place) <= POSITION * np.pi
        assert overstatement(motion, rows, np.pi) <= USEFUL


def test_launch_by_point_and_by_length(ring: ModuleType) -> None:
    """A launch by point and one by length at the same place agree to every digit."""
    by_length = ring.solve(lam0="pi/3")
    by_point = ring.solve(point=("sqrt(3)/2", "-1/2"))
    assert by_length.period_to(DIGITS) == by_point.period_to(DIGITS)


def test_start_point_off_the_curve(ring: ModuleType, generated_folder: Path) -> None:
    """A start point with few digits means the foot of its perpendicular, from which lengths count."""
    curve = gqm.Curve.implicit("x**2 + z**2 - 1", start=("0.6000001", "-0.8"))
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="exact_ring_beside", folder=generated_folder)
    with mp.workdps(DIGITS + 20):
        angle = mp.atan2(mpf("0.6000001"), mpf("0.8")) + mpf("0.25")
        assert agrees(module.solve(lam0="1/4").period_to(DIGITS), pendulum_period(angle, mpf(0)))


def test_beside_a_singular_point(generated_folder: Path) -> None:
    """The strophoid's loop is traced to its node; a swing on it (of the corpus) that stays away from the node has all
    digits.
    """
    start = ("-3*sqrt(3)/10", "-9/10")
    curve = gqm.Curve.implicit("x**2*(a - z) - z**2*(a + z)", start=start, tangent=-1, parameters={"a": "9/5"})
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="exact_strophoid", folder=generated_folder)
    motion = module.solve(lam0=0)
    assert ulps(motion.half_period, "1.003562114539050285946395584607442") <= PERIOD_ULPS


@pytest.mark.extended
def test_another_force(generated_folder: Path) -> None:
    """On a rotating hoop V**2 changes with x as well."""
    curve = gqm.Curve.implicit("x**2 + z**2 - 1", start=(0, -1))
    force = gqm.Gravity() + gqm.RotatingFrame(Omega="3/2")
    module = gqm.build(gqm.derive(curve, force), name="exact_hoop", folder=generated_folder)
    motion = module.solve(lam0="1")
    with mp.workdps(45):
        g, rate = mpf(G), mpf(9) / 4

        def quarter(phi: mpf) -> mpf:
            # With sin(angle/2) = k sin(phi), V**2 = (cos(angle) - cos(1)) (2 g - rate (cos(angle) + cos(1))).
            k = mp.sin(mpf("0.5"))
            angle = 2 * mp.asin(k * mp.sin(phi))
            return 2 / (mp.cos(angle / 2) * mp.sqrt(2 * (2 * g - rate * (mp.cos(angle) + mp.cos(1)))))

        period = 4 * mp.quad(quarter, [0, mp.pi / 2])
        assert agrees(motion.period_to(40), period)


# -- tracks of parts ------------------------------------------------------------------------------

VALLEY = [("-3", "4"), ("0", "0"), ("2", "0"), ("7", "12")]


@pytest.fixture(scope="module")
def valley(generated_folder: Path) -> ModuleType:
    """Return a track down a slope of 4:3, over a level, and up a slope of 12:5."""
    curve = gqm.Curve.sampled(VALLEY, kind="linear")
    return gqm.build(gqm.derive(curve, gqm.Gravity()), name="exact_valley", folder=generated_folder)


@pytest.mark.parametrize("lam0", ["0", "1/3", "2.7"])
def test_planes(valley: ModuleType, lam0: str) -> None:
    """With constant acceleration on slopes and none on the level, the period is right to 50 digits, and so are late
    places.
    """
    motion = valley.solve(lam0=lam0)
    with mp.workdps(DIGITS + 20):
        left, g = 5 - exactly(lam0), mpf(G)
        fast = mp.sqrt(2 * g * left * 4 / 5)
        down, level, up = fast / g * mpf(5) / 4, 2 / fast, fast / g * mpf(13) / 12
        period = 2 * (down + level + up)
        assert agrees(motion.period_to(DIGITS), period)
        rows = []
        for t in ("0.1", "1e6", "123456789.5"):
            r = mp.fmod(mpf(t), period)
            r = min(r, period - r)
            if r <= down:
                place = 5 - left + g * mpf("0.8") * r**2 / 2
            elif r <= down + level:
                place = 5 + fast * (r - down)
            else:
                place = 7 + g * mpf(12) / 13 / 2 * (up**2 - (down + level + up - r) ** 2)
            rows.append((t, place))
            assert error(motion.lam(t), place) <= POSITION * 20
            assert error(motion.lam(t), place) <= motion.error_bound(t)
        assert overstatement(motion, rows, 20.0) <= USEFUL


def swing_time(rate: Callable[[mpf], mpf], low: mpf, high: mpf, cuts: list[mpf]) -> mpf:
    """Return an integral over a function with the root of the distances from both ends in its denominator."""
    middle = (low + high) / 2

    def half(end: mpf, way: int) -> mpf:
        inside = sorted(mp.sqrt(abs(cut - end)) for cut in cuts if 0 < (cut - end) * way < (middle - end) * way)
        edges = [mpf(0), *inside, mp.sqrt(abs(middle - end))]
        return mp.quad(lambda w: 2 * w * rate(end + way * w * w), edges, method="gauss-legendre")

    return half(low, 1) + half(high, -1)


@pytest.mark.extended
@pytest.mark.filterwarnings("ignore::gqm_sym.errors.NoisyPointsWarning")
def test_spline(generated_folder: Path) -> None:
    """The period is that of the spline with exactly the coefficients that interpolate in doubles."""
    points = np.array([(-3.0, 2.0), (-2.0, 0.5), (-0.5, -0.25), (1.0, 0.125), (2.0, 1.0), (3.5, 3.0), (4.0, 5.0)])
    curve = gqm.Curve.sampled(points)
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="exact_spline", folder=generated_folder)
    chart = module.CHART.chart(())
    knots = np.array([place for _, place, _ in chart.origins] + [chart.origins[-1, 2]])
    knots = knots[[bool(np.abs(chart.points([s])[:2, 0] - points).max(axis=1).min() < 1e-12) for s in chart.edges]]
    assert len(knots) == len(points)
    vanishing = [(order, np.zeros(2)) for order in (3, 4)]
    spline = make_interp_spline(knots, points, k=5, bc_type=(vanishing, vanishing))
    motion = module.solve(lam0=0.25)
    with mp.workdps(40):
        # Each polynomial between breaks is found from six places by de Boor's algorithm in extended precision.
        breaks = np.unique(spline.t)

        def at(place: mpf, derivative: int) -> tuple[mpf, mpf]:
            k = int(np.clip(np.searchsorted(spline.t, float(place), side="right") - 1, 5, len(spline.t) - 7))
            c, t, p = [[mpf(float(v)) for v in row] for row in spline.c[k - 5 : k + 1]], spline.t, 5
            for order in range(1, derivative + 1):
                c = [
                    [(p + 1 - order) * (b - a) / (mpf(float(t[k + 1 + i])) - mpf(float(t[k - p + order + i])))
                     for a, b in zip(c[i], c[i + 1], strict=True)]
                    for i in range(p - order + 1)
                ]  # fmt: skip
            degree = p - derivative
            for order in range(1, degree + 1):
                for i in range(degree, order - 1, -1):
                    low, high = mpf(float(t[k - degree + i])), mpf(float(t[k + 1 + i - order]))
                    share = (place - low) / (high - low)
                    c[i] = [(1 - share) * a + share * b for a, b in zip(c[i - 1], c[i], strict=True)]
            return c[degree][0], c[degree][1]

        launch = _spline_place(at, mpf("0.25"), breaks)
        height = at(launch, 0)[1]
        far = mp.findroot(lambda u: at(u, 0)[1] - height, (mpf(5), mpf(9)), solver="anderson", tol=mpf(10) ** -70)

        def rate(place: mpf) -> mpf:
            return mp.hypot(*at(place, 1)) / mp.sqrt(2 * mpf(G) * (height - at(place, 0)[1]))

        half = swing_time(rate, launch, far, [mpf(float(b)) for b in breaks])
        assert ulps(motion.half_period, half) <= PERIOD_ULPS
        assert agrees(motion.period_to(30), 2 * half)


def _spline_place(at: Callable[[mpf, int], tuple[mpf, mpf]], length: mpf, breaks: np.ndarray) -> mpf:
    """Return the place on a spline at a length that lies before its first break."""
    place, step = length, length
    while abs(step) > mpf(10) ** -25:  # the next one would be below rounding
        gone = mp.quad(lambda u: mp.hypot(*at(u, 1)), [mpf(0), place], method="gauss-legendre")
        step = (length - gone) / mp.hypot(*at(place, 1))
        place += step
    assert place < breaks[1]
    return place


def test_rail(generated_folder: Path) -> None:
    """A half-pipe has quarters of a pendulum's swing and a level between them; the ends of its pieces are
    irrational.
    """
    pieces = [gqm.arc(radius="R", angle="pi/2"), gqm.line(length="sqrt(2)"), gqm.arc(radius="R", angle="pi/2")]
    curve = gqm.Curve.piecewise(pieces, start=(0, "R"), heading="-pi/2", parameters={"R": "3/2"})
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="exact_half_pipe", folder=generated_folder)
    motion = module.solve(lam0="3/2*pi/6")
    with mp.workdps(DIGITS + 20):
        g, radius, angle = mpf(G), mpf(3) / 2, mp.pi / 3
        swing = 4 * mp.sqrt(radius / g) * mp.ellipk(mp.sin(angle / 2) ** 2)
        period = swing + 2 * mp.sqrt(2) / mp.sqrt(2 * g * radius * (1 - mp.cos(angle)))
        assert agrees(motion.period_to(DIGITS), period)
        late = mp.mpf(10**6) * period + swing / 4  # at the end of the first arc
        assert error(motion.lam(mp.nstr(late, 40)), radius * mp.pi / 2) <= POSITION * 6


def test_rail_of_clothoid_and_curve(generated_folder: Path) -> None:
    """On half a parabola down and a clothoid up, the time on each side agrees with a separate quadrature."""
    bowl = gqm.Curve.parametric(x="u", z="a*u**2", parameter="u", domain=("-2", "0"), parameters={"a": "1/2"})
    pieces = [bowl, gqm.clothoid(length="4", kappa_start="1", kappa_end="1/10")]
    curve = gqm.Curve.piecewise(pieces)
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="exact_clothoid", folder=generated_folder)
    motion = module.solve(point=("-1", "1/2"))
    with mp.workdps(45):
        g = mpf(G)
        by_gauss = partial(mp.quad, method="gauss-legendre")

        def fall(w: mpf) -> mpf:
            """Return the integrand of the time down the parabola at u = 1 - w**2, where V**2 = g*(1 - u**2)."""
            return 2 * mp.sqrt((1 + (1 - w * w) ** 2) / (g * (2 - w * w)))

        def height(low: mpf, high: mpf) -> mpf:
            return by_gauss(lambda s: mp.sin(s - mpf(9) / 80 * s * s), [low, high])

        top = mp.findroot(lambda s: height(mpf(0), s) - mpf(1) / 2, mpf(1))
        down = by_gauss(fall, [0, 1])
        up = by_gauss(lambda w: 2 * w / mp.sqrt(2 * g * height(top - w * w, top)), [0, mp.sqrt(top)])
        assert ulps(motion.half_period, down + up) <= PERIOD_ULPS
        assert agrees(motion.period_to(30), 2 * (down + up))


@pytest.mark.extended
def test_launch_by_a_length_over_many_pieces(generated_folder: Path) -> None:
    """Far along a parabola the length is (u sqrt(1 + u**2) + asinh(u))/2, and the swing's time agrees with a
    quadrature.
    """
    bowl = gqm.Curve.parametric(x="u", z="a*u**2", parameter="u", domain=("-2", "2"), parameters={"a": "1/2"})
    module = gqm.build(
        gqm.derive(gqm.Curve.piecewise([bowl]), gqm.Gravity()), name="exact_bowl", folder=generated_folder
    )
    assert len(module.CHART.chart((0.5, 9.81, 1.0)).edges) > 4
    motion = module.solve(lam0="5")
    with mp.workdps(45):

        def length(u: mpf) -> mpf:
            return (u * mp.sqrt(1 + u * u) + mp.asinh(u)) / 2

        far = mp.findroot(lambda u: length(u) - length(mpf(-2)) - 5, mpf(1))
        # u = far sin(phi), V**2 = g far**2 cos(phi)**2
        period = 4 * mp.quad(lambda phi: mp.sqrt(1 + (far * mp.sin(phi)) ** 2), [0, mp.pi / 2]) / mp.sqrt(mpf(G))
        assert agrees(motion.period_to(30), period)


# -- the tools ------------------------------------------------------------------------------------


def test_polynomials() -> None:
    """Polynomials in integers agree with mpmath's at any precision."""
    rows = [[mpf("0.7"), mpf(-3), mpf("1e-20"), mpf(5)], [mpf("1e9"), mpf(2), mpf(0), mpf("-1e-3")]]
    found = Polynomials(mp, rows)
    for digits in (30, 60):
        with mp.workdps(digits):
            at = mpf(1) / 3
            for row, values in zip(rows, found(at), strict=True):
                size = max(abs(term) for term in row)
                wanted = (*mp.polyval(row[::-1], at, derivative=1), 2 * row[2] + 6 * row[3] * at)
                for value, truth in zip(values, wanted, strict=True):
                    assert abs(value - truth) <= size * mpf(10) ** (2 - digits)


def test_quadrature_takes_what_it_needs() -> None:
    """Quadrature returns the digits asked for, on easy and hard panels; it refuses integrands that are not analytic."""
    with mp.workdps(60):
        for rate, edges, wanted in (
            (lambda x: mp.exp(x), [mpf(0), mpf(1)], mp.e - 1),
            (lambda x: 1 / (1 + 400 * x * x), [mpf(-1), mpf(1)], mp.atan(20) / 10),
            (lambda x: x**40, [mpf(-1), mpf(1), mpf(3)], (mpf(3) ** 41 + 1) / 41),
        ):
            assert abs(sum(gauss(mp, rate, edges, 40)) / wanted - 1) <= mpf(10) ** -40
        with pytest.raises(gqm.errors.SolutionError, match="not analytic"):
            gauss(mp, lambda x: abs(x - mpf(1) / 3), [mpf(0), mpf(1)], 40)
