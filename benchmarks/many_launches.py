"""One quantity of many launches: a sweep on one core, and heyoka's integrator doing the same work launch by launch.

heyoka is given the equations of motion, events where our motions have them, and callbacks in Python, as its
documentation shows it. Its integrator is compiled beforehand. References are integrals and roots in 40 digits.
"""

import importlib
import tempfile
from collections.abc import Callable
from functools import cache
from math import cos, sin
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from measure import Row, apart, on_one_core
from mpmath import mp, mpf
from peers import has

import gqm_sym as gqm

LAUNCHES, FEW = 2000, 3
G, MU, DRAG = 9.81, 0.05, 0.05
HORIZON = 10.0
TOLERANCE = np.finfo(float).eps

Launches = np.ndarray[Any, np.dtype[np.float64]]


@cache
def module(name: str) -> ModuleType:
    """Return the module of one of the motions, built in a folder that is kept as long as the process."""
    circle, resisted = gqm.families.circle(L="1"), gqm.CoulombFriction(mu=str(MU)) + gqm.QuadraticDrag(b=str(DRAG))
    lissajous = gqm.Curve.parametric(x="sin(2*t)", z="-cos(3*t)/2 - cos(t)", parameter="t", period="2*pi")
    curve, force = {
        "lissajous": (lissajous, gqm.Gravity()),
        "resisted": (circle, gqm.Gravity() + resisted),
        "rubbed": (circle, gqm.Gravity() + gqm.CoulombFriction(mu=str(MU))),
        "dragged": (circle, gqm.Gravity() + gqm.QuadraticDrag(b=str(DRAG))),
        "hill": (gqm.Curve.graph("-x**4/4", parameter="x"), gqm.Gravity()),
    }[name]
    folder = tempfile.mkdtemp(prefix="gqm_sym_benchmark_")
    return gqm.build(gqm.derive(curve, force), name=f"launches_{name}", folder=Path(folder))


def many_launches() -> list[Row]:
    """Return the rows: half periods, places of rest, extremes of N, arrivals and liftoffs."""
    return [*_half_periods(), *_rest(), *_largest_forces(), *_arrivals(), *_liftoffs()]


def _rows(
    work: str, ours: Callable[[], Any], launches: Launches, truths: list[Any], peer: Callable[[], Any]
) -> list[Row]:
    def error(values: Any) -> float:
        return apart(np.asarray(values)[:FEW], truths, max(abs(float(t)) for t in truths))

    rows = [Row(work, "`sweep`, one core", on_one_core(ours), error, each=launches.size, line=1e-13, unit="of scale")]
    if has("heyoka"):
        who = "heyoka's integrator with events, launch by launch"
        rows.append(Row(work, who, peer, error, each=launches.size, repeats=3, unit="of scale"))
    return rows


def _hy() -> Any:
    return importlib.import_module("heyoka")


# -- half periods on a Lissajous curve ------------------------------------------------------------


def _half_periods() -> list[Row]:
    launches = np.random.default_rng(1).uniform(0.1, 0.4, LAUNCHES)

    def height(t: Any) -> Any:
        return -mp.cos(3 * t) / 2 - mp.cos(t)

    def truth(start: float) -> mpf:
        # From the turn to the bottom, twice: t = start*(1 - u**2) takes the singularity away.
        a = mpf(start)

        def rate(u: mpf) -> mpf:
            t = a * (1 - u * u)
            ds = mp.sqrt((2 * mp.cos(2 * t)) ** 2 + (mp.sin(3 * t) * 3 / 2 + mp.sin(t)) ** 2)
            return 2 * a * u * ds / mp.sqrt(2 * mpf(str(G)) * (height(a) - height(t)))

        return 2 * mp.quad(rate, mp.linspace(0, 1, 6), method="gauss-legendre")

    body: Any = None

    def integrated() -> list[float]:
        nonlocal body
        if body is None:
            hy = _hy()
            lam, v = hy.make_vars("lam", "v")
            dx, dz = 2 * hy.cos(2 * lam), 1.5 * hy.sin(3 * lam) + hy.sin(lam)
            ds = hy.sqrt(dx * dx + dz * dz)
            # Launched to the left, so the body turns where its velocity grows through zero no more.
            turn = hy.t_event(v, direction=hy.event_direction.positive)
            body = hy.taylor_adaptive([(lam, v / ds), (v, -G * dz / ds)], state=[0.1, 0.0], t_events=[turn])
        out = []
        for start in launches.tolist():
            body.time, body.state[:] = 0.0, (start, 0.0)
            body.reset_cooldowns()
            body.propagate_until(100.0)
            out.append(body.time)
        return out

    ours = module("lissajous")
    return _rows(
        "half period on a Lissajous curve",
        lambda: ours.sweep("half_period", launches).values,
        launches,
        [truth(start) for start in launches[:FEW].tolist()],
        integrated,
    )


