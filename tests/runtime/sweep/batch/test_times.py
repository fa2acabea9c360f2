"""Times of batches: their rounding errors are small, and on average nearly zero."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm

# The largest error of a half period, and of its mean over many launches, in units in the last place.
MAX_ERROR, MAX_MEAN_ERROR = 2.5, 0.4


def errors(values: np.ndarray, truths: list[Any]) -> np.ndarray:
    """Return errors in units in the last place of the truths."""
    with mp.workdps(40):
        pairs = zip(values.tolist(), truths, strict=True)
        return np.array([float((mpf(value) - truth) / mpf(float(np.spacing(float(truth))))) for value, truth in pairs])


@pytest.mark.parametrize("beta", [0.1, 0.3, 0.4, 0.7])
def test_roundings_of_the_inertia_do_not_add_up(beta: float, build: Callable[..., ModuleType]) -> None:
    """Inertia and pi are not representable; with both rounded, all times would be too short or too long."""
    module = build("rolling_mean", gqm.families.circle(L=1), gqm.Rolling())
    amplitudes = np.linspace(0.3, 2.0, 400)
    values = module.sweep("half_period", amplitudes, beta=beta).values
    with mp.workdps(40):
        scale = 2 * mp.sqrt((1 + mpf(beta)) / mpf(9.81))
        truths = [scale * mp.ellipk(mp.sin(mpf(a) / 2) ** 2) for a in amplitudes.tolist()]
    found = errors(values, truths)
    assert np.abs(found).max() <= MAX_ERROR
    assert abs(found.mean()) <= MAX_MEAN_ERROR


@pytest.mark.extended
def test_corrected_times_have_the_inertia_once(build: Callable[..., ModuleType]) -> None:
    """An inertia that rounds to 1 lengthens times by half of what it loses, also where double-double arithmetic, which
    does not round it, corrects them; there this was counted twice.
    """
    module = build("rolling_ripples", gqm.Curve.graph("x**2/2+sin(3*x)/10", parameter="x"), gqm.Rolling(radius="rho"))
    beta, starts = 0.99 * 2.0**-53, np.linspace(0.3, 1.2, 2000)
    values, without = (module.sweep("half_period", starts, beta=each, rho=0.05).values for each in (beta, 0.0))
    assert abs(np.mean((values - without) / without) / beta - 0.5) <= 0.15


@pytest.mark.parametrize("beta", [0.1, 0.4, 0.7])
def test_sums_over_nodes_are_rounded_once(beta: float, build: Callable[..., ModuleType]) -> None:
    """On the parabola z = x**2/2 half periods are complete elliptic integrals of the second kind, and those of the
    trapezoidal rule are rounded at random about them.
    """
    module = build("rolling_parabola_sums", gqm.Curve.graph("x**2/2", parameter="x"), gqm.Rolling())
    amplitudes = np.linspace(0.2, 1.5, 400)
    values = module.sweep("half_period", amplitudes, beta=beta).values
    with mp.workdps(40):
        scale = 2 * mp.sqrt((1 + mpf(beta)) / mpf(9.81))
        truths = [scale * mp.ellipe(-(mpf(a) ** 2)) for a in amplitudes.tolist()]
    found = errors(values, truths)
    assert np.abs(found).max() <= MAX_ERROR
    assert abs(found.mean()) <= MAX_MEAN_ERROR


@pytest.mark.parametrize("beta", [0.1, 0.4, 0.7])
def test_a_cycloid_has_one_period(beta: float, build: Callable[..., ModuleType]) -> None:
    """On Huygens's cycloid all times are the same, to the last bit, and their derivatives by the launch are zero."""
    module = build("rolling_cycloid", gqm.families.cycloid(R=1, inverted=True), gqm.Rolling())
    found = module.sweep("half_period", np.pi + np.linspace(0.2, 2.5, 400), beta=beta, gradient=("lam0", "v0"))
    with mp.workdps(40):
        truth = 2 * mp.pi * mp.sqrt((1 + mpf(beta)) / mpf(9.81))
    assert np.abs(errors(found.values, [truth] * len(found.values))).max() <= MAX_ERROR
    assert len(set(found.values.tolist())) == 1
    np.testing.assert_array_equal(found.gradient, 0.0)


