"""Rows of other programs that not every machine can install; the page says which are absent."""

import importlib
from collections.abc import Callable
from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
from measure import Row
from numpy.typing import NDArray

PEERS = ("heyoka", "quadax", "numbalsoda")
# Intervals of the trapezoidal rule in heyoka's compiled function: as many as the widest swing needs.
NODES = 32
# quadax takes 0.1 ms an orbit.
FEW = 200

Error = Callable[[Any], float]
Amplitudes = NDArray[np.float64]


def heyoka(work: str, amplitudes: Amplitudes, error: Error) -> list[Row]:
    """Give its compiled function of our formula, and its integrator on Legendre's form, both in batches."""
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


def quadax(work: str, amplitudes: Amplitudes, error: Error) -> list[Row]:
    """Give its Gauss-Kronrod rule on Legendre's form, mapped over orbits and compiled by JAX."""
    jax = importlib.import_module("jax")
    jax.config.update("jax_enable_x64", True)
    jnp, rule = importlib.import_module("jax.numpy"), importlib.import_module("quadax").quadgk

    def pace(psi: Any, k2: Any) -> Any:
        return 2 / sqrt(9.81) / jnp.sqrt(1 - k2 * jnp.sin(psi) ** 2)

    many = jax.jit(jax.vmap(lambda k2: rule(pace, jnp.array([0.0, pi / 2]), args=(k2,), epsabs=0.0, epsrel=1e-14)[0]))
    k2 = jnp.array(np.sin(amplitudes[:FEW] / 2) ** 2)
    who = "quadax's `quadgk` on Legendre's form, turning points given"
    return [Row(work, who, lambda: np.asarray(many(k2)), error, each=FEW, repeats=3, unit="ulp")]


def rows_of_peers(work: str, amplitudes: Amplitudes, error: Error) -> list[Row]:
    """Give the rows of the peers that are installed."""
    out = []
    for peer in (heyoka, quadax):
        try:
            out += peer(work, amplitudes, error)
        except ImportError:
            continue
    return out


def presence(peer: str) -> str:
    """Say whether a peer is installed."""
    try:
        module = importlib.import_module(peer)
    except ImportError:
        return "not installed here, not compared (`pip install gqm_sym[peers]`)"
    return f"installed ({getattr(module, '__version__', 'version unknown')})"
