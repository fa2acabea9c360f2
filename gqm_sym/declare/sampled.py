"""Tracks given by points: checked row by row, and kept as the exact text of their coordinates.

Smoothed points are kept in place of the measured ones: a module only has to pass through them, and a smooth track needs
fewer of them.
"""

from dataclasses import dataclass, field
from math import dist
from typing import TYPE_CHECKING, Any, Literal

from gqm_sym.arguments import one_of, short
from gqm_sym.declare.banking import is_formula
from gqm_sym.declare.order_of_points import check_order, check_survey, extent, warn_of_scatter
from gqm_sym.declare.points import IN_SPACE, Place, as_rows, in_metres, read_angles, read_rows
from gqm_sym.errors import DeclarationError, NumberError
from gqm_sym.literals.numbers import Number, without_unit

if TYPE_CHECKING:
    from gqm_sym.smoothing import Smoothing

KINDS = ("spline", "linear")
# The smallest number of different points: a quintic polynomial has six coefficients, and a closed track of straight
# lines is at least a triangle.
MIN_POINTS = {("spline", False): 6, ("spline", True): 6, ("linear", False): 2, ("linear", True): 3}
# A track is closed if its first and its last point are nearer to each other than this share of its size.
CLOSED_SHARE = 1e-9
# The smallest and the largest size of a track in m: fourth powers of the distances of points, and their inverses, must
# be in the range of doubles.
SIZES = 1e-60, 1e60
# The smallest and the largest scatter of points in m; its square must be in the range of doubles.
MAX_DEVIATION = 1e100
# The smallest number of points for cross-validation, which needs more than a spline does.
MIN_POINTS_AUTO = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """Points, and the kind of curve between them.

    Attributes
    ----------
    points : str
        One line for each point, with x and z, or x, y and z, and possibly the roll angle, as decimal numbers. A closed
        track does not repeat its first point.
    kind : {"spline", "linear"}
        A quintic spline, or straight lines between the points.
    closed : bool
        Whether the track continues from the last point to the first.
    smoothing : Smoothing or None
        The changes that smoothing made to the measured points, if they were smoothed.
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
        Rows of x and z, or in space of x, y and z: an array, or numbers or decimal text, which is kept unchanged; or a
        table with columns x and z, and possibly y; or the x of all points.
    z
        The heights of the points, if ``points`` are their x.
    kind
        "spline" or "linear".
    closed
        Whether the track is closed; by default it is if its last point equals its first.
    smoothing
        The standard deviation of the points in metres, or "auto"; by default the track passes through the points.
    roll
        In space the roll angle at each point in radians; by default that of a table which has one. A roll in another
        form, such as a formula, is ignored here.

    Raises
    ------
    DeclarationError
        If a row is not a point, or points are too few, repeated, out of order or too far away; the message names the
        row, counted from 1.

    Warns
    -----
    NoisyPointsWarning
        If the curvature of the track rises and falls from point to point.
    """
    one_of(kind, KINDS, where="sampled: kind")
    if not (closed is None or isinstance(closed, bool)):
        raise DeclarationError(f"sampled: closed: must be True, False or None, got {short(closed)}")
    points, z = in_metres(points), in_metres(z)
    deviation = _read_smoothing(in_metres(smoothing), kind)
    texts: list[str] = []
    places: list[Place] = []
    rows_given, angles = as_rows(points, z)
    for text, place in read_rows(rows_given):
        texts.append(text)
        places.append(place)
    angles = [] if is_formula(roll) else read_angles(angles if roll is None else roll, places)
    size = extent(places)
    if size and not SIZES[0] <= size <= SIZES[1]:
        raise DeclarationError(
            f"sampled: the points span {size:.3g} m; a track spans {SIZES[0]:g} to {SIZES[1]:g} m: are they in metres?"
        )
    repeated = len(places) > 1 and dist(places[0], places[-1]) <= CLOSED_SHARE * size
    joined = repeated if closed is None else closed
    if joined and repeated:
        del texts[-1], places[-1]
    in_space = bool(places) and len(places[0]) == IN_SPACE
    if in_space and kind != "spline" and (angles or roll is not None):
        raise DeclarationError(
            f"sampled: roll: a track of kind {kind!r} has corners, at which its upward direction jumps; leave roll "
            "out, or declare a spline"
        )
    rows = list(range(1, len(places) + 1))
    if deviation is not None:  # a recorder repeats its last value until there is a new one
        rows = [row for row in rows if row == 1 or places[row - 1] != places[row - 2]]
        places = [places[row - 1] for row in rows]
        angles = [angles[row - 1] for row in rows] if angles else angles
    fewest = MIN_POINTS_AUTO if deviation == "auto" else MIN_POINTS[kind, joined]
    if len(places) < fewest:
        what = "a closed" if joined else "an open"
        how = f"kind {kind!r}" if deviation is None else f"smoothing {smoothing!r}"
        raise DeclarationError(f"sampled: {len(places)} different points; {what} track of {how} needs {fewest} or more")
    if deviation is None:
        check_order(places, size, kind, joined)
        if kind == "spline":
            warn_of_scatter(places, joined, "give their standard deviation in metres as smoothing, or 'auto'")
        texts = [" ".join(parts) for parts in zip(texts, angles, strict=False)] if angles else texts
        return Track(points="\n".join(texts), kind=kind, closed=joined)
    check_survey(places, rows, joined, 0.0 if deviation == "auto" else deviation)
    smoothed, report = _smoothed(places, rows, joined, deviation, angles)
    warn_of_scatter(smoothed, joined, f"smoothing {smoothing!r} is less than their scatter")
    kept = "\n".join(" ".join(map(repr, place)) for place in smoothed)
    return Track(points=kept, kind=kind, closed=joined, smoothing=report)


def _read_smoothing(given: Any, kind: str) -> float | Literal["auto"] | None:
    """Return the standard deviation of points, "auto" for cross-validation, or None for exact points."""
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
    """Return the points of the smooth track, and the changes that smoothing made."""
    from gqm_sym.smoothing import smooth

    known = None if deviation == "auto" else deviation
    rolls = [float(angle) for angle, _ in zip(angles, places, strict=False)]
    found, report = smooth(places, rows, closed=joined, deviation=known, angles=rolls)
    return [tuple(place) for place in found.tolist()], report
