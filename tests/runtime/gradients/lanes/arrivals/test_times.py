"""Swept derivatives of first times at places agree with elliptic integrals and with quadratures of 30 digits."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from paths import ROOT

from gqm_sym.loading import load

# The steps of central differences, whose errors are their squares.
STEP, DIGITS = mpf(10) ** -12, 40


def generated(name: str) -> ModuleType:
    """Return a module of the repository."""
    return load(str(ROOT / "generated" / f"{name}.py"), name)


def slopes(time: Callable[..., mpf], at: dict[str, float], names: tuple[str, ...]) -> list[float]:
    """Return the derivatives of a time with respect to variables, by differences; by v0 = 0 they are one-sided."""
    exact, found = {name: mpf(value) for name, value in at.items()}, []
    for name in names:
        if exact[name] == 0:
            one, two = (time(**{**exact, name: k * STEP}) for k in (1, 2))
            found.append(float((4 * one - two - 3 * time(**exact)) / (2 * STEP)))
        else:
            above, below = (time(**{**exact, name: exact[name] + sign * STEP}) for sign in (1, -1))
            found.append(float((above - below) / (2 * STEP)))
    return found


def time_on_a_ring(lam0: mpf, v0: mpf, L: mpf, g: mpf, direction: int, place: mpf) -> mpf:
    """Return the time in which a pendulum comes from lam0 to a place, by elliptic integrals of the first kind."""
    k2 = mp.sin(lam0 / 2) ** 2 + v0**2 / (4 * g * L)
    scale = mp.sqrt(L / g)
    if k2 > 1:
        at = [mp.ellipf(angle / 2, 1 / k2) / mp.sqrt(k2) for angle in (lam0, place)]
        return direction * scale * (at[1] - at[0])
    start, stop = (scale * mp.ellipf(mp.asin(mp.sin(angle / 2) / mp.sqrt(k2)), k2) for angle in (lam0, place))
    if v0 == 0:
        start = mp.sign(lam0) * scale * mp.ellipk(k2)
        return abs(stop - start)
    if direction * (stop - start) > 0:
        return direction * (stop - start)
    return 2 * scale * mp.ellipk(k2) - direction * (start + stop)


# Launches with speed away from and towards the nearer turn, from rest, all but at rest, in laps, and small swings.
LAUNCHES = (
    *((0.7, 1.1, 1, 0.78), (0.7, 1.1, 1, -0.4), (0.7, 1.1, -1, 0.3), (0.7, 1.1, -1, 0.8), (-1.9, 0.6, 1, -1.7)),
    *((-1.9, 0.6, -1, -1.915), (-1.9, 0.6, -1, 1.2), (2.4, 0.0, 1, 1.3), (-2.4, 0.0, 1, 2.3), (1.2, 1e-6, 1, 0.8)),
    *((1.2, 1e-6, -1, 0.8), (0.4, 9.0, 1, 2.9), (0.4, 9.0, -1, -11.0), (1e-4, 0.0, 1, -3e-5), (1e-5, 2e-5, -1, 8e-6)),
)


def test_pendulums() -> None:
    """Derivatives on a ring are those of elliptic integrals; no launch is solved by itself."""
    lam0, v0, direction, place = np.array(LAUNCHES).T
    names, given = ("lam0", "L", "v0", "g"), {"L": 0.8, "g": 9.81}
    found = generated("circle").sweep("time_at", lam0, v0, direction, lam=place, gradient=names, **given)
    assert set(found.route_counts()) <= {"batch", "single"}
    with mp.workdps(DIGITS):
        for k, (start, speed, heading, there) in enumerate(LAUNCHES):

            def time(heading: int = heading, there: float = there, **at: mpf) -> mpf:
                return time_on_a_ring(direction=heading, place=mpf(there), **at)

            at = {"lam0": start, "v0": speed, **given}
            some = names if speed else ("L", "g")
            wanted = slopes(time, at, some)
            np.testing.assert_allclose(found.gradient[k, [names.index(name) for name in some]], wanted, rtol=2e-14)


def test_launches_from_rest() -> None:
    """From rest, the derivative by v0 is that of the time which the speed saves or costs, and that by lam0 is that of
    the elliptic integral from a turn.
    """
    names, g, length = ("v0", "lam0"), 9.81, 0.8
    swept = generated("circle").sweep("time_at", [1.1, 1.1], 0.0, [1, -1], lam=0.2, gradient=names, L=length, g=g)
    saved = 1 / (g * np.sin(1.1))
    np.testing.assert_allclose(swept.gradient[:, 0], [saved, -saved], rtol=1e-14)
    with mp.workdps(DIGITS):

        def time(lam0: mpf) -> mpf:
            return time_on_a_ring(lam0, mpf(0), mpf(length), mpf(g), 1, mpf(0.2))

        wanted = slopes(time, {"lam0": 1.1}, ("lam0",))
    np.testing.assert_allclose(swept.gradient[:, 1], wanted * 2, rtol=2e-14)


def time_in_a_well(potential: Any, slope: Any, lam0: mpf, v0: mpf, direction: int, place: mpf) -> mpf:
    """Return the time in which a body comes from lam0 to a place of a graph, by quadratures from its turns."""
    energy = v0**2 / 2 + potential(lam0)

    def turn(side: int) -> mpf:
        return mp.findroot(lambda u: potential(u) - energy, lam0 + side * mpf("0.3"))

    low, high = turn(-1), turn(1)

    def time(angle: mpf) -> mpf:
        def rate(phi: mpf) -> mpf:
            u = low + (high - low) * mp.sin(phi / 2) ** 2
            arc = mp.sqrt(1 + slope(u) ** 2)
            return (high - low) * mp.sin(phi) / 2 * arc / mp.sqrt(2 * (energy - potential(u)))

        return mp.quad(rate, mp.linspace(0, angle, 3), method="gauss-legendre")

    start, stop = (time(2 * mp.asin(mp.sqrt((u - low) / (high - low)))) for u in (lam0, place))
    if direction * (stop - start) > 0:
        return direction * (stop - start)
    return start + stop if direction < 0 else 2 * time(mp.pi) - start - stop


@pytest.mark.sample(2)
@pytest.mark.parametrize(("direction", "place"), [(1, 1.15), (-1, 0.95), (1, 0.8), (-1, 1.17)])
def test_a_well_without_symmetry(direction: int, place: float) -> None:
    """In one of two wells, derivatives are those of quadratures with 40 digits."""
    names, at = ("h", "g", "lam0", "v0"), {"h": 0.25, "g": 9.81, "lam0": 1.1, "v0": 0.8}
    found = generated("double_well").sweep("time_at", direction=direction, lam=place, gradient=names, **at)
    assert found.route <= 1  # compiled loops

    def time(h: mpf, g: mpf, lam0: mpf, v0: mpf) -> mpf:
        def potential(u: mpf) -> mpf:
            return g * h * (u**4 - 2 * u * u)

        return time_in_a_well(potential, lambda u: h * (4 * u**3 - 4 * u), lam0, v0, direction, mpf(place))

    with mp.workdps(DIGITS):
        np.testing.assert_allclose(found.gradient, slopes(time, at, names), rtol=1e-13)


def test_places_that_are_left_to_single_motions() -> None:
    """At the launch the derivative by its place is that of a moving start; at a turn and beyond it there is none."""
    ring = generated("circle")
    found = ring.sweep("time_at", 0.3, [0.5, 0.0, 0.5], lam=[0.3, -0.3, 0.6], L=2, gradient=("lam0", "L"))
    np.testing.assert_allclose(found.gradient[0], [-2 / 0.5, 0.0], rtol=1e-14, atol=1e-16)
    assert np.isnan(found.gradient[1:]).all()


def test_the_same_bits_alone() -> None:
    """A launch has the same derivatives alone as among others that need more nodes."""
    lam0, place = np.linspace(0.3, 3.1, 70), 0.1
    names, ring = ("L", "lam0", "v0"), generated("circle")
    many = ring.sweep("time_at", lam0, 0.2, lam=place, gradient=names)
    for k in (0, 33, 69):
        alone = ring.sweep("time_at", lam0[k], 0.2, lam=place, gradient=names)
        np.testing.assert_array_equal(alone.gradient, many.gradient[k])
