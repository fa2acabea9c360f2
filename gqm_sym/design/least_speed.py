"""The least launch speed for which a body passes everywhere without losing contact."""

from collections.abc import Callable
from math import isfinite, sqrt
from types import ModuleType
from typing import Any

import numpy as np

from gqm_sym.errors import LaunchError, ParameterError, SolutionError
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.formulas import Formulas
from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.launch.problem import bind
from gqm_sym.runtime.launch.request import CONTACTS, LaunchRequest, read_launch
from gqm_sym.runtime.launch.speed import path_and_force_at, speed_squared_at
from gqm_sym.runtime.motion.extremes import grid_peaks

# Places at which the range is looked at first: a summit narrower than their distance may be overlooked.
LOOKS = 4096

# Places at which the surroundings of a summit are then looked at, and how often: 16**12 is 2**48.
ZOOM, ROUNDS = 33, 12

# Contact that fails by less, as a share of v0**2, holds but for rounding.
ROUNDING = 1e-13


def least_speed(
    module: ModuleType,
    lam0: Any,
    *,
    between: tuple[Any, Any] | None = None,
    contact: str = "above",
    **parameters: Any,
) -> float:
    """The least speed at ``lam0`` with which a body passes a range of a track and keeps in contact all the way.

    Parameters
    ----------
    module
        A generated module of a conservative model.
    lam0
        Launch place, in the range.
    between
        Ends of the range, as values of the curve's parameter: the whole curve if nothing is said.
    contact : {"above", "below", "bilateral"}
        Which side of the track can push; of a bilateral track V**2 >= 0 is all that is asked.
    parameters
        Run-time parameters, as for ``module.solve``.

    Returns
    -------
    float
        The speed. With it N (or V**2) vanishes at one place of the range: launch a little faster. It is where a smooth
        function is largest, and as accurate as that function.

    Raises
    ------
    SolutionError
        If there is no such speed: where the track bends away, contact asks for a speed that is not too high.

    Examples
    --------
    A loop of radius L, from its lowest point: ``sqrt(5*g*L)``.

    >>> import tempfile
    >>> import gqm_sym as gqm
    >>> loop = gqm.derive(gqm.families.circle(), gqm.Gravity())
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     circle = gqm.build(loop, name="loop", folder=folder)
    >>> round(least_speed(circle, 0, L=1, g=10), 12)
    7.071067811865
    """
    formulas: Formulas = module.MODEL
    if formulas.dissipation is not None:
        raise SolutionError(f"least_speed: {formulas.name} is dissipative, and its V**2 depends on the way taken")
    if contact not in CONTACTS:
        raise LaunchError(f"contact: must be one of {', '.join(CONTACTS)}, got {contact!r}")
    for name in parameters:
        if name not in formulas.parameters:
            known = ", ".join(formulas.parameters)
            raise ParameterError(f"{name}: is no parameter of {formulas.name}, which has {known}")
    p = formulas.numbers(tuple((dict(formulas.parameters) | parameters).values()))
    launch = read_launch(formulas, p, LaunchRequest(lam0, 0))
    start = launch.lam0.value
    low, high = _range(formulas, p, start, between)
    mass = dict(zip(formulas.parameters, p, strict=True))["m"].value
    needs = _Needs(bind(formulas, p, launch), mass, start, contact)
    where, least = _largest(needs.least, low, high)
    least = max(least, 0.0)
    narrow, most = _largest(lambda lam: -needs.most(lam), low, high)
    if -most < least - ROUNDING * abs(least):
        ask = "none" if -most < 0.0 else f"at most {sqrt(-most)!r}"
        raise SolutionError(
            f"least_speed: no speed keeps contact {contact} the track for {formulas.parameter} in [{low!r}, {high!r}]: "
            f"at {where!r} it must be at least {sqrt(least)!r} at launch, at {narrow!r} {ask}; take a shorter range"
        )
    return sqrt(least)


def _range(formulas: Formulas, p: Any, start: float, between: tuple[Any, Any] | None) -> tuple[float, float]:
    low, high, period = formulas.domain(p).numbers[:3]
    if between is not None:
        ends = sorted(read_number(end, where="between").value for end in between)
        if not max(low, ends[0]) <= start <= min(high, ends[1]) or ends[0] < low or ends[1] > high:
            known = f"[{low!r}, {high!r}]"
            raise LaunchError(f"between: must be a range in {known} that holds lam0 = {start!r}, got {ends}")
        return ends[0], ends[1]
    if period:
        return start, start + period
    if not (isfinite(low) and isfinite(high)):
        raise LaunchError(f"between: {formulas.name} has no ends; give the range of {formulas.parameter} to be passed")
    return low, high


class _Needs:
    """What v0**2 must be at least, and at most, for the sake of one place."""

    def __init__(self, functions: BoundFunctions, mass: float, start: float, contact: str) -> None:
        self._functions, self._start = functions, start
        self._side = {"above": 1.0, "below": -1.0, "bilateral": 0.0}[contact]
        self._mass = mass

    def _terms(self, lam: Array) -> tuple[Array, Array, Array]:
        """What is lost in climbing, and curvature and n0 as seen from the side that can push."""
        f = self._functions
        climbed = -speed_squared_at(f.addresses, f.p, self._start, 0.0, 0.0, lam, lam - self._start)
        _, _, _, kappa, load = path_and_force_at(f.addresses, f.p, lam, np.zeros_like(lam))
        return climbed, self._side * kappa, self._side * load / self._mass

    def least(self, lam: Array) -> Array:
        """So that V**2 >= 0, and N >= 0 where the track bends towards the body."""
        climbed, kappa, load = self._terms(lam)
        inwards = kappa > 0.0
        return climbed + np.where(inwards & (load < 0.0), -load / np.where(inwards, kappa, 1.0), 0.0)

    def most(self, lam: Array) -> Array:
        """So that N >= 0 where the track bends away from the body."""
        climbed, kappa, load = self._terms(lam)
        away = kappa < 0.0
        bound = climbed + load / np.where(away, -kappa, 1.0)
        straight = np.where((kappa == 0.0) & (load < 0.0), -np.inf, np.inf)
        out: Array = np.where(away, bound, straight)
        return out


def _largest(function: Callable[[Array], Array], low: float, high: float) -> tuple[float, float]:
    """Where a function is largest in a range, and its value there."""
    first = next(grid_peaks(function, low, high, LOOKS + 1))
    *_, peak = grid_peaks(function, first.low, first.high, ZOOM, ROUNDS)
    return peak.place, peak.value
