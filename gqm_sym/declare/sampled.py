"""Tracks given by points: checked row by row, and kept as the exact text of their coordinates.

Points that were smoothed are kept instead of those that were measured: a module has no more to do than to go through
them, and a smooth track needs fewer of them.
"""

import re
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from itertools import pairwise
from math import atan2, dist, hypot, isfinite, pi
from statistics import median
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from gqm_sym.arguments import one_of, several, short
from gqm_sym.declare.banking import is_formula
from gqm_sym.errors import DeclarationError, NoisyPointsWarning, NumberError
from gqm_sym.literals.numbers import Number, read_numbers, without_unit
from gqm_sym.literals.units import is_quantity

if TYPE_CHECKING:
    from gqm_sym.smoothing import Smoothing

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
# Tracks are as large as this, in m: fourth powers of the distances of points are doubles, and so are their inverses.
SIZES = 1e-60, 1e60
# A chord of a smooth track that is this many times as long as half of all chords jumps to another place.
JUMP = 100.0
# A chord of measured points that is this many times as long as they scatter tells the direction of the track.
LONG = 8.0
# Points do not scatter by more than this, in m; squares of it are doubles.
MAX_DEVIATION = 1e100
# Cross-validation needs more points than a spline does.
FEWEST_AUTO = 12
# Curvature that rises and falls by turns between more than this share of neighbours is scatter,
RESTLESS = 0.5
# if it changes loads by this many g where a body is as fast as after a fall from one side of the track to the other.
FELT = 0.1

Place: TypeAlias = tuple[float, ...]
# The coordinates of points in space.
IN_SPACE = 3
# So many turns in a row, each to the other side and by more than this, are a zigzag that no smooth track goes through:
# the lengths of the spline between such points never settle.
ZIGZAGS = 5
ZIGZAG = pi / 9

_DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """Points and what lies between them.

    Attributes
    ----------
    points : str
        One point a line, x and z, or x, y and z, and perhaps the roll angle, as decimal numbers. A closed track does
        not repeat its first point.
    kind : {"spline", "linear"}
        A quintic spline, or planes stitched together.
    closed : bool
        Whether the track goes on from the last point to the first.
    smoothing : Smoothing or None
        What smoothing did to the points as measured, if they were smoothed.
    """

    points: str
    kind: str
    closed: bool
    smoothing: "Smoothing | None" = field(default=None, compare=False, repr=False)

    @property
    def in_space(self) -> bool:
        """Whether its points have three coordinates."""
        return self._columns >= IN_SPACE

    @property
    def banked(self) -> bool:
        """Whether its points have a roll angle."""
        return self._columns > IN_SPACE

    @property
    def _columns(self) -> int:
        return len(self.points[: self.points.find("\n")].split())


def in_metres(given: Any) -> Any:
    """Lengths that were given as quantities, alone or in sequences, as numbers of metres; anything else as it is."""
    if is_quantity(given):
        high, _, shape = read_numbers(given, where="sampled", unit="m")
        return high.reshape(shape).tolist()
    if isinstance(given, Mapping):
        return {key: in_metres(value) for key, value in given.items()}
    if isinstance(given, list | tuple) and any(map(_holds_quantity, given)):
        return [in_metres(value) for value in given]
    return given


def _holds_quantity(given: Any) -> bool:
    return is_quantity(given) or (isinstance(given, list | tuple) and any(map(is_quantity, given)))


