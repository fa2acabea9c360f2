"""Events along a motion: turning points, changes of contact, corners and ends."""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from math import sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import ZERO, Pair, minus, plus
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.launch.rider import rider_loads
from gqm_sym.runtime.launch.speed import length, path_and_force_at, path_in_space
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.motion.trajectory import TimedSegment, Trajectory
from gqm_sym.runtime.quadrature.substitution import REGULAR, TO_EQUILIBRIUM

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas
    from gqm_sym.runtime.launch.problem import Problem

# The number of places on each panel at which the sign of the contact force is sampled; its changes are then located by
# bisection. The first and the last place lie this share of the panel inside it: the contact force may jump at an edge.
SAMPLES_PER_PANEL, INSIDE_EDGE = 25, 1e-9

# A contact force below this share of the two terms that add up to it is zero within rounding, and has no sign. (On the
# orbit of a planet it is zero everywhere.)
ROUNDING_SHARE = 4e-15

# The same as a share of the median of these terms on a segment, because N is the rounding error of both terms where
# both vanish.
MEDIAN_ROUNDING_SHARE = 2e-14

# A change of sign this close to a singular point, as a share of the segment, is the rounding of a curvature that has no
# value there.
SINGULAR_SHARE = 1e-8

# A change of sign this close to the launch, as a share of the segment, is at the launch itself.
LAUNCH_SHARE = 1e-14


class Event(NamedTuple):
    """An event at one time of a motion.

    Attributes
    ----------
    kind : str
        "turn", "rest", "contact-sign", "liftoff", "domain-end", "cusp", "corner", "singular-point", "asymptote",
        "horizon" or "slip" (`gqm_sym.runtime.launch.kinds` says what each means).
    t : float
        Time from launch in s.
    lam : float
        The curve parameter there, in its unit; on a closed curve laps are counted.
    x, z : float
        Coordinates in m; z is up.
    """

    kind: str
    t: float
    lam: float
    x: float
    z: float


class Leg(NamedTuple):
    """A part of the motion in one direction, with the reason for its end.

    Attributes
    ----------
    lam_start, lam_end : float
        The curve parameter at the start and at the end, in its unit; on a closed curve laps are counted.
    t_start, t_end : float
        Times from launch in s; the second is infinite for an approach to an equilibrium.
    direction : int
        The sign of ds/dt.
    end : str
        "turn", "rest", "contact-sign" (with friction only), "liftoff", "domain-end", "cusp", "corner",
        "singular-point", "asymptote" or "horizon" (`gqm_sym.runtime.launch.kinds` says what each means).
    """

    lam_start: float
    lam_end: float
    t_start: float
    t_end: float
    direction: int
    end: str


def contact_force_on(problem: "Problem", timed: TimedSegment, phi: Array, share: float = 1.0) -> Array:
    """Return the contact force in N at phase angles of a timed segment, on a body with a share of the speed there; in a
    rotating frame it depends on the direction of motion.
    """
    return contact_force_at(problem, timed, phi, timed.segment.places(phi), share)


def contact_force_at(problem: "Problem", timed: TimedSegment, phi: Array, places: Array, share: float = 1.0) -> Array:
    """Return what `contact_force_on` does, for places that may lie a little beside those of the phase angles."""
    v2, f = (share * timed.segment.speeds(phi)) ** 2, problem.functions
    force: Array
    if problem.formulas.directed:
        force = length(path_in_space(problem.formulas, f.p, places, v2, np.full(phi.size, timed.direction))[1:])
    else:
        force = path_and_force_at(f.addresses, f.p, places, v2)[4]
    return force


def sided_force(formulas: "Formulas", f: BoundFunctions, places: Array, v2: Array, direction: int) -> Array:
    """Return a force whose sign shows on which side of the track a body is: N, or the vertical load on the riders of a
    space curve, which in a rotating frame depends on the direction of motion.
    """
    force: Array
    if formulas.signed:
        force = path_and_force_at(f.addresses, f.p, places, v2)[4]
    else:
        force = rider_loads(formulas, f.p, places, v2, np.full(places.size, direction), np.zeros(places.size))[0]
    return force


