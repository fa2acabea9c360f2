"""Time each stage from a YAML file to a warm solve; run by ``make bench``.

The numbers are for information and are not tested.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np

import gqm_sym as gqm

ROOT = Path(__file__).parent.parent
MANY = 100_000

SECOND_PROCESS = """
import sys
from time import perf_counter
start = perf_counter()
import numba
known = perf_counter()
import generated.pendulum as pendulum
pendulum.solve("-pi/2 + 6/5")
print(known - start, perf_counter() - known)
"""


def seconds(what: Callable[[], Any], repeats: int = 1) -> float:
    """Return the median time of some runs."""
    times = []
    for _ in range(repeats):
        start = perf_counter()
        what()
        times.append(perf_counter() - start)
    return median(times)


def second_process() -> tuple[float, float]:
    """Return the time to import numba, and from there to a solved pendulum, in a fresh process."""
    # As installed: what Python has compiled is kept.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    runs = [
        subprocess.run(
            [sys.executable, "-c", SECOND_PROCESS],
            cwd=ROOT,
            check=True,
            capture_output=True,
            text=True,
            env=environment,
        ).stdout.split()
        for _ in range(4)
    ]
    # The first run may still compile.
    numba, ours = np.median(np.array(runs[1:], dtype=float), axis=0)
    return float(numba), float(ours)


def main() -> None:
    """Print one line for each curve and a few for the pendulum."""
    print(f"{'curve':<18}{'derive':>10}{'emit':>10}{'solve':>12}{'lam(t)':>10}")
    with tempfile.TemporaryDirectory() as folder:
        for path in sorted((ROOT / "curves").glob("*.yaml")):
            spec = gqm.read_spec(path)
            derived = seconds(spec.derive)
            model = spec.derive()
            emitted = seconds(lambda model=model, name=spec.name: gqm.emit(model, name=name))
            module = gqm.build(model, name=spec.name, folder=folder)
            motion = module.solve(**spec.launch)
            times = np.linspace(0.0, min(motion.t_end, 100.0), MANY)
            motion.lam(times)
            solved = seconds(lambda module=module, spec=spec: module.solve(**spec.launch), 20)
            asked = seconds(lambda motion=motion, times=times: motion.lam(times), 5) / MANY
            print(f"{spec.name:<18}{derived:>8.2f} s{emitted:>8.2f} s{1e3 * solved:>9.2f} ms{1e9 * asked:>7.0f} ns")
    numba, ours = second_process()
    print(f"\na second process: import numba {numba:.2f} s, then a solved pendulum {ours:.3f} s")


if __name__ == "__main__":
    main()
