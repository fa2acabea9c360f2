"""What happens along a motion: turns, changes of contact, ends."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import Pair, minus, plus
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.motion.segment import Segment
from gqm_sym.runtime.motion.trajectory import TimedSegment, Trajectory

# Places a panel at which the contact force is looked at: its sign changes are then narrowed down.
LOOKS = 24

# A contact force below this share of the parts that it is the sum of is zero but for rounding: what follows decides
# its sign. (On a planet's own orbit it is zero all round.)
TOUCH = 4e-15

# The same against the middling size of those parts on a stretch: where the curvature and the load vanish together, what
# is left of N is the rounding of both.
LEVEL = 2e-14

# A change of sign this close to the launch, as a share of the stretch, is that of the launch itself.
AT_LAUNCH = 1e-14


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happens at one time: ``kind`` as the ends of legs, or "contact-sign"."""

    kind: str
    t: float
    lam: float
    x: float
    z: float


@dataclass(frozen=True, slots=True)
class Leg:
    """A part of the motion in one direction, and what ends it."""

    lam_start: float
    lam_end: float
    t_start: float
    t_end: float
    direction: int
    end: str


def contact_force(stretch: Segment, phi: Array) -> Array:
    """The contact force N at anomalies of a stretch."""
    f = stretch.functions
    force: Array = path_and_force_at(f.addresses, f.p, stretch.places(phi), stretch.speeds(phi) ** 2)[4]
    return force


def contact_signs(stretch: Segment, phi: Array) -> Array:
    """The sign of N at anomalies of a stretch; 0 where N is zero but for rounding, or not a number."""
    f, places = stretch.functions, stretch.places(phi)
    force = contact_force(stretch, phi)
    load = path_and_force_at(f.addresses, f.p, places, np.zeros_like(phi))[4]
    parts = np.abs(force - load) + np.abs(load)
    finite = np.isfinite(parts)
    least = np.maximum(TOUCH * parts, LEVEL * np.median(parts[finite])) if finite.any() else np.inf
    signs: Array = np.where(np.isfinite(force) & (np.abs(force) > least), np.sign(force), 0.0)
    return signs


def contact_changes(stretch: Segment) -> Array:
    """Anomalies of a stretch at which N changes sign, in rising order."""
    return sign_changes(
        stretch,
        lambda phi: contact_signs(stretch, phi),
        lambda phi: np.sign(contact_force(stretch, phi)),
    )


def sign_changes(stretch: Segment, signs: Callable[[Array], Array], narrowing: Callable[[Array], Array]) -> Array:
    """Anomalies of a stretch at which a sign changes, in rising order.

    ``signs`` tells it at many anomalies, 0 where it is not sure; ``narrowing`` close to a change.
    """
    steps = np.arange(LOOKS) / LOOKS
    edges = stretch.edges
    phi = np.append((edges[:-1, None] + np.diff(edges)[:, None] * steps).ravel(), edges[-1])
    sign = signs(phi)
    known = np.flatnonzero(sign)
    turns = known[:-1][sign[known[:-1]] != sign[known[1:]]]
    after = {int(k): int(n) for k, n in pairwise(known)}
    lo = np.array([phi[k] for k in turns])
    hi = np.array([phi[after[int(k)]] for k in turns])
    before = sign[turns]
    while lo.size and np.any(hi - lo > 2.5e-16 * np.maximum(1.0, hi)):
        middle = 0.5 * (lo + hi)
        if np.all((middle == lo) | (middle == hi)):
            break
        same = narrowing(middle) == before
        lo, hi = np.where(same, middle, lo), np.where(same, hi, middle)
    zeros: Array = 0.5 * (lo + hi)
    return zeros


def crossings(piece: TimedSegment, phi: Array, pace: float) -> list[tuple[Pair, float]]:
    """When a piece passes anomalies of its stretch, in the order of time; those outside the piece are left out."""
    out = []
    low, high = sorted((piece.r_start[0], piece.r_stop[0]))
    for angle, r in zip(phi, piece.stretch.times(phi), strict=True):
        exact = (float(r), -float(r) * pace)
        if low < r < high:
            spent = minus(exact, piece.r_start)
            out.append(
                (
                    plus(piece.t_start, (piece.sense * spent[0], piece.sense * spent[1])),
                    float(angle),
                )
            )
    return sorted(out)


def passages(pieces: Sequence[TimedSegment], course: Trajectory, lam: float, low: float) -> list[float]:
    """Times of passing a place, the first on each of some pieces."""
    out = []
    for piece in pieces:
        stretch = piece.stretch
        within = lam - piece.laps * course.lap
        inside, outside = stretch.offsets(within, low)
        if inside * stretch.direction < 0.0 or outside * stretch.direction < 0.0:
            continue
        phi = np.array([stretch.anomaly_of(inside, outside)])
        if phi[0] > stretch.edges[-1]:
            continue
        out += [when[0] + when[1] for when, _ in crossings(piece, phi, course.pace)]
        if phi[0] in (0.0, stretch.edges[-1]) and piece.r_stop[0] in (0.0, stretch.duration):
            at_stop = stretch.a if piece.sense < 0 else stretch.b
            if within == at_stop:
                out.append(piece.t_stop[0])
    return out


def corners_met(piece: TimedSegment, pace: float) -> list[tuple[Pair, float]]:
    """When a piece passes corners of the curve, and the anomalies there."""
    stretch = piece.stretch
    places = stretch.functions.between(stretch.functions.corners, stretch.a, stretch.b)
    phi = np.array([stretch.anomaly_of(*stretch.offsets(place)) for place in places])
    return crossings(piece, phi, pace)


def liftoff(piece: TimedSegment, side: int, *, first: bool) -> tuple[Pair, float] | None:
    """When and where contact is lost on a piece: time from its stretch's end ``a``, and anomaly; None if it lasts.

    Parameters
    ----------
    side : int
        +1 where the track can only push along the normal (N >= 0), -1 where against it.
    first : bool
        Whether the motion begins with this piece: it may be out of contact at once.
    """
    changes = contact_changes(piece.stretch)
    met = crossings(piece, changes, 0.0)
    if first:
        start, stop = piece.phi_start, piece.phi_stop
        met = [(when, phi) for when, phi in met if abs(phi - start) > AT_LAUNCH * piece.stretch.stop]
        ahead = met[0][1] if met else stop
        # N may vanish at the launch itself: what follows decides.
        here, then = contact_signs(piece.stretch, np.array([start, 0.5 * (start + ahead)])) * side
        if (here or then) < 0.0:
            return piece.r_start, piece.phi_start
    if not met:
        return None
    phi = met[0][1]
    return (float(piece.stretch.times(np.array([phi]))[0]), 0.0), phi
