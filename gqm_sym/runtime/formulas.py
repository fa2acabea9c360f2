"""What a generated module hands to the runtime, and the questions it answers through it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gqm_sym.errors import LaunchError, ParameterError
from gqm_sym.runtime.entries import frame_at, speed_squared_at
from gqm_sym.runtime.exact import ExactProblem
from gqm_sym.runtime.interface import Addresses, ExactFormulas
from gqm_sym.runtime.numbers import Number, read_number
from gqm_sym.runtime.stretch import Array, Functions

if TYPE_CHECKING:
    from gqm_sym.runtime.motion import Motion

# The same names as an mpmath context has, over floats.
FLOATS = SimpleNamespace(
    **{name: getattr(math, name) for name in ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"]},
    **{name: getattr(math, name) for name in ["asinh", "acosh", "atanh", "exp", "log", "sqrt", "pi", "e"]},
    mpf=float,
)

CONTACTS = ("bilateral", "above", "below")


class Pass1(NamedTuple):
    """Position, metric, curvature, V**2 and contact force at places of a curve, each an array of the places' shape."""

    x: Array
    z: Array
    ds: Array
    kappa: Array
    v2: Array
    normal_force: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Launch:
    """Where and how a motion begins, in numbers that mean exactly what was given."""

    lam0: Number
    v0: Number
    direction: int
    contact: str
    t_max: Number | None


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
    """

    name: str
    parameter: str
    parameters: Mapping[str, float | int | str | None]
    positive: tuple[str, ...]
    addresses: Addresses
    exact: ExactFormulas

    def numbers(self, given: tuple[Any, ...]) -> tuple[Number, ...]:
        """The run-time parameters as exact numbers, checked."""
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
        return tuple(out)

    def launch(self, lam0: Any, v0: Any, direction: int, point: Any, t_max: Any, contact: str) -> Launch:
        """A launch, checked as far as it can be without the curve."""
        if point is not None:
            raise LaunchError(
                f"point: {self.name} has a parameter of its own; launch by lam0 (a value of {self.parameter})"
            )
        if lam0 is None:
            raise LaunchError(f"lam0: not given; it is the value of {self.parameter} to launch from")
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
        place = read_number(lam0, where="lam0")
        return Launch(lam0=place, v0=speed, direction=int(direction), contact=contact, t_max=horizon)

    def domain(self, p: tuple[Number, ...]) -> tuple[float, float, float]:
        """Both ends of the parameter's range (infinite where open) and the period (0 where there is none)."""
        low, high, period = self.exact.domain(FLOATS, tuple(number.value for number in p))
        if period is not None:
            return -math.inf, math.inf, float(period)
        return (
            -math.inf if low is None else float(low),
            math.inf if high is None else float(high),
            0.0,
        )

    def functions(self, p: tuple[Number, ...], launch: Launch) -> Functions:
        """The compiled functions with their parameters, and the exact problem of one launch."""
        exact = ExactProblem(self.exact, p, launch.lam0, launch.v0)
        return Functions(tuple(self.addresses), np.array([number.value for number in p]), exact)

    def check_place(self, place: Number, low: float, high: float) -> None:
        """Refuse a launch outside the domain."""
        if not low <= place.value <= high:
            raise LaunchError(f"lam0: must lie in the domain [{low!r}, {high!r}] of {self.parameter}, got {place.text}")

    def pass1(self, lam: Any, lam0: Any, v0: Any, direction: int, given: tuple[Any, ...]) -> Pass1:
        """Pass 1 at places of the curve."""
        p = self.numbers(given)
        launch = self.launch(lam0, v0, direction, None, None, "bilateral")
        self.check_place(launch.lam0, *self.domain(p)[:2])
        f = self.functions(p, launch)
        places, low, shape = read_numbers(lam, where=self.parameter)
        start = launch.lam0
        offsets = (places - start.value) + low
        v2 = speed_squared_at(f.addresses, f.p, start.value, start.low, launch.v0.value**2, places, offsets)
        x, z, ds, kappa, force = frame_at(f.addresses, f.p, places, v2)
        return Pass1(*(array.reshape(shape) for array in (x, z, ds, kappa, v2, force)))

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
        from gqm_sym.runtime.solve import solve

        return solve(self, self.numbers(given), self.launch(lam0, v0, direction, point, t_max, contact))


def read_numbers(values: Any, *, where: str) -> tuple[Array, Array, tuple[int, ...]]:
    """Numbers, or arrays of them, as flat arrays of doubles, flat arrays of what those leave over, and their shape."""
    if isinstance(values, np.ndarray) and values.dtype == np.float64:
        flat = np.ascontiguousarray(values).reshape(-1)
        return flat, np.zeros_like(flat), values.shape
    array = np.asarray(values, dtype=object)
    numbers = [read_number(v, where=where) for v in array.reshape(-1)]
    high = np.array([n.value for n in numbers], dtype=np.float64)
    low = np.array([n.low for n in numbers], dtype=np.float64)
    return high, low, array.shape
