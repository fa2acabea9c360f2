"""One quantity over arrays of launches and parameters.

Most orbits are answered side by side in batches, others by a compiled loop over single launches (`scalar`); those that
both leave undecided are solved one by one, as `solve` does it.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache, partial
from math import inf, isfinite, nan, prod
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.arguments import not_given, one_of, short
from gqm_sym.errors import GQMError, InputError, ParameterError, SolutionError
from gqm_sym.literals.namespaces import ARRAYS
from gqm_sym.literals.numbers import Number, doubles_at_once, read_number
from gqm_sym.runtime.charts.chart import CORNER_ROUNDINGS, ChartMaker
from gqm_sym.runtime.charts.true_parts import NO_PARTS, parts_along
from gqm_sym.runtime.compiled.strided import DOMAIN_PERIOD, LAM0, PARAMETERS, V0, lay_out, pointers, widen
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.recording import BoundTape, record
from gqm_sym.runtime.interface import ExactFormulas, ExactPotential
from gqm_sym.runtime.launch.formulas import chart_with, true_pieces_of
from gqm_sym.runtime.launch.kinds import LOAD_EXTREMES
from gqm_sym.runtime.launch.request import ONLY_SIGN, LaunchRequest, check_contact
from gqm_sym.runtime.launch.rider import check_banked
from gqm_sym.runtime.launch.speed import path_and_force_at, potential_at
from gqm_sym.runtime.legs.answers import Track
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE
from gqm_sym.runtime.sweep import quantities, scalar
from gqm_sym.runtime.sweep.batch.batches import answer_batches
from gqm_sym.runtime.sweep.curve_table import NO_TABLE, CurveTable, Source, tabulate
from gqm_sym.runtime.sweep.dissipative_loop import MIN_BODIES_PER_THREAD, answer_driven, asked_of_bodies
from gqm_sym.runtime.sweep.orbit import CONTACT_ENDS, CURVE_ENDS, NO_ENDS
from gqm_sym.runtime.sweep.panel_forces import ROW
from gqm_sym.runtime.sweep.quantities import QUANTITIES, Answers, Quantity
from gqm_sym.runtime.sweep.result import Sweep
from gqm_sym.runtime.sweep.slow_places import NO_TAPE, RecordedFormulas

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas


# From how many launches on a thread is worth starting, and how many are laid out at a time.
MIN_LAUNCHES_PER_THREAD, CHUNK = 2**11, 2**16

# What one number is given as, and up to where all integers are doubles.
ONE_NUMBER, MAX_EXACT_INTEGER = (float, int, str, Number), 2**53

# The motion of one launch with given parameters.
Solve = Callable[[LaunchRequest, tuple[Any, ...]], Any]

# Quantities that are answered by batches themselves; for others batches find the span of an orbit.
ANSWERED_BY_BATCHES = (quantities.HALF_PERIOD, quantities.PERIOD, quantities.TURNING_POINTS)

# Quantities that are times, which are found in parts where V**2 all but vanishes.
IN_PARTS = (quantities.HALF_PERIOD, quantities.PERIOD, quantities.ARRIVAL_TIME, quantities.END_TIME)

# Into how many pieces a curve with formulas is cut at least before it is tabulated. By which share of itself the range
# of launch places is extended at first, so that it contains all motions, and how often that is doubled.
MIN_PIECES, FIRST_SHARE, MAX_DOUBLINGS = 64, 0.125, 10


def sweep(
    formulas: "Formulas",
    quantity: str,
    launches: LaunchRequest,
    parameters: tuple[Any, ...],
    lam: Any,
    solve: Solve,
) -> Sweep:
    """One quantity of the motion of each launch; all arguments but contact and t_max broadcast against each other.

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
        The place that "time_at" asks about.
    solve : callable
        ``solve(request, parameters)`` is the motion of one launch.

    Raises
    ------
    InputError
        If the quantity, the contact or ``lam`` cannot be, shapes do not broadcast, or a launch is impossible.
    ParameterError
        If a parameter is missing or outside of what the closed forms hold for.
    """
    lam0, v0, direction, _, t_max, contact = launches
    found = QUANTITIES[one_of(quantity, tuple(QUANTITIES), where="quantity")]
    if quantity in LOAD_EXTREMES:
        check_banked(formulas, quantity)
    if (lam is None) == (quantity == "time_at"):
        raise InputError(f"lam: is the place that 'time_at' asks about, got {short(lam)} with {quantity!r}")
    if t_max is not None and as_doubles(t_max, "t_max").ndim:
        raise InputError(f"t_max: must be one number, the same for all launches, got {short(t_max)}")
    check_contact(formulas, contact)
    names = ("lam0", "v0", "direction", "lam", *formulas.parameters)
    sources = (lam0, v0, direction, 0.0 if lam is None else lam, *parameters)
    named = {name: as_doubles(value, name) for value, name in zip(sources[:4], names, strict=False)}
    _check_launches(named["v0"], named["direction"])
    given, domain = _columns(formulas, parameters, named)
    arrays = [*named.values(), *given]
    shape = broadcast_shape(dict(zip(names, arrays, strict=False)))
    columns, domain = ([widen(array, shape) for array in of] for of in (arrays, domain))
    size = prod(shape)
    answers = Answers(
        np.full((size, found.width), nan),
        np.full(size, quantities.UNDECIDED, dtype=np.int8),
        np.full(size, quantities.BATCH, dtype=np.int8),
    )
    asked = asked_of_bodies(formulas, quantity, t_max, contact)
    if asked is not None or has_compiled_route(formulas, found, t_max):
        for group, chosen in _groups(formulas, columns, domain, shape, ONLY_SIGN[contact]):
            if asked is None and group.drops.size:
                continue  # tables know no corners
            some = answers if chosen is None else answers.part(chosen)
            if asked is not None:
                track = Track(group.chart, group.joints, group.corners, group.drops)
                work, least = partial(answer_driven, formulas, asked, track, group.columns, some), MIN_BODIES_PER_THREAD
            else:
                last = inf if t_max is None else as_doubles(t_max, "t_max").item()
                ask = Asked(found.code, ONLY_SIGN[contact], last, _rounded_off(formulas, parameters))
                work, least = partial(_answer, formulas, ask, group, some), MIN_LAUNCHES_PER_THREAD
            run_in_threads(work, some.status.size, least)
            if asked is None and group.corners.size:
                some.status[np.broadcast_to(_rests_on_corner(group), some.status.size)] = quantities.UNDECIDED
            if chosen is not None:
                answers.put(chosen, some)
    values = answers.values[:, found.columns]
    for k in np.flatnonzero(answers.status == quantities.UNDECIDED):
        here = [s if np.ndim(s) == 0 else float(c.flat[k % c.size]) for s, c in zip(sources, columns, strict=False)]
        values[k], answers.status[k] = _solved(solve, found, here, t_max, contact)
        answers.route[k] = quantities.SOLVE
    return Sweep(values.reshape(shape + values.shape[1:]), answers.status.reshape(shape), answers.route.reshape(shape))


def has_compiled_route(formulas: "Formulas", quantity: Quantity, t_max: Any) -> bool:
    """Whether compiled loops answer most launches.

    They do not for motions that lose energy, and of motions with a last time they know only when they end. The grid on
    which they look for extremes is too coarse for the length of a vector, which may be all but zero somewhere.
    """
    if not formulas.signed and quantity.code in (quantities.MIN_FORCE, quantities.MAX_FORCE):
        return False
    timely = t_max is None or (quantity.code == quantities.END_TIME and float(as_doubles(t_max, "t_max")) > 0.0)
    return formulas.dissipation is None and quantity.code != quantities.NOT_COMPILED and timely


def broadcast_shape(columns: Mapping[str, Array]) -> tuple[int, ...]:
    """The shape that named arrays broadcast to."""
    different = {column.shape for column in columns.values()} - {()}
    if len(different) <= 1:
        return next(iter(different), ())
    try:
        return np.broadcast_shapes(*different)
    except ValueError:
        shapes = ", ".join(f"{name} {column.shape}" for name, column in columns.items() if column.shape)
        raise InputError(f"sweep: these shapes do not broadcast against each other: {shapes}") from None


def as_doubles(value: Any, name: str) -> Array:
    """Numbers as doubles; text and exact numbers by their nearest."""
    if type(value) is float or (type(value) is int and abs(value) <= MAX_EXACT_INTEGER):
        return np.array(float(value))
    if type(value) is str:
        return np.array(_of_text(value, name))
    if value is None:
        raise ParameterError(not_given(name))
    if isinstance(value, np.ndarray) and value.dtype.kind in "fiu":
        return value.astype(np.float64, copy=False)
    doubles = doubles_at_once(value)
    if doubles is not None:
        return doubles
    array = np.asarray(value, dtype=object)
    numbers = [v if isinstance(v, float) else read_number(v, where=name).value for v in array.reshape(-1)]
    return np.array(numbers, dtype=np.float64).reshape(array.shape)


@lru_cache(maxsize=256)
def _of_text(value: str, name: str) -> float:
    return read_number(value, where=name).value


def _check_launches(v0: Array, direction: Array) -> None:
    """Refuse what no launch of a sweep may be."""
    if (v0 < 0.0).any():
        raise InputError("v0: is a speed and cannot be negative; use direction=-1 to launch the other way")
    if (np.abs(direction) != 1.0).any():
        raise InputError("direction: must be 1 or -1 (the sign of ds/dt at launch)")


def _check(formulas: "Formulas", columns: dict[str, Array]) -> None:
    """Refuse parameters for which the closed forms do not hold, and those below the limits that the model has."""
    for name in (*formulas.positive, "m"):
        if (columns[name] <= 0.0).any():
            raise ParameterError(f"{name}: must be positive; the closed forms hold for {name} > 0")
    for name, lower in formulas.at_least:
        bound = columns[lower] if lower in columns else read_number(lower, where=lower).value
        if (columns[name] < bound).any():
            raise ParameterError(f"{name}: must be at least {lower}")


def _columns(
    formulas: "Formulas", given: tuple[Any, ...], launches: dict[str, Array]
) -> tuple[list[Array], list[Array]]:
    """The columns of the parameters, with what stands behind them, and those of the curve's domain.

    Where all launches have the same parameters, they are found once; otherwise they must broadcast with the launches.
    """
    if all(isinstance(value, ONE_NUMBER) or not (isinstance(value, np.ndarray) or np.ndim(value)) for value in given):
        numbers = formulas.numbers(given)
        if numbers.columns is None:
            p = list(map(np.array, numbers.values))
            numbers.columns = p, list(_domain_columns(formulas, p))
        columns: tuple[list[Array], list[Array]] = numbers.columns
        return columns
    named = {name: as_doubles(value, name) for value, name in zip(given, formulas.parameters, strict=True)}
    _check(formulas, named)
    broadcast_shape({**launches, **named})
    p = list(named.values())
    if formulas.trigonometric is not None:
        p += map(np.asarray, formulas.trigonometric_over(ARRAYS, tuple(p)))
    return p, list(_domain_columns(formulas, p))


def _domain_columns(formulas: "Formulas", p: list[Array]) -> Iterator[Array]:
    """The domain and the axes of symmetry of each launch's curve, in the order of `strided`; none of a chart."""
    if formulas.chart is not None:
        return
    place, step = formulas.axes(ARRAYS, tuple(p))
    found = (*formulas.ends(ARRAYS, tuple(p)), place, _rounding_of_axis(formulas, place, p), step)
    for value, default in zip(found, (-inf, inf, 0.0, nan, nan, 0.0), strict=True):
        yield np.asarray(default if value is None else value, dtype=np.float64)


