"""Gradients of periods, turning points, extremes and actions agree with closed forms and differences in mpmath."""

from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf
from orbits import FORMULAS, by_differences, half_orbit
from paths import ROOT
from selection import examples

import gqm_sym as gqm
from gqm_sym.errors import GQMError, InputError, SolutionError
from gqm_sym.loading import load

ULP = 2.0**-52


@pytest.fixture(scope="module")
def circle() -> ModuleType:
    """Return a bead on a circle."""
    return generated("circle")


@pytest.fixture(scope="module")
def cubic(generated_folder: Path) -> ModuleType:
    """Return an asymmetric well, z = x**2 + c*x**3."""
    return gqm.build(gqm.derive(gqm.Curve.graph("x**2 + c*x**3"), gqm.Gravity()), name="well", folder=generated_folder)


def generated(name: str) -> ModuleType:
    """Return a module of the repository."""
    return load(str(ROOT / "generated" / f"{name}.py"), name)


def is_near(found: float, wanted: Any, ulps: float = 2.0, size: float = 0.0) -> bool:
    """Return whether a number is within some units in the last place of itself or of the terms that it is a difference
    of.
    """
    return bool(abs(mpf(found) - mpf(wanted)) <= ulps * ULP * max(abs(float(wanted)), size))


def test_reference_numbers(circle: ModuleType, cubic: ModuleType) -> None:
    """Gradients agree with published numbers for the pendulum of 1.2 rad and for an asymmetric well."""
    swing = circle.solve(lam0="6/5", L=1, g="9.81")
    found = swing.gradient("half_period")
    assert is_near(found["lam0"], mpf("0.1793769168809972247603535230824"))
    assert is_near(found["L"], mpf("0.55077064690312602386531582457741"))
    assert is_near(found["g"], mpf("-0.05614379683008420222888030831574"))
    assert found["m"] == found["v0"] == 0.0
    assert is_near(swing.action, mpf("13.1207806398375596652152789818"))
    well = cubic.solve(lam0="-4/5", c="3/10", g="9.81")
    assert is_near(well.half_period, mpf("1.0066169126272207248125717181"))
    found = well.gradient("half_period", ("lam0", "c"))
    assert is_near(found["lam0"], mpf("-0.52876998558330915424438815736"))
    assert is_near(found["c"], mpf("-0.04626839794834119119859582002"), size=0.2)


@given(amplitude=st.floats(1e-3, 3.1), length=st.floats(0.1, 10.0))
@examples(30)
def test_a_pendulum(amplitude: float, length: float, circle: ModuleType) -> None:
    """With k = sin(A/2), dtau/dA is sqrt(L/g) cos(A/2) (E/(k (1 - k**2)) - K/k), and dtau/dL is tau/(2L)."""
    motion = circle.solve(lam0=amplitude, L=length, g="9.81")
    found = motion.gradient("half_period")
    with mp.workdps(60):
        a, scale = mpf(amplitude), mp.sqrt(mpf(length) / mpf("9.81"))
        k = mp.sin(a / 2)
        first, second = mp.ellipk(k**2), mp.ellipe(k**2)
        assert is_near(found["lam0"], scale * mp.cos(a / 2) * (second / (k * (1 - k**2)) - first / k))
        assert is_near(found["L"], scale * first / length)
        assert is_near(found["g"], -scale * first / mpf("9.81"))
        action = 16 * mp.sqrt(mpf("9.81") * mpf(length) ** 3) * (second - (1 - k**2) * first)
        assert is_near(motion.action, action)
        assert is_near(motion.gradient("action", "L")["L"], action * 3 / (2 * mpf(length)))


@given(gap=st.floats(1.0, 3.7))
@examples(20)
def test_a_pendulum_nearly_to_the_top(gap: float, circle: ModuleType) -> None:
    """Gradients are right down to 2e-4 rad from the top, where the half period changes by thousands of seconds per
    radian.
    """
    with mp.workdps(60):
        amplitude = float(mp.pi - mpf(10) ** -gap)
        motion, a = circle.solve(lam0=amplitude, L=1, g="9.81"), mpf(amplitude)
        found, k, scale = motion.gradient("half_period"), mp.sin(a / 2), mp.sqrt(1 / mpf("9.81"))
        first, second = mp.ellipk(k**2), mp.ellipe(k**2)
        assert is_near(found["lam0"], scale * mp.cos(a / 2) * (second / (k * (1 - k**2)) - first / k))
        assert is_near(found["L"], scale * first)
        assert is_near(found["g"], -scale * first / mpf("9.81"))


