"""Rows for programs that cannot be installed on every machine; the page says which are absent."""

import importlib
import importlib.util
from collections.abc import Callable
from math import copysign, cos, pi, sin, sqrt
from typing import Any

import numpy as np
from measure import Row, repeated
from numpy.typing import NDArray

PEERS = ("heyoka", "quadax", "jax", "diffrax")
# Intervals of the trapezoidal rule in heyoka's compiled function: as many as the widest swing needs.
NODES = 32
# quadax takes 0.1 ms an orbit.
FEW = 200

Error = Callable[[Any], float]
Amplitudes = NDArray[np.float64]


def heyoka_half_periods(work: str, amplitudes: Amplitudes, error: Error) -> list[Row]:
    """Return rows for its compiled function of our formula and its integrator on Legendre's form, both in batches."""
    hy = importlib.import_module("heyoka")
    a, tau = hy.make_vars("a"), hy.make_vars("tau")
    terms = [1 / hy.sqrt(hy.sin(a) / a)]
    for k in range(1, NODES):
        left, right = a * sin(pi * k / (2 * NODES)) ** 2, a * cos(pi * k / (2 * NODES)) ** 2
        terms.append(hy.sqrt(left * right / (hy.sin(left) * hy.sin(right))))
    compiled = hy.cfunc([hy.sum(terms) * (pi / NODES / sqrt(9.81))], vars=[a])
    lanes = hy.recommended_simd_size()
    pace = 2 / sqrt(9.81) / hy.sqrt(1 - hy.par[0] * hy.sin(hy.time) ** 2)
    ode = hy.taylor_adaptive_batch(
        [(tau, pace)], state=np.zeros((1, lanes)), pars=np.zeros((1, lanes)), tol=np.finfo(float).eps
    )
    rows = amplitudes.reshape(1, -1)
    batches = amplitudes[: amplitudes.size // lanes * lanes].reshape(-1, lanes)

    def integrated() -> Any:
        out = np.empty_like(batches)
        for k, batch in enumerate(batches):
            ode.set_time(np.zeros(lanes))
            ode.state[:], ode.pars[:] = 0.0, np.sin(batch / 2) ** 2
            ode.propagate_until(np.full(lanes, pi / 2))
            out[k] = ode.state[0]
        return out.reshape(-1)

    def row(who: str, call: Callable[[], Any], each: int) -> Row:
        return Row(work, who, call, error, each=each, repeats=5, unit="ulp")

    return [
        row(
            f"heyoka's compiled function of our formula, {NODES} intervals, turning points given",
            lambda: compiled(rows)[0],
            amplitudes.size,
        ),
        row("heyoka's integrator on Legendre's form, turning points given", integrated, batches.size),
    ]


def quadax_half_periods(work: str, amplitudes: Amplitudes, error: Error) -> list[Row]:
    """Return the row for its Gauss-Kronrod rule on Legendre's form, mapped over orbits and compiled by JAX."""
    jax = importlib.import_module("jax")
    jax.config.update("jax_enable_x64", True)
    jnp, rule = importlib.import_module("jax.numpy"), importlib.import_module("quadax").quadgk

    def pace(psi: Any, k2: Any) -> Any:
        return 2 / sqrt(9.81) / jnp.sqrt(1 - k2 * jnp.sin(psi) ** 2)

    many = jax.jit(jax.vmap(lambda k2: rule(pace, jnp.array([0.0, pi / 2]), args=(k2,), epsabs=0.0, epsrel=1e-14)[0]))
    k2 = jnp.array(np.sin(amplitudes[:FEW] / 2) ** 2)
    who = "quadax's `quadgk` on Legendre's form, turning points given"
    return [Row(work, who, lambda: np.asarray(many(k2)), error, each=FEW, repeats=3, unit="ulp")]


def half_periods(work: str, amplitudes: Amplitudes, error: Error) -> list[Row]:
    """Return the rows of the installed peers."""
    rows = heyoka_half_periods(work, amplitudes, error) if has("heyoka") else []
    return rows + (quadax_half_periods(work, amplitudes, error) if has("quadax") else [])


def swing(lam0: float) -> Any:
    """Return heyoka's integrator of the pendulum, whose angle is measured from the horizontal."""
    hy = importlib.import_module("heyoka")
    u, w = hy.make_vars("u", "w")
    return hy.taylor_adaptive([(u, w), (w, -9.81 * hy.cos(u))], state=[lam0, 0.0], tol=np.finfo(float).eps)


def sampling(work: str, lam0: float, t: Any, error: Error) -> list[Row]:
    """Return the row for heyoka's continuous output at random times, without the integration."""
    if not has("heyoka"):
        return []
    out = swing(lam0).propagate_until(float(t.max()), c_output=True)[4]
    who = "heyoka's continuous output (without the integration)"
    return [Row(work, who, lambda: out(t)[:, 0].copy(), error, each=t.size, repeats=5, unit="of scale")]


def far(work: str, lam0: float, t: float, error: Error) -> list[Row]:
    """Return the row for a late state by heyoka, step by step."""
    if not has("heyoka"):
        return []
    body = swing(lam0)

    def integrated() -> list[float]:
        body.time, body.state[:] = 0.0, (lam0, 0.0)
        body.propagate_until(t)
        return [body.state[0]]

    return [Row(work, "heyoka's integrator", integrated, error, repeats=1, unit="of scale")]


def example2(work: str, error: Error) -> list[Row]:
    """Return the row for heyoka's integrator with events at contact changes and turning points."""
    if not has("heyoka"):
        return []
    hy = importlib.import_module("heyoka")
    x, v = hy.make_vars("x", "v")
    ds = hy.sqrt(1.0 + 9.0 * x**4)
    load = 9.81 / ds + 6.0 * x / ds**3 * v**2

    def turned_over(body: Any, _: int) -> bool:
        body.pars[0] = -body.pars[0]
        return True

    body = hy.taylor_adaptive(
        [(x, v / ds), (v, -9.81 * 3.0 * x**2 / ds - 0.1 * hy.par[0] * load)],
        state=[-1.0, 6.2088],
        pars=[-1.0],
        tol=np.finfo(float).eps,
        t_events=[hy.t_event(load, callback=turned_over), hy.t_event(v)],
    )
    sign = copysign(1.0, 9.81 / sqrt(10.0) - 6.0 / 10.0**1.5 * 6.2088**2)

    def integrated() -> tuple[float, float]:
        body.time, body.state[:], body.pars[0] = 0.0, (-1.0, 6.2088), sign
        body.reset_cooldowns()
        body.propagate_until(5.0)
        return body.time, body.state[0]

    return [
        Row(
            work,
            "heyoka's integrator with events (without compilation)",
            repeated(integrated, 20),
            error,
            each=20,
            unit="s and m",
        )
    ]


def has(peer: str) -> bool:
    """Return whether a peer is installed."""
    return importlib.util.find_spec(peer) is not None


def presence(peer: str) -> str:
    """Say whether a peer is installed."""
    try:
        module = importlib.import_module(peer)
    except ImportError:
        return "not installed here, not compared (`pip install gqm_sym[peers]`)"
    return f"installed ({getattr(module, '__version__', 'version unknown')})"
