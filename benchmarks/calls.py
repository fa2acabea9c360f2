"""Where the time of one call goes: a solve, a place, a state, a leg, an orbit of a sweep.

Each row is the least of many short runs in one process, so that other work on the machine weighs little; the numbers
are for reading, not for passing. ``make bench`` puts them into ``docs/benchmarks.md``.
"""

from math import inf, nan
from types import ModuleType
from typing import Any

import numpy as np
from measure import least, on_one_core, readable

import generated.cubic_coulomb as friction
import generated.double_well as double_well
import generated.parabola as parabola
import generated.pendulum as pendulum
from gqm_sym.runtime.inversion import table
from gqm_sym.runtime.launch.problem import bind
from gqm_sym.runtime.launch.request import LaunchRequest, read_launch
from gqm_sym.runtime.launch.survey import survey
from gqm_sym.runtime.legs import answers
from gqm_sym.runtime.legs.advance import Joints
from gqm_sym.runtime.legs.body import launched
from gqm_sym.runtime.legs.leg_record import COLUMNS, TIME_FROM_END
from gqm_sym.runtime.legs.leg_segments import Run, read_panels
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE
from gqm_sym.runtime.quadrature import time_panels


def conservative() -> list[tuple[str, float]]:
    """Parts of a pendulum's solve, and what is asked of its motion."""
    model, given = pendulum.MODEL, tuple(pendulum.PARAMETERS.values())
    p = model.numbers(given)
    launch = read_launch(model, p, LaunchRequest(-0.37))
    f, domain = bind(model, p, launch), model.domain(p).numbers
    motion = pendulum.solve(-0.37)
    motion.state(1000.0)
    segment = motion._segment
    panels, clock = segment.panels, segment.edge_times

    def first(ask: str) -> Any:
        return getattr(pendulum.solve(-0.37), ask)(1.0)

    return [
        ("`solve` of a pendulum, released from rest", least(lambda: pendulum.solve(-0.37))),
        ("- reading the parameters, from the cache", least(lambda: model.numbers(given))),
        ("- checking the launch", least(lambda: read_launch(model, p, LaunchRequest(-0.37)))),
        (
            "- compiled code: turning points, kind, half period",
            least(lambda: survey(f.addresses, f.p, -0.37, 0.0, 1, domain, True)),
        ),
        ("`lam` at one time", least(lambda: motion.lam(1000.0))),
        ("`state` at one time", least(lambda: motion.state(1000.0))),
        ("`solve` and the first `lam`", least(lambda: first("lam"))),
        ("`solve` and the first `state`", least(lambda: first("state"))),
        ("- binding the functions and the exact problem", least(lambda: bind(model, p, launch))),
        (
            "- panels of the time integral",
            least(
                lambda: time_panels.lay_panels(f.addresses, f.p, 0, segment.a, segment.b, 0.0, 0.0, panels[0][[0, -1]])
            ),
        ),
        ("- table that inverts time", least(lambda: table.build_table(panels[0], *clock, panels[3]))),
    ]


def dissipative() -> list[tuple[str, float]]:
    """Measure parts of the first leg of the paper's Example 2."""
    model = friction.MODEL
    p = model.numbers(tuple(friction.PARAMETERS.values()))
    assert model.dissipation is not None
    loss = model.dissipation.addresses(has_radius=False)
    launch = launched([(-1.0, -inf, inf, 0.0, 1, 0, inf, nan, 6.2088**2)])
    joints, records = Joints(NOWHERE, NOWHERE, NOWHERE, NOWHERE), np.empty((1, 16 * COLUMNS))

    def leg() -> int:
        return answers.drive(loss, p.values.reshape(1, -1), NOWHERE, joints, answers.LEGS, launch.copy(), records)

    run = Run(records[0], leg(), "turn", None)
    back, time = run.panels_back, float(run.record[TIME_FROM_END])
    return [
        ("`solve` of Example 2, to its turning point", least(lambda: friction.solve(-1.0, 6.2088))),
        ("- compiled code: the leg, its events and its time", least(leg)),
        ("reading the panels of the leg, for the first position", least(lambda: read_panels(back, time))),
        ("`solve` and the first `lam`", least(lambda: friction.solve(-1.0, 6.2088).lam(0.1), 5)),
    ]


def sweeping() -> list[tuple[str, float]]:
    """Measure an orbit's share of sweeps, on one core: the rows differ in what compiled code has to find."""
    launches, released = 4096, (-np.pi / 2 + 0.05, -np.pi / 2 + 2.5)

    def share(module: ModuleType, quantity: str, ends: tuple[float, float], v0: float = 0.0) -> float:
        lam0 = np.random.default_rng(0).uniform(*ends, launches)
        swept = module.sweep(quantity, lam0, v0)
        assert swept.route_counts() == {"batch": launches}
        return least(on_one_core(lambda: module.sweep(quantity, lam0, v0)), 3, 50) / launches

    return [
        ("turning points of a pendulum in a sweep, released from rest", share(pendulum, "turning_points", released)),
        ("- launched with speed", share(pendulum, "turning_points", released, 0.3)),
        ("- in a double well, where no orbit is symmetric", share(double_well, "turning_points", (1.02, 1.35))),
        (
            "half period of a pendulum in a sweep, by an arithmetic-geometric mean",
            share(pendulum, "half_period", released),
        ),
        ("- along a parabola, by the trapezoidal rule", share(parabola, "half_period", (0.1, 1.2))),
        ("- in a double well, by the trapezoidal rule", share(double_well, "half_period", (1.02, 1.35))),
    ]


def profile() -> list[str]:
    """Give the table, line by line."""
    rows = conservative() + dissipative() + sweeping()
    return ["| step | shortest time |", "|---|---|", *(f"| {what} | {readable(time)} |" for what, time in rows)]


if __name__ == "__main__":
    print("\n".join(profile()))