@given(gap=st.floats(2.0, 8.0), lam0=st.floats(-2.0, 2.0))
@examples(20)
def test_rounds_that_all_but_stop(gap: float, lam0: float, circle: ModuleType) -> None:
    """dT/dv0, and the change of the place after a round, are right for rounds whose energy exceeds that of the top by
    shares of 1e-2 to 1e-8.
    """
    with mp.workdps(60):
        g = mpf("9.81")
        v0 = float(mp.sqrt(4 * g * (1 + mpf(10) ** -gap) - 2 * g * (1 - mp.cos(mpf(lam0)))))
        square = mpf(v0) ** 2 + 2 * g * (1 - mp.cos(mpf(lam0)))
        slope = 2 * mp.diff(lambda q: 4 * mp.ellipk(4 * g / q) / mp.sqrt(q), square, h=mpf(10) ** -30)
        motion = circle.solve(lam0=lam0, v0=v0, L=1, g="9.81")
        assert is_near(motion.gradient("period")["v0"], slope * v0)
        after = motion.sensitivity(motion.period, "v0").lam[0]  # a round later the body is late by the change of T
        assert after == pytest.approx(float(-v0 * slope * v0), rel=1e-14)


@given(share=st.floats(1.01, 5.0), lam0=st.floats(-3.0, 3.0), direction=st.sampled_from([1, -1]))
@examples(20)
def test_a_round_on_a_circle(share: float, lam0: float, direction: int, circle: ModuleType) -> None:
    """With the speed v at the bottom T is 4 K(4 g L/v**2) L/v, from which dT/dv0 and dT/dE follow."""
    with mp.workdps(50):
        g = mpf("9.81")
        v0 = float(mp.sqrt(4 * g * share - 2 * g * (1 - mp.cos(mpf(lam0)))))
        motion = circle.solve(lam0=lam0, v0=v0, L=1, g="9.81", direction=direction)
        square = mpf(v0) ** 2 + 2 * g * (1 - mp.cos(mpf(lam0)))
        slope = 2 * mp.diff(lambda q: 4 * mp.ellipk(4 * g / q) / mp.sqrt(q), square)
        found = motion.gradient("period")
        assert is_near(found["v0"], slope * v0)
        assert is_near(found["lam0"], slope * g * mp.sin(mpf(lam0)))
        assert is_near(motion.period_slope, slope)


@pytest.mark.parametrize("name", FORMULAS)
def test_differences(name: str) -> None:
    """For random launches and parameters, derivatives of half period, action and turning points agree with differences,
    to rounding.
    """
    module, random = generated(name), np.random.default_rng(7)
    for _ in range(1):
        launch = {key: float(random.uniform(*ends)) for key, ends in FORMULAS[name].ranges.items()}
        motion = module.solve(**launch)
        assert motion.kind == "libration"
        ends = tuple(sorted(motion.turning_points))
        found = [motion.gradient(q) for q in ("half_period", "action", "turning_points")]
        # The rounding of a gradient is in proportion to the integral of the absolute value of its integrand.
        means = motion._derivatives._means[0][1:, 3]
        sizes = dict(zip((*module.PARAMETERS, "lam0", "v0"), means * np.pi, strict=False))
        with mp.workdps(42):
            for key in launch:
                time, action, low, high = by_differences(partial(half_orbit, name, near=ends), launch, key)
                assert is_near(found[0][key], time, size=sizes[key]), (name, key)
                assert is_near(found[1][key], action, 4.0, size=abs(motion.action)), (name, key)
                turns = found[2][key] if motion.turning_points[0] < motion.turning_points[1] else found[2][key][::-1]
                assert is_near(turns[0], low), (name, key)
                assert is_near(turns[1], high), (name, key)


def test_a_cycloid_is_isochronous() -> None:
    """At any amplitude dtau/dA is 0, and dtau/dR is tau/(2 R)."""
    module = generated("cycloid_inverted")
    for lam0 in (3.0, 2.0, 0.7):
        motion = module.solve(lam0=lam0)
        found = motion.gradient("half_period", ("lam0", "R"))
        assert abs(found["lam0"]) <= 1e-25
        assert is_near(found["R"], mpf(motion.half_period) / 2 / mpf(motion.problem.p[0].value), 3.0)
        assert abs(motion.period_slope) <= 1e-25


