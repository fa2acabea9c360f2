"""Gradients along charts agree with closed forms, and with differences of half periods in double-double arithmetic."""

from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from paths import ROOT
from quadrature import integral

import gqm_sym as gqm
from gqm_sym.loading import load
from gqm_sym.runtime.gradients import panels
from gqm_sym.runtime.motion import timing

ULP = 2.0**-52

# The step of a difference quotient of durations that have some 26 digits.
STEP = Fraction(1, 2**30)


@pytest.fixture(scope="module")
def ring(generated_folder: Path) -> ModuleType:
    """Return a circle as an implicit curve, in arc length from the bottom."""
    curve = gqm.Curve.implicit("x**2 + z**2 - R**2", start=(0, "-R"), parameters={"R": 1})
    return gqm.build(gqm.derive(curve, gqm.Gravity()), name="gradient_ring", folder=generated_folder)


@pytest.fixture(scope="module")
def rail(generated_folder: Path) -> ModuleType:
    """Return a valley of an arc between clothoids and lines, in which a ball rolls."""
    pieces = [
        gqm.line(length=3),
        gqm.clothoid(length="q", kappa_start=0, kappa_end="1/r"),
        gqm.arc(radius="r", angle="3/5"),
        gqm.clothoid(length="q", kappa_start="1/r", kappa_end=0),
        gqm.line(length=3),
    ]
    curve = gqm.Curve.piecewise(pieces, heading="-h", parameters={"q": "1/2", "r": "3/2", "h": "7/10"})
    model = gqm.derive(curve, gqm.Gravity() + gqm.Rolling(beta="2/5"))
    return gqm.build(model, name="gradient_rail", folder=generated_folder)


@pytest.fixture(scope="module")
def valley(generated_folder: Path) -> ModuleType:
    """Return the spline through nine points, with a spring."""
    x = np.linspace(-2.0, 2.0, 9)
    points = np.stack([x, 0.3 * x**2 + 0.05 * np.sin(3.0 * x)], axis=1)
    force = gqm.Gravity() + gqm.Potential("k*(x**2 + z**2)/2", parameters={"k": "3/2"})
    return gqm.build(gqm.derive(gqm.Curve.sampled(points), force), name="gradient_valley", folder=generated_folder)


@pytest.mark.parametrize("shape", [(0,), (2, 0)])
def test_no_times(shape: tuple[int, ...], rail: ModuleType) -> None:
    """For no times there are no derivatives, and the shapes are as for others."""
    motion = rail.solve(0.5, 9.0)
    assert motion.kind == "transit"
    assert motion.sensitivity(np.empty(shape), ("q", "v0")).lam.shape == (2, *shape)


def durations(module: ModuleType, launch: dict[str, Any], name: str) -> float:
    """Return the derivative of a half period, or of the time of a lap, as a difference quotient."""
    sides = []
    for sign in (1, -1):
        moved = Fraction(launch[name]) + sign * STEP
        motion = module.solve(**{**launch, name: moved})
        orbit = timing.orbit_of(motion.problem, motion.kind, motion.direction, motion._offsets)
        assert orbit is not None
        sides.append(Fraction(orbit.duration.high) + Fraction(orbit.duration.low))
    return float((sides[0] - sides[1]) / (2 * STEP))


def is_near(found: float, wanted: float, size: float, ulps: float = 4.0) -> bool:
    """Return whether a derivative is within some units in the last place of itself or of the terms that it is a
    difference of.
    """
    return abs(found - wanted) <= ulps * ULP * max(abs(wanted), size)