def contact_signs(formulas: "Formulas", timed: TimedSegment, phi: Array) -> Array:
    """Return the sign of `sided_force` at phase angles of a segment; 0 where it is zero within rounding, or NaN."""
    segment = timed.segment
    f, places = segment.functions, segment.places(phi)
    force = sided_force(formulas, f, places, segment.speeds(phi) ** 2, timed.direction)
    load = sided_force(formulas, f, places, np.zeros_like(phi), timed.direction)
    parts = np.abs(force - load) + np.abs(load)
    finite = np.isfinite(parts)
    least = (
        np.maximum(ROUNDING_SHARE * parts, MEDIAN_ROUNDING_SHARE * np.median(parts[finite])) if finite.any() else np.inf
    )
    signs: Array = np.where(np.isfinite(force) & (np.abs(force) > least), np.sign(force), 0.0)
    return signs


def contact_changes(formulas: "Formulas", timed: TimedSegment) -> Array:
    """Return the phase angles of a timed segment at which N changes sign, in ascending order."""
    segment = timed.segment
    if not formulas.sided:
        return np.empty(0)
    changes = sign_changes(
        segment,
        partial(contact_signs, formulas, timed),
        lambda phi: np.sign(
            sided_force(formulas, segment.functions, segment.places(phi), segment.speeds(phi) ** 2, timed.direction)
        ),
    )
    if timed.end == "singular-point":
        changes = changes[np.abs(changes - timed.phi_stop) > SINGULAR_SHARE * segment.stop]
    if timed.t_start == ZERO:
        changes = changes[np.abs(changes - timed.phi_start) > _launch_share(timed) * segment.stop]
    return changes


def _launch_share(timed: TimedSegment) -> float:
    """Return the distance in phase angle, as a share of the segment, within which a change of sign is at the launch
    itself.
    """
    at_turn = timed.segment.kind != REGULAR and timed.phi_start in (0.0, timed.segment.stop)
    return sqrt(LAUNCH_SHARE) if at_turn else LAUNCH_SHARE


def sign_changes(segment: Segment, signs: Callable[[Array], Array], narrowing: Callable[[Array], Array]) -> Array:
    """Return the phase angles of a segment at which a sign changes, in ascending order.

    Parameters
    ----------
    signs : callable
        A function that returns the signs at an array of phase angles; 0 where the sign is not certain.
    narrowing : callable
        A function that returns the signs close to a change; it is used for bisection.
    """
    steps = np.linspace(INSIDE_EDGE, 1.0 - INSIDE_EDGE, SAMPLES_PER_PANEL)
    edges = segment.edges
    phi = np.concatenate([edges[:1], (edges[:-1, None] + np.diff(edges)[:, None] * steps).ravel(), edges[-1:]])
    sign = signs(phi)
    known = np.flatnonzero(sign)
    changes = known[:-1][sign[known[:-1]] != sign[known[1:]]]
    after = {int(k): int(n) for k, n in pairwise(known)}
    lo = np.array([phi[k] for k in changes])
    hi = np.array([phi[after[int(k)]] for k in changes])
    before = sign[changes]
    while lo.size and np.any(hi - lo > 2.5e-16 * np.maximum(1.0, hi)):
        middle = 0.5 * (lo + hi)
        if np.all((middle == lo) | (middle == hi)):
            break
        same = narrowing(middle) == before
        lo, hi = np.where(same, middle, lo), np.where(same, hi, middle)
    zeros: Array = 0.5 * (lo + hi)
    return zeros


def crossings(timed: TimedSegment, phi: Array, time_scale_error: float) -> list[tuple[Pair, float]]:
    """Return the times at which a timed segment passes phase angles, in the order of time; phase angles outside of it
    are omitted.

    ``time_scale_error`` is that of the trajectory (`Trajectory`). Each item is a time in s as two doubles, and a phase
    angle.
    """
    out = []
    low, high = sorted((timed.r_start[0], timed.r_stop[0]))
    for angle, r in zip(phi, timed.segment.times(phi), strict=True):
        exact = (float(r), -float(r) * time_scale_error)
        if low < r < high:
            spent = minus(exact, timed.r_start)
            out.append(
                (
                    plus(timed.t_start, (timed.sense * spent[0], timed.sense * spent[1])),
                    float(angle),
                )
            )
    return sorted(out)


