"""Rows of derivatives by installed peers: variational equations, automatic differentiation of solvers and of rules."""

import importlib
from collections.abc import Callable
from math import pi, sqrt
from typing import Any

import numpy as np
from measure import Row
from peers import has

AMPLITUDE, G = 1.2, 9.81

# Example 2: the place and speed of launch, and the coefficient of friction.
START, SPEED, MU = -1.0, 6.2088, 0.1

# diffrax takes two seconds to this time.
LATEST = 1e3

Error = Callable[[Any], float]


def after(work: str, t: float, error: Error) -> list[Row]:
    """Return the rows of the derivatives of a pendulum's place by its amplitude and g after a time."""
    repeats = 5 if t < 10 else 1
    rows = []
    if has("heyoka"):
        who = "heyoka's variational equations"
        rows.append(Row(work, who, _heyoka_pendulum(t), error, repeats=repeats, unit="of scale"))
    if has("diffrax") and t <= LATEST:
        who = "diffrax's Dopri8 in JAX's `jacfwd`, tolerance 1e-13"
        rows.append(Row(work, who, _diffrax_pendulum(t), error, repeats=repeats, unit="of scale"))
    return rows


def half_period(work: str, error: Error) -> list[Row]:
    """Return the row of the derivative of a pendulum's half period by its amplitude."""
    if not has("quadax"):
        return []
    jax, rule = _jax(), importlib.import_module("quadax").quadgk

    def pace(psi: Any, amplitude: Any) -> Any:
        return 2 / sqrt(G) / jax.numpy.sqrt(1 - jax.numpy.sin(amplitude / 2) ** 2 * jax.numpy.sin(psi) ** 2)

    limits = jax.numpy.array([0.0, pi / 2])
    slope = jax.jit(jax.jacfwd(lambda a: rule(pace, limits, args=(a,), epsabs=0.0, epsrel=1e-14)[0]))
    return [Row(work, "JAX's `jacfwd` of quadax's `quadgk` on Legendre's form", lambda: float(slope(AMPLITUDE)), error)]


def through_legs(work: str, error: Error) -> list[Row]:
    """Return the rows of the derivatives of Example 2's turning point by mu and v0."""
    rows = []
    if has("heyoka"):
        rows.append(Row(work, "heyoka's variational equations with events", _heyoka_example(), error, repeats=5))
    if has("diffrax"):
        who = "diffrax's Dopri8 with an event in JAX's `jacfwd`, tolerance 1e-13"
        rows.append(Row(work, who, _diffrax_example(), error, repeats=3))
    return rows


def _heyoka_pendulum(t: float) -> Callable[[], list[float]]:
    hy = importlib.import_module("heyoka")
    u, w = hy.make_vars("u", "w")
    equations = [(u, w), (w, -hy.par[0] * hy.sin(u))]
    body = hy.taylor_adaptive(
        hy.var_ode_sys(equations, [u, hy.par[0]], order=1), state=[AMPLITUDE, 0.0], pars=[G], tol=np.finfo(float).eps
    )
    start = body.state.copy()

    def integrated() -> list[float]:
        body.time, body.state[:] = 0.0, start
        body.propagate_until(t)
        return [float(body.state[2]), float(body.state[3])]

    return integrated


def _heyoka_example() -> Callable[[], list[float]]:
    """The derivative of the place at the turn is that of the turning point, for there the speed is zero."""
    hy = importlib.import_module("heyoka")
    x, v = hy.make_vars("x", "v")
    ds = hy.sqrt(1.0 + 9.0 * x**4)
    load = G / ds + 6.0 * x / ds**3 * v**2
    friction, sign = hy.par[0], hy.par[1]

    def turned_over(body: Any, _: int) -> bool:
        body.pars[1] = -body.pars[1]
        return True

    body = hy.taylor_adaptive(
        hy.var_ode_sys([(x, v / ds), (v, -G * 3.0 * x**2 / ds - friction * sign * load)], [friction, v], order=1),
        state=[START, SPEED],
        pars=[MU, -1.0],
        tol=np.finfo(float).eps,
        t_events=[hy.t_event(load, callback=turned_over), hy.t_event(v)],
    )
    start = body.state.copy()

    def integrated() -> list[float]:
        body.time, body.state[:], body.pars[1] = 0.0, start, -1.0
        body.reset_cooldowns()
        body.propagate_until(5.0)
        return [float(body.state[2]), float(body.state[3])]

    return integrated


def _jax() -> Any:
    jax = importlib.import_module("jax")
    jax.config.update("jax_enable_x64", True)
    return jax


def _solved(flow: Callable[..., Any], t: float, start: Any, args: Any, **options: Any) -> Any:
    """Return the last state of diffrax's solution."""
    diffrax = importlib.import_module("diffrax")
    steps = diffrax.PIDController(rtol=1e-13, atol=1e-13)
    found = diffrax.diffeqsolve(
        diffrax.ODETerm(flow),
        diffrax.Dopri8(),
        0.0,
        t,
        1e-3,
        start,
        args,
        stepsize_controller=steps,
        adjoint=diffrax.ForwardMode(),
        max_steps=10**6,
        **options,
    )
    return found.ys[-1]


def _diffrax_pendulum(t: float) -> Callable[[], list[float]]:
    jax = _jax()
    jnp = jax.numpy

    def place(given: Any) -> Any:
        def flow(_: Any, y: Any, g: Any) -> Any:
            return jnp.array([y[1], -g * jnp.sin(y[0])])

        return _solved(flow, t, jnp.array([given[0], 0.0]), given[1])[0]

    slope = jax.jit(jax.jacfwd(place))
    return lambda: np.asarray(slope(jnp.array([AMPLITUDE, G]))).tolist()


def _diffrax_example() -> Callable[[], list[float]]:
    jax, diffrax, optimistix = _jax(), importlib.import_module("diffrax"), importlib.import_module("optimistix")
    jnp = jax.numpy

    def place(given: Any) -> Any:
        def flow(_: Any, y: Any, mu: Any) -> Any:
            ds = jnp.sqrt(1.0 + 9.0 * y[0] ** 4)
            load = G / ds + 6.0 * y[0] / ds**3 * y[1] ** 2
            return jnp.array([y[1] / ds, -G * 3.0 * y[0] ** 2 / ds - mu * jnp.abs(load)])

        turn = diffrax.Event(lambda t, y, args, **_: y[1], optimistix.Newton(1e-13, 1e-13))
        return _solved(flow, 5.0, jnp.array([START, given[1]]), given[0], event=turn)[0]

    slope = jax.jit(jax.jacfwd(place))
    return lambda: np.asarray(slope(jnp.array([MU, SPEED]))).tolist()
