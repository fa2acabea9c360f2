"""One curve and one periodic orbit on it, as the compiled loop of a sweep has them for a launch."""

from typing import Any, NamedTuple

# What the ends of a table, or of the curve where there is no table, are: nothing that is known, the ends of the curve,
# through which bodies leave it, or places where no body is in contact with the track any more.
NO_ENDS, CURVE_ENDS, CONTACT_ENDS = range(3)


class SweptCurve(NamedTuple):
    """The curve of a launch, with the forces on it.

    Attributes
    ----------
    fns : Addresses
        The module's compiled functions.
    p : array
        Run-time parameters, and behind them the curve's chart if it has one.
    joints : array
        The places at which the curve is not smooth, within one period.
    period : float
        The period of a closed curve, 0 otherwise.
    ends : int
        What both ends of the table, or of the curve where there is none, are: NO_ENDS, CURVE_ENDS or CONTACT_ENDS.
    mass : float
        The mass of the body.
    table : CurveTable
        The curve tabulated; empty if it is not.
    factors : array
        What the parts of the potential and of the load in the table are multiplied with.
    rows, levels : arrays
        Potential and load of the launch on each panel, and how far they are filled in (`tables.panel_forces`).
    v0 : float
        The speed of the launch.
    exact : RecordedFormulas
        The formulas as a tape, for what doubles do not tell (`slow_places`).
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


class Orbit(NamedTuple):
    """Where a body goes that repeats its motion, or leaves the curve through one end and has at most one turning point.

    Attributes
    ----------
    circulates : bool
        Whether it runs round a closed curve; otherwise it librates between two turning points.
    even : bool
        Whether the orbit's well is its own mirror image and V**2 is monotone on either side of the axis.
    direction : int
        The sign of dlam/dt at launch.
    lam0, v2 : float
        The launch place, and V**2 there.
    low, high : float
        Offsets from the launch place to both turning points, or to both ends of a lap that begins there. Of a body that
        leaves, to the end and to the turning point, or to the end and 0 where there is none.
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
