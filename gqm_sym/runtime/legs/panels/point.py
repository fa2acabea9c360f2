"""The forces on a body at one place: the change of V**2 that they cause, roots of V**2 in it, and the sign of N."""

from math import fabs, log
from typing import NamedTuple

from gqm_sym.runtime.compiled.calls import call_speed_equation
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.legs.panels.resolution import NOISE_LEVEL, STRICT_LEVEL

# The ratio of N to the sum of the sizes of its parts below which it counts as zero: the curvature of a chart has a
# digit less than doubles.
ZERO_TOLERANCE = 5e-14

# The value used for V**2 of a body at rest, for laws that contain its square root.
LEAST_V2 = 1e-300

# The derivative of a law with respect to V**2, at V**2 = LEAST_V2, above which it is taken to be infinite at rest; and
# the factor by which V**2 is larger where it is computed again, to find the power of V**2 in it.
LEAST_DERIVATIVE, LARGER = 1e20, 1e32

# The largest difference of a power from one half at which it is taken to be one half.
POWER_TOLERANCE = 1e-3

# A buffer for one place, V**2 there, and the five numbers of the speed equation.
point_buffer = on_stack(7)


@Inner
def slope_of_v2(forces, place, v2, contact_sign, point):  # type: ignore[no-untyped-def]
    """Return the increase of V**2 per unit of the curve parameter run, and fill ``point`` from index 2 on with DS to
    KAPPA.
    """
    v, nu = float(forces.direction), float(contact_sign)
    point[0], point[1] = place, v2
    call_speed_equation(forces.speed_equation, 1, point, (0, 1, 2), v, nu, forces.params)
    return forces.direction * (point[3] - point[4] * v2)


class LawAtRest(NamedTuple):
    """What a law is near V**2 = 0, which is about the same at all places.

    Attributes
    ----------
    slope : float
        The increase of V**2 with the distance for a body at rest, if the law contains roots of V**2; otherwise 0.
    grade : int
        The grade of the variable in which roots of V**2 as in the law are smooth at turns (`runs.whole_tables`).
    noise : float
        NOISE_LEVEL (`panels.resolution`); or STRICT_LEVEL if there may be other roots than those, to which the next
        grade might be better suited.
    """

    slope: float
    grade: int
    noise: float


SMOOTH_AT_REST = LawAtRest(0.0, 0, NOISE_LEVEL)


@Inner
def law_at_rest(forces, place, contact_sign):  # type: ignore[no-untyped-def]
    """Return what the law is for a body at rest at a place.

    Where its derivative with respect to V**2 is infinite, it shows the lowest power of V**2: one half for linear drag.
    A law without values for V**2 < 0 has other roots, as of V**3, which are not seen so.
    """
    if forces.linear or forces.squared_contact != 0:
        return SMOOTH_AT_REST
    point = point_buffer()
    slope = slope_of_v2(forces, place, LEAST_V2, contact_sign, point)
    derivative = fabs(point[4])
    if derivative > LEAST_DERIVATIVE:
        slope_of_v2(forces, place, LARGER * LEAST_V2, contact_sign, point)
        power = 1.0 - log(derivative / fabs(point[4])) / log(LARGER)
        if fabs(power - 0.5) <= POWER_TOLERANCE:
            return LawAtRest(slope, 1, NOISE_LEVEL)
        return LawAtRest(slope, 2, STRICT_LEVEL)
    beyond = slope_of_v2(forces, place, -LEAST_V2, contact_sign, point)
    return LawAtRest(slope, 1, STRICT_LEVEL) if beyond != beyond else SMOOTH_AT_REST


@Inner
def sign_of_load(forces, place, v2, point):  # type: ignore[no-untyped-def]
    """Return the sign of N at a place; 0 where it is zero within rounding."""
    slope_of_v2(forces, place, v2, 0, point)
    load, centripetal = point[5], point[6] * v2
    if fabs(load + centripetal) > ZERO_TOLERANCE * (fabs(load) + fabs(centripetal)):
        return 1 if load + centripetal > 0.0 else -1
    return 0
