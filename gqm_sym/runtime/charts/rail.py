"""Rails: lines, arcs, clothoids and curves with formulas, joined end to start.

The curvature of a standard piece is linear in arc length, so that its angle is known exactly and its coordinates are
integrals of the angle's cosine and sine.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from math import atan2, ceil, hypot, pi
from typing import Any

import numpy as np
from numba import types
from numpy.polynomial.legendre import leggauss

from gqm_sym.errors import BudgetError, DeclarationError, ParameterError
from gqm_sym.literals.namespaces import FLOATS
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.charts.arc_length import MAX_PIECES, Indices, Pieces, joined, rectify, summed
from gqm_sym.runtime.charts.chart import NODES, Chart, PieceData, assemble, tangents_of
from gqm_sym.runtime.charts.double_double.making import TruePieces, starting_context
from gqm_sym.runtime.charts.exact_parts import Part, Parts, spiral
from gqm_sym.runtime.compiled.calls import call_segment
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import Array

# The largest gap at a joint, as a share of the length so far, and the largest angle there in radians.
MAX_MISMATCH = 1e-9

# The largest turn on a piece of the chart, in radians: the cosine of the angle is a polynomial there, to rounding.
MAX_TURN = 1.0

# The largest turn of one line, arc or clothoid, in radians; a larger one is taken for a mistake.
MAX_TOTAL_TURN = 1e5
_GAUSS = leggauss(16)

# The numbers that define a line, an arc and a clothoid.
PIECE_NUMBERS = {"line": ("length",), "arc": ("radius", "angle"), "clothoid": ("length", "kappa_start", "kappa_end")}


@dataclass(frozen=True, slots=True)
class Pose:
    """An end of a piece: its coordinates, and the angle of the tangent in radians."""

    x: float
    z: float
    angle: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Rail:
    """A rail, which makes its chart for values of the run-time parameters.

    Attributes
    ----------
    numbers
        ``f(op, p)``: x, z and heading at the start if the rail is ``placed``, then for each piece the numbers that
        `PIECE_NUMBERS` lists, or the ends of a curve's parameter.
    pieces : tuple of str
        "line", "arc", "clothoid", or "curve".
    placed : bool
        Whether the start is given; otherwise the first piece is a curve, which has a place of its own.
    segments : tuple of int
        Addresses of the compiled functions of the curves among the pieces, in order.
    formulas
        The same curves as ``f(op, lam, p)``: x, z and their derivatives.
    closed : bool
        Whether the end is joined to the start.
    shaped_by : tuple of int or None
        The run-time parameters that the rail depends on, by their place; None if that is not known.
    """

    numbers: Callable[..., Any]
    pieces: tuple[str, ...]
    placed: bool
    segments: tuple[int, ...] = ()
    formulas: tuple[Callable[..., Any], ...] = ()
    closed: bool = False
    shaped_by: tuple[int, ...] | None = None

    def chart(self, p: tuple[float, ...]) -> Chart:
        """Return the chart.

        Raises
        ------
        ParameterError
            If a length or a radius is not positive, or a number is not finite.
        DeclarationError
            If pieces do not meet, or a closed rail does not close.
        """
        numbers = iter(self.numbers(FLOATS, p))
        pose = Pose(*(float(number) for number in islice(numbers, 3))) if self.placed else None
        segments = iter(self.segments)
        parts: list[Pieces] = []
        joints, start, length = [0.0], pose, 0.0
        for count, kind in enumerate(self.pieces, start=1):
            where = f"piecewise: piece {count} ({kind})"
            if kind == "curve":
                low, high = islice(numbers, 2)
                part, begin, end = _curve(next(segments), np.array(p), low, high, where)
                if pose is not None:
                    _check_joint(
                        pose, begin, length + part.lengths.sum(), f"{where}: begins", "the piece before it ends"
                    )
                    laps = 2.0 * pi * round((pose.angle - begin.angle) / (2.0 * pi))
                    part = replace(part, angles=part.angles + laps)
                    end = Pose(end.x, end.z, end.angle + laps)
                start, pose = start or begin, end
            else:
                assert pose is not None
                part, pose = _standard(kind, numbers, pose, where)
            parts.append(part)
            if sum(one.lengths.size for one in parts) > MAX_PIECES:
                raise BudgetError(f"chart: {where}: {MAX_PIECES} pieces reach no farther; let the rail turn less")
            length += float(part.lengths.sum())
            joints.append(length)
        assert start is not None
        assert pose is not None
        which = np.repeat(np.arange(len(parts)), [part.lengths.size for part in parts])
        return self._assembled(joined(parts), which, joints, start, pose)

    def is_exact(self, chart: Chart) -> bool:
        """Return True: every piece has formulas."""
        return True

    def true_curve(self, context: Any, p: tuple[Any, ...], chart: Chart) -> Parts:
        """Return the rail in extended precision."""
        numbers = iter(self.numbers(context, p))
        pose = tuple(context.mpf(number) for number in islice(numbers, 3)) if self.placed else None
        formulas, counts = iter(self.formulas), np.bincount(chart.origins[:, 0].astype(np.int64))
        parts: list[Part] = []
        speeds: list[Any] = []
        for kind, count in zip(self.pieces, counts.tolist(), strict=True):
            if kind == "curve":
                parts.append(along_range(context, next(formulas), p, *islice(numbers, 2)))
                speeds.append(None)
                x, z, dx, dz = parts[-1](context.mpf(1))
                pose = x, z, context.atan2(dz, dx)
                continue
            assert pose is not None
            given = {name: context.mpf(next(numbers)) for name in PIECE_NUMBERS[kind]}
            length, first, last = ends_of(kind, given)
            parts.append(spiral(context, pose, length, first, last, count))
            speeds.append(length / count)
            pose = *parts[-1](context.mpf(count))[:2], pose[2] + length * (first + last) / 2
        return Parts(context, chart, parts.__getitem__, speeds.__getitem__)

    def true_pieces(self, p: Sequence[Number], chart: Chart) -> TruePieces:
        """Return the rail in double-double arithmetic."""
        context = starting_context()
        curve = self.true_curve(context, tuple(number.at(context) for number in p), chart)
        return TruePieces(chart, curve.sample)

    def _assembled(self, pieces: Pieces, parts: Indices, joints: list[float], start: Pose, end: Pose) -> Chart:
        edges = summed(pieces.lengths)
        inner = joints[1:-1]
        turn = 0.0
        if self.closed:
            _check_joint(end, start, edges[-1], "piecewise: closed: the start lies", "the last piece ends")
            turn = 2.0 * pi * round((end.angle - start.angle) / (2.0 * pi))
            inner = joints[:-1]
        return assemble(
            edges,
            PieceData(pieces.anchors, pieces.angles, pieces.curvatures),
            period=edges[-1] if self.closed else 0.0,
            turn=turn,
            origins=np.column_stack([parts, pieces.places]),
            # Breaks are edges of the chart, to the last bit.
            breaks=edges[np.abs(edges[:, None] - np.array(inner)).argmin(axis=0)] if inner else (),
        )


def _check_joint(end: Pose, begin: Pose, length: float, who: str, whom: str) -> None:
    """Refuse a joint at which the place or the tangent jumps."""
    gap = hypot(begin.x - end.x, begin.z - end.z)
    turn = abs((begin.angle - end.angle + pi) % (2.0 * pi) - pi)
    if not (gap <= MAX_MISMATCH * length and turn <= MAX_MISMATCH):
        raise DeclarationError(
            f"{who} at ({begin.x!r}, {begin.z!r}) with its tangent at {begin.angle!r} rad, {gap:.3g} and "
            f"{turn:.3g} rad off where {whom}: ({end.x!r}, {end.z!r}), {end.angle!r} rad; "
            f"both must match within {MAX_MISMATCH:g} of the rail's length and {MAX_MISMATCH:g} rad"
        )


def along_range(
    context: Any, formula: Callable[..., Any], p: tuple[Any, ...], low: Any, high: Any
) -> Callable[[Any], Any]:
    """Return a curve with formulas as a function of the share of its parameter's range; its ends 0 and 1 are exact.

    The function gives the coordinates and their derivatives with respect to the share.
    """
    low, width = context.mpf(low), context.mpf(high) - low

    def at(share: Any) -> tuple[Any, ...]:
        values = formula(context, low + width * share, p)
        dimension = len(values) // 2
        return *values[:dimension], *(rate * width for rate in values[dimension:])

    return at


def ends_of(kind: str, given: dict[str, Any]) -> tuple[Any, Any, Any]:
    """Return the length of a line, an arc or a clothoid, and its curvature at both ends."""
    if kind == "arc":
        length = given["radius"] * abs(given["angle"])
        return length, given["angle"] / length, given["angle"] / length
    return given["length"], given.get("kappa_start", 0.0), given.get("kappa_end", 0.0)


def _standard(kind: str, numbers: Iterator[Any], pose: Pose, where: str) -> tuple[Pieces, Pose]:
    """Return a line, an arc or a clothoid, and its right end."""
    given = {name: float(next(numbers)) for name in PIECE_NUMBERS[kind]}
    for name, value in given.items():
        if not np.isfinite(value) or (name in ("length", "radius") and not value > 0.0):
            wanted = "positive" if name in ("length", "radius") else "finite"
            raise ParameterError(f"{where}: {name}: must be {wanted}, got {value!r}")
    if given.get("angle") == 0.0:
        raise ParameterError(f"{where}: angle: must not be zero; positive turns left, negative right")
    length, first, last = (float(value) for value in ends_of(kind, given))
    turned = max(abs(first), abs(last)) * length
    if not turned <= MAX_TOTAL_TURN:
        raise ParameterError(f"{where}: turns by {turned:.3g} rad; {MAX_TOTAL_TURN:g} is the most")
    count = max(1, ceil(turned / MAX_TURN))
    step, bent = length / count, 0.5 * (last - first) / length
    left: Array = step * np.arange(count, dtype=np.float64)[:, None]

    def angle(s: Array) -> Array:
        return pose.angle + s * (first + s * bent)

    nodes, weights = _GAUSS
    inside, middle = angle(left + 0.5 * step * (1.0 + nodes)), angle(left + 0.5 * step)
    # The difference from a straight piece is integrated; it vanishes with the curvature, so rounded weights do no harm.
    gained = np.concatenate(
        [
            step * at_middle + 0.5 * step * (at_nodes - at_middle) @ weights[:, None]
            for at_middle, at_nodes in zip(tangents_of(middle), tangents_of(inside), strict=True)
        ],
        axis=1,
    )
    places = np.cumsum(np.concatenate([[[pose.x, pose.z]], gained]), axis=0, dtype=np.longdouble).astype(np.float64)
    s = left + 0.5 * step * (1.0 + NODES)
    steps = np.arange(count)
    pieces = Pieces(
        places=np.stack([steps, steps + 1], axis=1),
        lengths=np.full(count, step),
        anchors=places[:-1],
        angles=angle(s),
        curvatures=first + 2.0 * bent * s,
    )
    return pieces, Pose(float(places[-1, 0]), float(places[-1, 1]), pose.angle + 0.5 * (first + last) * length)


@entry(types.float64[:, ::1](types.int64, types.float64[::1], types.float64[::1]))
def _segment_rows(address, p, lam):  # type: ignore[no-untyped-def]
    """Return x, z, ds/dlam, dx/ds, dz/ds and kappa of a curve with formulas, as rows."""
    out = np.empty((6, lam.size))
    call_segment(address, lam.size, lam, p, out)
    return out


def _curve(address: int, p: Array, low: float, high: float, where: str) -> tuple[Pieces, Pose, Pose]:
    """Return a curve with formulas, and both its ends."""
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise ParameterError(f"{where}: domain: must have finite ends lo < hi, got ({low!r}, {high!r})")

    def rows(left: Array, offsets: Array) -> Array:
        out: Array = _segment_rows(address, p, (left[:, None] + offsets).ravel())
        return out.reshape(6, *offsets.shape)

    pieces = rectify(rows, np.array([low, high], dtype=np.float64), where=where)
    pieces = replace(pieces, places=(pieces.places - low) / (high - low))
    ends = rows(np.array([low, high], dtype=np.float64), np.zeros((2, 1)))[:, :, 0]
    begin, end = (Pose(float(e[0]), float(e[1]), atan2(e[4], e[3])) for e in ends.T)
    laps = 2.0 * pi * round((pieces.angles[-1, 0] - end.angle) / (2.0 * pi))
    return pieces, begin, Pose(end.x, end.z, end.angle + laps)