CASES = [
    ("ring", {"lam0": "3/2", "v0": 0, "R": "5/4", "g": "9.81"}),
    ("ring", {"lam0": "3/2", "v0": "3/4", "R": "5/4", "g": "9.81"}),
    ("ring", {"lam0": "-3/2", "v0": "8", "R": "5/4", "g": "9.81"}),
    ("rail", {"lam0": "13/4", "v0": "1/2", "q": "1/2", "r": "3/2", "h": "7/10", "g": "9.81", "beta": "2/5"}),
    ("rail", {"lam0": "5/2", "v0": 0, "q": "2/5", "r": "7/4", "h": "1/2", "g": "9.81", "beta": "2/5"}),
    ("valley", {"lam0": "3/4", "v0": 0, "k": "3/2", "g": "9.81"}),
    ("valley", {"lam0": "1", "v0": "3/2", "k": "1/2", "g": "9.81"}),
]


@pytest.mark.sample(2)
@pytest.mark.parametrize(("name", "launch"), CASES)
def test_durations(name: str, launch: dict[str, Any], request: pytest.FixtureRequest) -> None:
    """Durations have derivatives with respect to launch, forces and shape; at rest the one with respect to speed is
    zero.
    """
    module = request.getfixturevalue(name)
    motion = module.solve(**launch)
    quantity = "period" if motion.kind == "circulation" else "half_period"
    found = motion.gradient(quantity, tuple(launch))
    edges, samples, _ = motion._derivatives._panels
    sizes = np.abs(samples[1:]).mean(axis=2) @ np.diff(edges)
    size = dict(zip((*module.PARAMETERS, "lam0", "v0"), sizes, strict=False))
    for key in launch:
        if launch[key] != 0:
            assert is_near(found[key], durations(module, launch, key), size[key]), key
    assert motion.gradient(quantity, "m") == {"m": 0.0}
    assert launch["v0"] != 0 or found["v0"] == 0.0


LAUNCHES = [
    (1.1, 1.3, 0.0, 0.7),
    (1.1, 1.3, 2.0, -3.0),
    (0.4, 0.6, -9.0, 250.0),
    (2.5, 3.0, 8.0, 1e3),
    (0.3, 2.0, -1.5, 99.0),
]


@pytest.mark.parametrize(("arc", "radius", "v0", "t"), LAUNCHES)
def test_states_on_a_circle(arc: float, radius: float, v0: float, t: float, ring: ModuleType) -> None:
    """Sensitivities, turning points, extremes and the action are those of the circle as a formula."""
    circle = load(str(ROOT / "generated" / "circle.py"), "circle")
    speed, direction = abs(v0), 1 if v0 >= 0.0 else -1
    one = ring.solve(lam0=arc, v0=speed, R=radius, direction=direction)
    other = circle.solve(lam0=f"{arc!r}/{radius!r}", v0=speed, L=radius, direction=direction)
    found, wanted = one.sensitivity(t), other.sensitivity(t)
    places = dict(zip(wanted.wrt, range(4), strict=False))

    def on_circle(rows: Any, name: str) -> Any:
        """Return the derivative at a given arc length of launch, from those at a given angle of launch."""
        if name == "R":
            return rows[places["L"]] - arc / radius**2 * rows[places["lam0"]]
        return rows[places[name]] / (radius if name == "lam0" else 1.0)

    period = one.sensitivity(np.linspace(t, t + one.period, 50))
    for k, name in enumerate(found.wrt[:4]):
        for quantity in ("x", "z", "v", "normal_force"):
            scale = np.abs(getattr(period, quantity)[k]).max()
            # A contact force depends on the second derivative of the displacement of the curve.
            enough = 1e-10 if (quantity, name) == ("normal_force", "R") else 5e-14
            assert abs(getattr(found, quantity)[k] - on_circle(getattr(wanted, quantity), name)) <= enough * scale
    angle = on_circle(wanted.lam, "R") * radius + float(other.lam(t))
    assert found.lam[found.wrt.index("R")] == pytest.approx(angle, rel=1e-13, abs=1e-14 * abs(period.lam).max())
    assert found.s.tolist() == found.lam.tolist()
    for quantity in ("v_max", "v_min", "normal_force_max", "normal_force_min", "period"):
        first, second = one.gradient(quantity), other.gradient(quantity)
        rows = [second[name] for name in wanted.wrt[:4]]
        for name in ("lam0", "g", "R"):
            enough = 1e-10 if (quantity[:6], name) == ("normal", "R") else 1e-12
            scale = max(map(abs, second.values()))
            assert first[name] == pytest.approx(on_circle(rows, name), rel=enough, abs=enough * scale)
    assert one.action == pytest.approx(other.action, rel=4e-15)
    assert one.period_slope == pytest.approx(other.period_slope, rel=4e-15)