def passages(segments: Sequence[TimedSegment], trajectory: Trajectory, lam: float, low: float) -> list[float]:
    """Return the times in s at which timed segments pass the place lam + low, the first time on each of them."""
    out = []
    for timed in segments:
        segment = timed.segment
        lam_in_lap = lam - timed.laps * trajectory.lap
        stop = segment.b if timed.sense > 0 else segment.a
        # The end of a domain is known to the segment as a double, which may lie before the exact end.
        is_end = timed.end == "domain-end" and lam_in_lap == stop
        inside, outside = segment.offsets(lam_in_lap, 0.0 if is_end else low)
        if inside * segment.direction < 0.0 or outside * segment.direction < 0.0:
            continue
        phi = np.array([segment.phase_angle_of(inside, outside)])
        if phi[0] > segment.edges[-1]:
            if segment.kind == TO_EQUILIBRIUM:
                continue
            phi[0] = segment.edges[-1]  # at the end itself it is larger by a rounding
        found = [when[0] + when[1] for when, _ in crossings(timed, phi, trajectory.time_scale_error)]
        if not found and min(timed.phi_start, timed.phi_stop) <= phi[0] <= max(timed.phi_start, timed.phi_stop):
            # At an end, and a rounding before it, the time is that of the end.
            r = float(segment.times(phi)[0])
            is_at_start = abs(r - timed.r_start[0]) < abs(r - timed.r_stop[0])
            found = [(timed.t_start if is_at_start else timed.t_stop)[0]]
        out += found
    return out


def corner_crossings(timed: TimedSegment, corners: Array, time_scale_error: float) -> list[tuple[Pair, float]]:
    """Return the times at which a timed segment passes some corners of the curve, each with its phase angle.

    In motions with losses, segments end at corners, and the body passes to the next segment.
    """
    if not corners.size:
        return []
    segment, f = timed.segment, timed.segment.functions
    places = f.between(corners, segment.a, segment.b)
    phi = np.array([segment.phase_angle_of(*segment.offsets(place)) for place in places])
    found = crossings(timed, phi, time_scale_error)
    stop = segment.b if timed.phi_stop > timed.phi_start else segment.a
    if timed.end == "" and f.between(corners, *np.nextafter(stop, (-np.inf, np.inf)).tolist()).size:
        found.append((timed.t_stop, timed.phi_stop))
    return found


def liftoff(formulas: "Formulas", timed: TimedSegment, side: int, *, first: bool) -> tuple[Pair, float] | None:
    """Return the time, from the segment's end ``a``, and the phase angle at which contact is lost on a timed segment.

    The result is None if contact lasts. Contact is lost where N changes its sign, and at corners at which the track
    bends away.

    Parameters
    ----------
    side : int
        +1 if the track can only push along the normal (N >= 0), -1 if only against it (N <= 0).
    first : bool
        Whether the motion begins with this segment; contact may then be lost at launch.
    """
    changes = contact_changes(formulas, timed)
    crossed = crossings(timed, changes, 0.0)
    if first:
        start, stop, share = timed.phi_start, timed.phi_stop, _launch_share(timed)
        crossed = [(when, phi) for when, phi in crossed if abs(phi - start) > share * timed.segment.stop]
        ahead = crossed[0][1] if crossed else stop
        # N may vanish at the launch itself; its sign half-way to the first change then decides. At a cusp it is
        # infinity times zero, so places a little ahead are examined.
        near = start + share * (stop - start)
        here, then = contact_signs(formulas, timed, np.array([near, 0.5 * (start + ahead)])) * side
        if (here or then) < 0.0:
            return timed.r_start, timed.phi_start
    lost = sorted([*crossed, *corner_crossings(timed, timed.segment.functions.liftoff_corners(side), 0.0)])
    if not lost:
        return None
    phi = lost[0][1]
    return (float(timed.segment.times(np.array([phi]))[0]), 0.0), phi
