"""One quantity over arrays of launches and parameters.

Most orbits are computed side by side in batches, others by a compiled loop over single launches (`scalar`). Those that
both leave undecided are solved one by one, as by `solve`.
"""

from collections.abc import Callable
from functools import partial
from math import inf, nan, prod
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.arguments import one_of, short
from gqm_sym.errors import GQMError, InputError, SolutionError
from gqm_sym.literals.numbers import Number, read_number
from gqm_sym.runtime.compiled.strided import PARAMETERS, lay_out, pointers, widen
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.recording import BoundTape
from gqm_sym.runtime.double_double.tapes import record
from gqm_sym.runtime.interface import ExactFormulas
from gqm_sym.runtime.launch.kinds import LOAD_EXTREMES
from gqm_sym.runtime.launch.request import LEAST_SPEED, MAX_LAPS, MAX_SPEED, ONLY_SIGN, LaunchRequest, check_contact
from gqm_sym.runtime.launch.rider import check_banked
from gqm_sym.runtime.legs.answers import Track
from gqm_sym.runtime.sweep import quantities, scalar
from gqm_sym.runtime.sweep.batch.batches import answer_batches
from gqm_sym.runtime.sweep.columns import as_doubles, broadcast_shape, check_launches, columns_of
from gqm_sym.runtime.sweep.dissipative_loop import MIN_BODIES_PER_THREAD, answer_driven, asked_of_bodies
from gqm_sym.runtime.sweep.exact_orbits import answer_exactly
from gqm_sym.runtime.sweep.groups import Group, groups_of, rests_on_corner
from gqm_sym.runtime.sweep.quantities import QUANTITIES, Answers, Quantity
from gqm_sym.runtime.sweep.result import Sweep
from gqm_sym.runtime.sweep.single.slow_places import NO_TAPE, RecordedFormulas
from gqm_sym.runtime.sweep.single.until import ROUNDED_TIME
from gqm_sym.runtime.sweep.small_swings import answer_small_swings
from gqm_sym.runtime.sweep.tables.panel_forces import ROW

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas

# The number of launches from which on a thread is worth starting, and the number of launches that are laid out at a
# time.
MIN_LAUNCHES_PER_THREAD, CHUNK = 2**11, 2**16

# The type of a function that returns the motion of one launch with given parameters.
Solve = Callable[[LaunchRequest, tuple[Any, ...]], Any]

# Quantities that batches compute themselves, as they do arrivals; for others they find the span of an orbit.
ANSWERED_BY_BATCHES = (quantities.HALF_PERIOD, quantities.PERIOD, quantities.TURNING_POINTS)

# Quantities for which the loop over launches always has a tape of the formulas, because V**2 cancels beside equilibria.
EXTREME_SPEEDS = (quantities.MIN_SPEED, quantities.MAX_SPEED)

# Quantities that are found from the tape if doubles do not suffice.
FROM_TAPE = (*ANSWERED_BY_BATCHES, quantities.ARRIVAL_TIME, quantities.END_TIME, *EXTREME_SPEEDS)


def sweep(
    formulas: "Formulas",
    quantity: str,
    launches: LaunchRequest,
    parameters: tuple[Any, ...],
    lam: Any,
    solve: Solve,
) -> Sweep:
    """Compute one quantity of the motion of each launch; all arguments except contact and t_max broadcast against each
    other.

    Parameters
    ----------
    formulas : Formulas
        The model of a generated module.
    quantity : str
        A name in `quantities.QUANTITIES`.
    launches : LaunchRequest
        Its ``lam0``, ``v0`` and ``direction`` may be arrays.
    parameters : tuple
        A number or an array for each run-time parameter.
    lam : number or array, optional
        The place for "time_at".
    solve : callable
        ``solve(request, parameters)`` is the motion of one launch.

    Raises
    ------
    InputError
        If the quantity, the contact or ``lam`` is not valid, shapes do not broadcast, or a launch is impossible.
    ParameterError
        If a parameter is missing, or outside of the range in which the closed forms hold.
    """
    return sweep_with_columns(formulas, quantity, launches, parameters, lam, solve)[0]


