"""Where the time of one call goes: a solve, a place, a state, a leg, an orbit of a sweep.

Each row is the least of many short runs in one process, so that other work on the machine weighs little; the numbers
are for reading, not for passing. ``make bench`` puts them into ``docs/benchmarks.md``.
"""

from math import inf, nan
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
from gqm_sym.runtime.legs import answers
from gqm_sym.runtime.legs.advance import Joints
from gqm_sym.runtime.legs.body import launched
from gqm_sym.runtime.legs.leg_record import COLUMNS, TIME_FROM_END
from gqm_sym.runtime.legs.leg_segments import Run, read_panels
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE
from gqm_sym.runtime.quadrature import time_panels, trapezoid
from gqm_sym.runtime.sweep import quantities
from gqm_sym.runtime.sweep.batch import batches, rows, times, turning_points, wells


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
    loss = model.dissipation.addresses()
    launch = launched([(-1.0, -inf, inf, 0.0, 1, 0, inf, nan, 6.2088**2)])
    joints, records = Joints(NOWHERE, NOWHERE, NOWHERE, NOWHERE), np.empty((1, 16 * COLUMNS))

    def leg() -> int:
        return answers.drive(loss, p.values.reshape(1, -1), joints, answers.LEGS, launch.copy(), records)

    run = Run(records[0], leg(), "turn", None)
    back, time = run.panels_back, float(run.record[TIME_FROM_END])
    return [
        ("`solve` of Example 2, to its turning point", least(lambda: friction.solve(-1.0, 6.2088))),
        ("- compiled code: the leg, its events and its time", least(leg)),
        ("reading the panels of the leg, for the first position", least(lambda: read_panels(back, time))),
        ("`solve` and the first `lam`", least(lambda: friction.solve(-1.0, 6.2088).lam(0.1), 5)),
    ]


def sweeping() -> list[tuple[str, float]]:
    """Parts of an orbit's share of a sweep over pendulums, on one core."""
    each, n = pendulum.MODEL.batch, rows.BATCH
    assert each is not None
    fns, held = each.addresses(), (each.orbit_rows, each.integrand_rows, -1)
    start_search, search_zeros, start_search_behind, set_ends, prove = (
        getattr(turning_points, name) for name in ("start_search", "search", "start_search_behind", "set_ends", "prove")
    )
    by_trapezoid, by_agm = times.times_by_trapezoid, times.half_periods_by_agm
    start = np.zeros((rows.ROWS, n))
    start[rows.INDEX], start[rows.SEARCH_DIRECTION] = np.arange(n), 1.0
    start[rows.LAUNCH_PLACE] = np.random.default_rng(0).uniform(0.05, 2.5, n) - np.pi / 2
    p = np.repeat(pendulum.MODEL.numbers(tuple(pendulum.PARAMETERS.values())).values[:, None], n, axis=1)
    count, given = len(p), np.append(p.reshape(-1), np.zeros(max(held) * n))
    known, work = (
        np.repeat([[-inf], [inf], [2 * np.pi], [-np.pi / 2], [-6.1e-17], [np.pi]], n, axis=1),
        np.empty((13, n)),
    )
    chosen, status = np.empty(n, dtype=np.int64), np.zeros(n, dtype=np.int8)
    scratch = rows.Scratch(count, held, chosen, chosen.copy(), work)
    answers = quantities.Answers(np.zeros((n, 1)), status, status.copy())

    params, of_wells = np.empty((count, rows.LANES)), np.empty((8, rows.LANES))
    no_side = wells.WellSide(np.zeros(0, dtype=np.int8), np.full(1, nan), 1.0, params, of_wells)
    unknown = wells.Wells(no_side, no_side, no_side)

    @njit
    def search(s: Any, start: Any, p: Any, known: Any, monotone: bool, work: Any) -> None:
        s[:] = start
        start_search(fns, n, s, p, known, monotone, unknown, work)
        search_zeros(fns, n, s, p, work)
        start_search_behind(fns, n, s, p, monotone, work)
        search_zeros(fns, n, s, p, work)
        set_ends(n, s)

    @njit
    def proof(s: Any, found: Any, p: Any, work: Any) -> None:
        s[:] = found
        prove(fns, 0, True, batches.FEW_PIECES_OF_HALF, n, s, p, work)

    @njit
    def trapezoidal(orbits: Any, found: Any, given: Any, scratch: Any, answers: Any) -> None:
        orbits.rows[:], orbits.params[:] = found, given
        by_trapezoid(fns, trapezoid.LIBRATION, True, orbits, scratch, quantities.HALF_PERIOD, answers)

    @njit
    def mean(orbits: Any, found: Any, scratch: Any, answers: Any) -> None:
        orbits.rows[:] = found
        by_agm(fns, orbits, scratch, quantities.HALF_PERIOD, answers)

    s, flat = start.copy(), given.copy()
    orbits = rows.Orbits(n, s, flat)
    search(s, start, p, known, True, work)
    found = s.copy()
    return [
        (
            "turning points of an orbit in a sweep: in closed form",
            least(lambda: search(s, start, p, known, True, work)) / n,
        ),
        ("- by Newton's method, without proof", least(lambda: search(s, start, p, known, False, work)) / n),
        ("- proof by intervals, where symbols do not suffice", least(lambda: proof(s, found, p, work)) / n),
        (
            "half period of an orbit in a sweep: by an arithmetic-geometric mean",
            least(lambda: mean(orbits, found, scratch, answers)) / n,
        ),
        (
            "- by the trapezoidal rule, with error control",
            least(lambda: trapezoidal(orbits, found, given, scratch, answers)) / n,
        ),
    ]


def profile() -> list[str]:
    """Give the table, line by line."""
    rows = conservative() + dissipative() + sweeping()
    return ["| step | shortest time |", "|---|---|", *(f"| {what} | {readable(time)} |" for what, time in rows)]


if __name__ == "__main__":
    print("\n".join(profile()))
