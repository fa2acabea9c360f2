"""Times along charts beside a hilltop are from double-double arithmetic, and agree with quadrature by mpmath and with
extended precision.
"""

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from naive import ulps

import gqm_sym as gqm
from gqm_sym.runtime.motion import timing
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.multiprecision import exact_panels
from gqm_sym.runtime.multiprecision.exact_problem import ExactProblem

DIGITS = 40

# The pieces of a rail, with their radii and angles; the length of a straight line is in place of its angle.
PIECES = [(0, "1.5"), (3, "pi/4"), (0, "2"), ("2.5", "pi/4"), (0, "3"), (3, "pi/2"), (0, "1")]
ATTRACTION, BELOW = 300, 6

# The energies of these launches are 1e-2 to 4e-4 above that of the hilltop, as a share of the largest kinetic energy.
LAUNCHES = [1.6746, 1.7123, 1.7204]

Build = Callable[..., ModuleType]


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Return a function that makes the module of a curve and a force."""
    folder: Path = tmp_path_factory.mktemp("beside_hilltops")

    def module(name: str, curve: gqm.Curve, force: Any) -> ModuleType:
        return gqm.build(gqm.derive(curve, force), name=name, folder=folder)

    return module


@pytest.fixture(scope="module")
def attracted(build: Build) -> ModuleType:
    """Return a rail around a centre of attraction."""
    pieces = [gqm.arc(radius=r, angle=size) if r else gqm.line(length=size) for r, size in PIECES]
    rail = gqm.Curve.piecewise(pieces, start=(-5, 4), heading="-pi/2")
    return build("rail_around_a_centre", rail, gqm.CentralForce(centre=(0, -BELOW)))


@pytest.fixture
def no_mpmath(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make it an error to ask for ends in extended precision."""

    def refuse(*_: Any) -> None:
        raise AssertionError("the ends are asked for in extended precision")

    monkeypatch.setattr(exact_panels, "exact_ends", refuse)


class Rail:
    """The rail in closed form, as a function of arc length."""

    def __init__(self) -> None:
        heading, x, z, self.edges, self.parts = -mp.pi / 2, mpf(-5), mpf(4), [mpf(0)], []
        for r, size in PIECES:
            radius, angle = mpf(r), {"pi/4": mp.pi / 4, "pi/2": mp.pi / 2}.get(size)
            length = mpf(size) if angle is None else radius * angle
            self.parts.append((x, z, heading, radius))
            x, z, heading = self._along(self.parts[-1], length)
            self.edges.append(self.edges[-1] + length)

    @staticmethod
    def _along(part: tuple[mpf, ...], d: mpf) -> tuple[mpf, mpf, mpf]:
        x, z, heading, radius = part
        if radius == 0:
            return x + d * mp.cos(heading), z + d * mp.sin(heading), heading
        to = heading + d / radius
        return x + radius * (mp.sin(to) - mp.sin(heading)), z + radius * (mp.cos(heading) - mp.cos(to)), to

    def potential(self, s: mpf) -> mpf:
        """Return the potential energy per unit mass."""
        number = max(k for k in range(len(self.parts)) if self.edges[k] <= s)
        x, z, _ = self._along(self.parts[number], s - self.edges[number])
        return -ATTRACTION / mp.hypot(x, z + BELOW)

    def time_to_end(self, s: float) -> mpf:
        """Return the time from rest at a place to the end of the rail."""
        start, end, level = mpf(s), self.edges[-1], self.potential(mpf(s))
        joints = [mp.sqrt((edge - start) / (end - start)) for edge in self.edges[1:-1] if edge > start]

        def rate(phi: mpf) -> mpf:
            return 2 * phi * (end - start) / mp.sqrt(2 * (level - self.potential(start + (end - start) * phi**2)))

        inner = [mpf(10) ** -k for k in (4, 3, 2)]
        # Towards the end of this rail the speed is small again.
        outer = [1 - mpf(10) ** -k for k in (2, 3, 4)]
        return mp.quad(rate, sorted([mpf(0), *inner, *joints, *outer, mpf(1)]))