def _rounding_of_axis(formulas: "Formulas", place: Any, p: list[Array]) -> float | None:
    """The difference between the axis of symmetry and its nearest double, if the axis is the same for all launches."""
    if place is None or np.ndim(place) or not all(column.size for column in p):
        return None
    return _rounding_of(formulas.axes, float(place), tuple(float(column.flat[0]) for column in p))


@lru_cache(maxsize=256)
def _rounding_of(axes: Callable[..., Any], place: float, values: tuple[float, ...]) -> float:
    from mpmath import mp

    with mp.workdps(40):
        return float(mp.mpf(axes(mp, tuple(map(mp.mpf, values)))[0]) - mp.mpf(place))


class Asked(NamedTuple):
    """What is asked of all launches: the code of a quantity, and side and last time as `GivenCurve` has them.

    ``lows`` is by how much each run-time parameter differs from its double, 0 of those that are arrays.
    """

    code: int
    side: int
    t_max: float
    lows: Array


# The factors of a potential and a load that are tabulated as a whole.
_WHOLE = [np.ones(1), np.ones(1)]


class Group(NamedTuple):
    """Launches on curves of one shape, which share a table.

    Attributes
    ----------
    columns : list of arrays
        The launches, in the order of `strided`; each array has one number, or one for each launch.
    chart, joints, corners, drops : arrays
        What compiled code reads behind the parameters, and the places within one period at which the curve is not
        smooth, or at which pieces of the chart meet, at which its tangent jumps, and at which contact is lost; all are
        empty for a curve with formulas.
    table : CurveTable
        The curve tabulated, where no energy is lost.
    factors : list of arrays
        What each launch multiplies the parts of potential and load in the table with.
    ends : int
        What both ends of the table, or of the curve where there is none, are (`SweptCurve`).
    """

    columns: list[Array]
    chart: Array = NOWHERE
    joints: Array = NOWHERE
    corners: Array = NOWHERE
    drops: Array = NOWHERE
    table: CurveTable = NO_TABLE
    factors: list[Array] = _WHOLE
    ends: int = NO_ENDS