def test_turning_points(ring: ModuleType) -> None:
    """The other turning point of a swing from rest on a circle lies as far on the other side, whatever the radius."""
    found = ring.solve(lam0="11/10", R="13/10").gradient("turning_points")
    assert found["lam0"] == (1.0, -1.0)
    assert found["g"] == (0.0, 0.0)
    assert np.abs(found["R"]).max() < 1e-15
    v0, radius, g, arc = mpf(2), mpf("1.3"), mpf("9.81"), mpf("1.1")
    with mp.workdps(40):
        ends = [
            mp.diff(lambda r: r * mp.acos(mp.cos(arc / r) - v0**2 / (2 * g * r)), radius),
            mp.diff(lambda q: radius * mp.acos(mp.cos(arc / radius) - v0**2 / (2 * q * radius)), g),
        ]
    found = ring.solve(lam0="11/10", R="13/10", v0=2).gradient("turning_points", ("R", "g"))
    for name, end in zip(("R", "g"), ends, strict=True):
        assert found[name] == pytest.approx((float(end), -float(end)), rel=4e-16)


def test_a_swing_that_is_too_small(ring: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """Derivatives whose digits are lost on however many panels are refused after the first ones; it took 26 s."""
    calls: list[Any] = []
    shares_on = panels.shares_on
    monkeypatch.setattr(panels, "shares_on", lambda *given: calls.append(given) or shares_on(*given))
    with pytest.raises(gqm.errors.SolutionError, match="comes too near to an equilibrium"):
        ring.solve(lam0="1/100000").gradient("half_period", "R")
    assert len(calls) == 1


@pytest.mark.extended
def test_sweeps_and_fits(ring: ModuleType) -> None:
    """Sweeps have gradients along charts, and so have fits: the length of a pendulum from its positions."""
    swept = ring.sweep("period", lam0=[0.5, 1.0], R=[1.0, 2.0], gradient=("R", "lam0"))
    one = ring.solve(lam0=1.0, R=2.0).gradient("period", ("R", "lam0"))
    assert swept.gradient[1].tolist() == pytest.approx([*one.values()], rel=1e-15)
    t = np.linspace(0.0, 6.0, 60)
    data = {"t": t, "lam": ring.solve(lam0=0.7, R=1.25).lam(t), "sigma": 1e-3}
    found = gqm.fit(ring, data, {"R": 1.2, "lam0": 0.6})
    assert found.estimates == pytest.approx({"R": 1.25, "lam0": 0.7}, rel=1e-9)


def test_unknown_names(ring: ModuleType) -> None:
    """Unknown names are refused."""
    with pytest.raises(gqm.errors.InputError, match="there is no parameter 'L'"):
        ring.solve(lam0=1.0).gradient("period", "L")


@pytest.fixture(scope="module")
def oval(generated_folder: Path) -> ModuleType:
    """Return a superellipse, whose exponent is a parameter, in arc length from the bottom."""
    curve = gqm.Curve.implicit("(x/a)**n + (z/b)**n - 1", start=(0, "-b"), parameters={"a": "7/5", "b": "9/10", "n": 4})
    return gqm.build(gqm.derive(curve, gqm.Gravity()), name="gradient_oval", folder=generated_folder)


def from_rest(z: Any, slope: Any, arc: Any, g: Any) -> Any:
    """Return the half period on a graph z(x) that is even, from rest at an arc length from the middle; 48 nodes have 30
    digits.
    """

    def speed(x: Any) -> Any:
        return mp.sqrt(1 + slope(x) ** 2)

    end, change = arc, arc
    while abs(change) > mpf(10) ** (5 - mp.dps):
        change = (integral(speed, [0, end], 5) - arc) / speed(end)
        end -= change
    top = z(end)

    def rate(phi: Any) -> Any:
        x = end * mp.sin(phi)
        return end * mp.cos(phi) * speed(x) / mp.sqrt(2 * g * (top - z(x)))

    return 2 * integral(rate, [0, mp.pi / 4, mp.pi / 2], 5)


def quotient(duration: Any, given: dict[str, Any], name: str) -> float:
    """Return the difference quotient of a duration by one of its arguments."""
    step = mpf(10) ** -8
    ends = [duration(**(given | {name: given[name] + k * step})) for k in (-2, -1, 1, 2)]
    return float((ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * step))


@pytest.mark.extended
def test_an_exponent_of_negative_numbers(oval: ModuleType) -> None:
    """A curve with an integer exponent has all derivatives but that by the exponent, which alone is refused."""
    motion = oval.solve(lam0="9/10")
    with mp.workdps(40):
        given = {"a": mpf("1.4"), "b": mpf("0.9"), "arc": mpf("0.9"), "g": mpf("9.81")}

        def duration(a: Any, b: Any, arc: Any, g: Any) -> Any:
            def inside(x: Any) -> Any:
                return 1 - (x / a) ** 4

            def slope(x: Any) -> Any:
                return b * (x / a) ** 3 / (a * inside(x) ** mpf("0.75"))

            return from_rest(lambda x: -b * inside(x) ** mpf("0.25"), slope, arc, g)

        assert motion.half_period == pytest.approx(float(duration(**given)), rel=1e-15)
        for name in ("a", "b", "arc"):
            wanted = quotient(duration, given, name)
            found = motion.gradient("half_period", "lam0" if name == "arc" else name)
            assert [*found.values()] == [pytest.approx(wanted, rel=2e-15)], name
    assert motion.gradient("half_period", ("m", "v0")) == {"m": 0.0, "v0": 0.0}
    assert np.isfinite(motion.sensitivity([0.3, 2.0], ("a", "g")).lam).all()
    for wrt in ("n", None, ("a", "n")):
        with pytest.raises(gqm.errors.SolutionError, match="no derivative with respect to n, because"):
            motion.gradient("half_period", wrt)
        with pytest.raises(gqm.errors.SolutionError, match="sensitivity: there is no derivative with respect to n,"):
            motion.sensitivity(0.3, wrt)
    with pytest.raises(gqm.errors.SolutionError, match="no second derivative with respect to n, because"):
        motion.gradient("half_period", ("a", "n"), order=2)
    a, g = motion.gradient("half_period", ("a", "g")).values()
    swept = oval.sweep("half_period", 0.9, gradient=("a", "n", "g")).gradient
    np.testing.assert_allclose(swept, [a, np.nan, g], rtol=1e-15, atol=0.0)


def test_an_arc_between_cusps(generated_folder: Path) -> None:
    """A part of a bicorn has all digits, although the curve has cusps farther on."""
    bicorn = "z**2*(a**2 - x**2) - (x**2 - 2*a*z - a**2)**2"
    curve = gqm.Curve.implicit(bicorn, start=(0, "-a"), domain=(-0.9, 0.9), parameters={"a": 1})
    motion = gqm.build(gqm.derive(curve, gqm.Gravity()), name="gradient_bicorn", folder=generated_folder).solve(
        lam0="3/4", a="11/10"
    )
    with mp.workdps(40):
        given = {"a": mpf("1.1"), "arc": mpf("0.75"), "g": mpf("9.81")}

        def duration(a: Any, arc: Any, g: Any) -> Any:
            def height(x: Any) -> Any:
                root = mp.sqrt(a**2 - x**2)
                return -(root**2) / (2 * a - root)

            def slope(x: Any) -> Any:
                root = mp.sqrt(a**2 - x**2)
                return x * (4 * a - root) / (2 * a - root) ** 2

            return from_rest(height, slope, arc, g)

        for name, key in (("a", "a"), ("arc", "lam0")):
            assert motion.gradient("half_period", key)[key] == pytest.approx(quotient(duration, given, name), rel=2e-15)


@pytest.mark.extended
def test_an_exponent_with_losses(generated_folder: Path) -> None:
    """With friction, too, an exponent of negative numbers alone is refused."""
    curve = gqm.Curve.implicit("(x/a)**n + (z/b)**n - 1", start=(0, "-b"), parameters={"a": 1, "b": 1, "n": 2})
    ring = gqm.Curve.implicit("x**2 + z**2 - a**2", start=(0, "-a"), parameters={"a": 1})
    force = gqm.Gravity() + gqm.CoulombFriction(mu="1/10")
    one, other = (
        gqm.build(gqm.derive(shape, force), name=f"gradient_rough_{name}", folder=generated_folder)
        for shape, name in ((curve, "oval"), (ring, "ring"))
    )
    found, wanted = (module.solve(lam0="9/10").gradient("turning_points", ("mu", "lam0")) for module in (one, other))
    for name, row in wanted.items():
        assert found[name] == pytest.approx(row, rel=1e-12, abs=1e-13)
    with pytest.raises(gqm.errors.SolutionError, match="no derivative with respect to n, because"):
        one.solve(lam0="9/10").gradient("turning_points")
    swept = one.sweep("v_max", 0.9, gradient=("a", "n", "mu")).gradient
    wanted = other.solve(lam0=0.9).gradient("v_max", "mu")["mu"]
    np.testing.assert_array_equal(np.isfinite(swept), [True, False, True])
    assert swept[2] == pytest.approx(wanted, rel=1e-12)


@pytest.mark.extended
def test_an_exponent_of_positive_numbers(generated_folder: Path) -> None:
    """A curve has a derivative by an exponent of numbers that are positive on it, whether it is an integer or not."""
    curve = gqm.Curve.implicit("(-z)**n + x**2 - 1", start=(0, -1), domain=(-1, 1), parameters={"n": "5/2"})
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="gradient_arch", folder=generated_folder)
    with mp.workdps(40):

        def duration(n: Any) -> Any:
            def slope(x: Any) -> Any:
                return 2 * x / n * (1 - x**2) ** (1 / n - 1)

            return from_rest(lambda x: -((1 - x**2) ** (1 / n)), slope, mpf("0.5"), mpf("9.81"))

        for n in (mpf("2.5"), mpf(3), mpf("2.7")):
            found = module.solve(lam0="1/2", n=str(n)).gradient("half_period", "n")["n"]
            assert found == pytest.approx(quotient(duration, {"n": n}, "n"), rel=4e-15), n


