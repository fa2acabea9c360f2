"""Checks that points lie along a track: in order, near enough to each other, and without much scatter."""

import warnings
from collections.abc import Sequence
from itertools import pairwise
from math import atan2, dist, hypot, pi
from statistics import median

from gqm_sym.declare.points import IN_SPACE, Place
from gqm_sym.errors import DeclarationError, NoisyPointsWarning

# Points nearer to each other than this share of the track's size are the same point.
SAME_POINT_SHARE = 1e-12

# A smooth track that turns by more than this from one chord to the next is out of order, or sampled too coarsely.
MAX_TURN = pi / 2

# Straight lines that turn by more than this lead back along themselves.
BACKWARDS = pi - 1e-6

# A chord of a smooth track that is this many times as long as half of all chords jumps to another place.
JUMP = 100.0

# A chord of measured points has the direction of the track if it is this many times longer than their scatter.
LONG_CHORD_RATIO = 8.0

# Curvature that alternately rises and falls between more than this share of neighbours is scatter,
MAX_ALTERNATING_SHARE = 0.5
# if it changes loads by this many g at the speed of a body that has fallen over the size of the track.
NOTICEABLE_LOAD = 0.1

# In place of the length of a chord between equal points, by which it is divided.
SMALLEST = 5e-324

# So many successive turns to alternating sides by more than this are a zigzag through which no smooth track passes: the
# lengths of the spline between such points do not converge.
ZIGZAG_TURNS, ZIGZAG_ANGLE = 5, pi / 9


def extent(places: list[Place]) -> float:
    """Return the longer side of the box around all points."""
    if not places:
        return 0.0
    return float(max(max(axis) - min(axis) for axis in zip(*places, strict=True)))


def check_survey(places: list[Place], rows: list[int], joined: bool, scatter: float) -> None:
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
    long = LONG_CHORD_RATIO * max(scatter, median(bends))
    for count, (turn, pair) in enumerate(zip(_turns(places, joined), pairwise([*chords, chords[0]]), strict=False), 1):
        if abs(turn) > MAX_TURN and min(pair) > long:
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
    """Return the angle by which the track turns at each point between two others; in space it has no sign."""
    around = [*places, *places[:2]] if joined else places
    if len(places[0]) == IN_SPACE:
        steps = [_difference(*pair) for pair in pairwise(around)]
        return [_angle(before, after) for before, after in pairwise(steps)]
    angles = [atan2(two[1] - one[1], two[0] - one[0]) for one, two in pairwise(around)]
    return [(after - before + pi) % (2.0 * pi) - pi for before, after in pairwise(angles)]


def _angle(one: Sequence[float], two: Sequence[float]) -> float:
    """Return the angle between two vectors in space."""
    crossed = [one[i] * two[j] - one[j] * two[i] for i, j in ((1, 2), (2, 0), (0, 1))]
    return atan2(hypot(*crossed), _product(one, two))


def check_order(places: list[Place], size: float, kind: str, joined: bool) -> None:
    """Refuse points that are repeated, out of order or far away from the rest."""
    chords = _chords(places, joined)
    usual = median(chords)
    for count, chord in enumerate(chords, start=1):
        if chord <= SAME_POINT_SHARE * size:
            row = count % len(places) + 1
            raise DeclarationError(f"sampled: row {row}: repeats row {count}; leave one of them out")
        if kind == "spline":
            _check_gap(chord, usual, count, count % len(places) + 1)
    most = MAX_TURN if kind == "spline" else BACKWARDS
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


def warn_of_scatter(places: list[Place], joined: bool, remedy: str) -> None:
    """Warn of a curvature that rises and falls from point to point, which the curvature of a real track does not.

    Scatter of points at distances h contributes to the curvature divided by h**2. If it dominates the curvature, the
    sign of the curvature changes between most neighbours; the sign of the curvature's changes shows it earlier, and on
    a loop as well. In space the curvature is a vector: of its change, the part across the track counts, and changes
    have opposite signs if they point to opposite sides.
    """
    around = [*places, *places[:2]] if joined else places
    chords = [_difference(one, two) for one, two in pairwise(around)]
    lengths = [hypot(*chord) or SMALLEST for chord in chords]
    ahead = [[part / length for part in chord] for chord, length in zip(chords, lengths, strict=True)]
    bends = [
        [2.0 * part / (before + after) for part in _difference(one, two)]
        for (one, two), (before, after) in zip(pairwise(ahead), pairwise(lengths), strict=True)
    ]
    steps = [_across(_difference(*pair), along) for pair, along in zip(pairwise(bends), ahead[1:-1], strict=True)]
    swings = [dist(one, two) / 4.0 for one, two in pairwise(steps) if _product(one, two) < 0.0]
    if len(swings) <= MAX_ALTERNATING_SHARE * (len(steps) - 1):
        return
    felt = 2.0 * extent(places) * median(swings)
    if felt > NOTICEABLE_LOAD:
        warnings.warn(
            "sampled: the curvature goes up and down from point to point (it changes between rising and falling at "
            f"{len(swings)} of {len(steps) - 1} places), and loads with it, by about {felt:.2g} g where a body is "
            f"fast: the points scatter, or are too far apart; {remedy}",
            NoisyPointsWarning,
            stacklevel=5,
        )


def _difference(one: Sequence[float], two: Sequence[float]) -> list[float]:
    """Return the vector from one place to another."""
    return [there - here for here, there in zip(one, two, strict=True)]


def _product(one: Sequence[float], two: Sequence[float]) -> float:
    """Return the scalar product of two vectors."""
    return sum(first * second for first, second in zip(one, two, strict=True))


def _across(vector: list[float], along: list[float]) -> list[float]:
    """Return the part of a vector that is orthogonal to a unit vector."""
    share = _product(vector, along)
    return [part - share * unit for part, unit in zip(vector, along, strict=True)]


def _check_zigzag(turns: list[float]) -> None:
    """Refuse points between which a smooth track would swing to and fro."""
    run = 0
    for count, turn in enumerate(turns):
        swings = run and turn * turns[count - 1] < 0.0
        run = 0 if abs(turn) <= ZIGZAG_ANGLE else run + 1 if swings else 1
        if run == ZIGZAG_TURNS:
            first = count + 3 - ZIGZAG_TURNS
            raise DeclarationError(
                f"sampled: row {first}: the track turns to and fro there, {ZIGZAG_TURNS} times by more than "
                f"{ZIGZAG_ANGLE * 180.0 / pi:.0f} degrees; no smooth track goes through a zigzag: give more points, "
                "points without their noise (smoothing takes it out), or kind='linear' for planes"
            )
