"""Surveyed tracks from files: tables of coordinates (CSV), and places on the Earth (GPX), which become metres in a
local frame.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from math import cos, hypot, isfinite, radians, sin, sqrt
from pathlib import Path
from typing import Any, NamedTuple
from xml.parsers import expat

from gqm_sym.arguments import file_path, short
from gqm_sym.errors import InputError
from gqm_sym.specfile.companion_files import ROW_LIMIT, read_companion, read_rows

EXPECTED_COLUMNS = "a CSV file with columns x, z, or x, y, z, perhaps with roll, or a GPX file"
"""A description of files of points, for messages."""
# The columns of a table without names, by the number of columns.
_UNNAMED = {2: ("x", "z"), 3: ("x", "y", "z"), 4: ("x", "y", "z", "roll")}
# The elements of GPX whose points form a track.
_PLACES = ("trkpt", "rtept")
# The ellipsoid of the World Geodetic System 1984: half its longer axis in m, and its flattening.
EQUATOR, FLATTENING = 6378137.0, 1.0 / 298.257223563
# The largest distance of a track from its first point in m; the Earth's curvature displaces a place by some d**3/(6
# R**2).
MAX_DISTANCE = 50_000.0


class Survey(NamedTuple):
    """The points in a file.

    Attributes
    ----------
    rows
        The coordinates of each point, x and z, or x, y and z: numbers or decimal text.
    roll
        The roll angle at each point; None if the file has none.
    first_line
        The line of the first point, from which messages count; 1 for GPX, which has no lines.
    """

    rows: Sequence[Sequence[Any]]
    roll: Sequence[Any] | None
    first_line: int


def read_track(path: Path | str) -> dict[str, tuple[float, ...]]:
    """Read the points of a surveyed track, as `Curve.sampled` takes them.

    Parameters
    ----------
    path
        The path of a CSV file with columns x and z, or x, y and z in metres, in the order of the names in its first
        line, possibly with the roll angle in radians as a column roll; or of a GPX file, whose latitudes, longitudes
        and heights become metres to the east (x), to the north (y) and upwards (z). x and y are then coordinates in the
        plane that touches the ellipsoid of WGS 84 at the first point, and z is the height in the file. The file may
        have at most 32 MiB.

    Returns
    -------
    dict
        The columns by name.

    Raises
    ------
    InputError
        If there is no such file, or it is not a table of points; the message names file and row.
    """
    file = file_path(path, where="read_track: path")
    try:
        file = file.resolve(strict=True)
    except (OSError, ValueError, RuntimeError):
        raise InputError(f"read_track: path: there is no file {short(str(file))}; give {EXPECTED_COLUMNS}") from None
    found = surveyed(file.name, file.parent)
    rows = found.rows
    if found.roll is not None:
        rows = [[*row, angle] for row, angle in zip(rows, found.roll, strict=True)]
    if not rows:
        raise InputError(f"{file.name!r}: has no points; give {EXPECTED_COLUMNS}")
    width = len(rows[0])
    for k, row in enumerate(rows, found.first_line):
        if len(row) != width or width not in _UNNAMED:
            raise InputError(
                f"{file.name!r}, row {k}: must be numbers, x and z, or x, y and z, as many in each row, got {list(row)}"
            )
    return {
        name: tuple(_numbers(column, lambda k: f"{file.name!r}, row {k + found.first_line}"))
        for name, column in zip(_UNNAMED[width], zip(*rows, strict=True), strict=True)
    }


def surveyed(name: str, folder: Path) -> Survey:
    """Read the points of a file in a folder; it is a CSV file unless its extension says otherwise.

    Raises
    ------
    InputError
        If the file does not contain points.
    """
    text = read_companion(name, folder, wanted=EXPECTED_COLUMNS)
    if name.lower().endswith(".gpx"):
        return Survey(_local(name, _Reader(name).read(text)), None, 1)
    header, rows = read_rows(name, text)
    named = tuple(field.lower() for field in header)
    if header and not (set(named) in map(set, _UNNAMED.values()) and len(set(named)) == len(named)):
        raise InputError(
            f"{name!r}, row 1: the columns must be x, z, or x, y, z, perhaps with roll, got {','.join(header)!r:.60}"
        )
    columns = named or _UNNAMED.get(len(rows[0]), ())
    if not (header or columns == _UNNAMED[4]):
        return Survey(rows, None, 1)
    for row, fields in enumerate(rows, start=1 + bool(header)):
        if len(fields) != len(columns):
            raise InputError(
                f"{name!r}, row {row}: must be {len(columns)} numbers, {', '.join(columns)}, got {fields}; "
                "a comma separates numbers, and a point is the decimal mark"
            )
    places = [columns.index(axis) for axis in "xyz" if axis in columns]
    roll = [fields[columns.index("roll")] for fields in rows] if "roll" in columns else None
    return Survey([[fields[k] for k in places] for fields in rows], roll, 1 + bool(header))


def _numbers(values: Sequence[Any], where: Callable[[int], str]) -> list[float]:
    """Return numbers, or texts as numbers; ``where`` says, for messages, where the one of an index stands."""
    text = "".join(value for value in values if isinstance(value, str))
    with suppress(ValueError):
        if text.isascii() and "_" not in text:  # Python reads others as numbers too
            numbers = list(map(float, values))
            if all(map(isfinite, numbers)):
                return numbers
    return [_number(value, where(k)) for k, value in enumerate(values)]


def _number(value: Any, where: str) -> float:
    try:
        number = float(value)
    except ValueError:
        number = float("nan")
    if isinstance(value, str) and not (value.isascii() and "_" not in value):
        number = float("nan")
    if not isfinite(number):
        raise InputError(f"{where}: {str(value)[:40]!r} is not a finite decimal number; leave the row out or mend it")
    return number


class _Reader:
    """A reader that collects latitude, longitude and height, as texts, of the points of the first track or route of a
    GPX file.

    Declarations of document types are refused, and entities with them: nothing is expanded or fetched.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.places: list[tuple[str, str]] = []
        self.heights: list[str] = []
        self.kind = ""
        self.ended = False
        self.parser = expat.ParserCreate("utf-8")
        self.parser.buffer_text = True
        self.parser.StartDoctypeDeclHandler = self._refuse
        self.parser.StartElementHandler, self.parser.EndElementHandler = self._start, self._end

    def read(self, text: str) -> list[tuple[float, float, float]]:
        """Read a file's text."""
        try:
            self.parser.Parse(text.encode(), True)
        except expat.ExpatError as error:
            what = expat.ErrorString(error.code)
            raise InputError(f"{self.name!r}, line {error.lineno}: is no GPX ({what}); export it again") from None
        if not self.places:
            raise InputError(f"{self.name!r}: has no points of a track (trkpt) or a route (rtept)")
        columns = zip(("lat", "lon"), zip(*self.places, strict=True), strict=True)
        latitudes, longitudes = (_numbers(column, partial(self._where, what=key)) for key, column in columns)
        for k, (latitude, longitude) in enumerate(zip(latitudes, longitudes, strict=True)):
            if not (abs(latitude) <= 90.0 and abs(longitude) <= 360.0):
                where = self._where(k)
                raise InputError(f"{where}: {latitude!r}, {longitude!r} are no latitude and longitude in degrees")
        if "" in self.heights:
            raise InputError(f"{self._where(self.heights.index(''))}: has no height (ele); loads need heights")
        return list(zip(latitudes, longitudes, _numbers(self.heights, partial(self._where, what="ele")), strict=True))

    def _where(self, k: int, what: str = "") -> str:
        """Name a point, and what of it, for messages."""
        return f"{self.name!r}, point {k + 1}" + (what and f": {what}")

    def _refuse(self, *_: Any) -> None:
        raise InputError(f"{self.name!r}: has a document type (DOCTYPE), which GPX files do not have; remove it")

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        tag = tag.rpartition(":")[2]
        if tag in _PLACES and not self.ended and self.kind in ("", tag):
            self.kind = tag
            if len(self.places) == ROW_LIMIT:
                raise InputError(f"{self.name!r}: has more than {ROW_LIMIT} points, which are the most")
            self.places.append((attributes.get("lat", ""), attributes.get("lon", "")))
            self.heights.append("")
        elif tag == "ele" and self.kind and not self.ended:
            self.heights[-1] = ""
            self.parser.CharacterDataHandler = self._height

    def _height(self, text: str) -> None:
        self.heights[-1] += text

    def _end(self, tag: str) -> None:
        tag = tag.rpartition(":")[2]
        if tag == "ele":
            self.parser.CharacterDataHandler = None
        elif tag in ("trk", "rte") and self.kind:
            self.ended = True


