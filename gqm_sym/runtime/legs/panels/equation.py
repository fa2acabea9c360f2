"""V**2 on one panel of a leg, from one linear equation (MATHS, section 2).

On a leg ``dW/dlam = P - Q W``, where W is V**2. The distance from the *origin*, the place at which the leg begins, is
``d = w (g w + c)``, where w is the *march variable* (`March`). In the regular case g is 0 and c is 1. From a turning
point g is 1 and c is 0, so that W/w**2 and the rate of time are smooth. After a slow launch with W = W0 and W' > 0, g
is 1 and c is 2 sqrt(W0/W'). With ``h = g (w + c/2) + 1 - g`` the speed is h Y and ``dt/dw = (1 + g) ds/Y``, where Y is
smooth.

With q the integral of Q from the panel's start, where W has the value ``v2``, ``W = exp(-q) (v2 + integral of exp(q)
P)``. The integrals come from running means, so that nothing is subtracted however short the intervals are, and W keeps
all its digits next to a turning point.
"""

from functools import reduce
from math import fabs, factorial, inf, sqrt
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.calls import call_path_in_space, call_speed_equation, call_squared_contact
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import copied, fused, on_stack, over_rows
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.legs.panels.breaks import within
from gqm_sym.runtime.legs.panels.polynomials import COUNT, ENDS_BY_NODE, WIDE, size_of, to_graded_means, to_means

copy = copied(WIDE)

# The largest q over a panel: resistance alone may not change V**2 by more than the factor exp(MAX_Q).
MAX_Q = 2.0

# exp(q) - 1 is summed as a series up to this q; a larger q is halved, and the result is squared again.
MAX_SERIES_Q = 0.25
EXPM1_TERMS = tuple(1.0 / factorial(k) for k in range(13, 1, -1))

# A number that keeps the length of a force that vanishes from being zero.
LEAST_SQUARE = 1e-300

# A distance larger than all others; an infinite one would make results NaN.
FARTHEST = 1e300

# The work array of a panel is a sequence of rows, each of WIDE numbers: a value at each of the COUNT Chebyshev nodes,
# and the value at the panel's right end in rows that have one there (W and those after it, and DS to KAPPA).
#
# ============ ====================================================================================================
# row          meaning
# ============ ====================================================================================================
# TIME_RATE    dt/dw
# LOAD         ds (n0 + kappa W): the contact force per mass, times ds
# W_FACTOR     W over its zero factor: W/d where a turning point lies at distance d, be it one behind a slow launch;
#              W itself elsewhere
# FORCE        exp(q) P along the direction
# Q_RATE       dq/dw
# DS           ds/dlam
# P, Q         coefficients of the equation
# N0, KAPPA    static normal load per mass and curvature
# W            V**2
# D            distance from the panel's start
# EXPM1_Q      exp(q) - 1
# MEAN         running means of FORCE
# GRADED       running means of FORCE, weighted with the distance in w
# SPEED        Y
# ARC_RATE     places on the curve; at the end of the panel's computation |ds/dw|
# OFFSET       w from the panel's start
# SERIES       Chebyshev coefficients of a row under examination
# SIZES        for each of the rows before P the size that its coefficients are compared with
# TAILS        last and middle coefficients of the row examined last, and its mean
# NODES        the nodes as shares of a panel
# AT_REST to   the rows of `squared_contact`: the coefficients of (N/m)**2, and v times the factor of friction
# RUBBING
# ============ ====================================================================================================
#
# The resolution of the rows before P can be tested.
TIME_RATE, LOAD, W_FACTOR, FORCE, Q_RATE, DS, P, Q, N0, KAPPA = range(0, 10 * WIDE, WIDE)
W, D, EXPM1_Q, MEAN, GRADED, SPEED, ARC_RATE, OFFSET, SERIES, SIZES, TAILS, NODES = range(10 * WIDE, 22 * WIDE, WIDE)
AT_REST, MIXED, TURNING, RUBBING = range(22 * WIDE, 26 * WIDE, WIDE)

# Rows for a law with friction in space (`solving`): P and Q without friction; N/m, and its derivative with respect to
# V**2.
PLAIN_P, PLAIN_Q, LENGTH, LENGTH_SLOPE = range(26 * WIDE, 30 * WIDE, WIDE)
panel_buffer = on_stack(30 * WIDE)

