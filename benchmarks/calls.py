"""Where the time of one call goes: a solve, a place, a state, a leg. Prints the table of ``docs/profiles.md``.

Each row is the least of many short runs in one process, so that other work on the machine weighs little; the numbers
are for reading, not for passing.
"""

from collections.abc import Callable
from math import inf
from time import perf_counter
from typing import Any

import numpy as np

import generated.cubic_coulomb as friction
import generated.pendulum as pendulum
from gqm_sym.runtime import entries, legs
from gqm_sym.runtime.leg_stretches import read_panels
from gqm_sym.runtime.surveying import survey


def least(work: Callable[[], Any], count: int = 20, repeats: int = 300) -> float:
    """Return the least time of one call, in microseconds."""
    work()
    times = []
    for _ in range(repeats):
        start = perf_counter()
        for _ in range(count):
            work()
        times.append((perf_counter() - start) / count)
    return 1e6 * min(times)


def conservative() -> list[tuple[str, float]]:
    """Parts of a pendulum's solve, and what is asked of its motion."""
    model, given = pendulum.MODEL, tuple(pendulum.PARAMETERS.values())
    p = model.numbers(given)
    launch = model.launch(p, lam0=-0.37, v0=0.0)
    f, (low, high, period, _) = model.functions(p, launch), model.domain(p)
    motion = pendulum.solve(-0.37)
    motion.state(1000.0)
    stretch = motion._stretch
    panels, clock = stretch.panels, stretch.clock

    def first(ask: str) -> Any:
        return getattr(pendulum.solve(-0.37), ask)(1.0)

    return [
        ("`solve` of a pendulum, released from rest", least(lambda: pendulum.solve(-0.37))),
        ("- parameters read, from the cache", least(lambda: model.numbers(given))),
        ("- launch checked", least(lambda: model.launch(p, lam0=-0.37, v0=0.0))),
        ("- functions and the exact problem", least(lambda: model.functions(p, launch))),
        (
            "- the crossing: turning points, kind, half period",
            least(lambda: survey(f.addresses, f.p, -0.37, 0.0, 1, low, high, period)),
        ),
        ("`lam` at one time", least(lambda: motion.lam(1000.0))),
        ("`state` at one time", least(lambda: motion.state(1000.0))),
        ("`solve` and the first `lam`", least(lambda: first("lam"))),
        ("`solve` and the first `state`", least(lambda: first("state"))),
        (
            "- panels of time",
            least(lambda: entries.lay_panels(f.addresses, f.p, 0, stretch.a, stretch.b, 0.0, 0.0, panels[0][[0, -1]])),
        ),
        ("- table of the anomaly", least(lambda: entries.build_table(panels[0], *clock, panels[3]))),
    ]


def dissipative() -> list[tuple[str, float]]:
    """Parts of the first leg of the paper's Example 2."""
    model = friction.MODEL
    p = model.numbers(tuple(friction.PARAMETERS.values()))
    loss = model.dissipation
    assert loss is not None
    flags = (int(loss.friction), int(loss.kinked), int(loss.linear))
    launch = (loss.drive, loss.hold, p.values, flags, -1.0, 6.2088**2, 1, 0, np.empty(0))
    leg = legs.follow(*launch, inf, 1.0, 0.25, 0, 0.0)
    times, ahead, back = leg[8], leg[11], leg[12]
    print(f"panels of Example 2's first leg: {len(ahead)} from the launch, {len(back)} from the turn")
    return [
        ("`solve` of Example 2: its leg to the turn", least(lambda: friction.solve(-1.0, 6.2088))),
        ("- the crossing: the leg, its events, its time", least(lambda: legs.follow(*launch, inf, 1.0, 0.25, 0, 0.0))),
        ("the leg's panels read, when a position is asked for", least(lambda: read_panels(back, times[1]))),
        ("`solve` and the first `lam`", least(lambda: friction.solve(-1.0, 6.2088).lam(0.1), 5)),
    ]


def main() -> None:
    """Print the table."""
    rows = conservative() + dissipative()
    print("| what | least time |\n|---|---|")
    for what, microseconds in rows:
        print(f"| {what} | {microseconds:.1f} µs |")


if __name__ == "__main__":
    main()