def half_period_of_ball(start: float, beta: float, rho: float) -> Any:
    """Return the half period of a ball released on x = sin(2t), z = -cos(3t)/2 - cos(t) between -start and start."""

    def height_and_ds(t: Any) -> tuple[Any, Any]:
        x1, z1 = 2 * mp.cos(2 * t), 3 * mp.sin(3 * t) / 2 + mp.sin(t)
        x2, z2 = -4 * mp.sin(2 * t), 9 * mp.cos(3 * t) / 2 + mp.cos(t)
        ds = mp.hypot(x1, z1)
        height = -mp.cos(3 * t) / 2 - mp.cos(t) + mpf(rho) * x1 / ds
        return height, ds - mpf(rho) * (x1 * z2 - z1 * x2) / ds**2

    end, nodes, total = mpf(start), 32, mpf(0)
    top, scale = height_and_ds(end)[0], 2 * mpf(9.81) / (1 + mpf(beta))
    for k in range(nodes):
        t = end * mp.cos(mp.pi * (2 * k + 1) / (4 * nodes))
        height, ds = height_and_ds(t)
        total += ds * mp.sqrt((end**2 - t**2) / (scale * (top - height)))
    return mp.pi * total / nodes


@pytest.mark.extended
def test_ball_with_a_radius(build: Callable[..., ModuleType]) -> None:
    """The speed of a ball's centre is a root less a small term, whose common divisor added roundings to the root."""
    curve = gqm.Curve.parametric(x="sin(2*t)", z="-cos(3*t)/2-cos(t)", parameter="t", period="2*pi")
    module = build("ball_on_lissajous", curve, gqm.Rolling(radius="rho"))
    starts = np.append(np.linspace(0.1, 0.14, 200), 0.11000609516847794)
    values = module.sweep("half_period", starts, beta=0.4, rho=0.05).values
    with mp.workdps(40):
        truths = [half_period_of_ball(start, 0.4, 0.05) for start in starts.tolist()]
    assert np.abs(errors(values, truths)).max() <= 2.0


def test_thrown_bodies_on_a_circle(tmp_path: Path) -> None:
    """Wherever it is thrown, a body up to nine tenths of the way to the top has its digits, by elliptic integrals."""
    module = gqm.build(gqm.derive(gqm.families.circle(L=1), gqm.Gravity()), name="thrown", folder=tmp_path)
    rng = np.random.default_rng(3)
    energies, shares = rng.uniform(0.3, 0.9, 600), rng.uniform(0.02, 1.0, 600)
    lam0 = 2 * np.arcsin(np.sqrt(energies * (1 - shares))) * rng.choice([-1, 1], 600)
    v0 = np.sqrt(4 * 9.81 * energies * shares)
    values = module.sweep("half_period", lam0, v0).values
    with mp.workdps(40):
        squares = [mp.sin(mpf(a) / 2) ** 2 + mpf(v) ** 2 / (4 * mpf(9.81)) for a, v in zip(lam0, v0, strict=True)]
        found = errors(values, [2 * mp.ellipk(square) / mp.sqrt(mpf(9.81)) for square in squares])
    assert np.abs(found).max() <= 3.5
    assert np.quantile(np.abs(found), 0.99) <= 2.1


@pytest.mark.extended
def test_released_at_rest_in_later_laps(build: Callable[..., ModuleType]) -> None:
    """The distance from the lowest point, which is not a double, has all digits many laps away too; half periods follow
    by elliptic integrals.
    """
    circle = gqm.Curve.parametric(x="cos(u)", z="sin(u)", parameter="u", period="2*pi")
    module, rng = build("circle_from_the_side", circle, gqm.Rolling()), np.random.default_rng(8)
    places = rng.uniform(-2.0, 2.0, 300) - np.pi / 2 + 2.0 * np.pi * rng.integers(1, 60, 300)
    values = module.sweep("half_period", places, beta=0.0).values
    with mp.workdps(40):
        squares = [mp.sin((mpf(place) + mp.pi / 2) / 2) ** 2 for place in places.tolist()]
        truths = [2 * mp.ellipk(square) / mp.sqrt(mpf(9.81)) for square in squares]
    assert np.abs(errors(values, truths)).max() <= MAX_ERROR


