"""How often fits contain the truth: 500 sets of synthetic measurements each, without and with losses.

Each true value should lie within a standard deviation in some 68 % of the sets.
"""

from types import ModuleType

import numpy as np

import generated.circle as circle
import generated.circle_drag as circle_drag
import gqm_sym as gqm

SETS, DEVIATION = 500, 1e-3


def covered(module: ModuleType, true: dict[str, float], guesses: dict[str, float], seed: int) -> dict[str, float]:
    """Return for each name the share of sets in which the truth is within a standard deviation of the estimate."""
    times, rng = np.linspace(0.1, 6.0, 25), np.random.default_rng(seed)
    exact, within = module.solve(**true).lam(times), dict.fromkeys(true, 0)
    for _ in range(SETS):
        data = {"t": times, "lam": exact + rng.normal(0.0, DEVIATION, times.size), "sigma": DEVIATION}
        found = gqm.fit(module, data, guesses)
        for name, value in true.items():
            within[name] += abs(found.estimates[name] - value) < found.std[name]
    return {name: count / SETS for name, count in within.items()}


if __name__ == "__main__":
    print(covered(circle, {"lam0": 1.0, "L": 1.3}, {"lam0": 0.99, "L": 1.29}, 11))
    print(covered(circle_drag, {"lam0": 1.2, "L": 1.1, "b": 0.05}, {"lam0": 1.19, "L": 1.09, "b": 0.06}, 12))