# Formulas for one row from others. Here y is the march variable from the panel's start, where the distance grows at the
# rate ``slope``, and u is the direction in which the panel is run.
copy_row = over_rows(lambda row: row, WIDE)
product = over_rows(lambda one, other: one * other, WIDE)
distance_row = over_rows(lambda y, slope, g: y * (slope + g * y), WIDE)
linear_row = over_rows(lambda d, begin, u: begin + u * d, WIDE)
q_rate_row = over_rows(lambda q, y, slope, g, u: u * q * (slope + 2.0 * g * y), WIDE)
force_row = over_rows(lambda p, expm1, u: u * p * (1.0 + expm1), WIDE)
solution_row = over_rows(lambda gained, expm1, v2: v2 + (gained - v2 * expm1) / (1.0 + expm1), WIDE)
graded_integral_row = over_rows(lambda y, mean, graded, slope: y * (slope * mean + y * graded), WIDE)
damped_row = over_rows(lambda mean, expm1: mean / (1.0 + expm1), WIDE)
difference_row = over_rows(lambda one, other: one - other, WIDE)
factor_row = over_rows(lambda w, y, shift: w / ((y + shift) * (y + shift)), WIDE)
load_row = over_rows(lambda ds, n0, kappa, w: ds * (n0 + kappa * w), WIDE)
load_per_mass_row = over_rows(lambda n0, kappa, w: n0 + kappa * w, WIDE)
load_size_row = over_rows(lambda ds, n0, kappa, w: abs(ds) * (abs(n0) + abs(kappa * w)), WIDE)
root_row = over_rows(np.sqrt, WIDE)
length_row = over_rows(lambda a, b, c, w: np.sqrt(a + w * (b + w * c) + LEAST_SQUARE), WIDE)
vector_length_row = over_rows(lambda x, y, z: np.sqrt(x * x + y * y + z * z), WIDE)
time_rate_row = over_rows(lambda ds, speed, factor: factor * ds / speed, WIDE)
arc_rate_row = over_rows(lambda ds, y, slope, g: ds * (slope + 2.0 * g * y), WIDE)


def _expm1(x: Any) -> Any:
    """Return exp(x) - 1 for a register of small numbers."""
    terms = reduce(lambda total, term: fused(total, x, term), EXPM1_TERMS[1:], x * 0.0 + EXPM1_TERMS[0])
    return fused(terms * x, x, x)


expm1_row = over_rows(_expm1, WIDE)
doubled_row = over_rows(lambda expm1: expm1 * (expm1 + 2.0), WIDE)


class Forces(NamedTuple):
    """The forces on a leg, and the direction in which the body moves.

    Attributes
    ----------
    speed_equation : int
        The address of the module's compiled function of this name.
    params : array
        Run-time parameters.
    friction, kinked, linear, has_radius : bool
        As in `interface.Dissipation`.
    direction : int
        The sign of dlam/dt.
    squared_contact, path_in_space : int
        As in `interface.Dissipation`.
    """

    speed_equation: int
    params: Array
    friction: bool
    kinked: bool
    linear: bool
    has_radius: bool
    direction: int
    squared_contact: int
    path_in_space: int


@Inner
def forces_on(dissipation, p, direction):  # type: ignore[no-untyped-def]
    """Return the forces on a body that moves in a direction, given an `interface.Dissipation` and the parameters."""
    return Forces(
        dissipation.speed_equation,
        p,
        dissipation.friction,
        dissipation.kinked,
        dissipation.linear,
        dissipation.has_radius,
        direction,
        dissipation.squared_contact,
        dissipation.path_in_space,
    )


class March(NamedTuple):
    """The march variable w of panels, defined by the distance ``w (g w + c)`` from the origin.

    Attributes
    ----------
    origin : (float, float)
        The place where the distance is zero, as two doubles.
    direction : int
        The sign of dlam/dw, which is opposite to that of the motion if a leg is followed back.
    g, c : float
        The coefficients.
    """

    origin: tuple[float, float]
    direction: int
    g: float
    c: float


class Panel(NamedTuple):
    """The start of a panel.

    Attributes
    ----------
    left : float
        The march variable.
    v2 : float
        V**2.
    contact_sign : int
        The sign of the normal force N on the panel; 0 where it is not known.
    span : (float, float)
        The places between which the curve may be evaluated (`panels.breaks`).
    """

    left: float
    v2: float
    contact_sign: int
    span: tuple[float, float]


@Inner
def distance(w, march):  # type: ignore[no-untyped-def]
    """Return the distance from the origin."""
    return w * (march.g * w + march.c)


@Inner
def slope_at(w, march):  # type: ignore[no-untyped-def]
    """Return the derivative of the distance with respect to the march variable."""
    return 2.0 * march.g * w + march.c


@Inner
def marched(d, march):  # type: ignore[no-untyped-def]
    """Return the march variable at a distance from the origin."""
    d = min(d, FARTHEST)
    return 2.0 * d / (march.c + sqrt(march.c * march.c + 4.0 * march.g * d)) if d > 0.0 else 0.0


@Inner
def fill_expm1(work, q, out):  # type: ignore[no-untyped-def]
    """Fill the row at ``out`` with exp(q) - 1 for the row at ``q``."""
    largest, scale, doublings = max(size_of(work, q), fabs(work[q + COUNT])), 1.0, 0
    while largest * scale > MAX_SERIES_Q:
        scale, doublings = 0.5 * scale, doublings + 1
    product(work, out, q, scale)
    expm1_row(work, out, out)
    for _ in range(doublings):
        doubled_row(work, out, out)