def read_track(
    points: Any,
    z: Any = None,
    *,
    kind: str = "spline",
    closed: bool | None = None,
    smoothing: float | str | None = None,
    roll: Any = None,
) -> Track:
    """Read and check the points of a track.

    Parameters
    ----------
    points
        Rows of x and z, or in space of x, y and z: an array, or numbers or decimal text, which is kept as it is; or a
        table with columns x and z, perhaps also y; or the x of all points.
    z
        The heights of the points, where ``points`` are their x.
    kind
        "spline" or "linear".
    closed
        Whether the track closes; None: if its last point is its first.
    smoothing
        The standard deviation of the points in metres, "auto", or None: the track goes through them.
    roll
        In space the roll angle at each point, in radians; None: that of a table which has one. What is no such thing,
        as a formula, is not for points.

    Raises
    ------
    DeclarationError
        If a row is no point, or points are too few, repeated, out of order or far away; the message names the row,
        counted from 1.

    Warns
    -----
    NoisyPointsWarning
        If the track's curvature goes up and down from point to point.
    """
    one_of(kind, KINDS, where="sampled: kind")
    if not (closed is None or isinstance(closed, bool)):
        raise DeclarationError(f"sampled: closed: must be True, False or None, got {short(closed)}")
    points, z = in_metres(points), in_metres(z)
    deviation = _read_smoothing(in_metres(smoothing), kind)
    texts: list[str] = []
    places: list[Place] = []
    rows_given, angles = _rows(points, z)
    for text, place in _read_rows(rows_given):
        texts.append(text)
        places.append(place)
    angles = [] if is_formula(roll) else _angles(angles if roll is None else roll, places)
    size = _size(places)
    if size and not SIZES[0] <= size <= SIZES[1]:
        raise DeclarationError(
            f"sampled: the points span {size:.3g} m; a track spans {SIZES[0]:g} to {SIZES[1]:g} m: are they in metres?"
        )
    repeated = len(places) > 1 and dist(places[0], places[-1]) <= CLOSES * size
    joined = repeated if closed is None else closed
    if joined and repeated:
        del texts[-1], places[-1]
    in_space = bool(places) and len(places[0]) == IN_SPACE
    if in_space and kind != "spline":
        raise DeclarationError(
            f"sampled: kind {kind!r} is for tracks of x and z only yet; in space declare a spline, of points dense "
            "enough where the track bends"
        )
    rows = list(range(1, len(places) + 1))
    if deviation is not None:  # what a recorder that waits for news says again was not measured again
        rows = [row for row in rows if row == 1 or places[row - 1] != places[row - 2]]
        places = [places[row - 1] for row in rows]
        angles = [angles[row - 1] for row in rows] if angles else angles
    fewest = FEWEST_AUTO if deviation == "auto" else FEWEST[kind, joined]
    if len(places) < fewest:
        what = "a closed" if joined else "an open"
        how = f"kind {kind!r}" if deviation is None else f"smoothing {smoothing!r}"
        raise DeclarationError(f"sampled: {len(places)} different points; {what} track of {how} needs {fewest} or more")
    if deviation is None:
        _check_order(places, size, kind, joined)
        if kind == "spline" and not in_space:
            _warn_of_scatter(places, joined, "give their standard deviation in metres as smoothing, or 'auto'")
        texts = [" ".join(parts) for parts in zip(texts, angles, strict=False)] if angles else texts
        return Track(points="\n".join(texts), kind=kind, closed=joined)
    _check_survey(places, rows, joined, 0.0 if deviation == "auto" else deviation)
    smoothed, report = _smoothed(places, rows, joined, deviation, angles)
    if not in_space:
        _warn_of_scatter(smoothed, joined, f"smoothing {smoothing!r} is less than their scatter")
    kept = "\n".join(" ".join(map(repr, place)) for place in smoothed)
    return Track(points=kept, kind=kind, closed=joined, smoothing=report)


def _read_smoothing(given: Any, kind: str) -> float | Literal["auto"] | None:
    """The standard deviation of points, "auto" for cross-validation, or None for points that are exact."""
    if given is None:
        return None
    if kind != "spline":
        raise DeclarationError(f"sampled: smoothing: is for kind 'spline'; a track of kind {kind!r} has its corners")
    if isinstance(given, str) and given == "auto":
        return "auto"
    try:
        given = without_unit(given, where="sampled: smoothing", unit="m")
        given = given.value if isinstance(given, Number) else given
        deviation = float("nan") if isinstance(given, bool | str) else float(given)
    except NumberError as error:
        raise DeclarationError(str(error)) from None
    except (TypeError, ValueError, OverflowError):
        deviation = float("nan")
    if not 0.0 < deviation < MAX_DEVIATION:
        raise DeclarationError(
            "sampled: smoothing: must be the standard deviation of the points in metres, a positive number, 'auto' or "
            f"None, got {given!r:.40}"
        )
    return deviation


def _smoothed(
    places: list[Place], rows: list[int], joined: bool, deviation: float | Literal["auto"], angles: list[str]
) -> tuple[list[Place], "Smoothing"]:
    """The points of the smooth track, and what smoothing did."""
    from gqm_sym.smoothing import smooth

    known = None if deviation == "auto" else deviation
    rolls = [float(angle) for angle, _ in zip(angles, places, strict=False)]
    found, report = smooth(places, rows, closed=joined, deviation=known, angles=rolls)
    return [tuple(place) for place in found.tolist()], report