@pytest.mark.extended
def test_an_epicycloid_absorber(generated_folder: Path) -> None:
    """In a frame with the angular velocity 3, swings along an epicycloid of the radii 1 and 1/4 have the order
    1/(2 sqrt(5)/4) at any amplitude.
    """
    curve = gqm.Curve.parametric(
        x="-(A + B)*cos(q) - B*cos((A + B)/B*q)",
        z="(A + B)*sin(q) + B*sin((A + B)/B*q)",
        parameter="q",
        domain=("-pi*B/A", "pi*B/A"),
        parameters={"A": 1, "B": "1/4"},
    )
    force = gqm.Potential("-w**2*(x**2 + z**2)/2", parameters={"w": 3})
    module = gqm.build(gqm.derive(curve, force), name="absorber", folder=generated_folder)
    order = 2 / mp.sqrt(5)
    for lam0 in ("1/100", "1/5", "7/10"):
        motion = module.solve(lam0=lam0)
        found = motion.gradient("half_period", ("lam0", "w", "A", "B"))
        assert is_near(motion.half_period, mp.pi / (3 * order))
        assert abs(found["lam0"]) <= 1e-25
        assert is_near(found["w"], -mp.pi / (9 * order))
        # The order is A/(2 sqrt(B (A + B))).
        assert is_near(found["A"], -(mp.pi / (3 * order)) * (1 - mpf(1) / 2 / mpf("1.25")))
        assert is_near(found["B"], (mp.pi / (3 * order)) * (4 + 1 / mpf("1.25")) / 2)


def test_extremes(circle: ModuleType, cubic: ModuleType) -> None:
    """By the envelope theorem extremes have derivatives where their place does not matter, at turning points, and at a
    horizon.
    """
    length, g, mass, angle = 1.25, 9.5, 2.0, 1.125
    motion = circle.solve(lam0=angle, L=length, g=g, m=mass)
    sine, cosine = mp.sin(angle), mp.cos(angle)
    speed = mp.sqrt(2 * g * length * (1 - cosine))
    wanted = {
        "v_max": {"lam0": g * length * sine / speed, "L": speed / (2 * length), "g": speed / (2 * g), "m": 0, "v0": 0},
        "v_min": {"lam0": 0, "L": 0, "m": 0},
        "normal_force_max": {
            "lam0": 2 * mass * g * sine,
            "L": 0,
            "g": mass * (3 - 2 * cosine),
            "m": g * (3 - 2 * cosine),
        },
        "normal_force_min": {"lam0": -mass * g * sine, "L": 0, "g": mass * cosine, "m": g * cosine, "v0": 0},
    }
    for quantity, numbers in wanted.items():
        found = motion.gradient(quantity, list(numbers))
        for name, number in numbers.items():
            assert abs(found[name] - number) <= 2 * ULP * abs(number), (quantity, name)
    cut = circle.solve(lam0=angle, L=length, g=g, m=mass, t_max=motion.half_period / 4)
    assert cut.gradient("v_max", "L")["L"] == pytest.approx(cut.sensitivity(cut.t_end, "L").v[0] * -1, rel=1e-14)
    uneven = cubic.solve(lam0=-0.8, c=0.3, g=9.81, m=1.5)

    def force(x: mpf, at: dict[str, mpf]) -> mpf:
        """Return N at a place."""

        def z(u: mpf) -> mpf:
            return u**2 + at["c"] * u**3

        slope, bend = 2 * x + 3 * at["c"] * x**2, 2 + 6 * at["c"] * x
        root = mp.sqrt(1 + slope**2)
        return at["m"] * (bend / root**3 * 2 * at["g"] * (z(at["lam0"]) - z(x)) + at["g"] / root)

    launch = {"lam0": -0.8, "c": 0.3, "g": 9.81, "m": 1.5}
    found, near = uneven.gradient("normal_force_max"), uneven.normal_force_max.lam
    with mp.workdps(60):

        def largest(at: dict[str, mpf]) -> list[mpf]:
            """Return the largest N, at which its slope vanishes."""
            return [force(mp.findroot(lambda x: mp.diff(lambda u: force(u, at), x), mpf(near)), at)]

        for name in launch:
            assert is_near(found[name], by_differences(largest, launch, name)[0]), name