def test_a_launch_at_rest_where_two_pieces_meet(generated_folder: Path) -> None:
    """A launch by a point that is a rounding away from the edge of two pieces has derivatives; the curve is a right
    strophoid.
    """
    start = "-0.51961524227066318805823390245176171008284157614311", "-0.9"
    curve = gqm.Curve.implicit("x**2*(a - z) - z**2*(a + z)", start=start, parameters={"a": "1.8"})
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="gradient_strophoid", folder=generated_folder)
    motion = module.solve(point=start, direction=1)
    with mp.workdps(40):
        a, g, phi = mpf("1.8"), mpf("9.81"), -mp.pi / 6

        def duration(end: Any) -> Any:
            """Return the half period on ``x = a cos(2 phi) tan(phi), z = -a cos(2 phi)``."""

            def rate(u: Any) -> Any:
                at = end * mp.sin(u)
                dx = a * (-2 * mp.sin(2 * at) * mp.tan(at) + mp.cos(2 * at) / mp.cos(at) ** 2)
                fall = 2 * g * a * 2 * mp.sin(end - at) * mp.sin(end + at)
                return -end * mp.cos(u) * mp.hypot(dx, 2 * a * mp.sin(2 * at)) / mp.sqrt(fall)

            return 2 * integral(rate, [0, mp.pi / 4, mp.pi / 2], 5)

        tau, by_phi = duration(phi), mp.diff(duration, phi, h=mpf(10) ** -12)
        rate = [mp.diff(lambda u, f=f: a * mp.cos(2 * u) * f(u), phi) for f in (mp.tan, lambda u: -1)]
        speed = mp.hypot(*rate)
        # The start point, which is fixed, is moved to the nearest point of the curve.
        point = mp.cos(2 * phi) * mp.tan(phi), -mp.cos(2 * phi)
        foot = -(point[0] * rate[0] + point[1] * rate[1]) / speed**2
        wanted = {"g": -tau / (2 * g), "lam0": by_phi / speed, "a": tau / (2 * a) + by_phi * foot}
    found = motion.gradient("half_period", tuple(wanted))
    for name, value in wanted.items():
        assert abs(found[name]) == pytest.approx(abs(float(value)), rel=2e-15), name


