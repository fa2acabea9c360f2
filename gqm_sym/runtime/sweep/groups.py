"""Groups of launches of a sweep on curves of the same shape, which share a chart and a table."""

from collections.abc import Callable, Iterator
from functools import lru_cache, partial
from math import isfinite, nan
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.errors import GQMError, SolutionError
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.charts.chart import CORNER_ROUNDINGS, ChartMaker
from gqm_sym.runtime.charts.double_double.parts import NO_PARTS, parts_along
from gqm_sym.runtime.compiled.strided import DOMAIN_PERIOD, LAM0, V0, widen
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.interface import ExactPotential
from gqm_sym.runtime.launch.formulas import chart_with, true_pieces_of
from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.launch.speed import potential_at
from gqm_sym.runtime.motion.events import sided_force
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE
from gqm_sym.runtime.sweep.orbit import CONTACT_ENDS, CURVE_ENDS, NO_ENDS
from gqm_sym.runtime.sweep.tables.layout import NO_TABLE, CurveTable
from gqm_sym.runtime.sweep.tables.tabulate import Source, tabulate

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas


# The smallest number of pieces into which a curve with formulas is cut before it is tabulated; the share by which the
# range of launch places is first extended in order to contain all motions; and the largest number of times that this
# share is doubled.
MIN_PIECES, FIRST_SHARE, MAX_DOUBLINGS = 64, 0.125, 10

# The factors of a potential and a load that are tabulated as a whole.
_WHOLE = [np.ones(1), np.ones(1)]


class Group(NamedTuple):
    """Launches on curves of the same shape, which share a table.

    Attributes
    ----------
    columns : list of arrays
        The launches, in the order of `strided`; each array has one number, or one for each launch.
    chart, joints, corners, liftoff_corners : arrays
        The chart, which compiled code reads after the parameters; and the places within one period at which the curve
        is not smooth or pieces of the chart meet, at which the tangent jumps, and at which contact is lost. All are
        empty for a curve with formulas.
    table : CurveTable
        The table of the curve, if no energy is lost.
    factors : list of arrays
        The factors of each launch for the parts of potential and load in the table.
    ends : int
        The kind of both ends of the table, or of the curve if there is no table (`SweptCurve`).
    table_between_ends : callable, optional
        Makes the table of a curve with formulas that has two ends, which only bodies that leave the curve need, and
        returns the kind of its ends too.
    """

    columns: list[Array]
    chart: Array = NOWHERE
    joints: Array = NOWHERE
    corners: Array = NOWHERE
    liftoff_corners: Array = NOWHERE
    table: CurveTable = NO_TABLE
    factors: list[Array] = _WHOLE
    ends: int = NO_ENDS
    table_between_ends: Callable[[], tuple[CurveTable, int]] | None = None


