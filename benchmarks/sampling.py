"""Positions of the pendulum at many times, and at a late one."""

from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
import peers
from measure import Row, apart, on_one_core
from mpmath import mp, mpf
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.special import ellipj
from swing import place

import generated.pendulum as pendulum

TIMES = 1_000_000
TOP = 1.2  # amplitude
FAR = 1e6


def sampling() -> list[Row]:
    """Return the rows for positions at many random times, and at a late one."""
    lam0 = TOP - pi / 2
    top = mpf(lam0) + mp.pi / 2
    motion = pendulum.solve(lam0)
    t = np.random.default_rng(2).uniform(0.0, 100.0, TIMES)
    truths, late = [place(top, float(v)) for v in t[:200]], [place(top, FAR)]
    scale = 2 * TOP

    def flow(_: float, y: Any) -> list[float]:
        return [y[1], -9.81 * cos(y[0])]

    dense = solve_ivp(flow, (0, 100), [lam0, 0], method="DOP853", rtol=1e-13, atol=1e-14, dense_output=True).sol
    tau = motion.half_period
    knots = np.linspace(0.0, tau, 2001)
    spline = CubicSpline(knots, motion.lam(knots), bc_type=((1, 0.0), (1, 0.0)))

    def tiled() -> Any:
        r = t % (2 * tau)
        return spline(np.where(r <= tau, r, 2 * tau - r))

    k = sin(TOP / 2)

    def elliptic() -> Any:
        sn = ellipj(sqrt(9.81) * t + float(mp.ellipk(k * k)), k * k)[0]
        return 2 * np.arcsin(k * sn) - pi / 2

    def error(values: Any) -> float:
        return apart(values, truths, scale)

    work, once = f"λ(t) at {TIMES:,} random times within 100 s, per time", "state at 10⁶ s"
    return [
        Row(
            work,
            "`motion.lam`, one core",
            on_one_core(lambda: motion.lam(t)),
            error,
            each=TIMES,
            line=5e-16,
            unit="of scale",
        ),
        Row(work, "`motion.lam`, all cores", lambda: motion.lam(t), error, each=TIMES, line=5e-16, unit="of scale"),
        Row(work, "closed form by `scipy.special.ellipj`", elliptic, error, each=TIMES, repeats=5, unit="of scale"),
        Row(
            work,
            "`CubicSpline` of 2001 of our points, tiled by our period",
            tiled,
            error,
            each=TIMES,
            repeats=5,
            unit="of scale",
        ),
        Row(
            work,
            "DOP853's dense output (without the integration)",
            lambda: dense(t[:100_000])[0],
            error,
            each=100_000,
            repeats=3,
            unit="of scale",
        ),
        *peers.sampling(work, lam0, t, error),
        Row(
            once,
            "`motion.state`",
            lambda: [motion.state(FAR).lam for _ in range(100)],
            lambda values: apart(values, late, scale),
            each=100,
            line=5e-16,
            unit="of scale",
        ),
        Row(
            once,
            "`motion.lam`",
            lambda: [motion.lam(FAR) for _ in range(100)],
            lambda values: apart(values, late, scale),
            each=100,
            line=5e-16,
            unit="of scale",
        ),
        *peers.far(once, lam0, FAR, lambda values: apart(values, late, scale)),
        Row(
            "one orbit from Python, λ at a single time",
            "`solve` with turning points, quadrature, table and series",
            lambda: [pendulum.solve(lam0).lam(0.7) for _ in range(20)],
            lambda values: apart(values, [place(top, 0.7)], scale),
            each=20,
            line=5e-16,
            unit="of scale",
        ),
    ]