def _angles(given: Any, places: list[Place]) -> list[str]:
    """The text of the roll angle at each point; none where none are given."""
    if given is None:
        return []
    if places and len(places[0]) != IN_SPACE:
        raise DeclarationError("sampled: roll: is for tracks in space; give rows of x, y and z")
    given = without_unit(given, where="sampled: roll", unit="rad")
    angles = several(given, where="sampled: roll", what="an angle for each point, a formula in s or 'coordinated'")
    if len(angles) != len(places):
        raise DeclarationError(f"sampled: roll: must be an angle for each point, got {len(angles)} for {len(places)}")
    return [_read(angle, count)[0] for count, angle in enumerate(angles, start=1)]


def _rows(points: Any, z: Any) -> tuple[Any, Any]:
    """Points as rows, whichever way they were given, and their roll angles in a table that has them."""
    if z is not None:
        return _paired("sampled: x and z", points, z), None
    # Any kind of table will do, whoever made it.
    names = points if isinstance(points, Mapping) else getattr(points, "columns", None)
    if names is None:
        return points, None
    columns = {name.strip().lower(): name for name in names if isinstance(name, str)}
    if columns.keys() >= {"x", "y", "z"}:
        rows = _paired("sampled: columns x, y and z", *(points[columns[name]] for name in "xyz"))
        return rows, points[columns["roll"]] if "roll" in columns else None
    if not columns.keys() >= {"x", "z"}:
        raise DeclarationError(
            f"sampled: points: a table must have columns x and z, got {short(list(names))}; rename them, or give "
            "both columns, as in Curve.sampled(table['distance'], table['height'])"
        )
    return _paired("sampled: columns x and z", points[columns["x"]], points[columns["z"]]), None


def _paired(where: str, *columns: Any) -> list[tuple[Any, ...]]:
    """Rows of two or three columns."""
    read = [_column(column, where) for column in columns]
    if len({len(column) for column in read}) > 1:
        lengths = " and ".join(str(len(column)) for column in read)
        raise DeclarationError(f"{where}: must be of one length, got {lengths} values")
    return list(zip(*read, strict=True))


def _column(values: Any, where: str) -> tuple[Any, ...]:
    listed = values.tolist() if hasattr(values, "tolist") else values
    return several(listed, where=where, what="two columns of numbers")


def _read_rows(points: Iterable[Any]) -> Iterator[tuple[str, Place]]:
    if isinstance(points, str):
        raise DeclarationError(
            f"sampled: points: must be rows of x and z, got {short(points)}; read a file first, as by pandas.read_csv"
        )
    # An array of numbers gives Python's own floats at once, which is many times quicker than row by row.
    rows = points.tolist() if hasattr(points, "tolist") else points
    try:
        numbered = enumerate(rows, start=1)
    except TypeError:
        raise DeclarationError(f"sampled: points: must be rows of x and z, got {short(points)}") from None
    wanted = 2
    for count, row in numbered:
        is_row = isinstance(row, Sequence) and not isinstance(row, str)
        if count == 1 and is_row and len(row) == IN_SPACE:
            wanted = IN_SPACE
        if not is_row or len(row) != wanted:
            told = "two numbers, x and z" if wanted == 2 else "three numbers, x, y and z, as in row 1"
            told += ", or in space three, x, y and z" if count == 1 else ""
            raise DeclarationError(
                f"sampled: row {count}: must be {told}, got {short(row)}; for one array of each write "
                "Curve.sampled(x, z)"
            )
        coordinates, place = zip(*[_read(value, count) for value in row], strict=True)
        yield " ".join(coordinates), place


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
            # All digits of a float, which means its binary value and not the shortest decimal that is read as it.
            text = str(value) if isinstance(value, int) else str(Decimal(float(value)))
        except (TypeError, ValueError, OverflowError):
            raise DeclarationError(f"sampled: row {count}: {value!r:.40} is no number") from None
    number = float(text)
    if not isfinite(number):
        raise DeclarationError(f"sampled: row {count}: {value!r:.40} is not finite; leave the row out or mend it")
    return text, number


def _size(places: list[Place]) -> float:
    """The longer side of the box around all points."""
    if not places:
        return 0.0
    return float(max(max(axis) - min(axis) for axis in zip(*places, strict=True)))


