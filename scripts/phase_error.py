"""Draw how the phase error grows over a billion periods of the paper's Example 1: ``docs/figures/phase_error.svg``.

``python scripts/phase_error.py`` (half a minute; needs the ``docs`` extra). Measured against Jacobi's elliptic
functions at 50 digits, for this package and for the tiling of one period by a double. The integrators are measured as
far as some seconds carry them, and beyond along the power of N of their last two decades; such points are hollow.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from mpmath import mp, mpf
from numba import njit

import gqm_sym as gqm

mpl.use("svg")
from matplotlib import pyplot as plt

ROOT = Path(__file__).parent.parent
FIGURE = ROOT / "docs" / "figures" / "phase_error.svg"

mp.dps = 50
G, AMPLITUDE = mpf("9.81"), mpf(6) / 5
K2 = mp.sin(AMPLITUDE / 2) ** 2
PERIOD = 4 * mp.ellipk(K2) / mp.sqrt(G)

COUNTS = (1, 10**3, 10**6, 10**9)  # periods shown in the table
PHASES = [mpf(2 * k + 1) / 16 for k in range(8)]  # of a period, looked at after N of them
LOST = 0.5  # a phase error of half a period cannot be told from any other

Step = Callable[[float, float, float], tuple[float, float]]
Point = tuple[int, float, bool]  # periods, phase error in periods, whether it was measured


@dataclass(frozen=True)
class Method:
    """An integrator: its step, the length of one in seconds, and how many periods some seconds carry it.

    No whole number of steps makes a period: with one, rounding would repeat itself and show no drift.
    """

    name: str
    step: Step
    h: float
    farthest: int


@njit
def runge_kutta(angle, rate, h):  # type: ignore[no-untyped-def]
    """Take one classical fourth-order step."""
    r1, a1 = rate, -9.81 * math.sin(angle)
    r2, a2 = rate + h / 2 * a1, -9.81 * math.sin(angle + h / 2 * r1)
    r3, a3 = rate + h / 2 * a2, -9.81 * math.sin(angle + h / 2 * r2)
    r4, a4 = rate + h * a3, -9.81 * math.sin(angle + h * r3)
    return angle + h / 6 * (r1 + 2 * r2 + 2 * r3 + r4), rate + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


@njit
def verlet(angle, rate, h):  # type: ignore[no-untyped-def]
    """Take one step of Störmer and Verlet in its velocity form."""
    half = rate - h / 2 * 9.81 * math.sin(angle)
    angle += h * half
    return angle, half - h / 2 * 9.81 * math.sin(angle)


ORDER = 24


@njit
def taylor(angle, rate, h):  # type: ignore[no-untyped-def]
    """Take one step of the Taylor series, its coefficients by the recurrences of sine and cosine."""
    q, v = np.zeros(ORDER + 2), np.zeros(ORDER + 1)
    s, c = np.zeros(ORDER + 1), np.zeros(ORDER + 1)
    q[0], v[0], s[0], c[0] = angle, rate, math.sin(angle), math.cos(angle)
    q[1], v[1] = v[0], -9.81 * s[0]
    for k in range(1, ORDER):
        for j in range(1, k + 1):
            s[k] += j * q[j] * c[k - j] / k
            c[k] -= j * q[j] * s[k - j] / k
        q[k + 1], v[k + 1] = v[k] / (k + 1), -9.81 * s[k] / (k + 1)
    angle, rate = q[ORDER], v[ORDER]
    for k in range(ORDER - 1, -1, -1):
        angle, rate = q[k] + h * angle, v[k] + h * rate
    return angle, rate


@njit
def follow(step, angle, rate, h, count):  # type: ignore[no-untyped-def]
    """Take many steps."""
    for _ in range(count):
        angle, rate = step(angle, rate, h)
    return angle, rate


METHODS = (
    Method("Störmer-Verlet, steps of 2 ms", verlet, 0.002, 10**5),
    Method("RK4, steps of 2 ms", runge_kutta, 0.002, 10**5),
    Method("Taylor series of order 24, steps of 0.1 s", taylor, 0.1, 10**5),
)


def integrated(method: Method) -> list[Point]:
    """Phase errors of an integrator a quarter period after N of them, where the body passes the lowest point."""
    fastest = 2 * math.sqrt(9.81) * math.sin(0.6)
    state, done, n = (1.2, 0.0), 0, 1
    points: list[Point] = []
    while n <= method.farthest:
        t = (n + mpf(1) / 4) * PERIOD
        steps = int(t / mpf(method.h))
        state = follow(method.step, *state, method.h, steps - done)
        angle, _ = method.step(*state, float(t - steps * mpf(method.h)))
        points.append((n, min(abs(angle) / fastest / float(PERIOD), LOST), True))
        done, n = steps, 10 * n
    # Over two decades: rounding grows by chance, not by rule.
    (n0, e0, _), _, (n1, e1, _) = points[-3:]
    power = math.log(e1 / e0) / math.log(n1 / n0)
    for k in range(1, 1 + round(math.log10(COUNTS[-1] / n1))):
        points.append((n1 * 10**k, min(e1 * 10 ** (k * power), LOST), False))
    return points


def truth(phase: mpf) -> tuple[mpf, mpf]:
    """Return the angle from the vertical and its rate, at a phase of the period after release."""
    u, k = mp.sqrt(G) * phase * PERIOD, mp.sqrt(K2)
    sn, cn, dn = (mp.ellipfun(name, u, m=K2) for name in ("sn", "cn", "dn"))
    half = mp.asin(k * cn / dn)
    return 2 * half, -2 * mp.sqrt(G) * k * (1 - K2) * sn / dn**2 / mp.cos(half)


def tabulated(lam_at: Callable[[mpf], float]) -> list[Point]:
    """Return the largest phase errors of a function of time, over the phases examined."""
    points = []
    for n in (10**k for k in range(10)):
        worst = mpf(0)
        for phase in PHASES:
            angle, rate = truth(phase)
            off = abs(mpf(lam_at((n + phase) * PERIOD)) + mp.pi / 2 - angle)
            worst = max(worst, off / abs(rate) / PERIOD)
        points.append((n, float(worst), True))
    return points


def main() -> None:
    """Measure, draw, and print the table of ``docs/accuracy.md``."""
    spec = gqm.read_spec(ROOT / "curves" / "pendulum.yaml")
    motion = gqm.build(spec.derive(), name=spec.name, folder=ROOT / "generated").solve(**spec.launch)
    period = float(PERIOD)
    curves = {
        "gqm_sym": tabulated(lambda t: motion.lam(mp.nstr(t, 40))),
        "tiling by a period of one double": tabulated(lambda t: motion.lam(math.fmod(float(t), period))),
        **{method.name: integrated(method) for method in METHODS},
    }
    print("| | " + " | ".join(f"N = {n:.0e}" for n in COUNTS) + " |")
    print("|---" * (len(COUNTS) + 1) + "|")
    for name, points in curves.items():
        at = {n: (error, measured) for n, error, measured in points}
        cells = [f"{at[n][0]:.1e}" if at[n][1] else f"({at[n][0]:.1e})" for n in COUNTS]
        print(f"| {name} | " + " | ".join("lost" if f"{LOST:.1e}" in cell else cell for cell in cells) + " |")

    mpl.rcParams.update({"svg.hashsalt": "gqm_sym", "svg.fonttype": "none", "font.size": 10})
    figure, axes = plt.subplots(figsize=(7.2, 4.6), layout="constrained")
    for (name, points), marker in zip(curves.items(), "osd^v", strict=True):
        n, error, measured = (np.array(column) for column in zip(*points, strict=True))
        (line,) = axes.loglog(n, error, linewidth=2.2 if name == "gqm_sym" else 1.0)
        for filled in (True, False):
            face = line.get_color() if filled else "white"
            axes.loglog(
                n[measured == filled],
                error[measured == filled],
                marker,
                color=line.get_color(),
                markerfacecolor=face,
                markersize=5,
                label=name if filled else None,
            )
    axes.axhline(2.0**-53, color="0.6", linewidth=0.8, linestyle=":")
    axes.text(1.3, 2.0**-53 / 3.2, "half a unit in the last place of the period", color="0.4", fontsize=8)
    axes.set(xlabel="periods since launch", ylabel="phase error, in periods", ylim=(1e-17, 2))
    axes.set_title("Phase error of the paper's Example 1 (hollow: extrapolated)", fontsize=10)
    axes.legend(fontsize=8, loc=(0.5, 0.12))
    axes.grid(visible=True, linewidth=0.3)
    FIGURE.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(FIGURE, metadata={"Date": None})


if __name__ == "__main__":
    main()