@pytest.mark.extended
def test_between_the_cusps_of_a_tricuspoid(build: Callable[..., ModuleType]) -> None:
    """The square of ds has a double root at each cusp, and its expanded terms cancelled near it; with the square S of
    the sine of half the distance from the axis, half periods are complete elliptic integrals of 2*S/(1 - 2*S).
    """
    curve = gqm.Curve.parametric(x="2*sin(t)-sin(2*t)", z="-2*cos(t)-cos(2*t)", parameter="t")
    places = np.pi + np.linspace(0.1, 1.03, 300)
    values = build("tricuspoid", curve, gqm.Rolling()).sweep("half_period", places, beta=0.0).values
    truths = []
    with mp.workdps(40):
        for place in places.tolist():
            rest = mp.cos(mpf(place) - mp.pi)
            first, second = mp.ellipk((1 - rest) / rest), mp.ellipe((1 - rest) / rest)
            truths.append(2 * mp.sqrt(8 / (mpf(9.81) * rest)) * (first - 2 * rest * (first - second)))
    assert np.abs(errors(values, truths)).max() <= MAX_ERROR


def half_period_on_hyperbolic_cosine(start: float) -> Any:
    """Return the half period of a body released on z = cosh(3x/2) at ``start``."""
    end, nodes, total = mpf(start), 96, mpf(0)
    top = mp.cosh(3 * end / 2)
    for k in range(nodes):
        x = end * mp.cos(mp.pi * (2 * k + 1) / (4 * nodes))
        ds = mp.sqrt(1 + (3 * mp.sinh(3 * x / 2) / 2) ** 2)
        total += ds * mp.sqrt((end**2 - x**2) / (2 * mpf(9.81) * (top - mp.cosh(3 * x / 2))))
    return mp.pi * total / nodes


@pytest.mark.extended
def test_wide_swings_in_steep_wells(tmp_path: Path) -> None:
    """Terms that all nodes of an orbit have in common follow from one hyperbolic sine, of an argument without rounding.

    With roundings of their own, and that of the argument, they made the mean square 1.4.
    """
    model = gqm.derive(gqm.Curve.graph("cosh(3*x/2)", parameter="x"), gqm.Gravity())
    module = gqm.build(model, name="hyperbolic_cosine", folder=tmp_path)
    starts = np.linspace(2.1, 2.9, 100)
    values = module.sweep("half_period", starts).values
    with mp.workdps(40):
        truths = [half_period_on_hyperbolic_cosine(start) for start in starts.tolist()]
    assert np.mean(errors(values, truths) ** 2) <= 1.0


def half_period_on_lissajous(start: float) -> Any:
    """Return the half period of a body released on x = 1.4 sin(t), z = 0.9 sin(3t + 7/10), in the well about 5.53."""
    x, z, phase, nodes, total = mpf("1.4"), mpf("0.9"), mpf("0.7"), 96, mpf(0)
    bottom = (11 * mp.pi / 2 - phase) / 3
    half = abs(mpf(start) - bottom)
    for k in range(nodes):
        angle = mp.pi * (2 * k + 1) / (2 * nodes)
        t = bottom + half * mp.cos(angle)
        ds = mp.hypot(x * mp.cos(t), 3 * z * mp.cos(3 * t + phase))
        fallen = z * (mp.cos(3 * (t - bottom)) - mp.cos(3 * half))
        total += ds * half * mp.sin(angle) / mp.sqrt(2 * mpf(9.81) * fallen)
    return mp.pi * total / nodes


@pytest.mark.extended
def test_waves_far_from_zero(tmp_path: Path) -> None:
    """The width of an orbit is rounded as the distance of its ends, and not as that of multiples of them, which are up
    to 18 here; with that rounding, which all nodes have in common, half of these times were off by over 2 ulp.
    """
    curve = gqm.Curve.parametric(x="7*sin(t)/5", z="9*sin(3*t + 7/10)/10", parameter="t", period="2*pi")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="lissajous_far_from_zero", folder=tmp_path)
    starts = np.linspace(5.0, 5.15, 12)
    values = module.sweep("half_period", starts).values
    with mp.workdps(40):
        truths = [half_period_on_lissajous(start) for start in starts.tolist()]
    assert np.abs(errors(values, truths)).max() <= MAX_ERROR