def _local(name: str, places: Sequence[Sequence[float]]) -> list[list[float]]:
    """Return metres to the east and to the north of the first place, in the plane that touches the ellipsoid, and the
    height.
    """
    square = FLATTENING * (2.0 - FLATTENING)
    north, start = radians(places[0][0]), radians(places[0][1])

    def in_meridian(latitude: float, height: float) -> tuple[float, float]:
        """Return the distance from the Earth's axis, and the distance from the plane of the equator."""
        radius = EQUATOR / sqrt(1.0 - square * sin(latitude) ** 2)
        return (radius + height) * cos(latitude), (radius * (1.0 - square) + height) * sin(latitude)

    first = in_meridian(north, places[0][2])
    rows = []
    for count, (latitude, longitude, height) in enumerate(places, start=1):
        out, along = in_meridian(radians(latitude), height)
        turn = radians(longitude) - start
        away = out * cos(turn) - first[0]
        rows.append([out * sin(turn), (along - first[1]) * cos(north) - away * sin(north), height])
        if (far := hypot(*rows[-1][:2])) > MAX_DISTANCE:
            raise InputError(
                f"{name!r}, point {count}: is {far / 1e3:.3g} km from the first; a track goes no further than "
                f"{MAX_DISTANCE / 1e3:.0f} km, as the Earth is round"
            )
    return rows
