"""What a generated module hands to the runtime, and the questions it answers through it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gqm_sym.budgets import budget
from gqm_sym.errors import LaunchError, ParameterError
from gqm_sym.runtime.chart import Chart, ChartMaker
from gqm_sym.runtime.entries import frame_at
from gqm_sym.runtime.exact_problems import exact_problem
from gqm_sym.runtime.functions import Functions
from gqm_sym.runtime.interface import Addresses, Dissipation, Each, ExactClimb, ExactFormulas
from gqm_sym.runtime.jit import Later
from gqm_sym.runtime.loads import Pass1, fill_loads, room
from gqm_sym.runtime.numbers import Number, read_number, read_numbers
from gqm_sym.runtime.stores import LARGE
from gqm_sym.runtime.stretch import Array
from gqm_sym.runtime.threads import spread

if TYPE_CHECKING:
    from gqm_sym.runtime.motion import Motion
    from gqm_sym.runtime.sweeping import Sweep

# The same names as an mpmath context has, over floats.
FLOATS = SimpleNamespace(
    **{name: getattr(math, name) for name in ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"]},
    **{name: getattr(math, name) for name in ["asinh", "acosh", "atanh", "exp", "log", "sqrt", "pi", "e"]},
    mpf=float,
)

# How far off a charted curve a launch point may be: a share of its larger coordinate or of the piece it is near to, for
# a curve as a whole may be followed very far.
NEAR = 1e-6

# Places of a load map that a thread is worth starting for.
LEAST_MAP = 2**16

NOTHING: Array = np.empty(0)

CONTACTS = ("bilateral", "above", "below")


class Launch(NamedTuple):
    """Where and how a motion begins, in numbers that mean exactly what was given."""

    lam0: Number
    v0: Number
    direction: int
    contact: str
    t_max: Number | None
    point: tuple[Number, Number] | None = None


class Domain(NamedTuple):
    """The parameter's range: its ends (infinite where open), its period (0 where there is none), and what is there.

    ``place`` and ``step`` are those of `Formulas.axes_of` where V**2 is monotone between them; else ``place`` is NaN.
    """

    low: float
    high: float
    period: float
    ends: tuple[str, str] = ("domain-end", "domain-end")
    place: float = math.nan
    step: float = 0.0


class Given(tuple[Number, ...]):
    """Run-time parameters, and what follows from them alone: the same for every launch with them."""

    values: Array
    domain: Domain | None = None
    functions: Functions | None = None


@cache
def _solver(dissipative: bool) -> "Callable[[Formulas, Given, Launch], Motion]":
    """What solves a launch, loaded when it is needed: a process that solves one model needs one of the two."""
    if dissipative:
        from gqm_sym.runtime.dissipative import dissipate

        return dissipate
    from gqm_sym.runtime.solve import solve

    return solve


@lru_cache(maxsize=8)
def _chart(maker: ChartMaker, values: tuple[float, ...]) -> Chart:
    """A curve's chart, made once for the same values of the run-time parameters."""
    with budget("chart", 60.0, "give fewer points, or shorter and simpler pieces"):
        return maker.chart(values)


