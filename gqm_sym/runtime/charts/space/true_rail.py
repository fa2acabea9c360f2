"""Rails in space in double-double arithmetic, by Taylor series of the frame on the parts of each piece."""

from collections.abc import Callable, Iterable, Sequence
from itertools import islice
from typing import Any

import numpy as np
from numba import types

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.charts import rail
from gqm_sym.runtime.charts.chart import Chart
from gqm_sym.runtime.charts.double_double.making import Samples, sample_places, starting_context
from gqm_sym.runtime.charts.double_double.pieces import IN_SAMPLES, NODES
from gqm_sym.runtime.charts.exact_parts import samples_between
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, divide, multiply
from gqm_sym.runtime.multiprecision.exact_problem import two_doubles

# The coefficients of each of the three rates of a transition, in powers of the distance from its beginning.
POWERS = 6
# The number of numbers that define each piece; those of a transition are its length and the coefficients of its rates.
PIECE_NUMBERS = {
    **{kind: len(names) for kind, names in rail.PIECE_NUMBERS.items()},
    "transition": 1 + 3 * POWERS,
    "curve": 2,
}

# A tangent that deviates from the vertical by less has no level direction.
MIN_LEVEL = 1e-9

# The largest power of a part's Taylor series: its terms fall at least as powers of 4 (`rail.RADIUS`).
TERMS = 56
# The derivatives of the frame's rows t, l and u: for each product the row, the other row, the rate and the sign.
TURNS = np.array([(0, 1, 0, 1), (0, 2, 1, 1), (1, 0, 0, -1), (1, 2, 2, -1), (2, 0, 1, -1), (2, 1, 2, 1)])
# The rows of a pose: those of the frame, then the place.
PLACE = 3
# A bound on the rounding errors of a frame over one part, in units of double-double arithmetic.
ROUNDINGS = 100.0


def rates_of(kind: str, given: Any) -> tuple[Any, tuple[Sequence[Any], Sequence[Any], Sequence[Any]]]:
    """Return the length of a piece, and the coefficients of yaw, pitch and roll, for numbers of any kind.

    Arcs and clothoids turn by pitch, as a rail in a plane does.
    """
    if kind == "transition":
        yaw, pitch, roll = (given[1 + POWERS * row : 1 + POWERS * (row + 1)] for row in range(3))
        return given[0], (yaw, pitch, roll)
    length, first, last = rail.ends_of(kind, dict(zip(rail.PIECE_NUMBERS[kind], given, strict=True)))
    return length, ((), (first, (last - first) / length), ())


def starting_frame(cosine: Any, sine: Any, heading: Any, climb: Any, roll: Any) -> list[list[Any]]:
    """Return the rows t, l and u of a frame, which leans to the left by the roll angle, with given functions."""
    c, s, level, rise, roll_cosine, roll_sine = (f(angle) for angle in (heading, climb, roll) for f in (cosine, sine))
    left, up = (-s, c, 0), (-rise * c, -rise * s, level)
    return [
        [level * c, level * s, rise],
        [roll_cosine * a - roll_sine * b for a, b in zip(left, up, strict=True)],
        [roll_cosine * b + roll_sine * a for a, b in zip(left, up, strict=True)],
    ]


def level_frame(hypotenuse: Any, ahead: Sequence[Any]) -> list[Sequence[Any]]:
    """Return the frame of a tangent without roll; for a vertical tangent, the frame with l along y."""
    width = hypotenuse(ahead[0], ahead[1])
    left = (-ahead[1] / width, ahead[0] / width, 0) if width > MIN_LEVEL else (0, 1, 0)
    up = [ahead[i - 2] * left[i - 1] - ahead[i - 1] * left[i - 2] for i in range(3)]
    return [ahead, left, up]


@Inner
def shift_rates(whole, part, scaled):  # type: ignore[no-untyped-def]
    """Fill the coefficients in powers of the share of a part that has been passed, from those in powers of the number
    of parts passed.
    """
    scaled[:] = whole
    for rate in range(3):
        for lowest in range(POWERS - 1):
            for j in range(POWERS - 2, lowest - 1, -1):
                s, s_low = multiply(scaled[rate, j + 1, 0], scaled[rate, j + 1, 1], float(part), 0.0)
                scaled[rate, j] = add(scaled[rate, j, 0], scaled[rate, j, 1], s, s_low)


