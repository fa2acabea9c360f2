"""Half periods of the pendulum, one by one and in sweeps."""

import math
from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
import peers
from measure import Row, on_one_core, ulps
from mpmath import mp, mpf
from numba import carray, cfunc, njit, types
from scipy import LowLevelCallable
from scipy.integrate import quad
from swing import G, half_period

import generated.circle as circle
import generated.ellipse as ellipse
import generated.pendulum as pendulum
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.types import ADDRESSES, VECTOR
from gqm_sym.runtime.launch import survey
from gqm_sym.runtime.launch.domain import DOMAIN
from gqm_sym.runtime.launch.problem import bind
from gqm_sym.runtime.launch.request import LaunchRequest, read_launch

ORBITS = 100_000


survey_inside = Inner(survey.survey.__wrapped__)


@njit(VECTOR(ADDRESSES, VECTOR, VECTOR, DOMAIN), error_model="numpy")
def in_a_loop(fns, p, lam0, domain):  # type: ignore[no-untyped-def]
    """Return half periods of launches from rest, one after the other."""
    out = np.empty(lam0.size)
    for k in range(lam0.size):
        out[k] = survey_inside(fns, p, lam0[k], 0.0, 1, domain, True)[3]
    return out


def half_periods() -> list[Row]:
    """Measure half periods, one by one and in a sweep."""
    amplitudes = np.random.default_rng(1).uniform(0.05, 2.5, ORBITS)
    lam0 = amplitudes - pi / 2
    # The sweep is given doubles, so its amplitudes are what those mean.
    exact = [half_period(mpf(float(v)) + mp.pi / 2) for v in lam0[:300]]
    few = amplitudes[:100]
    truths = [half_period(float(a)) for a in few]

    alone = [half_period(mpf(float(v)) + mp.pi / 2) for v in few - pi / 2]
    p = pendulum.MODEL.numbers(tuple(pendulum.PARAMETERS.values()))
    f = bind(pendulum.MODEL, p, read_launch(pendulum.MODEL, p, LaunchRequest(-0.37)))
    domain = pendulum.MODEL.domain(p).numbers

    def raw(a: float) -> float:
        return quad(lambda u: 1 / sqrt(2 * 9.81 * (cos(u) - cos(a))), -a, a, epsabs=0, epsrel=1e-12, limit=500)[0]

    def regular(phi: float, a: float) -> float:
        s, c = sin(phi / 2), cos(phi / 2)
        da, db = 2 * a * s * s, 2 * a * c * c
        return sqrt(da * db / (4 * 9.81 * sin(da / 2) * sin(db / 2))) if da * db > 0 else sqrt(a / (9.81 * sin(a)))

    inner = njit(regular)

    @cfunc(types.float64(types.intc, types.CPointer(types.float64)))
    def compiled(n: int, values: Any) -> float:
        both = carray(values, 2)
        return inner(both[0], both[1])

    native = LowLevelCallable(compiled.ctypes)

    def by_quad(integrand: Any, a: float) -> float:
        return quad(integrand, 0, pi, args=(a,), epsabs=0, epsrel=1.2e-14)[0]

    work = "half period of an orbit"
    ours = "`sweep`, one core, turning points found"

    return [
        Row(
            work,
            ours,
            on_one_core(lambda: pendulum.sweep("half_period", lam0).values),
            lambda values: ulps(values, exact),
            each=ORBITS,
            line=6.0,
            unit="ulp",
        ),
        Row(
            "turning points of an orbit",
            ours,
            on_one_core(lambda: pendulum.sweep("turning_points", lam0).values),
            lambda values: ulps(values[:300, 0], [-mp.pi - mpf(float(v)) for v in lam0[:300]]),
            each=ORBITS,
            line=2.0,
            unit="ulp",
        ),
        Row(
            "largest contact force on an orbit",
            ours,
            on_one_core(lambda: pendulum.sweep("normal_force_max", lam0).values),
            lambda values: ulps(values, [mpf(G) * (3 - 2 * mp.cos(mpf(float(v)) + mp.pi / 2)) for v in lam0[:300]]),
            each=ORBITS,
            line=4.0,
            unit="ulp",
        ),
        Row(
            "first time at the lowest point",
            ours,
            on_one_core(lambda: pendulum.sweep("time_at", lam0, lam=-pi / 2).values),
            lambda values: ulps(values, [half / 2 for half in exact]),
            each=ORBITS,
            line=6.0,
            unit="ulp",
        ),
        Row(
            work,
            "`sweep`, all cores, turning points found",
            lambda: pendulum.sweep("half_period", lam0).values,
            lambda values: ulps(values, exact),
            each=ORBITS,
            line=6.0,
            unit="ulp",
        ),
        Row(
            work,
            "a compiled loop over single launches, turning points found",
            lambda: in_a_loop(f.addresses, f.p, few - pi / 2, domain),
            lambda values: ulps(values, alone),
            each=100,
            line=6.0,
            unit="ulp",
        ),
        Row(
            work,
            "`sweep` of one launch, from Python",
            lambda: [pendulum.sweep("half_period", float(v)).values for v in lam0[:100]],
            lambda values: ulps(values, exact),
            each=100,
            line=6.0,
            unit="ulp",
        ),
        Row(
            work,
            "QUADPACK on our integrand, compiled, turning points given",
            lambda: [by_quad(native, a) for a in few],
            lambda values: ulps(values, truths),
            each=100,
            unit="ulp",
        ),
        Row(
            work,
            "QUADPACK on our integrand, in Python, turning points given",
            lambda: [by_quad(regular, a) for a in few],
            lambda values: ulps(values, truths),
            each=100,
            repeats=3,
            unit="ulp",
        ),
        Row(
            work,
            "QUADPACK on the singular integrand, in Python, turning points given",
            lambda: [raw(a) for a in few],
            lambda values: ulps(values, truths),
            each=100,
            repeats=3,
            unit="ulp",
        ),
        *peers.half_periods(
            work, amplitudes, lambda values: ulps(values, [half_period(float(a)) for a in amplitudes[:100]])
        ),
        *launched(amplitudes, ours),
        *on_an_ellipse(ours),
    ]


