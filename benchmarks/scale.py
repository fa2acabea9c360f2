"""How the cost grows with the time, the number of legs, the size of a sweep and the length of the formulas.

Draws ``docs/figures/scale.svg``; run by ``make bench``. Each point is the shortest of several runs.
"""

import json
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from measure import least

import generated.circle_drag as dragged
import generated.pendulum as pendulum
import gqm_sym as gqm

mpl.use("svg")
from matplotlib import pyplot as plt

ROOT = Path(__file__).parent.parent
FIGURE = ROOT / "docs" / "figures" / "scale.svg"

SWEPT = """
import resource, sys
from time import perf_counter
import numpy as np
import generated.pendulum as pendulum
pendulum.sweep("half_period", np.linspace(-1.5, 0.5, 1000))
start = perf_counter()
pendulum.sweep("half_period", np.linspace(-1.5, 0.5, int(sys.argv[1])))
print(perf_counter() - start, 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def late_states() -> tuple[list[float], list[float]]:
    """Measure the computation of one state at different times of the motion."""
    motion, when = pendulum.solve("-pi/2 + 6/5"), [10.0**k for k in range(10)]
    motion.state(1e9)
    return when, [least(lambda t=t: motion.state(t), 100, 20) for t in when]  # type: ignore[misc]


def many_legs() -> tuple[list[int], list[float]]:
    """Measure the computation of many half swings of a pendulum with drag."""
    counts = [10, 100, 1000, 10000]
    swing = 1.05  # half a period of its small swings, about
    solved = [least(lambda n=n: dragged.solve(1.0, t_max=swing * n).legs, 1, 2) for n in counts]  # type: ignore[misc]
    return [len(dragged.solve(1.0, t_max=swing * n).legs) for n in counts], solved


def large_sweeps() -> tuple[list[int], list[float], list[float]]:
    """Measure time and memory of sweeps of different sizes, each in a process of its own."""
    counts, seconds, sizes = [10**4, 10**5, 10**6, 10**7], [], []
    for count in counts:
        done = subprocess.run(
            [sys.executable, "-c", SWEPT, str(count)], cwd=ROOT, check=True, capture_output=True, text=True
        )
        time, size = map(float, done.stdout.split())
        seconds.append(time)
        sizes.append(size)
    return counts, seconds, sizes


def long_formulas() -> tuple[list[int], list[float]]:
    """Measure derivation and emission of graphs that are sums of many sines."""

    def emitted(terms: int, slowest: int) -> int:
        text = " + ".join(f"sin({k + slowest}*x)/{k + slowest}" for k in range(terms))
        gqm.emit(gqm.derive(gqm.Curve.graph(text, parameter="x"), gqm.Gravity()), name="waves")
        return len(text)

    emitted(2, 50)  # imports, and what SymPy remembers
    counts = (1, 2, 4, 8, 16, 32, 64)
    return [emitted(n, 100) for n in counts], [least(lambda n=n: emitted(n, 200 + 100 * n), 1, 1) for n in counts]  # type: ignore[misc]


def main() -> None:
    """Measure, print the numbers and draw them."""
    states, legs, sweeps, formulas = late_states(), many_legs(), large_sweeps(), long_formulas()
    print(json.dumps({"states": states, "legs": legs, "sweeps": sweeps, "formulas": formulas}, indent=1))
    mpl.rcParams.update({"svg.hashsalt": "gqm_sym", "svg.fonttype": "none", "font.size": 9})
    figure, panels = plt.subplots(2, 2, figsize=(8.0, 6.0), layout="constrained")
    (late, followed), (swept, derived) = panels
    late.loglog(*states, "o-", color="#0072b2")
    late.set(xlabel="time t asked for (s)", ylabel="time taken (s)", ylim=(1e-7, 1e-3), title="one state of a pendulum")
    followed.loglog(*legs, "o-", color="#0072b2")
    followed.set(xlabel="legs", ylabel="time taken (s)", title="legs of a pendulum with drag")
    swept.loglog(sweeps[0], sweeps[1], "o-", color="#0072b2", label="time (s)")
    swept.loglog(sweeps[0], np.array(sweeps[2]) / 1e9, "s--", color="#d55e00", label="peak memory of the process (GB)")
    swept.set(xlabel="launches", title="half periods in one sweep")
    swept.legend(loc="lower right", fontsize=7)
    derived.loglog(*formulas, "o-", color="#0072b2")
    derived.set(xlabel="characters of the formula", ylabel="time taken (s)", title="derivation and emission")
    for panel in panels.flat:
        panel.grid(alpha=0.3)
    figure.savefig(FIGURE, metadata={"Date": None})


if __name__ == "__main__":
    main()
