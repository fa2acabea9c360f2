"""The time that each step of a call takes: a solve, a position, a state, a leg, an orbit of a sweep.

Each row is the shortest of many runs in one process, which other work on the machine affects least. The numbers are for
information and are not tested. ``make bench`` writes them to ``docs/benchmarks.md``.
"""

from math import inf
from typing import Any

import numpy as np
from measure import least, readable
from numba import njit

import generated.cubic_coulomb as friction
import generated.pendulum as pendulum
from gqm_sym.runtime.inversion import table
from gqm_sym.runtime.launch.problem import bind
from gqm_sym.runtime.launch.request import LaunchRequest, read_launch
from gqm_sym.runtime.launch.survey import survey
from gqm_sym.runtime.legs import follow
from gqm_sym.runtime.legs.leg_record import BEFORE, COLUMNS
from gqm_sym.runtime.legs.leg_segments import Run, read_panels
from gqm_sym.runtime.quadrature import time_panels, trapezoid
from gqm_sym.runtime.sweep import quantities
from gqm_sym.runtime.sweep.batch import batches, rows, times, turning_points


def conservative() -> list[tuple[str, float]]:
    """Return the steps of solving a pendulum, and of questions about its motion."""
    model, given = pendulum.MODEL, tuple(pendulum.PARAMETERS.values())
    p = model.numbers(given)
    launch = read_launch(model, p, LaunchRequest(-0.37))
    f, (low, high, period, _, place, step) = bind(model, p, launch), model.domain(p)
    motion = pendulum.solve(-0.37)
    motion.state(1000.0)
    stretch = motion._stretch
    panels, clock = stretch.panels, stretch.clock

    def first(ask: str) -> Any:
        return getattr(pendulum.solve(-0.37), ask)(1.0)

    return [
        ("`solve` of a pendulum, released from rest", least(lambda: pendulum.solve(-0.37))),
        ("- reading the parameters, from the cache", least(lambda: model.numbers(given))),
        ("- checking the launch", least(lambda: read_launch(model, p, LaunchRequest(-0.37)))),
        ("- binding the functions and the exact problem", least(lambda: bind(model, p, launch))),
        (
            "- compiled code: turning points, kind, half period",
            least(lambda: survey(f.addresses, f.p, -0.37, 0.0, 1, low, high, period, place, step)),
        ),
        ("`lam` at one time", least(lambda: motion.lam(1000.0))),
        ("`state` at one time", least(lambda: motion.state(1000.0))),
        ("`solve` and the first `lam`", least(lambda: first("lam"))),
        ("`solve` and the first `state`", least(lambda: first("state"))),
        (
            "- panels of the time integral",
            least(
                lambda: time_panels.lay_panels(f.addresses, f.p, 0, stretch.a, stretch.b, 0.0, 0.0, panels[0][[0, -1]])
            ),
        ),
        ("- table that inverts time", least(lambda: table.build_table(panels[0], *clock, panels[3]))),
    ]


def dissipative() -> list[tuple[str, float]]:
    """Return the steps of the first leg of the paper's Example 2."""
    model = friction.MODEL
    p = model.numbers(tuple(friction.PARAMETERS.values()))
    loss = model.dissipation
    assert loss is not None
    launch = (*loss, p.values, -1.0, 6.2088**2, 1, 0, np.empty(0))
    record = np.empty(16 * COLUMNS)
    leg = (*launch, inf, 1.0, 0.25, 0, 0.0, record)
    what, *_, ahead, count, _, _, _, _, _ = follow.follow(*leg)
    run = Run(-1.0, ahead, count, record, what, "turn", 0)
    back, time = run.panels_back, run.pair(BEFORE)[1]
    return [
        ("`solve` of Example 2, to its turning point", least(lambda: friction.solve(-1.0, 6.2088))),
        ("- compiled code: the leg, its events and its time", least(lambda: follow.follow(*leg))),
        ("reading the panels of the leg, for the first position", least(lambda: read_panels(back, time))),
        ("`solve` and the first `lam`", least(lambda: friction.solve(-1.0, 6.2088).lam(0.1), 5)),
    ]