def launched(amplitudes: Any, ours: str) -> list[Row]:
    """Measure the same orbits launched from anywhere on them, with the speed there; the reference is that of
    doubles.
    """
    lam0 = amplitudes * np.random.default_rng(2).uniform(-1.0, 1.0, ORBITS)
    v0 = np.sqrt(2 * 9.81 * (np.cos(lam0) - np.cos(amplitudes)))

    def truth(place: float, speed: float) -> mpf:
        square = mp.sin(mpf(place) / 2) ** 2 + mpf(speed) ** 2 / (4 * G)
        return half_period(2 * mp.asin(mp.sqrt(square)))

    truths = [truth(float(a), float(v)) for a, v in zip(lam0[:300], v0[:300], strict=True)]
    return [
        Row(
            "half period of an orbit, launched with speed",
            ours,
            on_one_core(lambda: circle.sweep("half_period", lam0, v0, L=1).values),
            lambda values: ulps(values, truths),
            each=ORBITS,
            line=10.0,
            unit="ulp",
        )
    ]


def on_an_ellipse(ours: str) -> list[Row]:
    """Measure half periods on an ellipse twice as wide as it is high, of orbits that need up to 32 nodes between
    turns.
    """
    a, b = 2.0, 1.0
    amplitudes = np.random.default_rng(3).uniform(0.05, 1.2, ORBITS)

    def pace(phi: Any, half: Any, of: Any, g: Any) -> Any:
        da, db = 2 * half * of.sin(phi / 2) ** 2, 2 * half * of.cos(phi / 2) ** 2
        ds = of.sqrt((a * of.cos(half - da)) ** 2 + (b * of.sin(half - da)) ** 2)
        if not da * db > 0:
            return ds * of.sqrt(half / (g * b * of.sin(half)))
        return ds * of.sqrt(da * db / (4 * g * b * of.sin(da / 2) * of.sin(db / 2)))

    lam0 = amplitudes - pi / 2
    few = [mpf(float(v)) + mp.pi / 2 for v in lam0[:20]]
    truths = [2 * mp.quad(lambda phi, h=half: pace(phi, h, mp, G), [0, mp.pi / 4, mp.pi / 2]) for half in few]
    return [
        Row(
            "half period of an orbit on an ellipse",
            ours,
            on_one_core(lambda: ellipse.sweep("half_period", lam0, a=a, b=b).values),
            lambda values: ulps(values, truths),
            each=ORBITS,
            line=6.0,
            unit="ulp",
        ),
        Row(
            "half period of an orbit on an ellipse",
            "QUADPACK on our integrand, in Python, turning points given",
            lambda: [
                quad(pace, 0, pi, args=(h, math, 9.81), epsabs=0, epsrel=1.2e-14, limit=200)[0] for h in amplitudes[:20]
            ],
            lambda values: ulps(values, truths),
            each=20,
            repeats=3,
            unit="ulp",
        ),
    ]
