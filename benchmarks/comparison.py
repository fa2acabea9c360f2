"""Side by side: this package and its alternatives, accuracy beside time, in one process; run by ``make bench``.

All errors are against closed forms in 40 digits. A row of ours fails the run when its accuracy misses its line; times
never do. Writes ``docs/benchmarks.md``.
"""

import argparse
import platform
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp
from measure import Result, Row, Work, apart, measured, readable, ulps
from mpmath import mp, mpf
from numba import carray, cfunc, njit, types
from peers import PEERS, presence, rows_of_peers
from scipy import LowLevelCallable
from scipy.integrate import IntegrationWarning, quad, solve_ivp
from scipy.interpolate import CubicSpline
from scipy.special import ellipj
from stages import second_process

import generated.pendulum as pendulum
from gqm_sym.runtime import threads

PAGE = Path(__file__).parent.parent / "docs" / "benchmarks.md"
ORBITS, TIMES, PLACES = 100_000, 1_000_000, 1_000_000
mp.dps = 40
G = mpf("9.81")
TOP = 1.2  # amplitude of the swing that is sampled
FAR = 1e6


def half_period(amplitude: float) -> mpf:
    """Half period of the pendulum of length 1, in closed form."""
    return 2 * mp.ellipk(mp.sin(mpf(amplitude) / 2) ** 2) / mp.sqrt(G)


def place(amplitude: float, t: float) -> mpf:
    """Angle from the horizontal, released from rest on the right."""
    k = mp.sin(mpf(amplitude) / 2)
    return 2 * mp.asin(k * mp.ellipfun("cd", mp.sqrt(G) * mpf(t), m=k * k)) - mp.pi / 2


@contextmanager
def one_core() -> Iterator[None]:
    """Keep compiled loops on one core."""
    kept = threads.cores
    threads.cores = lambda: 1
    try:
        yield
    finally:
        threads.cores = kept


def half_periods() -> list[Row]:
    """Half periods, one by one and in a sweep."""
    amplitudes = np.random.default_rng(1).uniform(0.05, 2.5, ORBITS)
    lam0 = amplitudes - pi / 2
    # The sweep is given doubles, so its amplitudes are what those mean.
    exact = [half_period(mpf(float(v)) + mp.pi / 2) for v in lam0[:300]]
    few = amplitudes[:100]
    truths = [half_period(float(a)) for a in few]

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

    def on_one_core(call: Work) -> Work:
        def limited() -> Any:
            with one_core():
                return call()

        return limited

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
        *rows_of_peers(
            work, amplitudes, lambda values: ulps(values, [half_period(float(a)) for a in amplitudes[:100]])
        ),
    ]


def sampling() -> list[Row]:
    """Places at many random times, and at one late one."""
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

    work, once = f"λ(t) at {TIMES:,} random times in 100 s, each", "the state at 10⁶ s"
    return [
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
            "DOP853's dense output (integration apart)",
            lambda: dense(t[:100_000])[0],
            error,
            each=100_000,
            repeats=3,
            unit="of scale",
        ),
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
        Row(
            "one orbit from Python, λ at one time",
            "`solve`, turning points, quadrature, table and series",
            lambda: [pendulum.solve(lam0).lam(0.7) for _ in range(20)],
            lambda values: apart(values, [place(top, 0.7)], scale),
            each=20,
            line=5e-16,
            unit="of scale",
        ),
    ]


def load_maps() -> list[Row]:
    """Pass 1 over many places."""
    lam = np.linspace(-3.0, 0.0, PLACES)
    lam0, v0 = 0.0, 8.0
    truths = [64 - 2 * G * mp.sin(mpf(float(v))) for v in lam[::5000]]

    def error(values: Any) -> float:
        return apart(np.asarray(values[4])[::5000], truths, 64.0)

    u, start, speed, el, g, m = sp.symbols("u start speed L g m", positive=True)
    v2 = speed**2 + 2 * g * el * (sp.sin(start) - sp.sin(u))
    forms = (el * sp.cos(u), el * sp.sin(u), el, 1 / el, v2, m * (v2 / el - g * sp.sin(u)))
    printed = sp.lambdify((u, start, speed, el, g, m), forms, "numpy", cse=True)

    @njit(error_model="numpy")
    def by_hand(lam: Any, lam0: float, v0: float, el: float, g: float, m: float) -> Any:
        out = np.empty((6, lam.size))
        for i in range(lam.size):
            s = sin(lam[i])
            v2 = v0 * v0 + 2 * g * el * (sin(lam0) - s)
            out[0, i], out[1, i], out[2, i], out[3, i] = el * cos(lam[i]), el * s, el, 1 / el
            out[4, i], out[5, i] = v2, m * (v2 / el - g * s)
        return out

    work = f"load map at {PLACES:,} places, each"
    return [
        Row(
            work,
            "`pass1`, all cores, no heights subtracted",
            lambda: pendulum.pass1(lam, lam0, v0),
            error,
            each=PLACES,
            line=5e-16,
            unit="of scale",
        ),
        Row(
            work,
            "a numba loop by hand, one core",
            lambda: by_hand(lam, lam0, v0, 1.0, 9.81, 1.0),
            error,
            each=PLACES,
            unit="of scale",
        ),
        Row(
            work,
            "`lambdify(..., cse=True)` to NumPy",
            lambda: printed(lam, lam0, v0, 1.0, 9.81, 1.0),
            error,
            each=PLACES,
            repeats=5,
            unit="of scale",
        ),
    ]


def page(results: list[Result], start: tuple[float, float]) -> str:
    """Write the results as a page of Markdown."""
    lines = [
        "# Benchmarks",
        "",
        "Made by `make bench`; errors are the worst of some hundred, against closed forms in 40 digits. Times are",
        f"medians on {platform.machine()}, Python {platform.python_version()}; compare them with each other.",
        "",
        "| work | by | time | error | against ours |",
        "|---|---|---|---|---|",
    ]
    ours: dict[str, float] = {}
    for result in results:
        row = result.row
        ratio = result.seconds / ours.setdefault(row.work, result.seconds)
        wrong = f"{result.error:.2g} {row.unit}" + (f" **misses {row.line:g}**" if result.missed else "")
        lines.append(f"| {row.work} | {row.who} | {readable(result.seconds)} | {wrong} | {ratio:.3g} |")
    lines += ["", f"Start, in a second process: `import numba` {start[0]:.2f} s, from there to a solved pendulum"]
    lines += [f"{start[1]:.2f} s.", ""]
    lines += [f"- {peer}: {presence(peer)}" for peer in PEERS]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Measure all rows, write the page, and fail if an accuracy of ours misses its line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=PAGE)
    output = parser.parse_args().output
    warnings.simplefilter("ignore", IntegrationWarning)  # what QUADPACK doubts, the errors show
    results = []
    for row in [*half_periods(), *sampling(), *load_maps()]:
        results.append(measured(row))
        print(f"{row.work:<45} {row.who:<60} {readable(results[-1].seconds):>9} {results[-1].error:9.2g}", flush=True)
    output.write_text(page(results, second_process()), encoding="utf-8")
    missed = [result.row for result in results if result.missed]
    for row in missed:
        print(f"{row.work}, {row.who}: the error misses its line, {row.line:g} {row.unit}", file=sys.stderr)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