@dataclass(frozen=True, slots=True, kw_only=True)
class Formulas:
    """The compiled functions and exact formulas of one generated module.

    Attributes
    ----------
    name, parameter : str
        Its name, and the name of the curve's parameter.
    parameters : dict
        Run-time parameters and their defaults, None where one must be given.
    positive : tuple of str
        Parameters for which the closed forms assume a positive value.
    at_least : tuple of (str, str)
        Parameters with what they must not fall below: a number, or another parameter.
    body : str
        The radius of a rolling body whose centre's path was derived from its track; empty for any other.
    grip : tuple of str, optional
        Of a rolling body whose static friction is known: its inertia beta and its coefficient mu_static.
    domain_of
        ``f(op, p)``: both ends of the parameter's range and its period, None where there is none. A chart has its own.
    axes_of
        ``f(op, p)``: a place about which V**2 and ds are even, and the distance to the next; None where there is none.
    monotone
        Whether V**2 is proved to rise or fall all the way between two such places, and ds to vanish nowhere.
    exact
        The formulas over a namespace of operations, of a charted curve those of the forces; None where there are none.
    chart
        What makes the chart of a curve that has no formulas.
    dissipation
        What a dissipative model adds; None for a conservative one.
    loads
        What fills a load map at once; None where there is no such function.
    each
        The functions of a sweep; None where motions are solved one by one.
    """

    name: str
    parameter: str
    parameters: Mapping[str, float | int | str | None]
    positive: tuple[str, ...]
    addresses: Addresses
    domain_of: Callable[..., Any] | None = None
    axes_of: Callable[..., Any] | None = None
    monotone: bool = False
    exact: ExactFormulas | ExactClimb | None = None
    chart: ChartMaker | None = None
    dissipation: Dissipation | None = None
    loads: Later | None = None
    each: Each | None = None
    at_least: tuple[tuple[str, str], ...] = ()
    body: str = ""
    grip: tuple[str, str] | None = None
    _read: Callable[..., "Given"] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # Most launches come with the parameters of one before; 1 and 1.0 are told apart, for their texts differ.
        object.__setattr__(self, "_read", lru_cache(maxsize=16, typed=True)(self._numbers))

    def numbers(self, given: tuple[Any, ...]) -> "Given":
        """The run-time parameters as exact numbers, checked."""
        try:
            return self._read(*given)
        except TypeError:  # what cannot be hashed
            return self._numbers(*given)

    def _numbers(self, *given: Any) -> "Given":
        out = []
        for name, value in zip(self.parameters, given, strict=True):
            if value is None:
                raise ParameterError(f"{name}: has no default and was not given; pass {name}=...")
            number = read_number(value, where=name)
            if (name in self.positive or name == "m") and not number.value > 0.0:
                raise ParameterError(
                    f"{name}: must be positive, got {number.text}; the closed forms hold for {name} > 0"
                )
            out.append(number)
        self._check_least(dict(zip(self.parameters, out, strict=True)))
        p = Given(out)
        p.values = np.array([number.value for number in out])
        return p

    def _check_least(self, values: dict[str, Number]) -> None:
        """Refuse a parameter below what it must not fall below."""
        for name, least in self.at_least:
            bound = values.get(least) or read_number(least, where=least)
            if values[name].value < bound.value:
                what = f"{least} = {bound.text}" if least in values else least
                raise ParameterError(f"{name}: must be at least {what}, got {values[name].text}")

    def launch(
        self,
        p: Given,
        *,
        lam0: Any,
        v0: Any,
        direction: int = 1,
        point: Any = None,
        t_max: Any = None,
        contact: str = "bilateral",
    ) -> Launch:
        """A launch, checked."""
        if point is None and lam0 is not None:
            place, at = read_number(lam0, where="lam0"), None
        else:
            place, at = self._placed(p, lam0, point)
        if direction not in (1, -1):
            raise LaunchError(f"direction: must be 1 or -1 (the sign of ds/dt at launch), got {direction!r}")
        if contact not in CONTACTS:
            raise LaunchError(f"contact: must be one of {', '.join(CONTACTS)}, got {contact!r}")
        speed = read_number(v0, where="v0")
        if speed.value < 0.0:
            raise LaunchError(
                f"v0: is a speed and cannot be negative, got {speed.text}; use direction=-1 to launch the other way"
            )
        horizon = None if t_max is None else read_number(t_max, where="t_max")
        if horizon is not None and not horizon.value > 0.0:
            raise LaunchError(f"t_max: must be positive, got {horizon.text}")
        domain = self.domain(p)
        if not domain.low <= place.value <= domain.high:
            ends = f"[{domain.low!r}, {domain.high!r}]"
            raise LaunchError(f"lam0: must lie in the domain {ends} of {self.parameter}, got {place.text}")
        return Launch(place, speed, int(direction), contact, horizon, at)

    def _placed(self, p: Given, lam0: Any, point: Any) -> tuple[Number, tuple[Number, Number] | None]:
        """The launch place by the curve's parameter, and its coordinates: what was given."""
        if point is None:
            raise LaunchError(f"lam0: not given; it is the value of {self.parameter} to launch from")
        if self.chart is None:
            raise LaunchError(
                f"point: {self.name} has a parameter of its own; launch by lam0 (a value of {self.parameter})"
            )
        if lam0 is not None:
            raise LaunchError("lam0, point: give one of them; both say where to launch from")
        try:
            at_x, at_z = (read_number(value, where="point") for value in point)
        except (TypeError, ValueError):
            raise LaunchError(f"point: must be a pair of numbers (x, z), got {point!r}") from None
        chart, x, z = self.charted(p), at_x.value, at_z.value
        s, distance = chart.nearest(x, z)
        piece = np.diff(chart.edges)[max(int(np.searchsorted(chart.edges, s)) - 1, 0)]
        if distance > NEAR * min(chart.high - chart.low, max(abs(x), abs(z), piece)):
            there = chart.points([s])[:2, 0]
            raise LaunchError(
                f"point: ({x!r}, {z!r}) is {distance:.3g} off the curve; the nearest point on it is "
                f"({float(there[0])!r}, {float(there[1])!r}), at {self.parameter} = {s!r}"
            )
        return read_number(s, where="point"), (at_x, at_z)

    def charted(self, p: Given) -> Chart:
        """The chart of a charted curve."""
        assert self.chart is not None
        return _chart(self.chart, tuple(p.values.tolist()))

    def domain(self, p: Given) -> Domain:
        """The range of the curve's parameter."""
        if p.domain is None:
            p.domain = self._domain(p)
        return p.domain

    def _domain(self, p: Given) -> Domain:
        if self.chart is not None:
            chart = self.charted(p)
            if chart.period:
                return Domain(-math.inf, math.inf, chart.period)
            return Domain(chart.low, chart.high, 0.0, chart.ends)
        values = tuple(number.value for number in p)
        low, high, period = self.ends(FLOATS, values)
        place, step = self.axes(FLOATS, values) if self.monotone else (None, None)
        ends = (-math.inf if low is None else float(low), math.inf if high is None else float(high))
        return Domain(
            *ends, float(period or 0.0), place=math.nan if place is None else float(place), step=float(step or 0.0)
        )

    def ends(self, op: Any, values: tuple[Any, ...]) -> tuple[Any, Any, Any]:
        """Both ends of the parameter's range and its period, None where there is none: on a closed curve no ends."""
        assert self.domain_of is not None
        low, high, period = self.domain_of(op, values)
        return (low, high, None) if period is None else (None, None, period)

    def axes(self, op: Any, values: tuple[Any, ...]) -> tuple[Any, Any]:
        """A place of symmetry and the distance to the next, None where there is none."""
        return (None, None) if self.axes_of is None else self.axes_of(op, values)

    def functions(self, p: Given, launch: Launch) -> Functions:
        """The compiled functions with what they are given, and the exact problem of one launch."""
        if p.functions is None:
            p.functions = self._functions(p)
        if self.exact is None:
            return p.functions
        addresses, values, _, breaks, corners, period = p.functions
        return Functions(addresses, values, exact_problem(self, p, launch), breaks, corners, period)

    def _functions(self, p: Given) -> Functions:
        addresses = tuple(self.addresses)
        if self.chart is None:
            return Functions(addresses, p.values)
        chart = self.charted(p)
        block = np.concatenate([p.values, chart.block])
        return Functions(addresses, block, None, chart.breaks, chart.corners, chart.period)

    def pass1(self, lam: Any, lam0: Any, v0: Any, direction: int, given: tuple[Any, ...], out: Any = None) -> Pass1:
        """Pass 1 at places of the curve, into new arrays or those of ``out``."""
        p = self.numbers(given)
        launch = self.launch(p, lam0=lam0, v0=v0, direction=direction)
        f = self.functions(p, launch)
        if isinstance(lam, np.ndarray) and lam.dtype == np.float64:
            places, low, shape = np.ascontiguousarray(lam).reshape(-1), NOTHING, lam.shape
        else:
            places, low, shape = read_numbers(lam, where=self.parameter)
            low = low if low.any() else NOTHING
        found = room(shape, places, out)
        if self.dissipation is not None:
            from gqm_sym.runtime.dissipative import launch_leg

            v2 = launch_leg(self, p, launch, places)
            x, z, ds, kappa, force = frame_at(f.addresses, f.p, places, v2)
            for array, values in zip(found, (x, z, ds, kappa, v2, force), strict=True):
                array[...] = values.reshape(shape)
            return found
        start, w0, loads = launch.lam0, launch.v0.value**2, 0 if self.loads is None else self.loads.address
        rows, past = tuple(array.reshape(-1) for array in found), len(found) * places.nbytes >= LARGE

        def fill(part: slice) -> None:
            ends = part.start, part.stop
            fill_loads(f.addresses, loads, f.p, start.value, start.low, w0, places, low, rows, *ends, past)

        spread(fill, places.size, LEAST_MAP)
        return found

    def solve(
        self,
        lam0: Any,
        v0: Any,
        direction: int,
        point: Any,
        t_max: Any,
        contact: str,
        given: tuple[Any, ...],
    ) -> "Motion":
        """The motion that a launch begins."""
        p = self.numbers(given)
        launch = self.launch(p, lam0=lam0, v0=v0, direction=direction, point=point, t_max=t_max, contact=contact)
        find = _solver(self.dissipation is not None)
        if not self.body:
            return find(self, p, launch)
        from gqm_sym.runtime.fit import check_end, check_launch

        check_launch(self, self.functions(p, launch), launch.lam0.value)
        motion = find(self, p, launch)
        check_end(self, motion)
        return motion

    def sweep(
        self,
        quantity: str,
        lam0: Any,
        v0: Any,
        direction: Any,
        lam: Any,
        t_max: Any,
        contact: str,
        given: tuple[Any, ...],
        client: Any,
        source: str,
    ) -> "Sweep":
        """One quantity over arrays of launches and parameters, here or on a cluster that is sent the module's file."""
        if client is not None:
            from gqm_sym.runtime.cluster import sweep_on

            launch = {"lam0": lam0, "v0": v0, "direction": direction, "lam": lam, "t_max": t_max, "contact": contact}
            parameters = dict(zip(self.parameters, given, strict=True))
            return sweep_on(client, source, self.name, quantity, {**launch, **parameters})
        from gqm_sym.runtime.sweeping import sweep

        return sweep(self, quantity, lam0, v0, direction, lam, t_max, contact, given)