def test_rotating_bodies_of_constant_speed() -> None:
    """Without gravity speed and force are the same everywhere, with N = m v0**2/L."""
    motion = generated("circle").solve(lam0=0.3, v0=2.0, L=1.5, g=0, m=0.5)
    assert motion.kind == "circulation"
    found = motion.gradient("normal_force_max")
    assert found["v0"] == pytest.approx(2 * 0.5 * 2.0 / 1.5, rel=1e-15)
    assert found["L"] == pytest.approx(-0.5 * 4.0 / 2.25, rel=1e-15)
    assert motion.gradient("v_max", "v0") == {"v0": 1.0}
    assert motion.gradient("period", ("v0", "L"))["L"] == pytest.approx(2 * np.pi / 2.0, rel=1e-15)


def test_the_choice_of_names(circle: ModuleType) -> None:
    """By default a gradient has all names; otherwise it has the given ones, in their order."""
    motion = circle.solve(lam0=1.0)
    assert list(motion.gradient("period")) == ["lam0", "v0", "L", "g", "m"]
    assert list(motion.gradient("period", ("g", "lam0"))) == ["g", "lam0"]
    assert list(motion.gradient("period", "L")) == ["L"]


@pytest.mark.parametrize(
    ("quantity", "wrt", "launch", "error", "text"),
    [
        ("half_perid", None, {}, InputError, "did you mean 'half_period'"),
        (3, None, {}, InputError, "quantity: must be one of .*, got 3"),
        ("period", "l", {}, InputError, "there is no parameter 'l'; did you mean 'L'"),
        ("period", 3, {}, GQMError, "wrt: must be names"),
        ("half_period", None, {"v0": 9.0}, SolutionError, "only a libration has half_period"),
        ("turning_points", None, {"v0": 9.0}, SolutionError, "only a libration has turning_points"),
        ("period", None, {"lam0": 0}, SolutionError, "kind 'rest'"),
        ("t_end", None, {}, SolutionError, "goes on for ever and has no t_end"),
    ],
)
def test_what_has_no_gradient(
    quantity: Any, wrt: Any, launch: dict[str, Any], error: type[Exception], text: str, circle: ModuleType
) -> None:
    """Each quantity without a gradient gives one clear error."""
    motion = circle.solve(**{"lam0": 1.0, **launch})
    with pytest.raises(error, match=text):
        motion.gradient(quantity, wrt)


@pytest.mark.parametrize("place", [0.4, -1.1, 1.15])
def test_the_time_at_a_place(place: float, circle: ModuleType) -> None:
    """The derivative of the time at a place of a pendulum released at rest is known in elliptic integrals."""
    launch = {"lam0": 1.2, "L": 1.25, "g": 9.81}
    found = circle.solve(**launch).gradient("time_at", tuple(launch), lam=place)

    def time(at: dict[str, Any]) -> list[Any]:
        k = mp.sin(at["lam0"] / 2)
        return [mp.sqrt(at["L"] / at["g"]) * (mp.ellipk(k**2) - mp.ellipf(mp.asin(mp.sin(mpf(place) / 2) / k), k**2))]

    for name in launch:
        with mp.workdps(60):
            (wanted,) = by_differences(time, launch, name, 25)
        assert found[name] == pytest.approx(float(wanted), rel=1e-13)
    with pytest.raises(SolutionError, match="where the body turns"):
        circle.solve(**launch).gradient("time_at", lam=circle.solve(**launch).turning_points[0])
    with pytest.raises(InputError, match="lam: must be given with 'time_at'"):
        circle.solve(**launch).gradient("time_at")


def test_motions_without_gradients_yet() -> None:
    """The action of motions with losses has no gradient yet, nor has a body at rest; for curves without formulas see
    `test_charts`.
    """
    damped = generated("circle_drag").solve(lam0=1.0, t_max=3)
    resting = generated("circle_drag").solve(lam0=0.0)
    with pytest.raises(SolutionError, match="kind 'rest'"):
        resting.sensitivity(1.0)
    for name in ("action", "period_slope"):
        with pytest.raises(SolutionError, match=f"^{name}: only a libration or a circulation .* kind 'dissipative'"):
            getattr(damped, name)
