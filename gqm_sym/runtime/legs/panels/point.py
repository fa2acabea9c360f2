"""The forces on a body at one place: the change of V**2 that they cause, and the sign of N."""

from math import fabs

from gqm_sym.runtime.compiled.calls import call_speed_equation
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack

# The ratio of N to the sum of the sizes of its parts below which it counts as zero: the curvature of a chart has a
# digit less than doubles.
ZERO_TOLERANCE = 5e-14

# The value used for V**2 of a body at rest, for laws that contain its square root.
LEAST_V2 = 1e-300

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


@Inner
def sign_of_load(forces, place, v2, point):  # type: ignore[no-untyped-def]
    """Return the sign of N at a place; 0 where it is zero within rounding."""
    slope_of_v2(forces, place, v2, 0, point)
    load, centripetal = point[5], point[6] * v2
    if fabs(load + centripetal) > ZERO_TOLERANCE * (fabs(load) + fabs(centripetal)):
        return 1 if load + centripetal > 0.0 else -1
    return 0
