"""A curve and an orbit on it, in the form in which the compiled loop of a sweep uses them for each launch."""

from typing import Any, NamedTuple

# The kinds of the ends of a table, or of the curve if there is no table: unknown; ends of the curve, through which
# bodies leave it; or places at which no body is in contact with the track any more.
NO_ENDS, CURVE_ENDS, CONTACT_ENDS = range(3)


class SweptCurve(NamedTuple):
    """The curve of a launch, with the forces on it.

    Attributes
    ----------
    fns : Addresses
        The module's compiled functions.
    p : array
        Run-time parameters, followed by the curve's chart if it has one.
    joints : array
        The places at which the curve is not smooth, within one period.
    period : float
        The period of a closed curve, 0 otherwise.
    ends : int
        The kind of both ends of the table, or of the curve if there is no table: NO_ENDS, CURVE_ENDS or CONTACT_ENDS.
    mass : float
        The mass of the body.
    table : CurveTable
        The table of the curve; empty if it is not tabulated.
    factors : array
        The factors of the parts of the potential and of the load in the table.
    rows, levels : arrays
        Potential and load of the launch on each panel, and the parts of these that are filled in
        (`tables.panel_forces`).
    v0 : float
        The speed of the launch.
    exact : RecordedFormulas
        The formulas as a tape, for places at which doubles do not suffice (`slow_places`).
    signed : bool
        Whether the contact force has a sign.
    path_in_space : int
        The address of the function with the contact force as a vector; 0 for curves in a plane.
    directed : bool
        Whether that vector depends on the direction of motion.
    rider_loads : int
        The address of the function with the loads on riders; 0 if no roll is declared.
    """

    fns: Any
    p: Any
    joints: Any
    period: Any
    ends: Any
    mass: Any
    table: Any
    factors: Any
    rows: Any
    levels: Any
    v0: Any
    exact: Any
    signed: Any
    path_in_space: Any
    directed: Any
    rider_loads: Any


class Orbit(NamedTuple):
    """The orbit of a body that repeats its motion, or that leaves the curve through one end and has at most one turning
    point.

    Attributes
    ----------
    circulates : bool
        Whether the body circulates on a closed curve; otherwise it librates between two turning points.
    even : bool
        Whether the orbit's well is its own mirror image and V**2 is monotone on either side of the axis.
    direction : int
        The sign of dlam/dt at launch.
    lam0, v2 : float
        The launch place, and V**2 there.
    low, high : float
        Offsets from the launch place to both turning points, or to both ends of a lap that begins there. For a body
        that leaves, the offsets of the end and of the turning point; 0 in place of the latter if there is none.
    leaves : int
        1 if it leaves the curve through the upper end, -1 if through the lower one, 0 if it stays.
    """

    circulates: bool
    even: bool
    direction: int
    lam0: float
    v2: float
    low: float
    high: float
    leaves: int