def _groups(
    formulas: "Formulas", columns: list[Array], domain: list[Array], shape: tuple[int, ...], only_sign: int
) -> Iterator[tuple[Group, NDArray[np.intp] | None]]:
    """The launches, grouped by the shape of their curve, and which they are; None where all are of one shape.

    Launches whose curve cannot be made are in no group. Curves with formulas are tabulated if bodies may lift off.
    """
    if formulas.chart is None:
        may_lift_off = only_sign and not formulas.dissipation
        table, ends = NO_TABLE, CURVE_ENDS
        if may_lift_off:
            table, ends = _tabulated_range(formulas, columns, domain, only_sign)
        yield Group([*columns[:4], *domain, *columns[4:]], table=table, ends=ends), None
        return
    held, factors = _held(formulas, len(columns) - 4), _WHOLE
    if formulas.separated is not None and formulas.dissipation is None:
        factors = [widen(factor, shape) for factor in formulas.separated_factors(columns[4:])]
    for found, chosen in _distinct([columns[4 + k] for k in held], shape):
        given = dict(zip(held, found, strict=True))
        values = tuple(given.get(k, 1.0) for k in range(len(columns) - 4))
        try:
            chart = chart_with(formulas.chart, values)
        except GQMError:
            continue  # `solve` says why
        domain = [np.array(value) for value in (*chart.range, nan, nan, 0.0)]
        table = NO_TABLE
        if not formulas.dissipation:
            radius = dict(zip(formulas.parameters, values, strict=False)).get(formulas.rolling_radius, 0.0)
            made_from = _source(formulas), _exact_parts(formulas), radius, len(formulas.parameters)
            table = _tabulated(formulas.chart, *made_from, values)
        some, theirs = columns, factors
        if chosen is not None:
            some, theirs = ([_chosen(column, shape, chosen) for column in of] for of in (columns, factors))
        has_ends = not chart.period and chart.ends == ("domain-end", "domain-end")
        ends = CURVE_ENDS if has_ends else NO_ENDS
        launches, drops = [*some[:4], *domain, *some[4:]], chart.corners[chart.bends * only_sign < 0.0]
        # Bodies that lose energy pass the chart piece by piece.
        joints = chart.breaks if not formulas.dissipation else chart.inner_edges
        yield Group(launches, chart.block, joints, chart.corners, drops, table, theirs, ends), chosen


