"""The substitution lam(phi) between the curve parameter and the phase angle of a segment (MATHS, section 4).

The substitution depends on which ends of the segment [a, b] are special; it makes dt/dphi smooth:

=============== ======================================= ================================
kind            lam                                     phi
=============== ======================================= ================================
TURN_TURN       a + (b-a) sin(phi/2)**2                 0 to pi
FROM_TURN       a + (b-a) phi**2                        0 to 1
REGULAR         a + (b-a) phi                           0 to 1
FROM_SLOW       a + (b-a) phi                           0 to 1
FROM_SLOW_TURN  a + (b-a) phi**2                        0 to 1
TO_EQUILIBRIUM  b + (a-b) exp(-phi)                     0 onwards
=============== ======================================= ================================

There are three forms of it here: for one place, for arrays, and for compiled loops. `integrands` and `trapezoid` need
the offsets of a place from both ends instead of the place, and compute them in their own loops, which vectorise.
"""

from math import atan2, inf, log, pi, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.elementary import square_beside_quarter_turns
from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inlined
from gqm_sym.runtime.compiled.types import Array

# Kinds of segments: between turning points, from a turning point, without special ends, towards an equilibrium, from a
# place where the body is slowest, such as next to a hilltop that it passes, and from a turning point, which may be next
# to a hilltop.
TURN_TURN, FROM_TURN, REGULAR, TO_EQUILIBRIUM, FROM_SLOW, FROM_SLOW_TURN = range(6)

# Smaller than the square root of any positive double, so that a quotient by the greater of both is defined at zero too.
MIN_ROOT = 1e-200


def phase_angle_of(kind: int, offset: float, from_a: float, to_b: float, width: float) -> float:
    """Return the phase angle of a place.

    Parameters
    ----------
    kind : int
        The segment's kind.
    offset : float
        For a FROM_TURN segment whose turning point lies a little before ``a``: the phase angle from there to ``a``.
    from_a, to_b : float
        Distances from the ends of the segment, in units of the curve parameter; neither is negative.
    width : float
        The distance between the ends.
    """
    if kind == TURN_TURN:
        return 2.0 * atan2(sqrt(from_a), sqrt(to_b))
    if kind == TO_EQUILIBRIUM:
        return -log(to_b / width) if to_b > 0.0 else inf
    share = from_a / width if from_a <= to_b else 1.0 - to_b / width
    if kind == REGULAR or share <= 0.0:
        return share
    scaled = share * (1.0 + 2.0 * offset)
    return scaled / (offset + sqrt(offset**2 + scaled))


def phase_angles_of(kind: int, offset: float, from_a: Array, to_b: Array, width: float) -> Array:
    """Return the phase angles of many places; the arguments are those of `phase_angle_of`."""
    if kind == TURN_TURN:
        angles: Array = 2.0 * np.arctan2(np.sqrt(from_a), np.sqrt(to_b))
        return angles
    if kind == TO_EQUILIBRIUM:
        with np.errstate(divide="ignore"):
            angles = -np.log(to_b / width)
        return angles
    share = np.where(from_a <= to_b, from_a / width, 1.0 - to_b / width)
    if kind == REGULAR:
        return share
    scaled = share * (1.0 + 2.0 * offset)
    angles = np.where(share <= 0.0, share, scaled / np.maximum(offset + np.sqrt(offset**2 + scaled), MIN_ROOT))
    return angles


def places_at(
    kind: int, offset: float, start: tuple[float, float], stop: tuple[float, float], width: float, phi: Array
) -> Array:
    """Return the curve parameter at phase angles, computed from the nearer end.

    Parameters
    ----------
    kind, offset, width
        As for `phase_angle_of`, but the width has the sign of b - a.
    start, stop : (float, float)
        Both ends, as two doubles each.
    phi : (n,) array
        Phase angles.
    """
    (a, a_low), (b, b_low) = start, stop
    if kind == TURN_TURN:
        from_a, to_b = width * np.sin(0.5 * phi) ** 2, width * np.cos(0.5 * phi) ** 2
        return np.where(phi < 0.5 * pi, a + (a_low + from_a), b - (to_b - b_low))
    if kind == TO_EQUILIBRIUM:
        places: Array = b - width * np.exp(-phi)
        return places
    share = phi * (phi + 2.0 * offset) / (1.0 + 2.0 * offset) if kind == FROM_TURN else phi
    return np.where(share <= 0.5, a + (a_low + width * share), b - (width * (1.0 - share) - b_low))


@Inlined
def place_on_libration(a, b, phi):  # type: ignore[no-untyped-def]
    """Return the curve parameter at one phase angle of a TURN_TURN segment, from the nearer end."""
    width = b - a
    beyond, share = square_beside_quarter_turns(0.5 * phi)
    return choose(beyond, b - width * share, a + width * share)


@Inlined
def place_at(kind, a, b, phi):  # type: ignore[no-untyped-def]
    """Return the curve parameter at one phase angle of a TURN_TURN or REGULAR segment, from the nearer end."""
    if kind == TURN_TURN:
        return place_on_libration(a, b, phi)
    width = b - a
    return choose(phi <= 0.5, a + width * phi, b - width * (1.0 - phi))