def sweep_with_columns(
    formulas: "Formulas",
    quantity: str,
    launches: LaunchRequest,
    parameters: tuple[Any, ...],
    lam: Any,
    solve: Solve,
    width: int = 0,
) -> tuple[Sweep, Array]:
    """Do what `sweep` does, and also return all columns that compiled code fills, a row for each launch.

    There are at least ``width`` columns. With UPPER_END + 1 of them the turning points are beside the times.
    """
    lam0, v0, direction, _, t_max, contact = launches
    found = QUANTITIES[one_of(quantity, tuple(QUANTITIES), where="quantity")]
    if quantity in LOAD_EXTREMES:
        check_banked(formulas, quantity)
    if (lam is None) == (quantity == "time_at"):
        raise InputError(
            f"lam: must be given with 'time_at', and with no other quantity, got {short(lam)} with {quantity!r}"
        )
    if t_max is not None and as_doubles(t_max, "t_max").ndim:
        raise InputError(f"t_max: must be one number, the same for all launches, got {short(t_max)}")
    check_contact(formulas, contact)
    names = ("lam0", "v0", "direction", "lam", *formulas.parameters)
    sources = (lam0, v0, direction, 0.0 if lam is None else lam, *parameters)
    named = {name: as_doubles(value, name) for value, name in zip(sources[:4], names, strict=False)}
    check_launches(named["v0"], named["direction"])
    given, domain = columns_of(formulas, parameters, named)
    arrays = [*named.values(), *given]
    shape = broadcast_shape(dict(zip(names, arrays, strict=False)))
    columns, domain = ([widen(array, shape) for array in of] for of in (arrays, domain))
    size = prod(shape)
    answers = Answers(np.empty((size, max(found.width, width))), np.empty(size, np.int8), np.empty(size, np.int8))
    answers.values.fill(nan)
    answers.status.fill(quantities.UNDECIDED)
    answers.route.fill(quantities.BATCH)
    asked, varies = asked_of_bodies(formulas, quantity, t_max, contact), any(array.ndim for array in given)
    if asked is not None or has_compiled_route(formulas, found, t_max):
        for group, chosen in groups_of(formulas, columns, domain, shape, ONLY_SIGN[contact]):
            if asked is None and group.liftoff_corners.size:
                continue  # tables do not contain corners
            some = answers if chosen is None else answers.part(chosen)
            if asked is not None:
                track = Track(group.chart, group.joints, group.corners, group.liftoff_corners, not varies)
                # If launches differ in run-time parameters, they have no equilibria in common.
                work = partial(answer_driven, formulas, asked, track, group.columns, some, by_places=varies)
                least = MIN_BODIES_PER_THREAD
            else:
                last = inf if t_max is None else as_doubles(t_max, "t_max").item()
                ask = Question(found.code, ONLY_SIGN[contact], last, _rounded_off(formulas, parameters))
                work, least = partial(_answer, formulas, ask, group, some), MIN_LAUNCHES_PER_THREAD
            run_in_threads(work, some.status.size, least)
            if asked is not None and (some.status == quantities.NEAR_EQUILIBRIUM).any():
                answer_small_swings(formulas, formulas.numbers(parameters), asked, track, group.columns, some)
            if asked is None and group.corners.size:
                some.status[np.broadcast_to(rests_on_corner(group), some.status.size)] = quantities.UNDECIDED
                if formulas.rolling_radius:  # as `rolling.check_launch` does
                    refuse(some)
            if chosen is not None:
                answers.put(chosen, some)
    beyond = [_beyond_doubles(columns[1])] + ([_too_far(columns[0], domain[2])] if domain else [])
    for refused in (found for found in beyond if found.any()):
        answers.status[np.broadcast_to(refused.ravel(), size)] = quantities.UNDECIDED
    values = answers.values[:, found.columns].copy() if width else answers.values[:, found.columns]
    for k in np.flatnonzero(answers.status == quantities.UNDECIDED):
        here = [s if np.ndim(s) == 0 else float(c.flat[k % c.size]) for s, c in zip(sources, columns, strict=False)]
        values[k], answers.status[k] = _solved(solve, found, here, t_max, contact)
        answers.route[k] = quantities.SOLVE
    swept = Sweep(values.reshape(shape + values.shape[1:]), answers.status.reshape(shape), answers.route.reshape(shape))
    return swept, answers.values