def groups_of(
    formulas: "Formulas", columns: list[Array], domain: list[Array], shape: tuple[int, ...], only_sign: int
) -> Iterator[tuple[Group, NDArray[np.intp] | None]]:
    """Return the launches grouped by the shape of their curve, with their indices; None instead of indices if all have
    the same shape.

    Launches whose curve cannot be made belong to no group. Curves with formulas are tabulated if bodies may lift off or
    leave them at an end.
    """
    if formulas.chart is None:
        table, later, ends = NO_TABLE, None, CURVE_ENDS
        if only_sign and not formulas.dissipation:
            table, ends = _tabulated_range(formulas, columns, domain, only_sign)
        elif not formulas.dissipation and np.isfinite(domain[0]).all() and np.isfinite(domain[1]).all():
            later = partial(_tabulated_range, formulas, columns, domain, only_sign)
        yield Group([*columns[:4], *domain, *columns[4:]], table=table, table_between_ends=later, ends=ends), None
        return
    common, factors = _common_parameters(formulas, len(columns) - 4), _WHOLE
    if formulas.separated is not None and formulas.dissipation is None:
        factors = [widen(factor, shape) for factor in formulas.separated_factors(columns[4:])]
    for found, chosen in _distinct([columns[4 + k] for k in common], shape):
        if formulas.dissipation is not None:
            chosen = _by_parameters(columns[4:], shape, chosen)
        given = dict(zip(common, found, strict=True))
        values = tuple(given.get(k, 1.0) for k in range(len(columns) - 4))
        try:
            chart = chart_with(formulas.chart, values)
        except GQMError:
            continue  # `solve` reports the reason
        domain = [np.array(value) for value in (*chart.range, nan, nan, 0.0, 0.0)]
        table = NO_TABLE
        if not formulas.dissipation:
            radius = dict(zip(formulas.parameters, values, strict=False)).get(formulas.rolling_radius, 0.0)
            made_from = _source(formulas, only_sign), _exact_parts(formulas), radius, len(formulas.parameters)
            table = tabulated(formulas.chart, *made_from, values)
        some, theirs = columns, factors
        if chosen is not None:
            some, theirs = ([_chosen(column, shape, chosen) for column in of] for of in (columns, factors))
        has_ends = not chart.period and chart.ends == ("domain-end", "domain-end")
        ends = CURVE_ENDS if has_ends else NO_ENDS
        launches, liftoff_corners = [*some[:4], *domain, *some[4:]], chart.corners[chart.bends * only_sign < 0.0]
        # Bodies that lose energy pass the chart piece by piece.
        joints = chart.breaks if not formulas.dissipation else chart.inner_edges
        yield Group(launches, chart.block, joints, chart.corners, liftoff_corners, table, theirs, ends), chosen


def _common_parameters(formulas: "Formulas", count: int) -> list[int]:
    """Return the indices of the run-time parameters, and of the chart after them, that the launches of one group have
    in common.

    The curve and its table depend on no others. Bodies that lose energy have no table.
    """
    shaped_by = None if formulas.chart is None else formulas.chart.shaped_by
    if shaped_by is not None and formulas.dissipation is not None:
        return sorted(shaped_by)
    if formulas.separated is None or shaped_by is None:
        return list(range(count))
    return sorted({*shaped_by, *formulas.separated.held})


def _source(formulas: "Formulas", only_sign: int) -> Source:
    """Return the functions from which a table of the model's potential and load is made."""
    terms, mass = formulas.separated, list(formulas.parameters).index("m")
    loads = formulas.rider_loads if only_sign and not formulas.signed else None
    in_space = loads.address if loads else 0
    if terms is None:
        return Source(formulas.functions.addresses(), 0, 1, 1, mass, in_space)
    separated = terms.function.address, terms.potentials, terms.loads
    return Source(formulas.functions.addresses(), *separated, mass, in_space)


def rests_on_corner(group: Group) -> NDArray[np.bool_]:
    """Return whether each launch is from rest on a corner, so that the body starts in the direction of launch."""
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
    """Return the table of a curve with formulas over the range of all motions, and the kind of its ends.

    The table is empty if launches differ in parameters, and the ends are then those of the curve.
    """
    low, high, period = domain[:3]
    if not all(column.size == 1 for column in (low, high, period, *columns[4:])) or not columns[0].size:
        return NO_TABLE, CURVE_ENDS
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
        # The range grows from the launches outwards, until the potential exceeds the energy of each body or no body is
        # in contact any more.
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
                if not v2[1] > 0.0 or _is_lost(formulas, p, reach[side], np.maximum(v2, 0.0), only_sign):
                    closed += 1
                    break
                width *= 2.0
        first, last = reach
        ends = CONTACT_ENDS if closed == 2 else NO_ENDS
    made_from = formulas.exact, _source(formulas, only_sign), tuple(p.tolist())
    table = _tabulated_between(*made_from, first, last)
    for _ in range(MAX_DOUBLINGS if formulas.directed and not isfinite(high.item() - low.item()) else 0):
        if table.paths.size:
            break
        # Only a table tells the sides of a track if N depends on the direction of motion.
        first, last, ends = 0.5 * (first + float(places.min())), 0.5 * (last + float(places.max())), NO_ENDS
        table = _tabulated_between(*made_from, first, last)
    return table, ends if table.paths.size else CURVE_ENDS