@pytest.mark.sample(1)
@pytest.mark.usefixtures("no_mpmath")
@pytest.mark.parametrize("lam0", LAUNCHES)
def test_time_to_the_end_of_a_rail(lam0: float, attracted: ModuleType) -> None:
    """A body released beside a hilltop arrives at the end of a rail when quadrature by mpmath says."""
    with mp.workdps(DIGITS):
        truth = Rail().time_to_end(lam0)
    motion = attracted.solve(lam0, k=ATTRACTION)
    assert motion.kind == "transit"
    assert motion.condition_number > 64
    assert ulps(motion.t_end, truth) <= 2.0


def points() -> gqm.Curve:
    """Return a track of points with a hill between two valleys."""
    x = np.linspace(-2.5, 2.5, 21)
    return gqm.Curve.sampled(np.column_stack([x, (x * x - 1) ** 2 / 4]))


def hilly() -> gqm.Curve:
    """Return the implicit curve with the same hill."""
    return gqm.Curve.implicit("(x**2-1)**2/4-z", start=(0, "1/4"))


def humps() -> gqm.Curve:
    """Return a rail with a hump of circular arcs."""
    line, arc = gqm.line, gqm.arc
    arcs = [arc(radius=1, angle="pi/2"), arc(radius=2, angle="-pi/2"), arc(radius=1, angle="pi/2")]
    return gqm.Curve.piecewise([line(length=2), *arcs, line(length=3)], start=(0, 0), heading="-pi/4")


@pytest.mark.extended
@pytest.mark.parametrize(
    ("curve", "force", "values", "top"),
    [
        (points, gqm.Gravity(), {}, None),
        (hilly, gqm.Gravity(), {}, 0.0),
        (humps, gqm.Gravity(), {}, 2 + math.pi),
        (humps, gqm.Gravity() + gqm.Rolling(radius="rho"), {"rho": 0.05, "beta": 0.4}, 2 + math.pi),
    ],
)
def test_states_agree_with_extended_precision(
    curve: Callable[[], gqm.Curve],
    force: Any,
    values: dict[str, float],
    top: float | None,
    build: Build,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """States beside a hilltop are those of panels and times in extended precision."""
    module = build(f"over_{curve.__name__}_{len(values)}", curve(), force)
    if top is None:
        passing = module.solve(1.0, 9.0).state(np.linspace(0, 1, 4001))
        top = float(passing.lam[np.argmin(np.abs(passing.x))])
    compared = 0
    for offset in (-0.04, 0.011):
        for v0 in (0.1, 0.13):
            solve = partial(module.solve, top + offset, v0, 1, **values)
            motion = solve()
            if motion.condition_number < 64:
                continue
            until = motion.t_end if math.isfinite(motion.t_end) else 3 * motion.period
            times = np.linspace(0, 0.87 * until, 9)
            state = motion.state(times)
            with monkeypatch.context() as patch:
                patch.setattr(timing, "passage_of", lambda *_: None)
                patch.setattr(ExactProblem, "along_chart", property(lambda _: lambda *_: None, lambda *_: None))
                exact = solve()
                truth = exact.state(times)
            size = np.ptp(truth.lam)
            assert np.abs(state.lam - truth.lam).max() <= 2e-15 * (size + abs(top))
            assert np.abs(state.v - truth.v).max() <= 2e-15 * np.abs(truth.v).max()
            compared += 1
    assert compared >= 1


@pytest.mark.usefixtures("no_mpmath")
def test_turning_points_are_found(attracted: ModuleType) -> None:
    """The ends of a segment between two turning points, or from one of them, are those that bound the motion."""
    motion = attracted.solve(1.75, 0.2, 1, k=ATTRACTION)
    assert motion.kind == "libration"
    (segment,) = {id(part.segment): part.segment for part in motion.one_period}.values()
    assert isinstance(segment, Segment)
    exact = segment.functions.exact
    assert exact is not None
    rates = exact.along_chart(segment.kind, (segment.a, segment.b))
    assert rates.is_known
    assert list(rates.ends) == sorted(motion.turning_points)
