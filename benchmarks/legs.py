"""The paper's Example 2: a bead on z = x**3 with friction, to its first turning point."""

import json
from math import copysign, sqrt
from pathlib import Path
from typing import Any

import peers
from measure import Row, apart, repeated
from mpmath import mpf
from scipy.integrate import solve_ivp

import generated.cubic_coulomb as cubic

CASES = Path(__file__).parent.parent / "tests" / "data" / "paper_cases.json"
START, SPEED, G, MU = -1.0, 6.2088, 9.81, 0.1


def by_integrator() -> tuple[float, float]:
    """Return time and place of the turning point by DOP853, run separately for each sign of the contact force."""

    def forces(y: Any) -> tuple[float, float, float]:
        ds = sqrt(1 + 9 * y[0] ** 4)
        return ds, 3 * y[0] ** 2 / ds, G / ds + 6 * y[0] / ds**3 * y[1] ** 2

    def load(_: float, y: Any) -> float:
        return forces(y)[2]

    def speed(_: float, y: Any) -> float:
        return float(y[1])

    load.terminal = speed.terminal = True  # type: ignore[attr-defined]
    t, y, sign = 0.0, [START, SPEED], copysign(1.0, load(0.0, [START, SPEED]))
    while True:

        def flow(_: float, y: Any, sign: float = sign) -> list[float]:
            ds, slope, force = forces(y)
            return [y[1] / ds, -G * slope - MU * sign * force]

        found = solve_ivp(flow, (t, 5.0), y, "DOP853", events=(load, speed), rtol=1e-13, atol=1e-14)
        if found.t_events[1].size:
            return float(found.t_events[1][0]), float(found.y_events[1][0][0])
        t, y, sign = float(found.t_events[0][0]), found.y_events[0][0], -sign
        # From where the force has just changed sign.
        y[0] += 1e-15


def legs() -> list[Row]:
    """Return the rows for this package, DOP853 with events, and installed peers."""
    cases = json.loads(CASES.read_text(encoding="utf-8"))["cases"]
    (known,) = (case["expected"]["events"] for case in cases if case["id"] == "example2_cubic_coulomb")
    (turn,) = (event for event in known if event["leg"] == 1 and event["kind"] == "turning_point")
    truth = [mpf(turn["t"]), mpf(turn["lam"])]

    def error(values: Any) -> float:
        return apart(values, truth, 1.0)

    def told(motion: Any) -> float:
        (leg,) = (leg for leg in motion.legs[:2] if leg.end == "turn")
        return error((leg.t_end, leg.lam_end))

    work = "Example 2 to its turning point, from Python"
    return [
        Row(
            work,
            "`solve`: leg, contact change, turning point and time",
            repeated(lambda: cubic.solve(START, SPEED), 100),
            told,
            each=100,
            line=5e-16,
            unit="s and m",
        ),
        *peers.example2(work, error),
        Row(work, "DOP853 with events, tolerance 1e-13", by_integrator, error, unit="s and m"),
    ]
