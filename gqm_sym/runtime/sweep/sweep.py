"""One quantity over arrays of launches and parameters.

Most orbits are answered by one compiled loop (`swift`); those that it leaves are solved one by one, as `solve` does.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from math import inf, isfinite, nan, prod
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.errors import GQMError, InputError, ParameterError, SolutionError
from gqm_sym.literals.namespaces import ARRAYS
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.compiled.strided import PARAMETERS, lay_out, pointers, widen
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.request import CONTACTS, LaunchRequest
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.motion.extremes import grid_peaks, over_legs
from gqm_sym.runtime.sweep import quantities, scalar
from gqm_sym.runtime.sweep.batch.batches import answer_batches

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas


# Launches a thread is worth starting for, and those that are laid out at a time.
LEAST, CHUNK = 2**9, 2**16

# What the compiled loop is never asked.
NEVER = -1

# Why there is no value, by code; 0 where there is one.
REASONS = (
    "",
    "left to the exact problem",
    "the motion is not of a kind that has this quantity",
    "the launch or a parameter is not a finite number",
    "the launch place lies outside the domain",
    "the motion is never at the place asked for",
    "the launch is refused; solve says why",
)
REFUSED = 6


class Sweep(NamedTuple):
    """Values over all launches, NaN where there is none, and why not: codes into `REASONS`, 0 where there is one."""

    values: Array
    reasons: NDArray[np.int8]

    def why(self) -> dict[str, int]:
        """Count the launches without a value, by reason."""
        codes, counts = np.unique(self.reasons[self.reasons > 0], return_counts=True)
        return {REASONS[code]: int(count) for code, count in zip(codes, counts, strict=True)}


class Quantity(NamedTuple):
    """One quantity: what is asked of the compiled loop, the numbers it answers, which of them, and of one motion."""

    asked: int
    width: int
    columns: slice | int
    of_motion: Callable[[Any, Any], Any]


def _turning_points(motion: Any, _: Any) -> Any:
    return sorted(motion.turning_points) if motion.kind == "libration" else (nan, nan)


def _rest_position(motion: Any, _: Any) -> float:
    if motion.kind == "rest":
        return float(motion.problem.lam0)
    rests = motion.kind == "dissipative" and isfinite(motion.t_end) and motion.legs[-1].end == "rest"
    return motion.legs[-1].lam_end if rests else nan


def _extreme(load: Callable[[Any, Array], Array], of_state: str, sign: int) -> Callable[[Any, Any], float]:
    """The largest or least load: of a periodic motion the best of many places, closer and closer."""

    def of_motion(motion: Any, _: Any) -> float:
        if motion.kind not in ("libration", "circulation") or isfinite(motion.t_end):
            return over_legs(motion, _STATES[of_state], sign)
        stop = motion.one_period[0].segment.stop
        *_, peak = grid_peaks(lambda phi: sign * load(motion, phi), 0.0, stop)
        return float(sign * peak.value)

    return of_motion


def _speed(motion: Any, phi: Array) -> Array:
    speeds: Array = motion.one_period[0].segment.speeds(phi)
    return speeds


# The same of states.
_STATES: dict[str, Callable[[Any], Array]] = {
    "speed": lambda state: np.abs(state.v),
    "force": lambda state: state.normal_force,
}


def _force(motion: Any, phi: Array) -> Array:
    segment = motion.one_period[0].segment
    f = segment.functions
    forces: Array = path_and_force_at(f.addresses, f.p, segment.places(phi), segment.speeds(phi) ** 2)[4]
    return forces


QUANTITIES = {
    "half_period": Quantity(quantities.HALF_PERIOD, 1, 0, lambda motion, _: motion.half_period),
    "period": Quantity(quantities.PERIOD, 1, 0, lambda motion, _: motion.period),
    "turning_points": Quantity(quantities.TURNING_POINTS, 2, slice(0, 2), _turning_points),
    "v_min": Quantity(quantities.MIN_SPEED, 1, 0, _extreme(_speed, "speed", -1)),
    "v_max": Quantity(quantities.MAX_SPEED, 1, 0, _extreme(_speed, "speed", 1)),
    "normal_force_min": Quantity(quantities.MIN_FORCE, 1, 0, _extreme(_force, "force", -1)),
    "normal_force_max": Quantity(quantities.MAX_FORCE, 1, 0, _extreme(_force, "force", 1)),
    "time_at": Quantity(quantities.ARRIVAL_TIME, 1, 0, lambda motion, place: motion.time_at(place)),
    "t_end": Quantity(NEVER, 1, 0, lambda motion, _: motion.t_end if isfinite(motion.t_end) else nan),
    "rest_position": Quantity(NEVER, 1, 0, _rest_position),
}


def sweep(
    formulas: "Formulas",
    quantity: str,
    launches: LaunchRequest,
    given: tuple[Any, ...],
    lam: Any,
    solve: Callable[[LaunchRequest, tuple[Any, ...]], Any],
) -> Sweep:
    """One quantity of the motion of each launch; all arguments but contact and t_max broadcast against each other."""
    lam0, v0, direction, _, t_max, contact = launches
    asked = QUANTITIES.get(quantity)
    if asked is None:
        raise InputError(f"quantity: must be one of {', '.join(QUANTITIES)}, got {quantity!r}")
    if (lam is None) == (quantity == "time_at"):
        raise InputError(f"lam: is the place that 'time_at' asks about, got {lam!r} with {quantity!r}")
    if contact not in CONTACTS:
        raise InputError(f"contact: must be one of {', '.join(CONTACTS)}, got {contact!r}")
    names = ("lam0", "v0", "direction", "lam", *formulas.parameters)
    sources = (lam0, v0, direction, 0.0 if lam is None else lam, *given)
    columns = [_column(value, name) for value, name in zip(sources, names, strict=True)]
    _check(formulas, dict(zip(names, columns, strict=True)))
    shape = broadcast_shape(dict(zip(names, columns, strict=True)))
    _check_least(formulas, dict(zip(names, columns, strict=True)))
    plain, columns = columns, [widen(column, shape) for column in columns]
    size = prod(shape)
    out, reasons = np.full((size, asked.width), nan), np.full(size, quantities.UNDECIDED, dtype=np.int8)
    if is_swift(formulas, asked, t_max, contact):
        known = [widen(value, shape) for value in _known(formulas, plain[4:])]
        rows = [*columns[:4], *known, *columns[4:]]
        run_in_threads(lambda part: _answer(formulas, asked, rows, part, out, reasons), size, LEAST)
    values = out[:, asked.columns]
    for k in np.flatnonzero(reasons == quantities.UNDECIDED):
        here = [s if np.ndim(s) == 0 else float(c.flat[k % c.size]) for s, c in zip(sources, columns, strict=True)]
        values[k], reasons[k] = _solved(solve, asked, here, t_max, contact)
    return Sweep(values.reshape(shape + values.shape[1:]), reasons.reshape(shape))


def is_swift(formulas: "Formulas", asked: "Quantity", t_max: Any, contact: str) -> bool:
    """Whether the compiled loop answers most launches.

    Charts, dissipative motions, bodies that must fit their track or may leave it, and horizons have no swift way.
    """
    plain = formulas.chart is None and formulas.dissipation is None and not formulas.body
    return plain and asked.asked != NEVER and t_max is None and contact == "bilateral"


def broadcast_shape(columns: Mapping[str, Array]) -> tuple[int, ...]:
    """The shape that named arrays broadcast to."""
    try:
        return np.broadcast_shapes(*(column.shape for column in columns.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {column.shape}" for name, column in columns.items() if column.shape)
        raise InputError(f"sweep: these shapes do not broadcast against each other: {shapes}") from None


def _column(value: Any, name: str) -> Array:
    """Numbers as doubles; text and exact numbers by their nearest."""
    if type(value) is float:
        return np.array(value)
    if type(value) is str:
        return np.array(_of_text(value, name))
    if value is None:
        raise ParameterError(f"{name}: has no default and was not given; pass {name}=...")
    if isinstance(value, np.ndarray) and value.dtype != object:
        return value.astype(np.float64, copy=False)
    array = np.asarray(value, dtype=object)
    numbers = [v if isinstance(v, float) else read_number(v, where=name).value for v in array.reshape(-1)]
    return np.array(numbers, dtype=np.float64).reshape(array.shape)


@lru_cache(maxsize=256)
def _of_text(value: str, name: str) -> float:
    return read_number(value, where=name).value


def _check(formulas: "Formulas", columns: dict[str, Array]) -> None:
    """Refuse what no launch of a sweep may be."""
    if (columns["v0"] < 0.0).any():
        raise InputError("v0: is a speed and cannot be negative; use direction=-1 to launch the other way")
    if (np.abs(columns["direction"]) != 1.0).any():
        raise InputError("direction: must be 1 or -1 (the sign of ds/dt at launch)")
    for name in (*formulas.positive, "m"):
        if (columns[name] <= 0.0).any():
            raise ParameterError(f"{name}: must be positive; the closed forms hold for {name} > 0")


def _check_least(formulas: "Formulas", columns: dict[str, Array]) -> None:
    """Refuse parameters below what they must not fall below."""
    for name, least in formulas.at_least:
        bound = columns[least] if least in columns else read_number(least, where=least).value
        if (columns[name] < bound).any():
            raise ParameterError(f"{name}: must be at least {least}")


def _known(formulas: "Formulas", p: list[Array]) -> Iterator[Array]:
    """What is known of each launch's curve, in the order of `columns`."""
    place, step = formulas.axes(ARRAYS, tuple(p))
    known = (*formulas.ends(ARRAYS, tuple(p)), place, _left_over(formulas, place, p), step)
    for value, missing in zip(known, (-inf, inf, 0.0, nan, nan, 0.0), strict=True):
        yield np.asarray(missing if value is None else value, dtype=np.float64)


