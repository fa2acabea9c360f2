"""Half periods of the pendulum, one by one and in sweeps."""

from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
import peers
from measure import Row, on_one_core, ulps
from mpmath import mp, mpf
from numba import carray, cfunc, njit, types
from scipy import LowLevelCallable
from scipy.integrate import quad
from swing import half_period

import generated.pendulum as pendulum
from gqm_sym.runtime import surveying
from gqm_sym.runtime.jit import Inner

ORBITS = 100_000


def half_periods() -> list[Row]:
    """Half periods, one by one and in a sweep."""
    amplitudes = np.random.default_rng(1).uniform(0.05, 2.5, ORBITS)
    lam0 = amplitudes - pi / 2
    # The sweep is given doubles, so its amplitudes are what those mean.
    exact = [half_period(mpf(float(v)) + mp.pi / 2) for v in lam0[:300]]
    few = amplitudes[:100]
    truths = [half_period(float(a)) for a in few]

    alone = [half_period(mpf(float(v)) + mp.pi / 2) for v in few - pi / 2]
    survey = Inner(surveying.survey.__wrapped__)
    p = pendulum.MODEL.numbers(tuple(pendulum.PARAMETERS.values()))
    f = pendulum.MODEL.functions(p, pendulum.MODEL.launch(p, lam0=-0.37, v0=0.0))
    low, high, period, _, place, step = pendulum.MODEL.domain(p)
    known = (low, high, period, place, step)

    @njit
    def in_a_loop(fns: Any, p: Any, lam0: Any, known: Any) -> Any:
        out = np.empty(lam0.size)
        for k in range(lam0.size):
            out[k] = survey(fns, p, lam0[k], 0.0, 1, *known)[3]
        return out

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
            "the same, its turning points alone",
            ours,
            on_one_core(lambda: pendulum.sweep("turning_points", lam0).values),
            lambda values: ulps(values[:300, 0], [-mp.pi - mpf(float(v)) for v in lam0[:300]]),
            each=ORBITS,
            line=2.0,
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
            "one launch after the other in a compiled loop, turning points found",
            lambda: in_a_loop(f.addresses, f.p, few - pi / 2, known),
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
            "QUADPACK on the raw integrand, in Python, turning points given",
            lambda: [raw(a) for a in few],
            lambda values: ulps(values, truths),
            each=100,
            repeats=3,
            unit="ulp",
        ),
        *peers.half_periods(
            work, amplitudes, lambda values: ulps(values, [half_period(float(a)) for a in amplitudes[:100]])
        ),
    ]
