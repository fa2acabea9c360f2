"""Measure the errors of half periods in sweeps, for launches uniform in energy (see docs/accuracy.md).

Each is compared with ``solve``, whose half periods are the doubles nearest to the exact ones.
"""

import tempfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np

import gqm_sym as gqm

LAUNCHES = 1500

# The curve, a place at the bottom of a well, and the places up to which bodies swing.
WELLS: dict[str, tuple[Callable[[], gqm.Curve], float, tuple[float, float]]] = {
    "circle": (lambda: gqm.families.circle(L="1"), 0.0, (-3.1, 3.1)),
    "ellipse": (lambda: gqm.families.ellipse(a="2", b="1"), -np.pi / 2, (-4.6, 1.5)),
    "parabola": (lambda: gqm.Curve.graph("x**2/2", parameter="x"), 0.0, (-3.0, 3.0)),
    "catenary": (lambda: gqm.Curve.graph("cosh(x)", parameter="x"), 0.0, (-3.0, 3.0)),
    "quartic": (lambda: gqm.Curve.graph("x**4", parameter="x"), 0.0, (-2.0, 2.0)),
    "tilted graph": (lambda: gqm.Curve.graph("x**2 + x**3/5", parameter="x"), 0.0, (-2.5, 2.0)),
    "Lissajous curve": (
        lambda: gqm.Curve.parametric(x="sin(2*t)", z="-cos(3*t)/2 - cos(t)", parameter="t", period="2*pi"),
        0.0,
        (-1.2, 1.2),
    ),
}


def launches(
    module: ModuleType, bottom: float, ends: tuple[float, float], thrown: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return launch places and speeds of bodies that stay between two places."""
    rng = np.random.default_rng(1)
    top = float(np.min(-module.pass1(np.array(ends), lam0=bottom).v2))
    lam0, energy = rng.uniform(*ends, 20 * LAUNCHES), rng.uniform(0.0, top, 20 * LAUNCHES)
    height = -module.pass1(lam0, lam0=bottom).v2
    if not thrown:
        chosen = height < top
        return lam0[chosen][:LAUNCHES], np.zeros(min(LAUNCHES, int(chosen.sum())))
    chosen = height < energy
    return lam0[chosen][:LAUNCHES], np.sqrt((energy - height)[chosen][:LAUNCHES])


def main() -> None:
    """Print a row for each well."""
    for name, (curve, bottom, ends) in WELLS.items():
        folder = Path(tempfile.mkdtemp(prefix="gqm_sym_errors_"))
        module = gqm.build(gqm.derive(curve(), gqm.Gravity()), name="swept", folder=folder)
        row = [name]
        for thrown in (False, True):
            lam0, v0 = launches(module, bottom, ends, thrown)
            swept = module.sweep("half_period", lam0, v0).values
            truths = np.full(swept.size, np.nan)
            for k, (place, speed) in enumerate(zip(lam0.tolist(), v0.tolist(), strict=True)):
                if np.isfinite(swept[k]):
                    truths[k] = module.solve(place, speed).half_period
            errors = np.abs(swept - truths) / np.spacing(truths)
            errors = errors[np.isfinite(errors)]
            row += [
                f"{np.quantile(errors, 0.99):.0f}",
                f"{errors.max():.0f}",
                f"{np.mean(errors > 2):.2%}",
                str(errors.size),
            ]
        print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