def _left_over(formulas: "Formulas", place: Any, p: list[Array]) -> float | None:
    """What a place of symmetry leaves over as a double, if it is the same for all launches."""
    if place is None or np.ndim(place) or not all(column.size for column in p):
        return None
    return _rest_of(formulas.axes, float(place), tuple(float(column.flat[0]) for column in p))


@lru_cache(maxsize=256)
def _rest_of(axes: Callable[..., Any], place: float, values: tuple[float, ...]) -> float:
    from mpmath import mp

    with mp.workdps(40):
        return float(mp.mpf(axes(mp, tuple(map(mp.mpf, values)))[0]) - mp.mpf(place))


def _answer(
    formulas: "Formulas", asked: Quantity, columns: list[Array], part: slice, out: Array, reasons: NDArray[np.int8]
) -> None:
    """Answer a part of all launches."""
    for begin in range(part.start, part.stop, CHUNK):
        chunk = slice(begin, min(begin + CHUNK, part.stop))
        lines = lay_out(columns, chunk.start, chunk.stop)
        launches, values, codes = (pointers(lines), formulas.monotone), out[chunk], reasons[chunk]
        alone = asked.asked not in (
            quantities.HALF_PERIOD,
            quantities.PERIOD,
            quantities.TURNING_POINTS,
        )  # batches find its span, no more
        spans = np.empty((codes.size, 2)) if alone else values
        if formulas.each is not None:
            each, held = formulas.each.addresses(), (formulas.each.held, formulas.each.top_held)
            answer_batches(each, held, *launches, quantities.SPANS if alone else asked.asked, spans, codes)
        room = np.empty(len(lines) - PARAMETERS)
        scalar.answer_one_by_one(formulas.addresses, *launches, asked.asked, spans, values, codes, room)


def _solved(
    solve: Callable[[LaunchRequest, tuple[Any, ...]], Any], asked: Quantity, here: list[Any], t_max: Any, contact: str
) -> tuple[Any, int]:
    """The quantity of one launch, solved by itself."""
    lam0, v0, direction, place, *given = here
    try:
        motion = solve(LaunchRequest(lam0, v0, int(direction), None, t_max, contact), tuple(given))
    except GQMError:
        return nan, REFUSED
    try:
        value = asked.of_motion(motion, place)
    except SolutionError:
        return nan, quantities.NEVER_THERE if asked.asked == quantities.ARRIVAL_TIME else quantities.NOT_PERIODIC
    return value, quantities.NOT_PERIODIC if np.isnan(value).any() else quantities.ANSWERED