@Inner
def set_nodes(work):  # type: ignore[no-untyped-def]
    """Fill in the nodes, once for all panels."""
    for j in range(WIDE):
        work[NODES + j] = ENDS_BY_NODE[j]


@Inner
def lay_places(march, panel, row, work):  # type: ignore[no-untyped-def]
    """Fill a row with the places on the curve for the distances in the row D."""
    origin, u = march.origin, march.direction
    linear_row(work, row, D, origin[0] + (u * distance(panel.left, march) + origin[1]), float(u))
    if panel.span[0] > -inf or panel.span[1] < inf:
        for j in range(WIDE):
            work[row + j] = within(work[row + j], panel.span)


@Inner
def fill_square(forces, row, work):  # type: ignore[no-untyped-def]
    """Fill the rows AT_REST to RUBBING at the places in a row."""
    places, out = work[row : row + WIDE], work[AT_REST : AT_REST + 4 * WIDE]
    call_squared_contact(forces.squared_contact, WIDE, places, forces.params, out)


@Inner
def sample(forces, march, panel, work):  # type: ignore[no-untyped-def]
    """Fill the rows DS to KAPPA and Q_RATE at the panel's places, for the values of V**2 in the row W.

    The values at the panel's end only fill up the registers, and may be NaN.
    """
    v, nu = float(forces.direction), float(panel.contact_sign)
    call_speed_equation(forces.speed_equation, WIDE, work, (ARC_RATE, W, DS), v, nu, forces.params)
    q_rate_row(work, Q_RATE, Q, OFFSET, slope_at(panel.left, march), march.g, float(march.direction))


@Inner
def fill_force(march, work):  # type: ignore[no-untyped-def]
    """Fill the rows EXPM1_Q and FORCE for the sampled forces; return q over the panel, or inf if it is too large."""
    to_means(work, Q_RATE, work, SPEED)
    product(work, SPEED, SPEED, OFFSET)
    total = work[SPEED + COUNT]
    if not fabs(total) <= MAX_Q:
        return inf
    fill_expm1(work, SPEED, EXPM1_Q)
    force_row(work, FORCE, P, EXPM1_Q, float(march.direction))
    return total


@Inner
def integrate(march, panel, out, work):  # type: ignore[no-untyped-def]
    """Fill the row at ``out`` with W for the sampled forces; return q over the panel, or inf if it is too large."""
    total = fill_force(march, work)
    if not total < inf:
        return inf
    # The integral over the distance comes from means, and if g is not zero also from means weighted with y.
    to_means(work, FORCE, work, MEAN)
    if march.g > 0.0:
        to_graded_means(work, FORCE, work, GRADED)
        graded_integral_row(work, SPEED, OFFSET, MEAN, GRADED, slope_at(panel.left, march))
    else:
        product(work, SPEED, OFFSET, MEAN)
    solution_row(work, out, SPEED, EXPM1_Q, panel.v2)
    return total


@Inner
def fill_length(forces, march, panel, work):  # type: ignore[no-untyped-def]
    """Replace the rows N0 and KAPPA of a computed panel by the length of the contact force per mass, and 0; by that of
    the contact force itself where `interface.Dissipation.path_in_space` gives it.
    """
    if forces.linear or forces.path_in_space != 0:
        lay_places(march, panel, SERIES, work)
    if forces.path_in_space != 0:
        places, v2, out = work[SERIES : SERIES + WIDE], work[W : W + WIDE], work[AT_REST : AT_REST + 4 * WIDE]
        call_path_in_space(forces.path_in_space, WIDE, places, v2, float(forces.direction), forces.params, out)
        vector_length_row(work, N0, AT_REST + WIDE, AT_REST + 2 * WIDE, AT_REST + 3 * WIDE)
        copy_row(work, KAPPA, 0.0)
        return
    if forces.linear:
        fill_square(forces, SERIES, work)
    length_row(work, N0, AT_REST, MIXED, TURNING, W)
    copy_row(work, KAPPA, 0.0)


@Inner
def as_factor(w, march, left):  # type: ignore[no-untyped-def]
    """Return a value of W at the start of a panel in the unit of W_FACTOR."""
    return w / (0.25 * march.c * march.c) if march.g > 0.0 and left == 0.0 and march.c > 0.0 else w


@Inner
def fill_rates(march, panel, work):  # type: ignore[no-untyped-def]
    """Fill Y and the rates of time and of arc length, which are NaN where W is not positive."""
    if panel.v2 == 0.0 or march.g == 0.0:
        root_row(work, SPEED, W_FACTOR)
    else:
        factor_row(work, SPEED, W, OFFSET, panel.left + 0.5 * march.c)
        root_row(work, SPEED, SPEED)
    time_rate_row(work, TIME_RATE, DS, SPEED, 1.0 + march.g)
    arc_rate_row(work, ARC_RATE, DS, OFFSET, slope_at(panel.left, march), march.g)