def half_period_on_graph(height: Callable[[Any], Any], ds: Callable[[Any], Any], start: float, guess: Any) -> Any:
    """Return the half period of a body released at ``start`` that turns next to ``guess``."""
    level, nodes, total = height(mpf(start)), 160, mpf(0)
    end = mp.findroot(lambda t: height(t) - level, guess)
    for k in range(nodes):
        angle = mp.pi * (2 * k + 1) / (2 * nodes)
        t = (start + end + (end - start) * mp.cos(angle)) / 2
        total += ds(t) * mp.sin(angle) / mp.sqrt(2 * mpf(9.81) * (level - height(t)))
    return mp.pi * total / nodes * abs(end - start) / 2


@pytest.mark.extended
def test_turns_far_from_zero(tmp_path: Path) -> None:
    """Waves of a place, at the ends of an orbit too, follow from the launch and the distance from there, whose sum is
    not rounded: after a hundred turns these times were up to 278 ulp off.
    """
    curve = gqm.Curve.parametric(
        x="2*cos(t)/(1+sin(t)**2)", z="2*sin(t)*cos(t)/(1+sin(t)**2)", parameter="t", period="2*pi"
    )
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="lemniscate", folder=tmp_path)
    starts = np.array([4.9, 5.2, 6.0, 6.2]) + 200.0 * np.pi
    swept = module.sweep("half_period", starts)
    turns = module.sweep("turning_points", starts).values
    assert swept.route_counts() == {"batch": starts.size}
    with mp.workdps(30):
        truths = [
            half_period_on_graph(
                lambda t: 2 * mp.sin(t) * mp.cos(t) / (1 + mp.sin(t) ** 2),
                lambda t: 2 / mp.sqrt(1 + mp.sin(t) ** 2),
                start,
                turns[k, 0] + turns[k, 1] - start,
            )
            for k, start in enumerate(starts.tolist())
        ]
    assert np.abs(errors(swept.values, truths)).max() <= MAX_ERROR


@pytest.mark.extended
def test_wide_swings_far_from_zero(tmp_path: Path) -> None:
    """The rounding of an end counts where it is more than that of the width: these times were up to 4 ulp off."""
    curve = gqm.Curve.graph("cosh(3*(x-7)/2)+x/3", parameter="x")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="cosh_far", folder=tmp_path)
    starts = np.linspace(4.3, 5.0, 24)
    values, turns = module.sweep("half_period", starts).values, module.sweep("turning_points", starts).values
    with mp.workdps(30):
        truths = [
            half_period_on_graph(
                lambda x: mp.cosh(3 * (x - 7) / 2) + x / 3,
                lambda x: mp.sqrt(1 + (3 * mp.sinh(3 * (x - 7) / 2) / 2 + mpf(1) / 3) ** 2),
                start,
                turns[k, 1],
            )
            for k, start in enumerate(starts.tolist())
        ]
    assert np.abs(errors(values, truths)).max() <= MAX_ERROR


def half_period_on_kappa_curve(angle: Any) -> Any:
    """Return the half period of a body on r = 1.3 tan(theta) that turns at -``angle`` and ``angle``."""
    nodes, total = 96, mpf(0)
    for k in range(nodes):
        u = mp.pi * (2 * k + 1) / (4 * nodes)
        t = angle * mp.cos(u)
        ds = mp.hypot(mp.tan(t), 1 / mp.cos(t) ** 2)
        fallen = (mp.cos(t) - mp.cos(angle)) * (1 + 1 / (mp.cos(t) * mp.cos(angle)))
        total += mpf("1.3") * ds * angle * mp.sin(u) / mp.sqrt(2 * mpf(9.81) * mpf("1.3") * fallen)
    return mp.pi * total / nodes


