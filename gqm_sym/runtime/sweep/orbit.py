"""One periodic orbit, as the compiled loop of a sweep finds it for a launch."""

from typing import NamedTuple


class Orbit(NamedTuple):
    """Where a body goes that repeats its motion.

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
        Offsets from the launch place to both turning points, or to both ends of a lap that begins there.
    """

    circulates: bool
    even: bool
    direction: int
    lam0: float
    v2: float
    low: float
    high: float