def test_motions_that_do_not_repeat(generated_folder: Path) -> None:
    """A body that leaves a rail has the derivatives of a fall along a straight line, t = sqrt(2 (length - lam0) / (g
    sin)).
    """
    curve = gqm.Curve.piecewise([gqm.line(length=3), gqm.line(length="q")], heading="-pi/6", parameters={"q": 2})
    free = gqm.build(gqm.derive(curve, gqm.Gravity()), name="gradient_slope", folder=generated_folder)
    motion = free.solve("0.5")
    t = np.sqrt(2 * 4.5 / (9.81 * 0.5))
    assert motion.t_end == pytest.approx(t, rel=4e-16)
    wanted = {"lam0": -t / 9.0, "q": t / 9.0, "g": -t / (2 * 9.81)}
    assert motion.gradient("t_end", tuple(wanted)) == pytest.approx(wanted, rel=1e-14)
    thrown = free.solve("0.5", 2, -1)
    back = (2 + np.sqrt(4 + 2 * 9.81 * 0.5 * 4.5)) / (9.81 * 0.5)
    speed = np.sqrt(4 + 9.81 * 4.5)
    assert thrown.t_end == pytest.approx(back, rel=4e-16)
    wanted = {"lam0": -1 / speed, "q": 1 / speed, "v0": (1 + 2 / speed) / (9.81 * 0.5)}
    assert thrown.gradient("t_end", tuple(wanted)) == pytest.approx(wanted, rel=1e-14)
    assert thrown.gradient("turning_points", ("v0", "lam0")) == {
        "v0": pytest.approx((-4 / 9.81,), rel=1e-14),
        "lam0": pytest.approx((1.0,), rel=1e-14),
    }