def test_next_to_a_pole(tmp_path: Path) -> None:
    """Next to a pole of a curve the cosine of the place is small, and the ends of an orbit in doubles do not give its
    digits: half of the times of these thrown bodies were off by over 2 ulp.
    """
    curve = gqm.Curve.polar("13*tan(theta)/10", parameter="theta", domain=("-1.5", "1.5"))
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="kappa_curve", folder=tmp_path)
    starts, v0, at_rest = np.linspace(0.4, 1.05, 6), np.linspace(7.0, 9.5, 6), np.linspace(0.5, 1.45, 4)
    values = module.sweep("half_period", [*starts, *at_rest], [*v0, *np.zeros(4)]).values
    with mp.workdps(40):
        ends = []
        for start, speed in zip(map(mpf, starts.tolist()), v0.tolist(), strict=True):
            level = mp.sin(start) ** 2 / mp.cos(start) + mpf(speed) ** 2 / (2 * mpf(9.81) * mpf("1.3"))
            ends.append(mp.acos(2 / (level + mp.sqrt(level**2 + 4))))
        truths = [half_period_on_kappa_curve(end) for end in (*ends, *map(mpf, at_rest.tolist()))]
    assert np.abs(errors(values, truths)).max() <= MAX_ERROR


def half_period_on_conchoid(start: float) -> Any:
    """Return the half period of a body released on r = 1/sin(theta) - 2, whose height is 1 - 2 sin(theta)."""
    half, nodes, total = abs(mpf(start) - mp.pi / 2), 192, mpf(0)
    for k in range(nodes):
        distance = 2 * mp.asin(mp.sin(half / 2) * mp.cos(mp.pi * (2 * k + 1) / (4 * nodes)))
        ds = mp.hypot(1 / mp.cos(distance) - 2, mp.sin(distance) / mp.cos(distance) ** 2)
        total += ds / mp.cos(distance / 2)
    return mp.pi * total / nodes / mp.sqrt(2 * mpf(9.81))


@pytest.mark.extended
def test_from_rest_next_to_a_pole(tmp_path: Path) -> None:
    """The distance from an axis at pi/2 is no double, and what rounding takes from it counts next to the pole: these
    times were up to 16 ulp off.
    """
    curve = gqm.Curve.polar("1/sin(theta) - 2", parameter="theta", domain=("0.1", "3.04"))
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="conchoid", folder=tmp_path)
    starts = np.concatenate([np.linspace(0.12, 0.4, 12), np.linspace(0.45, 1.45, 40)])
    values = module.sweep("half_period", starts).values
    with mp.workdps(40):
        found = np.abs(errors(values, [half_period_on_conchoid(start) for start in starts.tolist()]))
    assert found.max() <= MAX_ERROR
    assert found.mean() <= 0.6  # 0.75 where cosines of places were sums of more terms


def half_period_on_ellipse(distance: Any) -> Any:
    """Return the half period of a body released at an angle from the lowest point of (2 cos, sin)."""
    nodes, total = 192, mpf(0)
    for k in range(nodes):
        place = 2 * mp.asin(mp.sin(distance / 2) * mp.cos(mp.pi * (2 * k + 1) / (4 * nodes)))
        total += mp.hypot(2 * mp.cos(place), mp.sin(place)) / mp.cos(place / 2)
    return mp.pi * total / nodes / mp.sqrt(mpf(9.81))


def test_from_rest_beside_the_top_in_later_laps(build: Callable[..., ModuleType]) -> None:
    """What rounding takes from the distance from the axis of a later lap counts beside the top: these times were up to
    3 ulp off.
    """
    curve = gqm.Curve.parametric(x="2*cos(t)", z="sin(t)", parameter="t", period="2*pi")
    places = 1.5 * np.pi + np.linspace(2.6, 3.05, 24)
    values = build("ellipse_later", curve, gqm.Rolling()).sweep("half_period", places, beta=0.0).values
    with mp.workdps(40):
        truths = [half_period_on_ellipse(mpf(place) - 3 * mp.pi / 2) for place in places.tolist()]
    assert np.abs(errors(values, truths)).max() <= MAX_ERROR