def _check_survey(places: list[Place], rows: list[int], joined: bool, scatter: float) -> None:
    """Refuse measured points that are far away from the rest, or out of order beyond what scatter explains."""
    chords = _chords(places, joined)
    usual = median(chords)
    for count, chord in enumerate(chords, start=1):
        _check_gap(chord, usual, rows[count - 1], rows[count % len(rows)])
    around = [*places, *places[:2]] if joined else places
    bends = [
        dist([0.5 * (before + after) for before, after in zip(one, three, strict=True)], two)
        for one, two, three in zip(around, around[1:], around[2:], strict=False)
    ]
    long = LONG * max(scatter, median(bends))
    for count, (turn, pair) in enumerate(zip(_turns(places, joined), pairwise([*chords, chords[0]]), strict=False), 1):
        if abs(turn) > SHARPEST and min(pair) > long:
            _refuse_turn(turn, rows[count % len(rows)])


def _check_gap(chord: float, usual: float, before: int, row: int) -> None:
    if chord > JUMP * usual:
        raise DeclarationError(
            f"sampled: row {row}: is {chord:.3g} from row {before}, where half of all points are within "
            f"{usual:.3g} of the next; leave out stray points, or sample the gap"
        )


def _chords(places: list[Place], joined: bool) -> list[float]:
    around = [*places, places[0]] if joined else places
    return [dist(one, two) for one, two in pairwise(around)]


def _turns(places: list[Place], joined: bool) -> list[float]:
    """By how much the track turns at each point between two others; in space it has no sign."""
    around = [*places, *places[:2]] if joined else places
    if len(places[0]) == IN_SPACE:
        steps = [tuple(there - here for here, there in zip(*pair, strict=True)) for pair in pairwise(around)]
        return [_angle(before, after) for before, after in pairwise(steps)]
    angles = [atan2(two[1] - one[1], two[0] - one[0]) for one, two in pairwise(around)]
    return [(after - before + pi) % (2.0 * pi) - pi for before, after in pairwise(angles)]


def _angle(one: Place, two: Place) -> float:
    """The angle between two vectors in space."""
    crossed = [one[i] * two[j] - one[j] * two[i] for i, j in ((1, 2), (2, 0), (0, 1))]
    return atan2(hypot(*crossed), sum(first * second for first, second in zip(one, two, strict=True)))


def _check_order(places: list[Place], size: float, kind: str, joined: bool) -> None:
    """Refuse points that are repeated, out of order or far away from the rest."""
    chords = _chords(places, joined)
    usual = median(chords)
    for count, chord in enumerate(chords, start=1):
        if chord <= SAME * size:
            row = count % len(places) + 1
            raise DeclarationError(f"sampled: row {row}: repeats row {count}; leave one of them out")
        if kind == "spline":
            _check_gap(chord, usual, count, count % len(places) + 1)
    most = SHARPEST if kind == "spline" else BACKWARDS
    for count, turn in enumerate(_turns(places, joined), start=1):
        if abs(turn) > most:
            _refuse_turn(turn, count % len(places) + 1)
    if kind == "spline":
        _check_zigzag(_turns(places, joined))


def _refuse_turn(turn: float, row: int) -> None:
    raise DeclarationError(
        f"sampled: row {row}: the track turns by {abs(turn) * 180.0 / pi:.0f} degrees there; are the points in order "
        "along it, without a stray one, and close enough? (If they scatter farther than they are apart, give smoothing)"
    )


def _warn_of_scatter(places: list[Place], joined: bool, remedy: str) -> None:
    """Warn of a track whose curvature goes up and down from point to point, as that of the track does not.

    Scatter of points at distances h is in the curvature over h**2. Where it is most of that, the sign changes between
    most neighbours; that the sign of the curvature's changes does shows it earlier, and on a loop as well.
    """
    chords = _chords(places, joined)
    if joined:
        chords.append(chords[0])
    bends = [
        2.0 * turn / (before + after)
        for turn, (before, after) in zip(_turns(places, joined), pairwise(chords), strict=True)
    ]
    steps = [after - before for before, after in pairwise(bends)]
    swings = [abs(after - before) / 4.0 for before, after in pairwise(steps) if before * after < 0.0]
    if len(swings) <= RESTLESS * (len(steps) - 1):
        return
    felt = 2.0 * _size(places) * median(swings)
    if felt > FELT:
        changes = sum(before * after < 0.0 for before, after in pairwise(bends))
        warnings.warn(
            f"sampled: the curvature goes up and down from point to point (its sign changes between {changes} of "
            f"{len(bends) - 1} neighbours), and loads with it, by about {felt:.2g} g where a body is fast: the points "
            f"scatter, or are too far apart; {remedy}",
            NoisyPointsWarning,
            stacklevel=5,
        )


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
                "without their noise (smoothing takes it out), or kind='linear' for planes"
            )