@pytest.mark.extended
def test_a_slide_in_space(generated_folder: Path) -> None:
    """On a descending helix through points, derivatives agree with what units and the flow of time require.

    If g is c**2 times and the speed c times as large, times are shorter by c and forces c**2 times as large. A launch
    from a later state of the motion leaves so much less time to the end.
    """
    turn = np.linspace(0.0, 4.0 * np.pi, 60)
    track = gqm.Curve.sampled(np.column_stack([np.cos(turn), np.sin(turn), -0.2 * turn]))
    module = gqm.build(gqm.derive(track, gqm.Gravity()), name="gradient_helix", folder=generated_folder)
    motion, g, v0 = module.solve(3, 2), 9.81, 2.0
    for quantity, power, value in (("t_end", -1, motion.t_end), ("normal_force_max", 2, motion.normal_force_max.value)):
        found = motion.gradient(quantity, ("g", "v0", "m"))
        assert 2 * g * found["g"] + v0 * found["v0"] == pytest.approx(power * value, rel=1e-13), quantity
        assert found["m"] == pytest.approx(value if power == 2 else 0.0, rel=1e-13, abs=1e-13)
    start, found = motion.state(0.0), motion.gradient("t_end", ("lam0", "v0"))
    push = -g * (motion.state(1e-6).z - start.z) / (1e-6 * v0)  # along the track
    assert found["lam0"] * v0 + found["v0"] * push == pytest.approx(-1.0, rel=1e-5)
    banked = gqm.Curve.sampled(np.column_stack([np.cos(turn), np.sin(turn), -0.2 * turn]), roll="0")
    built = gqm.build(gqm.derive(banked, gqm.Gravity()), name="gradient_banked", folder=generated_folder)
    held = built.solve(3, 2, contact="above")
    assert held.gradient("t_end", ("g", "v0")) == pytest.approx(motion.gradient("t_end", ("g", "v0")), rel=1e-13)


