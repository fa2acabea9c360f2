"""Tracks given by points: checked row by row, and kept as the exact text of their coordinates."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise
from math import atan2, hypot, isfinite, pi
from statistics import median
from typing import Any

from gqm_sym.arguments import one_of, several, short
from gqm_sym.errors import DeclarationError

KINDS = ("spline", "linear")
# The fewest different points: a quintic polynomial has six; a closed ring of planes is a triangle.
FEWEST = {("spline", False): 6, ("spline", True): 6, ("linear", False): 2, ("linear", True): 3}
# Points nearer to each other than this share of the track's size are the same point.
SAME = 1e-12
# The first and the last point nearer than this share of the track's size: the track closes.
CLOSES = 1e-9
# A smooth track that turns by more than this from one chord to the next is out of order, or sampled too coarsely.
SHARPEST = pi / 2
# Planes that turn by more than this lead back along themselves.
BACKWARDS = pi - 1e-6
# A chord of a smooth track that is this many times as long as half of all chords jumps to another place.
JUMP = 100.0
# So many turns in a row, each to the other side and by more than this, are a zigzag that no smooth track goes through:
# the lengths of the spline between such points never settle.
ZIGZAGS = 3
ZIGZAG = pi / 9

_DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """Points and what lies between them.

    Attributes
    ----------
    points : str
        One point a line, x and z as decimal numbers. A closed track does not repeat its first point.
    kind : {"spline", "linear"}
        A quintic spline, or planes stitched together.
    closed : bool
        Whether the track goes on from the last point to the first.
    """

    points: str
    kind: str
    closed: bool


def read_track(points: Any, z: Any = None, *, kind: str = "spline", closed: bool | None = None) -> Track:
    """Read and check the points of a track.

    Parameters
    ----------
    points
        Rows of x and z: an (n, 2) array, or pairs of numbers or of decimal text, which is kept as it is; or a table
        with columns x and z; or the x of all points.
    z
        The heights of the points, where ``points`` are their x.
    kind
        "spline" or "linear".
    closed
        Whether the track closes; None: if its last point is its first.

    Raises
    ------
    DeclarationError
        If a row is no point, or points are too few, repeated, out of order or far away; the message names the row,
        counted from 1.
    """
    one_of(kind, KINDS, where="sampled: kind")
    if not (closed is None or isinstance(closed, bool)):
        raise DeclarationError(f"sampled: closed: must be True, False or None, got {short(closed)}")
    texts: list[str] = []
    places: list[tuple[float, float]] = []
    for text, place in _read_rows(_rows(points, z)):
        texts.append(text)
        places.append(place)
    size = _size(places)
    repeated = len(places) > 1 and _distance(places[0], places[-1]) <= CLOSES * size
    joined = repeated if closed is None else closed
    if joined and repeated:
        del texts[-1], places[-1]
    fewest = FEWEST[kind, joined]
    if len(places) < fewest:
        what = "a closed" if joined else "an open"
        raise DeclarationError(
            f"sampled: {len(places)} different points; {what} track of kind {kind!r} needs {fewest} or more"
        )
    _check_order(places, size, kind, joined)
    return Track(points="\n".join(texts), kind=kind, closed=joined)


def _rows(points: Any, z: Any) -> Any:
    """Points as rows, whichever way they were given."""
    if z is not None:
        return _paired(points, z, "sampled: x and z")
    # Any kind of table will do, whoever made it.
    names = points if isinstance(points, Mapping) else getattr(points, "columns", None)
    if names is None:
        return points
    columns = {name.strip().lower(): name for name in names if isinstance(name, str)}
    if not columns.keys() >= {"x", "z"}:
        raise DeclarationError(
            f"sampled: points: a table must have columns x and z, got {short(list(names))}; rename them, or give "
            "both columns, as in Curve.sampled(table['distance'], table['height'])"
        )
    return _paired(points[columns["x"]], points[columns["z"]], "sampled: columns x and z")


def _paired(x: Any, z: Any, where: str) -> list[tuple[Any, Any]]:
    """Rows of two columns."""
    first, second = (_column(column, where) for column in (x, z))
    if len(first) != len(second):
        raise DeclarationError(f"{where}: must be of one length, got {len(first)} and {len(second)} values")
    return list(zip(first, second, strict=True))


def _column(values: Any, where: str) -> tuple[Any, ...]:
    listed = values.tolist() if hasattr(values, "tolist") else values
    return several(listed, where=where, what="two columns of numbers")


def _read_rows(points: Iterable[Any]) -> Iterator[tuple[str, tuple[float, float]]]:
    # An array of numbers gives Python's own floats at once, which is many times quicker than row by row.
    rows = points.tolist() if hasattr(points, "tolist") else points
    try:
        numbered = enumerate(rows, start=1)
    except TypeError:
        raise DeclarationError(f"sampled: points: must be rows of x and z, got {short(points)}") from None
    for count, row in numbered:
        if isinstance(row, str) or not isinstance(row, Sequence) or len(row) != 2:
            raise DeclarationError(
                f"sampled: row {count}: must be two numbers, x and z, got {short(row)}; "
                "for one array of each write Curve.sampled(x, z)"
            )
        (x, first), (z, second) = (_read(value, count) for value in row)
        yield f"{x} {z}", (first, second)


def _read(value: Any, count: int) -> tuple[str, float]:
    """A coordinate's text and value."""
    if isinstance(value, str | Decimal):
        text = str(value).strip()
        if not _DECIMAL.fullmatch(text):
            raise DeclarationError(f"sampled: row {count}: {text[:40]!r} is no decimal number")
    elif isinstance(value, bool):
        raise DeclarationError(f"sampled: row {count}: {value} is no number")
    else:
        try:
            text = repr(float(value))
        except (TypeError, ValueError, OverflowError):
            raise DeclarationError(f"sampled: row {count}: {value!r:.40} is no number") from None
    number = float(text)
    if not isfinite(number):
        raise DeclarationError(f"sampled: row {count}: {value!r:.40} is not finite; leave the row out or mend it")
    return text, number