def sweeping() -> list[tuple[str, float]]:
    """Return the steps of one orbit in a sweep over pendulums, on one core."""
    each, n = pendulum.MODEL.each, rows.BATCH
    fns, held = each.addresses(), (each.held, each.top_held)
    launch, seek, turn_round, prove = (
        getattr(turning_points, name) for name in ("launch", "seek", "turn_round", "prove")
    )
    time_of, by_means = times.times, times.half_periods_by_agm
    start = np.zeros((rows.ROWS, n))
    start[rows.WHO], start[rows.WAY] = np.arange(n), 1.0
    start[rows.START] = np.random.default_rng(0).uniform(0.05, 2.5, n) - np.pi / 2
    p = np.repeat(pendulum.MODEL.numbers(tuple(pendulum.PARAMETERS.values())).values[:, None], n, axis=1)
    count, given = len(p), np.append(p.reshape(-1), np.zeros(max(held) * n))
    known, work = (
        np.repeat([[-inf], [inf], [2 * np.pi], [-np.pi / 2], [-6.1e-17], [np.pi]], n, axis=1),
        np.empty((13, n)),
    )
    chosen, out, reasons = np.empty(n, dtype=np.int64), np.zeros((n, 1)), np.zeros(n, dtype=np.int8)

    @njit
    def search(s: Any, start: Any, p: Any, known: Any, monotone: bool, work: Any) -> None:
        s[:] = start
        launch(fns, n, s, p, known, monotone, work)
        seek(fns, n, s, p, work)
        turn_round(n, s)

    @njit
    def proof(s: Any, found: Any, p: Any, work: Any) -> None:
        s[:] = found
        prove(fns, 0, True, batches.FEW_OF_HALF, n, s, p, work)

    @njit
    def clock(s: Any, found: Any, flat: Any, given: Any, work: Any, chosen: Any, out: Any, reasons: Any) -> None:
        s[:], flat[:] = found, given
        time_of(
            fns, trapezoid.LIBRATION, True, n, s, flat, count, held, chosen, work, quantities.HALF_PERIOD, out, reasons
        )

    @njit
    def mean(s: Any, found: Any, given: Any, work: Any, out: Any, reasons: Any) -> None:
        s[:] = found
        by_means(fns, n, s, given, count, work, quantities.HALF_PERIOD, out, reasons)

    s, flat = start.copy(), given.copy()
    search(s, start, p, known, True, work)
    found, other = s.copy(), s[rows.A]
    found[rows.LEAST], found[rows.MOST] = np.minimum(other, 0.0), np.maximum(other, 0.0)
    found[rows.A] = found[rows.START] + found[rows.LEAST]
    found[rows.B] = found[rows.START] + found[rows.MOST]
    return [
        (
            "turning points of an orbit in a sweep: in closed form",
            least(lambda: search(s, start, p, known, True, work)) / n,
        ),
        ("- by Newton's method, without proof", least(lambda: search(s, start, p, known, False, work)) / n),
        ("- proof by intervals, where symbols do not suffice", least(lambda: proof(s, found, p, work)) / n),
        (
            "half period of an orbit in a sweep: by an arithmetic-geometric mean",
            least(lambda: mean(s, found, given, work, out, reasons)) / n,
        ),
        (
            "- by the trapezoidal rule, with error control",
            least(lambda: clock(s, found, flat, given, work, chosen, out, reasons)) / n,
        ),
    ]


def profile() -> list[str]:
    """Return the lines of the table."""
    rows = conservative() + dissipative() + sweeping()
    return ["| step | shortest time |", "|---|---|", *(f"| {what} | {readable(time)} |" for what, time in rows)]


if __name__ == "__main__":
    print("\n".join(profile()))