def refuse(answers: Answers) -> None:
    """Refuse all launches that are possible as such."""
    refused = ~np.isin(answers.status, (quantities.NOT_FINITE, quantities.OUTSIDE_DOMAIN))
    answers.values[refused], answers.status[refused] = nan, quantities.REFUSED


def _beyond_doubles(v0: Array) -> NDArray[np.bool_]:
    """Return which launches `solve` refuses because the square of the speed is beyond doubles."""
    found: NDArray[np.bool_] = ((v0 > MAX_SPEED) & (v0 < inf)) | ((v0 > 0.0) & (v0 < LEAST_SPEED))
    return found


def _too_far(lam0: Array, period: Array) -> NDArray[np.bool_]:
    """Return which launches `solve` refuses because doubles do not resolve places so many laps away."""
    if period.ndim == 0:
        last: Any = MAX_LAPS * period.item() if period.item() > 0.0 else inf
    else:
        last = np.where(period > 0.0, MAX_LAPS * period, inf)
    found: NDArray[np.bool_] = np.abs(lam0) > last
    return found


def has_compiled_route(formulas: "Formulas", quantity: Quantity, t_max: Any) -> bool:
    """Return whether compiled loops can compute the quantity for most launches; not for motions that lose energy."""
    timely = t_max is None or float(as_doubles(t_max, "t_max")) > 0.0
    return formulas.dissipation is None and quantity.code != quantities.NOT_COMPILED and timely


class Question(NamedTuple):
    """The question for all launches: the code of a quantity, and the side and the last time as in `GivenCurve`.

    ``lows`` are the differences of the run-time parameters from their doubles; they are 0 for arrays.
    """

    code: int
    side: int
    t_max: float
    lows: Array


def _answer(formulas: "Formulas", asked: Question, group: Group, answers: Answers, part: slice) -> None:
    """Fill the answers of a part of a group of launches by compiled loops, as far as these decide them."""
    columns, chart, joints, table = group.columns, group.chart, group.joints, group.table
    mass = list(formulas.parameters).index("m")
    code, batches = asked.code, formulas.batch if asked.side == 0 and asked.code != quantities.END_TIME else None
    for begin in range(part.start, part.stop, CHUNK):
        chunk = slice(begin, min(begin + CHUNK, part.stop))
        lines = lay_out(columns, chunk.start, chunk.stop)
        launches, found = (pointers(lines), formulas.monotone), answers.part(chunk)
        spans = found.values if code in ANSWERED_BY_BATCHES else np.empty((found.status.size, 2))
        exact = _recorded(formulas, asked.lows) if batches is not None or code in FROM_TAPE else NO_TAPE
        if batches is not None:
            arrives = code == quantities.ARRIVAL_TIME and exact.work.size and not joints.size
            wanted = code if code in ANSWERED_BY_BATCHES or arrives else quantities.SPANS
            layout = (batches.orbit_rows, batches.integrand_rows, formulas.inertia_row)
            in_batches, asked_for = partial(answer_batches, batches.addresses(), layout), found._replace(values=spans)
            in_batches(*launches, wanted, False, exact, asked_for)
            undecided = found.status == quantities.UNDECIDED
            if exact.work.size and undecided.any():
                left = np.flatnonzero(undecided)
                again = [line if line.size == 1 else line[left] for line in lines]
                some = asked_for.part(left)
                in_batches(pointers(again), formulas.monotone, wanted, True, exact, some)
                asked_for.put(left, some)
            if arrives:
                take_arrivals(spans[:, 0], asked.t_max, found)
            open_ones = (found.status == quantities.UNDECIDED) | (found.status == quantities.SPAN_KNOWN)
            if wanted == code and not open_ones.any():
                continue
        if group.table_between_ends and (found.status == quantities.UNDECIDED).any():
            table, _ = group.table_between_ends()
        parameters = np.concatenate([np.empty(len(lines) - PARAMETERS), chart])
        factors = lay_out(group.factors, chunk.start, chunk.stop)
        buffers = np.full(len(factors), nan), np.empty((len(table.paths), ROW)), np.zeros(len(table.paths), np.int8)
        shared = parameters, joints, table, pointers(factors), *buffers, mass, group.ends
        in_space, loads = (made.address if made else 0 for made in (formulas.path_in_space, formulas.rider_loads))
        of_force = formulas.signed, in_space, formulas.directed, loads
        at_once = exact if code in EXTREME_SPEEDS else NO_TAPE
        given = scalar.GivenCurve(*shared, asked.side, asked.t_max, at_once, *of_force)
        one_by_one = partial(scalar.answer_one_by_one, formulas.functions.addresses(), *launches)
        if code in ANSWERED_BY_BATCHES and exact.work.size:
            spans = np.empty((found.status.size, 2))
            one_by_one(quantities.SPANS, spans, found._replace(values=spans), given)
            answer_exactly(exact, launches[0], code, spans, found)
        one_by_one(code, spans, found, given)
        if code in FROM_TAPE and code not in EXTREME_SPEEDS and (found.status == quantities.UNDECIDED).any():
            one_by_one(code, spans, found, given._replace(exact=exact))


