"""Motions on random curves under random forces obey general laws and agree with an integrator.

The integrator (DOP853 of SciPy) follows dlam/dt = V/ds and dV/dt from the definitions of MATHS, section 2, with the
signs of V and N held between events, and begins afresh at each of them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from types import ModuleType

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from selection import examples

import gqm_sym as gqm

G = 9.81
HORIZON = 3.0
# Events closer than this to a change of the motion are not compared with the integrator.
GRAZING = 1e-9


@dataclass(frozen=True)
class Shape:
    """A curve for the generator, and written by hand: (x', z', x'', z'') and x."""

    curve: gqm.Curve
    derivatives: Callable[[float], tuple[float, float, float, float]]
    x: Callable[[float], float]
    places: tuple[float, float]


SHAPES = {
    "circle": Shape(
        gqm.Curve.parametric(x="sin(u)", z="-cos(u)", parameter="u", period="2*pi"),
        lambda u: (np.cos(u), np.sin(u), -np.sin(u), np.cos(u)),
        np.sin,
        (-3.0, 3.0),
    ),
    "ellipse": Shape(
        gqm.Curve.parametric(x="3/2*cos(u)", z="sin(u)", parameter="u", period="2*pi"),
        lambda u: (-1.5 * np.sin(u), np.cos(u), -1.5 * np.cos(u), -np.sin(u)),
        lambda u: 1.5 * np.cos(u),
        (-4.0, 1.0),
    ),
    "parabola": Shape(gqm.Curve.graph("u**2/2", parameter="u"), lambda u: (1.0, u, 0.0, 1.0), lambda u: u, (-1.5, 1.5)),
    "waves": Shape(
        gqm.Curve.graph("u**2/4 + sin(2*u)/3", parameter="u"),
        lambda u: (1.0, u / 2 + 2 * np.cos(2 * u) / 3, 0.0, 0.5 - 4 * np.sin(2 * u) / 3),
        lambda u: u,
        (-2.5, 2.5),
    ),
}


@dataclass(frozen=True)
class Force:
    """A sum of kernels, and written by hand: (F_x, F_z), resistance and drag."""

    kernel: gqm.Kernel
    names: tuple[str, ...]
    push: Callable[[float, dict[str, float]], tuple[float, float]] = lambda x, p: (0.0, -G)
    resistance: Callable[[float, dict[str, float]], float] = lambda kappa, p: 0.0
    drag: str = ""
    friction: str = ""


FORCES = {
    "coulomb": Force(gqm.Gravity() + gqm.CoulombFriction(), ("mu",), friction="mu"),
    "drag": Force(gqm.Gravity() + gqm.QuadraticDrag(b="c"), ("c",), drag="c"),
    "coulomb and drag": Force(
        gqm.Gravity() + gqm.CoulombFriction() + gqm.QuadraticDrag(b="c"), ("mu", "c"), drag="c", friction="mu"
    ),
    "droplet": Force(
        gqm.Gravity() + gqm.SurfaceTension(),
        ("gamma", "ell_c"),
        resistance=lambda k, p: p["gamma"] * p["ell_c"] ** 2 * abs(k),
    ),
    "spring and coulomb": Force(
        gqm.Gravity() + gqm.Potential("k_s*x**2/2") + gqm.CoulombFriction(),
        ("mu", "k_s"),
        push=lambda x, p: (-p["k_s"] * x, -G),
        friction="mu",
    ),
}


@cache
def module(shape: str, force: str, folder: str) -> ModuleType:
    """Build the module of a pair, once."""
    model = gqm.derive(SHAPES[shape].curve, FORCES[force].kernel)
    return gqm.build(model, name=f"{shape}_{force.replace(' ', '_')}", folder=folder)


@dataclass(frozen=True)
class System:
    """A pair with values, in the form that the integrator needs."""

    shape: Shape
    force: Force
    p: dict[str, float]

    def parts(self, lam: float) -> tuple[float, float, float, float]:
        """Return ds, kappa, F.t and n0."""
        dx, dz, ddx, ddz = self.shape.derivatives(lam)
        ds = np.hypot(dx, dz)
        fx, fz = self.force.push(self.shape.x(lam), self.p)
        return ds, (dx * ddz - dz * ddx) / ds**3, (fx * dx + fz * dz) / ds, (fx * dz - fz * dx) / ds

    def pull(self, lam: float, v: float, way: float, nu: float) -> float:
        """Return the tangential acceleration of a body that moves in direction ``way``."""
        _, kappa, along, n0 = self.parts(lam)
        lost = self.force.resistance(kappa, self.p)
        lost += self.p.get(self.force.drag, 0.0) * v * v
        lost += self.p.get(self.force.friction, 0.0) * nu * (n0 + kappa * v * v)
        return along - way * lost

    def pressure(self, lam: float, v: float) -> float:
        """Return N per unit mass."""
        _, kappa, _, n0 = self.parts(lam)
        return n0 + kappa * v * v

    def follow(self, lam: float, v: float, until: float) -> tuple[float, float, float]:
        """Return the body's place and speed after a time, and the smallest margin by which it missed an event."""
        t, margin = 0.0, np.inf
        way, nu = np.sign(v), np.sign(self.pressure(lam, v))
        for _ in range(200):

            def rate(_: float, y: np.ndarray, way: float = way, nu: float = nu) -> list[float]:
                return [y[1] / self.parts(y[0])[0], self.pull(y[0], y[1], way, nu)]

            def stops(_: float, y: np.ndarray) -> float:
                return float(y[1])

            def presses(_: float, y: np.ndarray) -> float:
                return self.pressure(y[0], y[1])

            stops.terminal = presses.terminal = True  # type: ignore[attr-defined]
            stops.direction, presses.direction = -way, -nu  # type: ignore[attr-defined]
            events = [stops, presses] if self.force.friction else [stops]
            run = solve_ivp(
                rate, (t, until), [lam, v], "DOP853", rtol=1e-12, atol=1e-14, events=events, first_step=1e-6
            )
            t, (lam, v) = float(run.t[-1]), run.y[:, -1]
            if run.status == 0:
                return lam, v, margin
            if self.force.friction and run.t_events[1].size:
                nu = -nu
                margin = min(margin, abs(v))
                continue
            ahead, back = self.pull(lam, 0.0, 1.0, nu), self.pull(lam, 0.0, -1.0, nu)
            margin = min(margin, abs(ahead), abs(back))
            if ahead <= 0.0 <= back:
                return lam, 0.0, margin
            way = 1.0 if ahead > 0.0 else -1.0
            v = way * 1e-300
        return lam, v, 0.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return one folder for all modules of this file."""
    return str(tmp_path_factory.mktemp("random"))


@examples(60, otherwise=5)
@given(
    shape=st.sampled_from(sorted(SHAPES)),
    force=st.sampled_from(sorted(FORCES)),
    share=st.floats(0.0, 1.0),
    v0=st.floats(0.05, 5.0),
    direction=st.sampled_from([1, -1]),
    coefficient=st.floats(0.02, 0.5),
    other=st.floats(0.05, 1.5),
    at=st.floats(0.05, 1.0),
)
def test_random_motion(
    folder: str,
    shape: str,
    force: str,
    share: float,
    v0: float,
    direction: int,
    coefficient: float,
    other: float,
    at: float,
) -> None:
    """Speeds are real, times grow, legs join and events are in order; places agree with the integrator's."""
    names = FORCES[force].names
    p = dict(zip(names, (coefficient, other), strict=False))
    low, high = SHAPES[shape].places
    lam0 = low + share * (high - low)
    motion = module(shape, force, folder).solve(lam0, v0, direction, t_max=HORIZON, **p)
    end = min(HORIZON, motion.t_end)
    state = motion.state(np.linspace(0.0, end, 50))
    assert np.isfinite(state).all()
    assert (state.v2 >= 0.0).all()
    legs = motion.legs
    assert legs[0].t_start == 0.0
    assert all(leg.t_end >= leg.t_start for leg in legs)
    assert all(a.t_end == b.t_start and a.lam_end == b.lam_start for a, b in pairwise(legs))
    times = [event.t for event in motion.events]
    assert times == sorted(times)
    system = System(SHAPES[shape], FORCES[force], p)
    t = at * end
    lam, _, margin = system.follow(lam0, direction * v0, t)
    moved = system.follow(lam0, direction * (v0 + 1e-12), t)
    assume(min(margin, moved[2]) >= GRAZING)
    sensitivity = 1.0 + abs(moved[0] - lam) / 1e-12
    assert abs(motion.lam(t) - lam) <= 1e-9 * sensitivity
