"""A launch as a user gives it, and the same launch checked and read as exact numbers."""

from typing import Any, NamedTuple

import numpy as np

from gqm_sym.arguments import short
from gqm_sym.errors import LaunchError, NumberError
from gqm_sym.literals.numbers import Number, read_number
from gqm_sym.runtime.charts.train import TrackOfTrain
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues

# The largest distance of a launch point from a charted curve, as a share of the point's larger coordinate or of the
# length of the nearest piece (a curve as a whole may be very long).
MAX_POINT_DISTANCE_SHARE = 1e-6

# The names of the side of the track that can push, each with the only sign that N can then have; 0 if it can have both.
ONLY_SIGN = {"bilateral": 0, "above": 1, "below": -1}
CONTACTS = tuple(ONLY_SIGN)

# The largest speed in m/s, and the smallest one but 0. Their squares are in the range of doubles, with room for the
# factors that multiply them, and have all digits.
MAX_SPEED, LEAST_SPEED = 1e150, 1e-150

# The largest launch place on a closed curve, in laps: beyond it, doubles resolve places to a thousandth of a lap or
# worse.
MAX_LAPS = 2.0**43


class LaunchRequest(NamedTuple):
    """A launch, or arrays of launches, as given to a module's ``solve`` and ``sweep``.

    Attributes
    ----------
    lam0, v0, direction
        The launch place as a value of the curve parameter, the speed in m/s, and the sign of ds/dt at launch.
    point : pair of numbers, optional
        The coordinates of the launch place in m, instead of ``lam0``.
    t_max : number, optional
        The time in s up to which the motion is computed (the horizon).
    contact : str
        One of `CONTACTS`: which side of the track can push.
    """

    lam0: Any
    v0: Any = 0.0
    direction: Any = 1
    point: Any = None
    t_max: Any = None
    contact: str = "bilateral"


class Launch(NamedTuple):
    """The launch of a motion, in exact numbers.

    Attributes
    ----------
    lam0, v0 : Number
        The launch place, and the speed in m/s.
    direction : int
        The sign of ds/dt at launch.
    contact : str
        One of `CONTACTS`.
    t_max : Number or None
        The horizon in s.
    point : pair of Number, optional
        The coordinates of the launch place in m, if it was given by them.
    """

    lam0: Number
    v0: Number
    direction: int
    contact: str
    t_max: Number | None
    point: tuple[Number, Number] | None = None


def read_launch(formulas: Formulas, p: ParameterValues, request: tuple[Any, ...]) -> Launch:
    """Check a launch, given by the fields of a `LaunchRequest`, and read its numbers.

    Raises
    ------
    LaunchError
        If the model cannot be launched in this way. The message names the argument and says what would be right.
    """
    lam0, v0, direction, point, t_max, contact = request
    if point is None and lam0 is not None:
        unit = None if type(lam0) is float else formulas.units.get(formulas.parameter)
        place, point_place = read_number(lam0, where="lam0", unit=unit), None
    else:
        place, point_place = _read_place(formulas, p, lam0, point)
    if type(direction) is not int or direction not in (1, -1):
        direction = _read_direction(direction)
    if type(contact) is not str or contact != "bilateral":
        check_contact(formulas, contact)
    speed = read_number(v0, where="v0", unit="m/s")
    if speed.value < 0.0:
        raise LaunchError(
            f"v0: is a speed and cannot be negative, got {speed.text}; use direction=-1 to launch the other way"
        )
    if speed.value > MAX_SPEED:
        raise LaunchError(f"v0: must be at most {MAX_SPEED:g} m/s, because its square is computed, got {speed.text}")
    if 0.0 < speed.value < LEAST_SPEED:
        raise LaunchError(
            f"v0: must be 0 or at least {LEAST_SPEED:g} m/s, because its square is computed, got {speed.text}"
        )
    horizon = None if t_max is None else read_number(t_max, where="t_max", unit="s")
    if horizon is not None and not horizon.value > 0.0:
        raise LaunchError(f"t_max: must be positive, got {horizon.text}")
    domain = formulas.domain(p).numbers
    if not domain.low <= place.value <= domain.high:
        ends = f"[{domain.low!r}, {domain.high!r}]"
        raise LaunchError(f"lam0: must lie in the domain {ends} of {formulas.parameter}, got {place.text}")
    if domain.period and abs(place.value) > MAX_LAPS * domain.period:
        raise LaunchError(
            f"lam0: {place.text} is so many laps away that doubles cannot tell places apart; the curve repeats after "
            f"{domain.period!r}"
        )
    # This avoids the constructor of a named tuple, which is slow.
    return tuple.__new__(Launch, (place, speed, direction, contact, horizon, point_place))