def take_arrivals(times: Array, t_max: float, answers: Answers) -> None:
    """Take the times of launches that batches have answered; one after the last time is none, and one close to it is
    left to the exact problem.
    """
    there = np.flatnonzero(answers.status == quantities.ANSWERED)
    found = times[there]
    early, late = found <= t_max * (1.0 - ROUNDED_TIME), found * (1.0 - ROUNDED_TIME) >= t_max
    answers.values[there[early], 0] = found[early]
    answers.status[there[~early]] = np.where(late, quantities.NEVER_THERE, quantities.UNDECIDED)[~early]


def _recorded(formulas: "Formulas", lows: Array) -> RecordedFormulas:
    """Return the formulas of a curve as a tape with its own registers; an empty tape for a chart, or if they are too
    long.
    """
    exact, domain, count = formulas.exact, formulas.domain_of, lows.size
    recorded = record(exact, domain, count) if isinstance(exact, ExactFormulas) and domain is not None else None
    if recorded is None:
        return NO_TAPE
    tape, work = recorded
    return RecordedFormulas(*BoundTape(tape, work.copy(), np.array([np.zeros(count), lows])).operands)


def _rounded_off(formulas: "Formulas", parameters: tuple[Any, ...]) -> Array:
    """Return the differences of the run-time parameters from their doubles, which are 0 for arrays."""
    lows = np.zeros(len(parameters))
    for k, (name, value) in enumerate(zip(formulas.parameters, parameters, strict=True)):
        if isinstance(value, (str, Number)):
            lows[k] = read_number(value, where=name, unit=formulas.units.get(name)).low
    return lows


def _solved(
    solve: Solve,
    quantity: Quantity,
    here: list[Any],
    t_max: Any,
    contact: str,
) -> tuple[Any, int]:
    """Return the quantity of one launch that is solved separately, and its status."""
    lam0, v0, direction, place, *parameters = here
    try:
        motion = solve(LaunchRequest(lam0, v0, int(direction), None, t_max, contact), tuple(parameters))
    except GQMError:
        return nan, quantities.REFUSED
    try:
        value = quantity.of_motion(motion, place)
    except SolutionError:
        return nan, quantities.NEVER_THERE if quantity.code == quantities.ARRIVAL_TIME else quantities.NOT_PERIODIC
    return value, quantities.NOT_PERIODIC if np.isnan(value).any() else quantities.ANSWERED