# -- a circle with friction and drag ---------------------------------------------------------------


class _Leg:
    """A swing on the circle of radius 1 from rest, N > 0: V**2 in closed form, since its equation is linear."""

    def __init__(self, start: Any, mu: float, drag: float) -> None:
        self.u, self.start = (-1 if start > 0 else 1), start
        self.mu, self.q = mpf(str(mu)), 2 * (mpf(str(mu)) + mpf(str(drag)))
        # u*dW/dlam = -2 g (u sin + mu cos) - q W, solved by a*sin + b*cos along the way d = u*(lam - start).
        g, u, q = mpf(str(G)), self.u, self.q
        # W = a sin(lam) + b cos(lam): u*(a cos - b sin) + q*(a sin + b cos) = -2 g (u sin + mu cos).
        d = q * q + 1
        self.a = (-2 * g * u * q - 2 * g * self.mu * u) / d
        self.b = (-2 * g * self.mu * q + 2 * g) / d
        self.c = -(self.a * mp.sin(start) + self.b * mp.cos(start))

    def v2(self, lam: Any) -> Any:
        """Return V**2 at a place."""
        return self.a * mp.sin(lam) + self.b * mp.cos(lam) + self.c * mp.exp(-self.q * self.u * (lam - self.start))

    def force(self, lam: Any) -> Any:
        """Return N over the mass."""
        return mpf(str(G)) * mp.cos(lam) + self.v2(lam)

    def time(self, end: Any) -> Any:
        """Return the time to a place inside."""
        width = end - self.start

        def rate(w: Any) -> Any:
            return 2 * w * abs(width) / mp.sqrt(self.v2(self.start + width * w * w))

        return mp.quad(rate, mp.linspace(0, 1, 6), method="gauss-legendre")


def _rest_place(start: float) -> Any:
    place = mpf(start)
    while abs(mp.tan(place)) > mpf(str(MU)):
        leg = _Leg(place, MU, DRAG)
        place = _first_turn(leg)
    return place


def _first_turn(leg: _Leg) -> Any:
    """Return the first zero of V**2 on the other side, by bisection and Newton's method."""
    step, lam = mpf(1) / 64, leg.start + leg.u * mpf("1e-6")
    while leg.v2(lam + leg.u * step * abs(leg.start)) > 0:
        lam += leg.u * step * abs(leg.start)
    return mp.findroot(leg.v2, (lam, lam + leg.u * step * abs(leg.start)), solver="anderson")


def _swinging(mu: float, drag: float, events: Callable[[Any, Any, Any], dict[str, Any]]) -> Any:
    """Return heyoka's integrator of the circle, with the sign of the velocity as its parameter."""
    hy = _hy()
    lam, v = hy.make_vars("lam", "v")
    load = G * hy.cos(lam) + v * v
    resistance = hy.par[0] * (mu * load + drag * v * v)
    equations = [(lam, v), (v, -G * hy.sin(lam) - resistance)]
    return hy.taylor_adaptive(equations, state=[0.5, 0.0], pars=[-1.0], tol=TOLERANCE, **events(hy, lam, v))


def _turned(mu: float) -> Callable[[Any, int], bool]:
    """Decide what happens at a turn: the body stays, or goes back."""

    def turned(body: Any, _: int) -> bool:
        if abs(sin(body.state[0])) <= mu * cos(body.state[0]):
            return False
        body.pars[0] = -1.0 if body.state[0] > 0 else 1.0
        return True

    return turned


def _launched(body: Any, start: float) -> None:
    body.time, body.state[:], body.pars[0] = 0.0, (start, 0.0), -1.0 if start > 0 else 1.0
    body.reset_cooldowns()


def _rest() -> list[Row]:
    launches = np.random.default_rng(2).uniform(0.2, 1.4, LAUNCHES)
    body: Any = None

    def integrated() -> list[float]:
        nonlocal body
        if body is None:
            body = _swinging(MU, DRAG, lambda hy, _, v: {"t_events": [hy.t_event(v, callback=_turned(MU))]})
        out = []
        for start in launches.tolist():
            _launched(body, start)
            body.propagate_until(1000.0)
            out.append(body.state[0])
        return out

    ours = module("resisted")
    return _rows(
        "place of rest, friction and drag",
        lambda: ours.sweep("rest_position", launches).values,
        launches,
        [_rest_place(start) for start in launches[:FEW].tolist()],
        integrated,
    )