def _held(formulas: "Formulas", count: int) -> list[int]:
    """Which run-time parameters, with what stands behind them, launches of one group have in common.

    The curve and its table depend on no others; bodies that lose energy are driven with all parameters the same.
    """
    shaped_by = None if formulas.chart is None else formulas.chart.shaped_by
    if formulas.separated is None or formulas.dissipation is not None or shaped_by is None:
        return list(range(count))
    return sorted({*shaped_by, *formulas.separated.held})


def _source(formulas: "Formulas") -> Source:
    """What a table of the model's potential and load is made from."""
    terms, mass = formulas.separated, list(formulas.parameters).index("m")
    if terms is None:
        return Source(formulas.functions.addresses(), 0, 1, 1, mass)
    return Source(formulas.functions.addresses(), terms.function.address, terms.potentials, terms.loads, mass)


def _rests_on_corner(group: Group) -> NDArray[np.bool_]:
    """Whether each launch is from rest on a corner, so that it takes the direction of launch."""
    lam0, v0, period = group.columns[LAM0].reshape(-1), group.columns[V0].reshape(-1), group.columns[DOMAIN_PERIOD]
    near, found = CORNER_ROUNDINGS * np.spacing(np.abs(lam0)), np.zeros(1, dtype=np.bool_)
    for corner in group.corners if np.any(v0 == 0.0) else ():
        off = lam0 - corner
        found = found | (np.abs(off - period * np.round(off / period) if period else off) <= near)
    on_corner: NDArray[np.bool_] = found & (v0 == 0.0)
    return on_corner


