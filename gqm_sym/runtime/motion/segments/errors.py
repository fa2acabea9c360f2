"""Errors of a segment: those of its times, and those of its places due to the table and to the rounding of its turning
points.
"""

from math import inf

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.inversion.table import MAX_TIME_ERROR
from gqm_sym.runtime.launch.speed import path_and_force_at, potential_at
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR, TO_EQUILIBRIUM, TURN_TURN

# The error of a turning point in doubles, in roundings of the width times the ratio of the largest Q to Q there
# (`end_errors`); the largest measured error was 0.6.
MAX_END_ROUNDINGS = 2.0

# The error of the potential's slope along a chart that has no formulas, in roundings of the largest slope; the same in
# roundings of the largest slope times ds, which is small along the path of a centre (2.5 was measured); and the number
# of places of a closed chart at which the largest slope is searched for.
CHART_ROUNDINGS, CENTRE_ROUNDINGS, SLOPE_SAMPLES = 8.0, 4.0, 16

# The error of a place due to the rounding of a chart, in roundings of the width of a motion, and of its coordinates.
MAX_WIDTH_ROUNDINGS, MAX_SIZE_ROUNDINGS = 128.0, 4.0

# The share of a segment by which places lie aside of its ends, from which its tangents are taken. With a smaller one,
# tangents at the ends of a tiny segment would be rounding.
TANGENT_SHARE = 2.0**-4

# The largest slope of lam(phi), in widths, by the kind of the segment; approaches to an equilibrium have none.
MAX_SLOPES = (0.5, 2.0, 1.0)


def time_error(segment: Segment, phi: Array) -> Array:
    """Return the estimated error in s of a segment's times at phase angles, which is that of their panels."""
    of_panels: Array = time_errors_of_panels(segment)[np.searchsorted(segment.edges[1:-1], phi, side="right")]
    return of_panels


def time_errors_of_panels(segment: Segment) -> Array:
    """Return the estimated error in s of the times on each panel of a segment.

    It is a share of the whole duration, or of the panel's duration if the times at its edges are exact.
    """
    error = segment.relative_error + ULP + MAX_TIME_ERROR
    if segment.kind == TURN_TURN and segment.balance > 0.0 and not segment.from_multiprecision:
        # The rounding of the ends changes V**2 by a larger share if little of it is left after cancellation.
        error += 0.5 * ULP * max(abs(segment.a), abs(segment.b)) / (abs(segment.width) * segment.balance)
    times = segment.edge_times[0]
    if segment.has_given_times:
        spans: Array = np.diff(times)
    elif segment.kind == TO_EQUILIBRIUM or segment.march_end is not None:
        spans = times[1:]  # its end is arbitrary, or the error grows from ``a``
    else:
        spans = np.full(len(times) - 1, segment.duration)
    return error * spans


def inversion_error(segment: Segment, phi: Array) -> Array:
    """Return the estimated error of places due to the table of a segment, at phase angles and in units of the curve
    parameter.
    """
    powers, of_intervals = segment.table[3], segment.table[6]
    errors = of_intervals[np.searchsorted(powers[:-1].sum(axis=1), phi)]
    width = abs(segment.width)
    if segment.kind == TO_EQUILIBRIUM:
        near_equilibrium: Array = width * np.exp(-phi) * (errors + 3.0 * ULP * np.maximum(phi, 1.0))
        return near_equilibrium
    bounded: Array = width * (MAX_SLOPES[segment.kind] * errors + 3.0 * ULP)
    if segment.kind == REGULAR or segment.from_multiprecision:
        return bounded
    at_a, at_b = end_errors(segment)
    share = phi**2 if segment.kind == FROM_TURN else np.sin(0.5 * phi) ** 2
    return bounded + at_a * (1.0 - share) + at_b * share