def _is_lost(formulas: "Formulas", p: Array, place: float, v2: Array, only_sign: int) -> bool:
    """Return whether no body keeps contact at a place, at any V**2 between two values and in either direction.

    N is a polynomial of degree 2 in V, and lies between its least and its largest coefficient in Bernstein's basis.
    """
    low, high = np.sqrt(v2)
    f, places = BoundFunctions(formulas.functions.addresses(), p), np.full(3, place)
    try:
        for direction in (1, -1):
            first, middle, last = sided_force(
                formulas, f, places, np.array([low, 0.5 * (low + high), high]) ** 2, direction
            )
            if not max(only_sign * first, only_sign * (2.0 * middle - 0.5 * (first + last)), only_sign * last) < 0.0:
                return False
    except SolutionError:
        return False
    return True


@lru_cache(maxsize=16)
def _tabulated_between(exact: Any, source: Source, values: tuple[float, ...], first: float, last: float) -> CurveTable:
    """Return the table of a curve with formulas between two places; it is made once for the same parameters.

    The exact formulas distinguish modules whose functions have successively used the same memory.
    """
    pieces = np.linspace(first, last, MIN_PIECES + 1)
    return CurveTable(*tabulate(source, NO_PARTS, np.array(values), pieces))


def _exact_parts(formulas: "Formulas") -> Callable[..., Any] | None:
    """Return the function that gives the parts of the potential from coordinates, possibly followed by other values."""
    if formulas.separated is not None:
        return formulas.separated.parts
    return formulas.exact.effective_potential if isinstance(formulas.exact, ExactPotential) else None


@lru_cache(maxsize=8)
def tabulated(
    maker: ChartMaker,
    source: Source,
    exact_parts: Callable[..., Any] | None,
    radius: float,
    parameters: int,
    values: tuple[float, ...],
) -> CurveTable:
    """Return the table of a chart; it is made once for the same parameters, which are followed by functions of them."""
    chart, true = chart_with(maker, values), None
    if exact_parts is not None:
        p = tuple(read_number(value, where="p") for value in values)
        try:
            pieces = true_pieces_of(maker, p[:parameters], chart)
            true = pieces and parts_along(pieces, exact_parts, source.potentials, p, (radius, 0.0))
        except GQMError:
            true = None  # the table then has the accuracy of the chart
    p_and_chart = np.concatenate([values, chart.block])
    table = CurveTable(*tabulate(source, true or NO_PARTS, p_and_chart, chart.edges))
    return table._replace(least_slope=0.0)  # the functions of a chart have no more digits than its table


def _distinct(
    columns: list[Array], shape: tuple[int, ...]
) -> Iterator[tuple[tuple[float, ...], NDArray[np.intp] | None]]:
    """Return the different sets of values of columns, each with the elements that have it; None if all elements have
    the same values.
    """
    if all(column.size == 1 for column in columns):
        yield tuple(float(column.flat[0]) for column in columns), None
        return
    rows = np.column_stack([np.broadcast_to(column, shape).reshape(-1) for column in columns])
    different, which = np.unique(rows, axis=0, return_inverse=True)
    order = np.argsort(which.reshape(-1), kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(which.reshape(-1)))[:-1])
    yield from zip(map(tuple, different.tolist()), parts, strict=True)


def _by_parameters(
    parameters: list[Array], shape: tuple[int, ...], chosen: NDArray[np.intp] | None
) -> NDArray[np.intp] | None:
    """Return the chosen elements (None for all) in an order in which those with the same parameters are together."""
    varied = [column for column in parameters if column.size > 1]
    if not varied:
        return chosen
    rows = [np.broadcast_to(column, shape).reshape(-1) for column in varied]
    if chosen is None:
        return np.lexsort(rows)
    return chosen[np.lexsort([row[chosen] for row in rows])]


def _chosen(column: Array, shape: tuple[int, ...], chosen: NDArray[np.intp]) -> Array:
    """Return elements of a column that is broadcast to a shape."""
    return column if column.size == 1 else np.broadcast_to(column, shape).reshape(-1)[chosen]