def _tabulated_range(
    formulas: "Formulas", columns: list[Array], domain: list[Array], only_sign: int
) -> tuple[CurveTable, int]:
    """The table of a curve with formulas on the range of all motions, and what its ends are.

    It is empty if launches differ in parameters.
    """
    low, high, period = domain[:3]
    if not all(column.size == 1 for column in (low, high, period, *columns[4:])) or not columns[0].size:
        return NO_TABLE, NO_ENDS
    p = np.array([column.item() for column in columns[4:]])
    first, last, places = low.item(), high.item(), np.ascontiguousarray(columns[0]).reshape(-1)
    ends = NO_ENDS
    if period.item() > 0.0:
        first, last = 0.0, period.item()
    elif isfinite(first) and isfinite(last):
        ends = CURVE_ENDS
    else:
        if not np.isfinite(places).all():
            return NO_TABLE, NO_ENDS
        # From all launches outwards, until the potential is above the energy of each or none is in contact any more.
        fns, closed, reach = formulas.functions.addresses(), 0, [float(places.min()), float(places.max())]
        heights, energies = potential_at(fns, p, places)[0], 0.5 * columns[1] ** 2
        energy = np.array([np.min(heights) + np.min(energies), np.max(heights) + np.max(energies)])
        for side, (limit, sense) in enumerate(((first, -1.0), (last, 1.0))):
            width = FIRST_SHARE * float(np.ptp(places)) or 1.0
            for _ in range(MAX_DOUBLINGS):
                place = reach[side] + sense * width
                reach[side] = max(place, limit) if side == 0 else min(place, limit)
                both = np.repeat(reach[side], 2)
                v2 = 2.0 * (energy - potential_at(fns, p, both)[0])
                force = path_and_force_at(fns, p, both, np.maximum(v2, 0.0))[4]  # it is linear in the energy
                if not v2[1] > 0.0 or (only_sign * force < 0.0).all():
                    closed += 1
                    break
                width *= 2.0
        first, last = reach
        ends = CONTACT_ENDS if closed == 2 else NO_ENDS
    return _tabulated_between(formulas.exact, _source(formulas), tuple(p.tolist()), first, last), ends


@lru_cache(maxsize=8)
def _tabulated_between(exact: Any, source: Source, values: tuple[float, ...], first: float, last: float) -> CurveTable:
    """The table of a curve with formulas between two places; it is made once for the same parameters.

    The exact formulas tell modules apart whose functions stood at the same place in memory, one after the other.
    """
    pieces = np.linspace(first, last, MIN_PIECES + 1)
    return CurveTable(*tabulate(source, NO_PARTS, np.array(values), pieces))


def _exact_parts(formulas: "Formulas") -> Callable[..., Any] | None:
    """The function that gives the parts of the potential by coordinates, and perhaps more behind them."""
    if formulas.separated is not None:
        return formulas.separated.parts
    return formulas.exact.effective_potential if isinstance(formulas.exact, ExactPotential) else None