@Inner
def fill_series(scaled, step, pose, series):  # type: ignore[no-untyped-def]
    """Fill the Taylor coefficients of the pose in powers of the share of a part that has been passed."""
    series[0], series[1:] = pose, 0.0
    for n in range(TERMS):
        for turn in range(TURNS.shape[0]):
            row, other, rate, sign = TURNS[turn]
            for j in range(min(n + 1, POWERS)):
                r, r_low = sign * scaled[rate, j, 0], sign * scaled[rate, j, 1]
                if r == 0.0:
                    continue
                for axis in range(3):
                    known, before = series[n + 1, row, axis], series[n - j, other, axis]
                    s, s_low = multiply(r, r_low, before[0], before[1])
                    series[n + 1, row, axis] = add(known[0], known[1], s, s_low)
        for axis in range(3):
            ahead = series[n, 0, axis]
            series[n + 1, PLACE, axis] = multiply(ahead[0], ahead[1], step[0], step[1])
            for row in range(4):
                known = series[n + 1, row, axis]
                series[n + 1, row, axis] = divide(known[0], known[1], n + 1.0, 0.0)


@Inner
def value_of_series(series, row, axis, share, share_low):  # type: ignore[no-untyped-def]
    """Return a component of the pose where a share of a part has been passed, as two doubles."""
    high, low = 0.0, 0.0
    for n in range(TERMS, -1, -1):
        high, low = multiply(high, low, share, share_low)
        high, low = add(high, low, series[n, row, axis, 0], series[n, row, axis, 1])
    return high, low


@Inner
def rates_by_parts(rates, step):  # type: ignore[no-untyped-def]
    """Return the coefficients in powers of the number of parts passed, from those in powers of the distance."""
    whole = np.zeros((3, POWERS, 2))
    for rate in range(3):
        power, power_low = step[0], step[1]
        for j in range(POWERS):
            whole[rate, j] = multiply(rates[rate, j, 0], rates[rate, j, 1], power, power_low)
            power, power_low = multiply(power, power_low, step[0], step[1])
    return whole


@entry(
    types.void(types.float64[:, :, ::1], VECTOR, types.float64[:, :, ::1], INTEGER, VECTOR, types.float64[:, :, ::1])
)
def fill_frame(rates, step, pose, part, share, frame):  # type: ignore[no-untyped-def]
    """Fill the frame's rows where a share of a part has been passed; the arguments are those of `fill_parts`, with the
    pose at the left end of the part.
    """
    scaled, series = np.zeros((3, POWERS, 2)), np.zeros((TERMS + 1, 4, 3, 2))
    shift_rates(rates_by_parts(rates, step), part, scaled)
    fill_series(scaled, step, pose, series)
    for row in range(3):
        for axis in range(3):
            frame[row, axis] = value_of_series(series, row, axis, share[0], share[1])


@entry(types.void(types.float64[:, :, ::1], VECTOR, types.float64[:, :, ::1], types.float64[:, :, :, ::1], MATRIX))
def fill_parts(rates, step, pose, samples, nodes):  # type: ignore[no-untyped-def]
    """Fill the coordinates x, z and y on the n equal parts of a piece, and move the pose to its right end.

    Parameters
    ----------
    rates : (3, POWERS, 2) array
        Coefficients of yaw, pitch and roll in powers of the distance from the beginning, two doubles each.
    step : (2,) array
        The length of a part, as two doubles.
    pose : (4, 3, 2) array
        The frame's rows and the place at the left end, two doubles each.
    samples : (n, 3, 2, NODES) array
        Filled.
    nodes : (2, NODES) array
        The Chebyshev points in [-1, 1], as two doubles each.
    """
    whole, scaled, series = rates_by_parts(rates, step), np.zeros((3, POWERS, 2)), np.zeros((TERMS + 1, 4, 3, 2))
    for part in range(samples.shape[0]):
        shift_rates(whole, part, scaled)
        fill_series(scaled, step, pose, series)
        for column in range(3):
            axis = IN_SAMPLES[column]
            for i in range(NODES):
                share, share_low = add(0.5 * nodes[0, i], 0.5 * nodes[1, i], 0.5, 0.0)
                samples[part, column, 0, i], samples[part, column, 1, i] = value_of_series(
                    series, PLACE, axis, share, share_low
                )
        for row in range(4):
            for axis in range(3):
                pose[row, axis] = value_of_series(series, row, axis, 1.0, 0.0)