def _size(places: list[tuple[float, float]]) -> float:
    """The longer side of the box around all points."""
    if not places:
        return 0.0
    xs, zs = zip(*places, strict=True)
    return float(max(max(xs) - min(xs), max(zs) - min(zs)))


def _distance(one: tuple[float, float], two: tuple[float, float]) -> float:
    return hypot(two[0] - one[0], two[1] - one[1])


def _check_order(places: list[tuple[float, float]], size: float, kind: str, joined: bool) -> None:
    """Refuse points that are repeated, out of order or far away from the rest."""
    around = [*places, places[0]] if joined else places
    chords = [_distance(one, two) for one, two in pairwise(around)]
    usual = median(chords)
    for count, chord in enumerate(chords, start=1):
        row = count % len(places) + 1
        if chord <= SAME * size:
            raise DeclarationError(f"sampled: row {row}: repeats row {count}; leave one of them out")
        if kind == "spline" and chord > JUMP * usual:
            raise DeclarationError(
                f"sampled: row {row}: is {chord:.3g} from row {count}, where half of all points are within {usual:.3g} "
                "of the next; leave out stray points, or sample the gap"
            )
    angles = [atan2(two[1] - one[1], two[0] - one[0]) for one, two in pairwise(around)]
    if joined:
        angles.append(angles[0])
    most = SHARPEST if kind == "spline" else BACKWARDS
    for count, (before, after) in enumerate(pairwise(angles), start=1):
        turn = abs((after - before + pi) % (2.0 * pi) - pi)
        if turn > most:
            raise DeclarationError(
                f"sampled: row {count % len(places) + 1}: the track turns by {turn * 180.0 / pi:.0f} degrees there; "
                "are the points in order along it, without a stray one, and close enough?"
            )
    if kind == "spline":
        _check_zigzag([(after - before + pi) % (2.0 * pi) - pi for before, after in pairwise(angles)])


def _check_zigzag(turns: list[float]) -> None:
    """Refuse points between which a smooth track would swing to and fro."""
    run = 0
    for count, turn in enumerate(turns):
        swings = run and turn * turns[count - 1] < 0.0
        run = 0 if abs(turn) <= ZIGZAG else run + 1 if swings else 1
        if run == ZIGZAGS:
            first = count + 3 - ZIGZAGS
            raise DeclarationError(
                f"sampled: row {first}: the track turns to and fro there, {ZIGZAGS} times by more than "
                f"{ZIGZAG * 180.0 / pi:.0f} degrees; no smooth track goes through a zigzag: give more points, points "
                "without their noise, or kind='linear' for planes"
            )
