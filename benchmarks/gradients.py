"""Derivatives of motions: at early and late times, of a half period, and through the paper's Example 2."""

import importlib
from math import cos, sin
from typing import Any

import gradient_peers
import numpy as np
from legs import MU, SPEED, START
from measure import Row, apart
from mpmath import mp, mpf
from peers import has
from scipy.integrate import solve_ivp

import generated.circle as circle
import generated.cubic_coulomb as cubic

AMPLITUDE, G = 1.2, 9.81
WRT = ("lam0", "g")

# Steps of central differences: the error of the positions over the step is that of its square.
STEP = 1e-5

# Nodes of the rule that JAX differentiates.
NODES = 24


def place(t: mpf, amplitude: mpf, g: mpf) -> mpf:
    """Return the angle of the pendulum of 1 m at a time from rest."""
    k, quarter = mp.sin(amplitude / 2), mp.sqrt(g)
    phase = mp.ellipk(k**2) + quarter * t
    return -2 * mp.asin(k * mp.ellipfun("sn", phase - 2 * mp.ellipk(k**2), m=k**2))


def truth(t: float) -> list[mpf]:
    """Return the derivatives of the angle by amplitude and g, by differences of 60 digits."""
    with mp.workdps(60):
        at, step = [mpf("1.2"), mpf("9.81")], mpf(10) ** -18
        found = []
        for k in range(2):
            ends = [place(mpf(t), *(x + sign * step * (i == k) for i, x in enumerate(at))) for sign in (1, -1)]
            found.append((ends[0] - ends[1]) / (2 * step))
        return found


def by_variational_equation(t: float) -> list[float]:
    """Return the derivatives by DOP853 on the pendulum with its variational equations."""

    def flow(_: float, y: Any) -> list[float]:
        bend = G * cos(y[0])
        return [y[1], -G * sin(y[0]), y[3], -bend * y[2], y[5], -bend * y[4] - sin(y[0])]

    found = solve_ivp(flow, (0.0, t), [AMPLITUDE, 0, 1, 0, 0, 0], "DOP853", rtol=1e-13, atol=1e-13)
    return [float(found.y[2, -1]), float(found.y[4, -1])]


def by_differences(t: float) -> list[float]:
    """Return central differences of our places."""
    sides = [
        [circle.solve(AMPLITUDE + d, L=1, g=G).lam(t) - circle.solve(AMPLITUDE - d, L=1, g=G).lam(t) for d in (STEP,)],
        [circle.solve("6/5", L=1, g=G + d).lam(t) - circle.solve("6/5", L=1, g=G - d).lam(t) for d in (STEP,)],
    ]
    return [side[0] / (2 * STEP) for side in sides]


def late_states() -> list[Row]:
    """Return the rows of derivatives at times."""
    rows = []
    for t in (1.0, 1e3, 1e6):
        wanted = truth(t)
        scale = float(max(abs(x) for x in wanted))
        work, motion = f"dλ/dλ0 and dλ/dg of a pendulum after {t:g} s", circle.solve("6/5", L=1, g="9.81")

        def error(values: Any, wanted: Any = wanted, scale: float = scale) -> float:
            return apart(np.ravel(values), wanted, scale)

        def ours(t: float = t, motion: Any = motion) -> Any:
            return motion.sensitivity(t, WRT).lam

        rows.append(Row(work, "`motion.sensitivity`", ours, error, line=1e-13, unit="of scale"))
        rows.append(
            Row(work, "central differences of `motion.lam`", lambda t=t: by_differences(t), error, unit="of scale")
        )
        if t <= 1e3:
            who = "DOP853 on the variational equations, tolerance 1e-13"
            repeats = 5 if t < 10 else 1
            rows.append(Row(work, who, lambda t=t: by_variational_equation(t), error, repeats=repeats, unit="of scale"))
        rows += gradient_peers.after(work, t, error)
    return rows


def half_period() -> list[Row]:
    """Return the rows of the derivative of a half period by the amplitude."""
    with mp.workdps(60):
        k, a = mp.sin(mpf("0.6")), mpf("1.2")
        first, second = mp.ellipk(k**2), mp.ellipe(k**2)
        wanted = [mp.cos(a / 2) * (second / (k * (1 - k**2)) - first / k) / mp.sqrt(mpf("9.81"))]
    work = "dτ/dλ0 of a pendulum's half period"

    def error(values: Any) -> float:
        return apart([values], wanted, float(abs(wanted[0])))

    def differences() -> float:
        times = [circle.solve(AMPLITUDE + d, L=1, g=G).half_period for d in (STEP, -STEP)]
        return (times[0] - times[1]) / (2 * STEP)

    places = np.full(1000, AMPLITUDE)
    rows = [
        Row(
            work,
            "`solve(...).gradient`",
            lambda: circle.solve("6/5", L=1, g="9.81").gradient("half_period", "lam0")["lam0"],
            error,
            line=4.5e-16,
            unit="",
        ),
        Row(
            work,
            "`sweep(..., gradient=)`, per launch",
            lambda: circle.sweep("half_period", lam0=places, L=1, g=G, gradient="lam0").gradient[0, 0],
            error,
            each=1000,
        ),
        Row(work, "central differences of `half_period`", differences, error),
    ]
    if has("jax"):
        jax = importlib.import_module("jax")
        jax.config.update("jax_enable_x64", True)
        nodes = (np.arange(NODES) + 0.5) * np.pi / (2 * NODES)

        def rule(amplitude: Any) -> Any:
            """Legendre's form by the midpoint rule, whose limits do not move."""
            k2 = jax.numpy.sin(amplitude / 2) ** 2
            return jax.numpy.mean(1 / jax.numpy.sqrt(1 - k2 * np.sin(nodes) ** 2)) * np.pi / np.sqrt(G)

        slope = jax.jit(jax.jacfwd(rule))
        rows.append(Row(work, f"JAX's `jacfwd` of {NODES} nodes of Legendre's form", lambda: float(slope(1.2)), error))
    return [*rows, *gradient_peers.half_period(work, error)]


def through_legs() -> list[Row]:
    """Return the rows of the derivatives of Example 2's turning point by mu and v0."""
    wanted = [mpf("-1.370490175291658727794"), mpf("0.1812676943574192802416")]
    work = "dx*/dμ and dx*/dv0 of Example 2's turning point"

    def error(values: Any) -> float:
        return apart(values, wanted, 1.0)

    def ours() -> list[float]:
        found = cubic.solve(START, SPEED, t_max=1).gradient("turning_points", ("mu", "v0"))
        return [found["mu"][0], found["v0"][0]]

    def differences() -> list[float]:
        """Return central differences of our own turning points."""
        d, ends = STEP, []
        for moves in (({"mu": MU + d}, {"mu": MU - d}), ({"v0": SPEED + d}, {"v0": SPEED - d})):
            sides = [
                cubic.solve(**{"lam0": START, "v0": SPEED, "t_max": 1, **move}).turning_points[0] for move in moves
            ]
            ends.append((sides[0] - sides[1]) / (2 * d))
        return ends

    return [
        Row(work, "`solve(...).gradient`", ours, error, line=1e-13),
        Row(work, "central differences of `turning_points`", differences, error),
        *gradient_peers.through_legs(work, error),
    ]


def gradients() -> list[Row]:
    """Return all rows."""
    return [*half_period(), *late_states(), *through_legs()]
