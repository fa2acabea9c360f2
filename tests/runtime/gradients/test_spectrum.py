"""Fourier coefficients agree with closed forms, and with the motion itself."""

from typing import Any

import numpy as np
import pytest
from paths import ROOT

from gqm_sym.errors import InputError, SolutionError
from gqm_sym.loading import load


def circle(**launch: Any) -> Any:
    """Return a motion on a circle."""
    return load(str(ROOT / "generated" / "circle.py"), "circle").solve(L=1, g="9.81", **launch)


def test_a_pendulum() -> None:
    """At 1.2 rad the first coefficient is 8 sqrt(q)/(1 + q); the third is known too, and even ones and sines vanish."""
    found = circle(lam0="6/5").fourier("lam", 5)
    assert found.a.shape == found.b.shape == (6,)
    wanted = [0.0, 1.20976057007855867244104160222, 0.0, -0.00990061091437302041253432191172, 0.0]
    np.testing.assert_allclose(found.a[:5], wanted, rtol=0, atol=1e-15)
    np.testing.assert_allclose(found.b, 0.0, atol=1e-15)


def test_a_melnikov_integral() -> None:
    """Along the separatrix of a pendulum of unit length and gravity, the integral of v cos(w t) over all times is 2 pi
    sech(pi w/2). The trapezoidal rule converges like exp(-pi**2/h), because v has poles at half of pi.
    """
    motion = load(str(ROOT / "generated" / "circle.py"), "circle").solve(lam0=0, v0=2, L=1, g=1)
    assert motion.kind == "asymptotic"
    step = 0.125
    times = step * np.arange(1, 280)
    found = step * (2.0 + 2.0 * np.sum(motion.state(times).v * np.cos(1.3 * times)))
    assert abs(found - 1.60366308118402222946135298272) < 2e-15


@pytest.mark.parametrize("quantity", ["x", "z", "v", "normal_force"])
@pytest.mark.parametrize("launch", [{"lam0": 2.5, "v0": 1.0, "direction": -1}, {"lam0": 0.4, "v0": 7.0}])
def test_the_sum_is_the_motion(quantity: str, launch: dict[str, Any]) -> None:
    """The sum is the motion at random times, to rounding."""
    motion = circle(**launch)
    a, b = motion.fourier(quantity, 90)
    times = np.random.default_rng(1).uniform(0.0, motion.period, 50)
    angles = 2 * np.pi / motion.period * np.outer(times, np.arange(91))
    values = getattr(motion.state(times), quantity)
    np.testing.assert_allclose(
        np.cos(angles) @ a + np.sin(angles) @ b, values, atol=2e-13 * np.abs(values).max(), rtol=0
    )


@pytest.mark.extended
def test_beside_a_hilltop() -> None:
    """A body that passes a hilltop slowly has coefficients too: those of the velocity, times k, are those of the arc
    length.
    """
    motion = load(str(ROOT / "generated" / "double_well.py"), "double_well").solve(lam0=0, v0=1e-12)
    v, s = motion.fourier("v", 9), motion.fourier("s", 9)
    order = 2 * np.pi / motion.period * np.arange(10)
    np.testing.assert_allclose(v.a, order * s.b, atol=2e-15, rtol=0)
    np.testing.assert_allclose(v.b, -order * s.a, atol=2e-15, rtol=0)


def test_on_stitched_planes() -> None:
    """On planes the velocity is linear in time between corners: its coefficients are those of its accelerations' jumps.

    The half period from a height z0 consists of the times on the planes, each 2 l/(v + v') for their length l and the
    speeds at their ends, v**2 = 2 g (z0 - z).
    """
    x, z = np.loadtxt(ROOT / "curves" / "track.csv", delimiter=",", skiprows=1, unpack=True)
    corners = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(z)))])
    launch = 10.0
    top = float(np.interp(launch, corners, z))
    beyond = 10 + int(np.argmax(z[10:] > top))  # the eleventh corner is the lowest of this valley
    far = float(np.interp(top, z[beyond - 1 : beyond + 1], corners[beyond - 1 : beyond + 1]))
    places = np.concatenate([[launch], corners[(corners > launch) & (corners < far)], [far]])
    speeds = np.sqrt(2 * 9.81 * np.maximum(top - np.interp(places, corners, z), 0.0))
    times = np.concatenate([[0.0], np.cumsum(2 * np.diff(places) / (speeds[1:] + speeds[:-1]))])
    rates = np.diff(speeds) / np.diff(times)
    motion = load(str(ROOT / "generated" / "planes.py"), "planes").solve(lam0=10, g="9.81")
    assert motion.half_period == pytest.approx(times[-1], rel=2e-15)
    found, omega = motion.fourier("v", 5), np.pi / times[-1]
    order = np.arange(1, 6)
    wanted = -np.sin(omega * np.outer(order, times[1:-1])) @ np.diff(rates) * 2 / np.pi / (order**2 * omega)
    np.testing.assert_allclose(found.b[1:], wanted, rtol=0, atol=1e-14 * np.abs(wanted).max())
    np.testing.assert_allclose(found.a, 0.0, atol=1e-14 * np.abs(wanted).max())


@pytest.mark.parametrize(
    ("quantity", "n", "launch", "error", "text"),
    [
        ("y", 3, {}, InputError, "quantity: must be one of .*, got 'y'"),
        ("x", -1, {}, InputError, "must be a whole number from 0"),
        ("x", 1.5, {}, InputError, "must be a whole number from 0"),
        ("lam", 3, {"v0": 9.0}, SolutionError, "does not repeat"),
        ("x", 3, {"lam0": 0}, SolutionError, "kind 'rest'"),
    ],
)
def test_what_has_no_coefficients(
    quantity: str, n: Any, launch: dict[str, Any], error: type[Exception], text: str
) -> None:
    """Each motion without coefficients gives one clear error."""
    with pytest.raises(error, match=text):
        circle(**{"lam0": 1.0, **launch}).fourier(quantity, n)