class TrueRail:
    """A rail in space, known to some 31 digits.

    Parameters
    ----------
    kinds : sequence of str
        The kinds of its pieces.
    placed : bool
        Whether the start is given.
    numbers, formulas
        As `rail.SpaceRail` has them.
    p : sequence of Number
        Run-time parameters.
    chart : Chart
        Its chart.
    """

    def __init__(
        self,
        kinds: Sequence[str],
        placed: bool,
        numbers: Callable[..., Iterable[Any]],
        formulas: Sequence[Callable[..., Any]],
        p: Sequence[Number],
        chart: Chart,
    ) -> None:
        self._context = context = starting_context()
        values, following = tuple(number.at(context) for number in p), iter(formulas)
        self._origins = [(int(part), low, high) for part, low, high in chart.origins.tolist()]
        counts = np.bincount(chart.origins[:, 0].astype(np.int64)).tolist()
        given = (context.mpf(number) for number in numbers(context, values))
        pose, passed = np.zeros((4, 3, 2)), 0
        if placed:
            place, angles = [*islice(given, 3)], [*islice(given, 3)]
            pose = _pairs([*starting_frame(context.cos, context.sin, *angles), place])
        self._parts: list[Array | Callable[[Any], tuple[Any, ...]]] = []
        self._begins = list[tuple[Array, Array, Array] | None]()
        for kind, count in zip(kinds, counts, strict=True):
            own = [*islice(given, PIECE_NUMBERS[kind])]
            passed += count
            if kind == "curve":
                at = rail.along_range(context, next(following), values, *own)
                *place, dx, dy, dz = at(context.mpf(1))
                size = context.sqrt(dx * dx + dy * dy + dz * dz)
                pose = _pairs([*level_frame(context.hypot, [dx / size, dy / size, dz / size]), place])
                self._parts.append(at)
                self._begins.append(None)
                continue
            length, rates = rates_of(kind, own)
            coefficients = np.zeros((3, POWERS, 2))
            for row, terms in zip(coefficients, rates, strict=True):
                for j, term in enumerate(terms):
                    row[j] = two_doubles(term)
            samples, step = np.empty((count, 3, 2, NODES)), np.array(two_doubles(length / count))
            self._begins.append((coefficients, step, pose.copy()))
            fill_parts(coefficients, step, pose, samples, sample_places())
            self._parts.append(samples)
        self._error = ROUNDINGS * UNIT * (1.0 + passed) * float(np.abs(chart.edges[[0, -1]]).max())

    def sample(self, k: int) -> Samples:
        """Return a piece of the chart at the Chebyshev points (`double_double.pieces`)."""
        part, low, high = self._origins[k]
        known = self._parts[part]
        if not callable(known):
            samples = np.ascontiguousarray(known[int(low)])
            return samples, self._error + 4.0 * UNIT * float(np.abs(samples).max())

        def coordinates(place: Any) -> list[Any]:
            found = known(place)
            return [found[axis] for axis in IN_SAMPLES]

        return samples_between(self._context, coordinates, low, high)

    def frame(self, k: int, u: float, u_low: float) -> Array:
        """Return the rows t, l and u of the frame at a place on a piece of the chart that is no curve with formulas, as
        two doubles each.
        """
        number, low, _ = self._origins[k]
        begin = self._begins[number]
        assert begin is not None
        coefficients, step, pose = begin[0], begin[1], begin[2].copy()
        fill_parts(coefficients, step, pose, np.empty((int(low), 3, 2, NODES)), sample_places())
        frame, share = np.empty((3, 3, 2)), np.array(add.py_func(0.5 * u, 0.5 * u_low, 0.5, 0.0))
        fill_frame(coefficients, step, pose, int(low), share, frame)
        return frame


def _pairs(values: Any) -> Array:
    """Return numbers in nested sequences as two doubles each."""
    return np.array([_pairs(value) for value in values] if isinstance(values, (list, tuple)) else two_doubles(values))