@pytest.mark.extended
@pytest.mark.parametrize(("lam0", "v0"), [("0.3", "1"), ("0.05", "0")])
def test_a_body_that_leaves_an_ellipse(lam0: str, v0: str, generated_folder: Path) -> None:
    """A body on top of an ellipse slides down until it lifts off; this time and that of a place before have the
    derivatives of 40-digit differences of the closed form, also by the axis of the ellipse.
    """
    curve = gqm.Curve.implicit("x**2/a**2+(z-1)**2-1", start=(0, 2), parameters={"a": 2})
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="gradient_dome", folder=generated_folder)
    motion = module.solve(lam0, v0, contact="below")
    given = {"lam0": mpf(lam0), "v0": mpf(v0), "a": mpf(2), "g": mpf("9.81")}

    def stretch(u: Any, a: Any) -> Any:
        return mp.hypot(a * mp.cos(u), mp.sin(u))

    def angle(length: Any, a: Any) -> Any:
        """Return the angle from the top at an arc length."""
        found = change = length / a
        while abs(change) > mpf(10) ** (5 - mp.dps):
            change = (integral(lambda u: stretch(u, a), [0, found], 5) - length) / stretch(found, a)
            found -= change
        return found

    def times(lam0: Any, v0: Any, a: Any, g: Any) -> list[Any]:
        """Return the times at which the body lifts off, and is at the arc length of 0.7."""
        first = angle(lam0, a)

        def square(way: Any) -> Any:  # V**2; cosines are not subtracted
            return v0**2 + 4 * g * mp.sin(first + way / 2) * mp.sin(way / 2)

        def until(last: Any) -> Any:
            def rate(x: Any) -> Any:  # with the root of the way as the variable
                way = (last - first) * x * x
                return 2 * x * (last - first) * stretch(first + way, a) / mp.sqrt(square(way))

            return integral(rate, [0, 0.25, 0.5, 1], 5)

        lost = mp.findroot(lambda u: square(u - first) - g * mp.cos(u) * stretch(u, a) ** 2, 0.7)
        return [until(lost), until(angle(mpf("0.7"), a))]

    with mp.workdps(40):
        names, step = tuple(name for name in given if given[name]), mpf(10) ** -12
        truth = times(**given)
        assert (motion.t_end, motion.time_at("0.7")) == pytest.approx([float(time) for time in truth], rel=4e-15)
        found = motion.gradient("t_end", names), motion.gradient("time_at", names, lam="0.7")
        for name in names:
            below, above = (times(**{**given, name: given[name] + sign * step}) for sign in (-1, 1))
            wanted = [float((b - a) / (2 * step)) for a, b in zip(below, above, strict=True)]
            assert [row[name] for row in found] == pytest.approx(wanted, rel=1e-12), name