def _read_direction(given: Any) -> int:
    """Return a sign that is given as a number of another type than int."""
    try:
        sign = 0.0 if isinstance(given, str | np.ndarray) else read_number(given, where="direction").value
    except NumberError:
        sign = 0.0
    if sign not in (1.0, -1.0):
        raise LaunchError(f"direction: must be 1 or -1 (the sign of ds/dt at launch), got {short(given)}")
    return int(sign)


def check_contact(formulas: Formulas, contact: Any) -> None:
    """Refuse a side of contact that is not one of `CONTACTS`, or that the curve does not have.

    Raises
    ------
    LaunchError
    """
    if not (isinstance(contact, str) and contact in CONTACTS):
        raise LaunchError(f"contact: must be one of {', '.join(CONTACTS)}, got {short(contact)}")
    if not ONLY_SIGN[contact]:
        return
    if isinstance(formulas.chart, TrackOfTrain):
        raise LaunchError(
            f"contact: {contact!r} is for one body; a train is held from all sides, which is 'bilateral', and "
            "`Motion.cars` tells the contact force of each car"
        )
    if not formulas.sided:
        raise LaunchError(
            f"contact: {contact!r} needs to know which side of this space curve the body is on: declare the upward "
            "direction by Curve.space(..., roll=...), as an angle (0 is level) or for a speed; without it the body is "
            "held from all sides, which is 'bilateral'"
        )


def _read_place(
    formulas: Formulas, p: ParameterValues, lam0: Any, point: Any
) -> tuple[Number, tuple[Number, Number] | None]:
    """Return the launch place as a value of the curve parameter, and its coordinates if these were given."""
    if point is None:
        raise LaunchError(f"lam0: not given; it is the value of {formulas.parameter} to launch from")
    if formulas.chart is None:
        raise LaunchError(
            f"point: {formulas.name} has a parameter of its own; launch by lam0 (a value of {formulas.parameter})"
        )
    if formulas.path_in_space is not None:
        raise LaunchError(
            f"point: is for planar curves; launch on this track in space by lam0 (a value of {formulas.parameter})"
        )
    if lam0 is not None:
        raise LaunchError("lam0, point: give one of them; both say where to launch from")
    try:
        at_x, at_z = (read_number(value, where="point", unit="m") for value in point)
    except (TypeError, ValueError):
        raise LaunchError(f"point: must be a pair of numbers (x, z), got {point!r}") from None
    chart, x, z = formulas.charted(p), at_x.value, at_z.value
    s, distance = chart.nearest(x, z)
    piece = np.diff(chart.edges)[max(int(np.searchsorted(chart.edges, s)) - 1, 0)]
    if distance > MAX_POINT_DISTANCE_SHARE * min(chart.high - chart.low, max(abs(x), abs(z), piece)):
        there = chart.points([s])[:2, 0]
        raise LaunchError(
            f"point: ({x!r}, {z!r}) is {distance:.3g} off the curve; the nearest point on it is "
            f"({float(there[0])!r}, {float(there[1])!r}), at {formulas.parameter} = {s!r}"
        )
    return read_number(s, where="point"), (at_x, at_z)
