"""Rails in space: pieces whose frame turns at rates that are polynomials in arc length, and curves with formulas.

The frame is the tangent t, the direction l to the left and u upwards; along a piece

    t' = yaw l + pitch u,   l' = -yaw t - roll u,   u' = -pitch t + roll l.

Its Taylor series on parts of the piece is found with a longer mantissa than that of doubles. The coordinates, which are
integrals of t, keep these digits as two doubles each.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from math import ceil, comb
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebder

from gqm_sym.errors import BudgetError, DeclarationError, ParameterError
from gqm_sym.literals.namespaces import FLOATS
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.charts.arc_length import MAX_PIECES, divided, summed
from gqm_sym.runtime.charts.chart import AT_NODES, FIT, NODES, WEIGHTS, Chart, assemble_in_space
from gqm_sym.runtime.charts.double_double.making import TruePieces
from gqm_sym.runtime.charts.rail import MAX_MISMATCH, MAX_TOTAL_TURN
from gqm_sym.runtime.charts.space.true_rail import (
    PIECE_NUMBERS,
    POWERS,
    TrueRail,
    level_frame,
    rates_of,
    starting_frame,
)
from gqm_sym.runtime.compiled.calls import call_segment
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR, Array

# The frame turns by less than MAX_TURN over RADIUS times the length of a part, also where distances are complex: terms
# of its series on the part fall at least as powers of RADIUS, so that after TERMS of them nothing is left of 64 bits.
RADIUS, MAX_TURN, TERMS = 4.0, 2.0, 36

# The number of parts of a piece is multiplied by one of these, the first for which the last coefficients of its roll
# angle are below MAX_TAIL.
REFINEMENTS, MAX_TAIL = (1, 2, 4, 8, 16, 32, 64), 1e-14
# The matrix that maps values at the nodes to those of the derivative.
DERIVATIVE: Array = np.pad(chebder(FIT, axis=0), ((0, 1), (0, 0))).T @ AT_NODES

# The largest number of pieces of a chart for which the rail is computed in double-double arithmetic, in about a second.
MAX_TRUE_PIECES = 10_000

# Rows of the function of a piece with formulas: coordinates, ds/dlam, and three derivatives of these with respect to
# arc length.
CURVE_ROWS = 13
Long = Any  # an array of the longest floats


class Pose(NamedTuple):
    """The end of a piece: its coordinates, the frame in rows, and the roll angle of a banked rail."""

    place: Long
    frame: Long
    roll_angle: Long = 0.0


class Pieces(NamedTuple):
    """The n pieces of the chart of one part of the rail: where they begin and end in the part's own parameter, their
    lengths, coordinates at left edges, and t, t', t'' at nodes.

    The coordinates are followed by the roll angle of a banked rail. The parameter of a curve with formulas is the share
    of its range; that of other parts counts the pieces.
    """

    places: Array
    lengths: Array
    anchors: Long
    slopes: Array
    bends: Array
    changes: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class SpaceRail:
    """A rail in space, which makes its chart for values of the run-time parameters.

    Attributes
    ----------
    numbers
        ``f(op, p)``: x, y and z, heading, climb and roll at the start if the rail is ``placed``, then for each piece as
        many numbers as `PIECE_NUMBERS` says.
    pieces : tuple of str
        "line", "arc", "clothoid", "transition" or "curve".
    placed : bool
        Whether the start is given; otherwise the first piece is a curve, which has a place of its own.
    segments : tuple of int
        Addresses of the compiled functions of the curves among the pieces, in order.
    formulas
        The same curves as ``f(op, lam, p)``: x, y, z and their derivatives.
    closed : bool
        Whether the end is joined to the start.
    banked : bool
        Whether the chart has the roll angle of the frame too.
    shaped_by : tuple of int or None
        The run-time parameters that the rail depends on, by their place; None if that is not known.
    """

    numbers: Callable[..., Any]
    pieces: tuple[str, ...]
    placed: bool
    segments: tuple[int, ...] = ()
    formulas: tuple[Callable[..., Any], ...] = ()
    closed: bool = False
    banked: bool = False
    shaped_by: tuple[int, ...] | None = None

    def chart(self, p: tuple[float, ...]) -> Chart:
        """Return the chart.

        Raises
        ------
        ParameterError
            If a length or a radius is not positive, or a number is not finite.
        DeclarationError
            If pieces do not meet, a closed rail does not close, or the frame of a banked one has no roll angle.
        """
        numbers, segments = iter(self.numbers(FLOATS, p)), iter(self.segments)
        pose = _start(np.array([*map(float, islice(numbers, 6))], dtype=np.longdouble)) if self.placed else None
        start, parts, joints = pose, [], [0.0]
        for count, kind in enumerate(self.pieces, start=1):
            where = f"piecewise: piece {count} ({kind})"
            given = [float(number) for number in islice(numbers, PIECE_NUMBERS[kind])]
            if kind == "curve":
                if self.banked:
                    raise DeclarationError(f"{where}: has no roll of its own; declare the roll by a formula in s")
                part, begin, end = _curve(next(segments), np.array(p), given, where)
                if pose is not None:
                    length = joints[-1] + float(part.lengths.sum())
                    _check_joint(pose, begin, length, f"{where}: begins", "the piece before it ends")
            else:
                assert pose is not None
                begin = pose
                part, end = _piece(*_rates(kind, given, where), pose, where, self.banked)
            start, pose = start or begin, end
            parts.append(part)
            joints.append(joints[-1] + float(part.lengths.sum()))
            if sum(one.lengths.size for one in parts) > MAX_PIECES:
                raise BudgetError(f"chart: {where}: {MAX_PIECES} pieces reach no farther; let the rail turn less")
        assert start is not None
        assert pose is not None
        if self.closed:
            _check_joint(pose, start, joints[-1], "piecewise: closed: the start lies", "the last piece ends")
            if self.banked and not abs(np.sin(0.5 * (pose.roll_angle - start.roll_angle))) <= MAX_MISMATCH:
                roll_angles = (
                    f"{float(pose.roll_angle)!r} rad at its end, and {float(start.roll_angle)!r} rad at its start"
                )
                raise DeclarationError(f"piecewise: closed: the rail leans by {roll_angles}; let it roll back")
        places, lengths, anchors, *derivatives = (np.concatenate(rows) for rows in zip(*parts, strict=True))
        which = np.repeat(np.arange(len(parts)), [part.lengths.size for part in parts])
        edges, inner = summed(lengths), joints[:-1] if self.closed else joints[1:-1]
        return assemble_in_space(
            edges,
            anchors,
            derivatives,
            period=edges[-1] if self.closed else 0.0,
            # Breaks are edges of the chart, to the last bit.
            breaks=edges[np.abs(edges[:, None] - np.array(inner)).argmin(axis=0)] if inner else (),
            origins=np.column_stack([which, places]),
        )

    def is_exact(self, chart: Chart) -> bool:
        """Return False: the rail is known to the digits of double-double arithmetic."""
        return False

    def true_curve(self, context: Any, p: tuple[Any, ...], chart: Chart) -> Any:
        """Return None, because the rail is known to the digits of double-double arithmetic only."""
        return None

    def true_pieces(self, p: Sequence[Number], chart: Chart) -> TruePieces | None:
        """Return the rail in double-double arithmetic; None if it has too many pieces for that."""
        if chart.edges.size > MAX_TRUE_PIECES:
            return None
        rail = TrueRail(self.pieces, self.placed, self.numbers, self.formulas, p, chart)
        return TruePieces(chart, rail.sample, in_space=True, frame=rail.frame)


def _start(numbers: Long) -> Pose:
    """Return the start of a rail, given by x, y and z, heading, climb and roll."""
    frame = np.array(starting_frame(np.cos, np.sin, *numbers[3:]), dtype=np.longdouble)
    return Pose(numbers[:3], frame, numbers[5])


def _check_joint(end: Pose, begin: Pose, length: float, who: str, whom: str) -> None:
    """Refuse a joint at which the place or the tangent jumps."""
    gap = float(np.sqrt(((begin.place - end.place) ** 2).sum()))
    turn = float(np.sqrt(((begin.frame[0] - end.frame[0]) ** 2).sum()))
    if not (gap <= MAX_MISMATCH * length and turn <= MAX_MISMATCH):
        place, other = (tuple(pose.place.astype(float).tolist()) for pose in (begin, end))
        raise DeclarationError(
            f"{who} at {place!r}, {gap:.3g} m and {turn:.3g} rad off where {whom}: {other!r}; "
            f"both must match within {MAX_MISMATCH:g} of the rail's length and {MAX_MISMATCH:g} rad"
        )


def _rates(kind: str, given: list[float], where: str) -> tuple[Long, Long]:
    """Return the length of a piece, and the coefficients of yaw, pitch and roll in rows."""
    size, other = ("radius", "angle") if kind == "arc" else ("length", "rate")
    if not (np.isfinite(given[0]) and given[0] > 0.0):
        raise ParameterError(f"{where}: {size}: must be positive, got {given[0]!r}")
    for value in given[1:]:
        if not np.isfinite(value):
            raise ParameterError(f"{where}: {other}: must be finite, got {value!r}")
    if kind == "arc" and given[1] == 0.0:
        raise ParameterError(f"{where}: angle: must not be zero; positive turns up, negative down")
    length, terms = rates_of(kind, np.array(given, dtype=np.longdouble))
    rates = np.zeros((3, POWERS), dtype=np.longdouble)
    for row, own in zip(rates, terms, strict=True):
        row[: len(own)] = own
    return length, rates


def _piece(length: Long, rates: Long, pose: Pose, where: str, banked: bool) -> tuple[Pieces, Pose]:
    """Return a piece with given rates, in enough parts to resolve its roll angle too, and its right end."""
    for finer in REFINEMENTS if banked else REFINEMENTS[:1]:
        pieces, end, spin, end_roll = _turned(length, rates, pose, where, finer)
        if not banked:
            break
        with np.errstate(all="ignore"):
            across, along, up = np.moveaxis(pieces.slopes, 1, 0)
            change = (across * pieces.bends[:, 1] - along * pieces.bends[:, 0]) / (across**2 + along**2)
            # The frame rolls; and where a climbing track turns, the horizontal direction turns about the tangent.
            slopes = spin + up * change
        half = 0.5 * pieces.lengths[:, None]
        roll_angles = np.cumsum(np.append(pose.roll_angle, half[:, 0] * (slopes @ WEIGHTS)), dtype=np.longdouble)
        # Beyond a vertical tangent, the roll angle is measured from another horizontal direction.
        off = np.abs(np.sin(0.5 * (roll_angles[1:] - end_roll))).max()
        if np.abs(half * (slopes @ FIT[-2:].T)).max() <= MAX_TAIL and off <= MAX_MISMATCH:
            bends = slopes @ DERIVATIVE / half
            rows = (slopes, bends, bends @ DERIVATIVE / half)
            known = (np.append(row, roll[:, None], axis=1) for row, roll in zip(pieces[3:], rows, strict=True))
            anchors = np.column_stack([pieces.anchors, roll_angles[:-1]])
            return Pieces(pieces.places, pieces.lengths, anchors, *known), end._replace(roll_angle=roll_angles[-1])
    else:
        raise DeclarationError(
            f"{where}: its tangent is vertical, or nearly so, where there is no level to measure a roll angle from; "
            "declare roll='coordinated'"
        )
    return pieces, end


def _turned(length: Long, rates: Long, pose: Pose, where: str, finer: int) -> tuple[Pieces, Pose, Array, Long]:
    """Return a piece with given rates, its right end, the roll rate at the nodes, and the roll angles at the ends of
    its parts.
    """
    orders = np.arange(POWERS)
    sizes = np.sqrt((rates.astype(np.float64) ** 2).sum(axis=0))
    turned = float((sizes * float(length) ** (orders + 1)).sum())
    if not turned <= MAX_TOTAL_TURN:
        raise ParameterError(f"{where}: turns by {turned:.3g} rad; {MAX_TOTAL_TURN:g} is the most")
    count, scaled = 1, _on_parts(length, rates, 1)
    while (np.sqrt((scaled**2).sum(axis=1)) @ (RADIUS ** (orders + 1) / (orders + 1))).max() > MAX_TURN:
        count = ceil(1.25 * count)
        scaled = _on_parts(length, rates, count)
    if finer > 1:
        count *= finer
        scaled = _on_parts(length, rates, count)
    step = np.longdouble(length) / count
    yaw, pitch, roll = np.moveaxis(scaled, 1, 0)
    turn = np.zeros((POWERS, count, 3, 3), dtype=np.longdouble)
    for (row, column), rate in {(0, 1): yaw, (0, 2): pitch, (2, 1): roll}.items():
        turn[:, :, row, column], turn[:, :, column, row] = rate.T, -rate.T
    series = [np.broadcast_to(np.eye(3, dtype=np.longdouble), (count, 3, 3))]
    for k in range(TERMS):
        total = sum(turn[j] @ series[k - j] for j in range(min(k + 1, POWERS)))
        series.append(total / (k + 1))
    frames = np.empty((count + 1, 3, 3), dtype=np.longdouble)
    passed: Long = sum(series)
    frames[0] = pose.frame
    for k in range(count):
        frames[k + 1] = passed[k] @ frames[k]
    gained: Long = step * sum(term[:, 0] / (k + 1) for k, term in enumerate(series))
    gains = np.concatenate([pose.place[None], np.einsum("ki,kij->kj", gained, frames[:-1])])
    places = np.cumsum(gains, axis=0)
    shares = 0.5 * (1.0 + np.asarray(NODES, dtype=np.longdouble))
    at_nodes: Long = sum(term[:, None] * (shares**k)[:, None, None] for k, term in enumerate(series))
    at_nodes = at_nodes @ frames[:-1, None]
    now: Long = sum(scaled[:, :, j, None] * shares**j for j in range(POWERS)) / step
    growth: Long = sum(scaled[:, :, j, None] * (j * shares ** (j - 1)) for j in range(1, POWERS)) / step**2
    (yaw, pitch, roll), (more_yaw, more_pitch, _) = (np.moveaxis(r, 1, 0)[..., None] for r in (now, growth))
    ahead, side, up = np.moveaxis(at_nodes, 2, 0)
    bends = yaw * side + pitch * up
    changes = (more_yaw + pitch * roll) * side + (more_pitch - yaw * roll) * up - (yaw**2 + pitch**2) * ahead
    rows = (np.moveaxis(row, 2, 1).astype(np.float64) for row in (ahead, bends, changes))
    shares_passed = np.arange(count, dtype=np.float64)
    own = np.stack([shares_passed, shares_passed + 1.0], axis=1)
    pieces = Pieces(own, np.full(count, float(step)), places[:-1], *rows)
    across, along = -frames[1:, 0, 1], frames[1:, 0, 0]
    left, upright = (frames[1:, row, 0] * across + frames[1:, row, 1] * along for row in (1, 2))
    return pieces, Pose(places[-1], frames[-1]), roll[:, :, 0].astype(np.float64), np.arctan2(upright, left)


def _on_parts(length: Long, rates: Long, count: int) -> Long:
    """Return the rates on equal parts of a piece: for each part their coefficients in powers of its share passed."""
    step = np.longdouble(length) / count
    left = step * np.arange(count)
    scaled = np.zeros((count, 3, POWERS), dtype=np.longdouble)
    for j in range(POWERS):
        for i in range(j, POWERS):
            scaled[:, :, j] += comb(i, j) * rates[:, i] * (left ** (i - j))[:, None]
        scaled[:, :, j] *= step ** (j + 1)
    return scaled


@entry(MATRIX(INTEGER, VECTOR, VECTOR))
def _segment_rows(address, p, lam):  # type: ignore[no-untyped-def]
    """Return the rows of a curve with formulas."""
    out = np.empty((CURVE_ROWS, lam.size))
    call_segment(address, lam.size, lam, p, out)
    return out


def _curve(address: int, p: Array, ends: list[float], where: str) -> tuple[Pieces, Pose, Pose]:
    """Return a curve with formulas, and both its ends."""
    low, high = ends
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise ParameterError(f"{where}: domain: must have finite ends lo < hi, got ({low!r}, {high!r})")

    def rows(left: Array, offsets: Array) -> Array:
        out: Array = _segment_rows(address, p, (left[:, None] + offsets).ravel())
        return out.reshape(CURVE_ROWS, *offsets.shape)

    found = divided(rows, np.array([low, high]), 3, where=where)
    at_ends = rows(np.array([low, high]), np.zeros((2, 1)))[:, :, 0].T
    begin, end = (Pose(row[:3], np.array(level_frame(np.hypot, row[4:7]))) for row in at_ends.astype(np.longdouble))
    values = np.moveaxis(found.at_nodes, 0, 1)
    anchors = found.at_edges[:3].T.astype(np.longdouble)
    shares = (found.places - low) / (high - low)
    return Pieces(shares, found.lengths, anchors, values[:, :3], values[:, 3:6], values[:, 6:]), begin, end