def end_errors(segment: Segment) -> tuple[float, float]:
    """Return bounds on the errors of a segment's turning points, in units of the curve parameter.

    V**2 = (lam - a)*(b - lam)*Q is known to a rounding of its largest values, so that its zero at ``a`` is known
    to as many roundings of the width as Q is smaller there than at its largest. Along a chart Q is rounded too.
    """
    if not segment.balance > 0.0:
        return 0.0, 0.0
    error = MAX_END_ROUNDINGS * ULP * abs(segment.width) / segment.balance
    f = segment.functions
    if segment.kind == FROM_TURN:
        return error, 0.0
    # Q at the ends, up to a factor.
    ends = np.array([segment.a, segment.b])
    steepness, of_chart = np.abs(potential_at(f.addresses, f.p, ends)[1]), np.zeros(2)
    least, steepness = float(steepness.min()), steepness.tolist()
    errors = [error * (least / steep if steep > 0.0 else 1.0) for steep in steepness]
    if f.exact is None:
        # Slopes of a chart without formulas are known to a rounding of the largest. The path of a centre has the
        # rounding errors of the curve, which are larger by the factor 1/ds.
        around = np.array([*ends, *f.breaks, *np.linspace(0.0, f.period, SLOPE_SAMPLES)])
        largest = np.abs(potential_at(f.addresses, f.p, around)[1]).max()
        shortest = np.abs(path_and_force_at(f.addresses, f.p, around, np.zeros_like(around))[2]).min()
        roundings = max(CHART_ROUNDINGS, CENTRE_ROUNDINGS / shortest) if shortest > 0.0 else inf
        rounding = roundings * ULP * abs(segment.width) * largest
        errors = [
            own + (rounding / steep if steep > 0.0 else 0.0) for own, steep in zip(errors, steepness, strict=True)
        ]
    elif f.exact.edges.size:
        # A body's path beside the curve has the rounding errors of the curve, which are larger there by the factor
        # 1/ds.
        x, z, ds = path_and_force_at(f.addresses, f.p, ends, np.zeros(2))[:3]
        size, shortest = float(np.hypot(x, z).max()), min(1.0, float(np.abs(ds).min()))
        of_chart += ULP * min(MAX_WIDTH_ROUNDINGS * abs(segment.width), MAX_SIZE_ROUNDINGS * size) / shortest
        of_chart += _errors_of_coordinates(segment, steepness)
    at_a, at_b = (
        of_end if known is not None or _is_launch_from_rest(segment, place) else own + of_end
        for place, known, own, of_end in zip(ends, segment.ends, errors, of_chart.tolist(), strict=True)
    )
    return at_a, at_b


def _errors_of_coordinates(segment: Segment, steepness: list[float]) -> Array:
    """Return how far a rounding of the coordinates moves each turning point, in units of the curve parameter.

    The potential changes by the force times the rounding of the distance between the ends, coordinate by coordinate, so
    that a turning point moves the farther, the more the forces cancel along the curve and not across it. In space y is
    left out.
    """
    f, aside = segment.functions, TANGENT_SHARE * (segment.b - segment.a)
    places = np.array([segment.a, segment.b, segment.a + aside, segment.b - aside])
    x, z, ds, _, support = path_and_force_at(f.addresses, f.p, places, np.zeros(4))
    slopes = potential_at(f.addresses, f.p, places[:2])[1]
    found = np.zeros(2)
    for k, steep in enumerate(steepness):
        step = complex(x[k + 2] - x[k], z[k + 2] - z[k]) * (1.0 - 2.0 * k)
        if not steep > 0.0 or step == 0.0:
            continue
        force = -complex(slopes[k] / ds[k], support[k] / f.mass) * step / abs(step)
        terms = abs(force.real * (x[1] - x[0])) + abs(force.imag * (z[1] - z[0]))
        found[k] = MAX_SIZE_ROUNDINGS * ULP * terms / steep
    return found


def _is_launch_from_rest(segment: Segment, place: float) -> bool:
    exact = segment.functions.exact
    return exact is not None and place == exact.lam0.value and exact.v0.value == 0.0