def _largest_forces() -> list[Row]:
    launches = np.random.default_rng(3).uniform(0.2, 1.4, LAUNCHES)
    body: Any = None
    largest = 0.0

    def integrated() -> list[float]:
        nonlocal body, largest

        def seen(body: Any, t: float, _: int) -> None:
            nonlocal largest
            body.update_d_output(t)
            lam, v = body.d_output
            largest = max(largest, G * cos(lam) + v * v)

        if body is None:

            def events(hy: Any, lam: Any, v: Any) -> dict[str, Any]:
                load = G * hy.cos(lam) + v * v
                rate = -G * hy.sin(lam) * v + 2 * v * (-G * hy.sin(lam) - hy.par[0] * MU * load)
                return {
                    "t_events": [hy.t_event(v, callback=_turned(MU))],
                    "nt_events": [hy.nt_event(rate, callback=seen)],
                }

            body = _swinging(MU, 0.0, events)
        out = []
        for start in launches.tolist():
            largest = G * cos(start)
            _launched(body, start)
            body.propagate_until(HORIZON)
            out.append(largest)
        return out

    def truth(start: float) -> Any:
        leg = _Leg(mpf(start), MU, 0.0)  # of the first swing, which is the fastest
        place = mp.findroot(lambda lam: mp.diff(leg.force, lam), -0.1 * start)
        return max(leg.force(place), leg.force(leg.start))

    ours = module("rubbed")
    return _rows(
        f"largest contact force in {HORIZON:g} s, friction",
        lambda: ours.sweep("normal_force_max", launches, t_max=HORIZON).values,
        launches,
        [truth(start) for start in launches[:FEW].tolist()],
        integrated,
    )


def _arrivals() -> list[Row]:
    launches, place = np.random.default_rng(4).uniform(0.2, 1.4, LAUNCHES), 0.1
    body: Any = None

    def integrated() -> list[float]:
        nonlocal body
        if body is None:
            body = _swinging(0.0, DRAG, lambda hy, lam, _: {"t_events": [hy.t_event(lam - place)]})
        out = []
        for start in launches.tolist():
            _launched(body, start)
            body.propagate_until(100.0)
            out.append(body.time)
        return out

    ours = module("dragged")
    return _rows(
        "time of arrival, drag",
        lambda: ours.sweep("time_at", launches, lam=place).values,
        launches,
        [_Leg(mpf(start), 0.0, DRAG).time(mpf(place)) for start in launches[:FEW].tolist()],
        integrated,
    )


# -- over a hill that can only push ----------------------------------------------------------------


def _liftoffs() -> list[Row]:
    speeds = np.random.default_rng(5).uniform(0.5, 2.5, LAUNCHES)
    body: Any = None

    def integrated() -> list[float]:
        nonlocal body
        if body is None:
            hy = _hy()
            x, v = hy.make_vars("x", "v")
            slope, second = -x * x * x, -3.0 * x * x  # its series of powers fail at 0
            ds = hy.sqrt(1.0 + slope * slope)
            load = G / ds + second / (ds * ds * ds) * v * v
            body = hy.taylor_adaptive(
                [(x, v / ds), (v, -G * slope / ds)], state=[0.0, 1.0], tol=TOLERANCE, t_events=[hy.t_event(load)]
            )
        out = []
        for speed in speeds.tolist():
            body.time, body.state[:] = 0.0, (0.0, speed)
            body.reset_cooldowns()
            body.propagate_until(100.0)
            out.append(body.time)
        return out

    def truth(speed: float) -> Any:
        g, v0 = mpf(str(G)), mpf(speed)

        place = mp.findroot(lambda x: g - 3 * v0**2 * x**2 - g * x**6 / 2, 1)
        return mp.quad(lambda x: mp.sqrt((1 + x**6) / (v0**2 + g * x**4 / 2)), mp.linspace(0, place, 5))

    ours = module("hill")
    return _rows(
        "liftoff over a hill",
        lambda: ours.sweep("t_end", 0.0, speeds, contact="above").values,
        speeds,
        [truth(speed) for speed in speeds[:FEW].tolist()],
        integrated,
    )