@lru_cache(maxsize=8)
def _tabulated(
    maker: ChartMaker,
    source: Source,
    exact_parts: Callable[..., Any] | None,
    radius: float,
    parameters: int,
    values: tuple[float, ...],
) -> CurveTable:
    """The table of a chart; it is made once for the same parameters. Behind these many stand functions of them."""
    chart, true = chart_with(maker, values), None
    if exact_parts is not None and maker.is_exact(chart):
        p = tuple(read_number(value, where="p") for value in values)
        try:
            pieces = true_pieces_of(maker, p[:parameters], chart)
            true = pieces and parts_along(pieces, exact_parts, source.potentials, p, (radius, 0.0))
        except GQMError:
            true = None  # then the table has the digits of the chart
    p_and_chart = np.concatenate([values, chart.block])
    return CurveTable(*tabulate(source, true or NO_PARTS, p_and_chart, chart.edges))


def _distinct(
    columns: list[Array], shape: tuple[int, ...]
) -> Iterator[tuple[tuple[float, ...], NDArray[np.intp] | None]]:
    """The different sets of values that columns have, and which elements have each; None where all have the same."""
    if all(column.size == 1 for column in columns):
        yield tuple(float(column.flat[0]) for column in columns), None
        return
    rows = np.column_stack([np.broadcast_to(column, shape).reshape(-1) for column in columns])
    different, which = np.unique(rows, axis=0, return_inverse=True)
    order = np.argsort(which.reshape(-1), kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(which.reshape(-1)))[:-1])
    yield from zip(map(tuple, different.tolist()), parts, strict=True)


def _chosen(column: Array, shape: tuple[int, ...], chosen: NDArray[np.intp]) -> Array:
    """Elements of a column, which is broadcast to a shape."""
    return column if column.size == 1 else np.broadcast_to(column, shape).reshape(-1)[chosen]


def _answer(formulas: "Formulas", asked: Asked, group: Group, answers: Answers, part: slice) -> None:
    """Answer a part of a group of launches by compiled loops, as far as they decide them."""
    columns, chart, joints, table = group.columns, group.chart, group.joints, group.table
    mass = list(formulas.parameters).index("m")
    code, batches = asked.code, formulas.batch if asked.side == 0 and asked.code != quantities.END_TIME else None
    for begin in range(part.start, part.stop, CHUNK):
        chunk = slice(begin, min(begin + CHUNK, part.stop))
        lines = lay_out(columns, chunk.start, chunk.stop)
        launches, found = (pointers(lines), formulas.monotone), answers.part(chunk)
        spans = found.values if code in ANSWERED_BY_BATCHES else np.empty((found.status.size, 2))
        if batches is not None:
            wanted = code if code in ANSWERED_BY_BATCHES else quantities.SPANS
            counts = (batches.orbit_rows, batches.integrand_rows)
            answer_batches(batches.addresses(), counts, *launches, wanted, found._replace(values=spans))
            if wanted == code and not (found.status == quantities.UNDECIDED).any():
                continue
        parameters = np.concatenate([np.empty(len(lines) - PARAMETERS), chart])
        factors = lay_out(group.factors, chunk.start, chunk.stop)
        buffers = np.full(len(factors), nan), np.empty((len(table.paths), ROW)), np.zeros(len(table.paths), np.int8)
        shared = parameters, joints, table, pointers(factors), *buffers, mass, group.ends
        given = scalar.GivenCurve(*shared, asked.side, asked.t_max, NO_TAPE)
        scalar.answer_one_by_one(formulas.functions.addresses(), *launches, code, spans, found, given)
        if code in IN_PARTS and (found.status == quantities.UNDECIDED).any():
            given = given._replace(exact=_recorded(formulas, asked.lows))
            scalar.answer_one_by_one(formulas.functions.addresses(), *launches, code, spans, found, given)


def _recorded(formulas: "Formulas", lows: Array) -> RecordedFormulas:
    """The formulas of a curve as a tape, with registers of its own; none of a chart, or where they are too long."""
    exact, domain, count = formulas.exact, formulas.domain_of, lows.size
    recorded = record(exact, domain, count) if isinstance(exact, ExactFormulas) and domain is not None else None
    if recorded is None:
        return NO_TAPE
    tape, work = recorded
    return RecordedFormulas(*BoundTape(tape, work.copy(), np.array([np.zeros(count), lows])).operands)


def _rounded_off(formulas: "Formulas", parameters: tuple[Any, ...]) -> Array:
    """By how much each run-time parameter differs from its double, 0 of those that are arrays."""
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
    """The quantity of one launch that is solved by itself, and its status."""
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
