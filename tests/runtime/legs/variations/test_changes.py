"""Derivatives of states agree with the variational equations in time, carried through turns and changes of contact."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from paths import ROOT
from scipy.integrate import solve_ivp
from selection import examples

from gqm_sym.loading import load

LAM, V = sp.symbols("lam V", real=True)
# The tolerances are the integrator's own errors; those of derivatives grow with the number of events.
RTOL, ATOL, TOLERANCE = 1e-13, 1e-15, 2e-11


@dataclass(frozen=True)
class Track:
    """Coordinates, and the acceleration along the track in addition to gravity and friction: ``resistance(V,
    kappa)``.
    """

    x: Any
    z: Any
    names: str
    ranges: dict[str, tuple[float, float]]
    resistance: Callable[..., Any] | None = None
    until: float = 2.5


def _track(x: str, z: str, names: str, ranges: dict[str, tuple[float, float]], **others: Any) -> Track:
    symbols = {name: sp.Symbol(name, positive=True) for name in names.split()}
    return Track(
        sp.sympify(x, {**symbols, "lam": LAM}), sp.sympify(z, {**symbols, "lam": LAM}), names, ranges, **others
    )


TRACKS = {
    "cubic_coulomb": _track(
        "lam", "lam**3", "mu g m", {"lam0": (-1.2, -0.8), "v0": (5.0, 7.0), "mu": (0.05, 0.2)}, until=1.2
    ),
    "circle_coulomb": _track(
        *("L*sin(lam)", "-L*cos(lam)", "L mu g m"),
        {"lam0": (0.2, 1.0), "v0": (6.0, 8.0), "L": (0.8, 1.2), "mu": (0.05, 0.1)},
    ),
    "ellipse_drag": _track(
        *("a*cos(lam)", "b*sin(lam)", "a b b_air g m"),
        {
            "lam0": (-1.5, -0.5),
            "v0": (0.5, 8.0),
            "a": (1.2, 1.6),
            "b": (0.7, 1.0),
            "b_air": (0.1, 0.4),
            "m": (1.0, 3.0),
        },
        resistance=lambda v, kappa, p: -p["b_air"] / p["m"] * v * sp.Abs(v),
    ),
    "circle_law": _track(
        *("L*sin(lam)", "-L*cos(lam)", "L c1 c2 g m"),
        {"lam0": (1.0, 2.0), "v0": (0.1, 2.0), "L": (0.8, 1.2), "c1": (0.05, 0.1), "c2": (0.01, 0.05)},
        resistance=lambda v, kappa, p: -sp.sign(v) * v**2 * (p["c1"] + p["c2"] * v**2),
    ),
    "parabola_law": _track(
        *("lam", "a*lam**2", "a r w1 g m"),
        {"lam0": (-1.2, -0.8), "v0": (0.1, 1.0), "a": (0.5, 0.8), "r": (0.3, 0.9), "w1": (1.0, 3.0)},
        resistance=lambda v, kappa, p: -sp.sign(v) * p["r"] / (1 + v**2 / p["w1"]),
        until=1.5,
    ),
    "parabola_droplet": _track(
        *("lam", "a*lam**2", "a gamma ell_c g m"),
        {"lam0": (-1.2, -0.8), "v0": (0.1, 1.0), "a": (0.4, 0.8), "gamma": (0.2, 0.5), "ell_c": (0.8, 1.2)},
        resistance=lambda v, kappa, p: -sp.sign(v) * p["gamma"] * p["ell_c"] ** 2 / p["m"] * kappa,
        until=1.5,
    ),
}


@cache
def equations(name: str) -> Any:
    """Return, for each pair of signs of V and N, the rates of lam, V and their derivatives; and the acceleration and
    N.
    """
    track = TRACKS[name]
    symbols = [sp.Symbol(n, positive=True) for n in track.names.split()]
    p = {s.name: s for s in symbols}
    slopes = sp.diff(track.x, LAM), sp.diff(track.z, LAM)
    ds = sp.sqrt(slopes[0] ** 2 + slopes[1] ** 2)
    kappa = (slopes[0] * sp.diff(slopes[1], LAM) - slopes[1] * sp.diff(slopes[0], LAM)) / ds**3
    load = kappa * V**2 + p["g"] * slopes[0] / ds
    found = {}
    for sense in (1, -1):
        for contact in (1, -1):
            rate = -p["g"] * slopes[1] / ds - sense * contact * p.get("mu", 0) * load
            if track.resistance:
                resistance = sp.sympify(track.resistance(V, kappa, p))
                rate += resistance.subs(sp.sign(V), sense).subs(sp.Abs(V), sense * V)
            right = sp.Matrix([V / ds, rate])
            forms = [*right, *right.jacobian([LAM, V]), *right.jacobian(symbols), load]
            found[sense, contact] = sp.lambdify([LAM, V, *symbols], forms, "numpy", cse=True)
    return found


def integrated(name: str, launch: dict[str, float], times: Any) -> Any:
    """Return the derivatives of lam and V at times: rows for parameters, lam0 and v0."""
    track, forms = TRACKS[name], equations(name)
    values = [launch[n] for n in track.names.split()]
    n = len(values)
    change = np.zeros((2, n + 2))
    change[0, n] = change[1, n + 1] = 1.0
    y = np.concatenate([[launch["lam0"], launch["v0"]], change.ravel()])
    sense, t = 1, 0.0
    contact = 1 if forms[1, 1](y[0], y[1], *values)[-1] > 0 else -1
    out = np.empty((2, n + 2, len(times)))
    while t < times[-1]:
        at = forms[sense, contact]

        def right(_: float, y: Any, at: Any = at) -> Any:
            found = np.array(at(y[0], y[1], *values), dtype=float)
            by_state, by_p = found[2:6].reshape(2, 2), found[6:-1].reshape(2, n)
            rows = by_state @ y[2:].reshape(2, n + 2)
            rows[:, :n] += by_p
            return np.concatenate([found[:2], rows.ravel()])

        def turn(_: float, y: Any) -> float:
            return float(y[1])

        def loses(_: float, y: Any, at: Any = at) -> float:
            return float(at(y[0], y[1], *values)[-1])

        turn.terminal = loses.terminal = True  # type: ignore[attr-defined]
        turn.direction, loses.direction = -sense, -contact  # type: ignore[attr-defined]
        events = [turn, loses] if "mu" in track.names.split() else [turn]
        found = solve_ivp(right, (t, times[-1]), y, "DOP853", rtol=RTOL, atol=ATOL, events=events, dense_output=True)
        here = (times >= t) & (times <= found.t[-1])
        if here.any():
            out[:, :, here] = found.sol(times[here])[2:].reshape(2, n + 2, -1)
        t, y = float(found.t[-1]), found.y[:, -1].copy()
        if found.status == 1 and found.t_events[0].size:
            before = at(y[0], 0.0, *values)[1]
            sense, y[1] = -sense, 0.0
            y[2:].reshape(2, n + 2)[1] *= forms[sense, contact](y[0], 0.0, *values)[1] / before
        elif found.status == 1:
            contact = -contact
    return out


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", TRACKS)
@examples(2)
@given(data=st.data())
def test_states_follow_the_variational_equations(name: str, data: Any) -> None:
    """Random launches on tracks with all kinds of losses follow the equations through turns and changes of contact."""
    track, module = TRACKS[name], load(str(ROOT / "generated" / f"{name}.py"), name)
    launch = {key: data.draw(st.floats(*ends)) for key, ends in track.ranges.items()}
    motion = module.solve(**launch)
    numbers = {"g": 9.81, "m": 1.0, **{k: float(v) for k, v in module.PARAMETERS.items()}, **launch}
    times = np.linspace(0.0, min(track.until, 0.999 * motion.t_end), 21)[1:]
    wanted = integrated(name, numbers, times)
    found = motion.sensitivity(times, (*track.names.split(), "lam0", "v0"))
    for rows, truth in zip((found.lam, found.v), wanted, strict=True):
        error = np.nan_to_num(np.abs(rows - truth).max(axis=1))
        assert (error <= TOLERANCE * np.maximum(np.abs(truth).max(axis=1), 1.0)).all(), (launch, error)
