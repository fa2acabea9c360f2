"""The least launch speed with which a body passes a range of a track without losing contact."""

from collections.abc import Callable
from functools import lru_cache
from math import isfinite, sqrt
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.arguments import compiled_model, several, short
from gqm_sym.design.limits import end_slopes
from gqm_sym.errors import InputError, LaunchError, ParameterError, SolutionError
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.recording import Recorder
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.evaluation import values
from gqm_sym.runtime.gradients.formula_orbit import source_of, variables_of
from gqm_sym.runtime.gradients.programs import Program, Source, assemble
from gqm_sym.runtime.gradients.quantities import selected
from gqm_sym.runtime.launch.formulas import Formulas
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.request import LaunchRequest, check_contact, read_launch
from gqm_sym.runtime.launch.rider import FIELDS, STANDARD_GRAVITY, rider_loads
from gqm_sym.runtime.launch.speed import path_and_force_at, speed_squared_at
from gqm_sym.runtime.motion.parts.peaks import grid_peaks

# The number of steps of the first grid over the range; a maximum narrower than one step may be missed.
FIRST_STEPS = 4096

# The number of points of each finer grid around the maximum, and the number of such grids: each step is a 16th of the
# one before, so that the last is 2**-48 of the first.
FINE_POINTS, FINE_GRIDS = 33, 12

# The number of Newton steps to the place of a maximum, of which a grid gives half of the digits only.
NEWTON_STEPS = 3

# The V**2 at which loads on riders are read to find their increase with V**2, in m**2/s**2.
LARGE_V2 = 2.0**20

# Contact counts as kept if it is lost by less than this, relative to v0**2, because so small an amount is rounding.
ROUNDING = 1e-13


def least_speed(
    module: ModuleType,
    lam0: Any,
    *,
    between: tuple[Any, Any] | None = None,
    contact: str = "above",
    **parameters: Any,
) -> float:
    """Return the least speed at ``lam0`` with which a body passes a range of a track and stays in contact throughout.

    Parameters
    ----------
    module : module
        A generated module of a model without friction, drag or resistance.
    lam0 : number
        Launch place (a value of the curve parameter), inside the range.
    between : pair of numbers, optional
        Ends of the range, as values of the curve parameter. Without it the range is the whole curve.
    contact : {"above", "below", "bilateral"}
        The side of the track on which the body runs, as for ``module.solve``. A bilateral track holds the body on both
        sides, so that only V**2 >= 0 is required. On a space curve "above" is the side to which the upward direction
        of its riders points, so that its roll must be declared.
    parameters
        Run-time parameters, as for ``module.solve``.

    Returns
    -------
    float
        The speed in m/s. At exactly this speed N (or V**2) vanishes at one place of the range, so launch slightly
        faster. The speed is accurate to rounding of the function whose maximum it is.

    Raises
    ------
    LaunchError
        If ``lam0``, ``between`` or ``contact`` is not valid.
    ParameterError
        If a parameter is unknown or has no value.
    SolutionError
        If the model loses energy, or if no speed keeps contact: where the track curves away from the body, contact
        also limits the speed from above.

    Notes
    -----
    Where V**2 = v0**2 - h(lam), V**2 >= 0 requires v0**2 >= h. With N/m = kappa*V**2 + n0, contact above also requires
    v0**2 >= h - n0/kappa where the track curves towards the body and the static load n0 is negative, and
    v0**2 <= h - n0/kappa where it curves away.

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
    found = _found(module, lam0, between, contact, parameters)
    return sqrt(max(found.bound, 0.0))


def least_speed_gradient(
    module: ModuleType,
    lam0: Any,
    wrt: Any = None,
    *,
    between: tuple[Any, Any] | None = None,
    contact: str = "above",
    **parameters: Any,
) -> dict[str, float]:
    """Return the derivatives of the least launch speed with respect to the launch place and run-time parameters.

    Parameters
    ----------
    module, lam0, between, contact, parameters
        As for `least_speed`.
    wrt : str or sequence of str, optional
        The names with respect to which derivatives are taken: run-time parameters and "lam0"; by default all of them.

    Returns
    -------
    dict
        A float for each name. If any speed suffices, the least speed is 0 and so are its derivatives.

    Raises
    ------
    InputError
        If there is no such parameter, or as `least_speed`.
    SolutionError
        If the curve has no formulas, or as `least_speed`.

    Notes
    -----
    One place of the range decides the least speed. If it is inside the range, the derivative is that of its bound at
    this place, because the bound is largest there (envelope theorem); an end of the curve moves.

    Examples
    --------
    The speed ``sqrt(5*g*L)`` of a loop:

    >>> import tempfile
    >>> import gqm_sym as gqm
    >>> loop = gqm.derive(gqm.families.circle(), gqm.Gravity())
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     circle = gqm.build(loop, name="loop", folder=folder)
    >>> round(least_speed_gradient(circle, 0, "L", L=1, g=10)["L"], 12)
    3.535533905933
    """
    found = _found(module, lam0, between, contact, parameters)
    formulas = found.problem.formulas
    rows = selected(formulas.parameters, (*formulas.parameters, "lam0") if wrt is None else wrt)
    if "v0" in rows:
        raise InputError("wrt: the least speed does not depend on v0")
    if not found.bound > 0.0:
        return dict.fromkeys(rows, 0.0)
    slopes = found.slopes() / (2.0 * sqrt(found.bound))
    return {name: float(slopes[row]) for name, row in rows.items()}


@lru_cache(maxsize=64)
def bound_program(source: Source, *, has_load: bool) -> Program:
    """Return the program of the least v0**2 with which a body passes a place, with its first and second derivative with
    respect to the place, and those with respect to all variables.

    ``has_load`` is for places where contact decides, and not V**2 >= 0.
    """
    op = Recorder(source.variables)
    formulas, p, lam0 = source.formulas, op.values[: source.parameters], op.values[source.parameters]
    here, launched = (formulas.effective_potential(op, lam, p) for lam in (op.place, lam0))
    bound = 2 * op.number(here - launched)
    if has_load:
        bound = bound - formulas.static_normal_load(op, op.place, p) / op.number(formulas.kappa(op, op.place, p))
    slope, *partials = gradient(op, bound, [op.place, *op.values])
    return assemble(op, [bound, slope, *gradient(op, slope, [op.place]), *partials])


class _Found(NamedTuple):
    """The place that decides the least speed.

    Attributes
    ----------
    problem : Problem
        The launch.
    bounds : _SpeedBounds
        The bounds on v0**2.
    place, bound : float
        The place, and the bound on v0**2 there; negative if any speed suffices.
    is_end, is_end_of_curve : bool
        Whether the place is an end of the range, and whether that is the whole curve.
    """

    problem: Problem
    bounds: "_SpeedBounds"
    place: float
    bound: float
    is_end: bool
    is_end_of_curve: bool

    def slopes(self) -> Array:
        """Return the derivatives of the bound with respect to all variables."""
        problem, formulas = self.problem, self.problem.formulas
        by_load = self.bounds.by_load(self.place)
        if by_load and not formulas.signed:
            raise SolutionError("gradients: there are none of the load on a rider, which decides the least speed here")
        source, inputs = source_of(formulas), variables_of(problem)
        program = bound_program(source, has_load=by_load)
        place, moved = np.array([self.place]), np.zeros(source.variables)
        if self.is_end and self.is_end_of_curve:
            ends = end_slopes(formulas, problem.p, list(formulas.parameters))
            moved[: source.parameters] = ends[int(self.place == problem.high)]
        for _ in range(0 if self.is_end else NEWTON_STEPS):
            _, slope, bend, *_ = values(program, inputs, place)[:, 0]
            place = place - np.divide(slope, bend, where=bend < 0.0, out=np.zeros(1))
        _, slope, _, *partials = values(program, inputs, place)[:, 0, 0]
        found: Array = np.array(partials) + slope * moved
        return found


def _found(
    module: ModuleType, lam0: Any, between: tuple[Any, Any] | None, contact: str, parameters: dict[str, Any]
) -> _Found:
    """Find the place that decides the least speed, and check that this speed keeps contact."""
    formulas: Formulas = compiled_model(module, where="least_speed")
    if formulas.dissipation is not None:
        raise SolutionError(
            f"least_speed: {formulas.name} loses energy, so that V**2 depends on the path taken; use module.solve"
        )
    check_contact(formulas, contact)
    for name in parameters:
        if name not in formulas.parameters:
            known = ", ".join(formulas.parameters)
            raise ParameterError(f"{name}: is not a parameter of {formulas.name}; its parameters are {known}")
    p = formulas.numbers(tuple((dict(formulas.parameters) | parameters).values()))
    launch = read_launch(formulas, p, LaunchRequest(lam0, 0))
    start = launch.lam0.value
    low, high = _range(formulas, p, start, between)
    mass = dict(zip(formulas.parameters, p, strict=True))["m"].value
    problem = Problem(formulas, launch, p, formulas.domain(p))
    bounds = (_SpeedBounds if formulas.signed else _BankedSpeedBounds)(problem, mass, start, contact)
    slow_place, lower = _maximum(bounds.lower, low, high)
    least = max(lower, 0.0)
    fast_place, negative_upper = _maximum(lambda lam: -bounds.upper(lam), low, high)
    upper = -negative_upper
    if upper < least - ROUNDING * least:
        limit = "no speed is low enough" if upper < 0.0 else f"it must be at most {sqrt(upper)!r}"
        raise SolutionError(
            f"least_speed: no speed keeps contact {contact} the track for {formulas.parameter} in [{low!r}, {high!r}]: "
            f"because of {slow_place!r} the launch speed must be at least {sqrt(least)!r}, because of {fast_place!r} "
            f"{limit}; take a shorter range"
        )
    return _Found(problem, bounds, slow_place, lower, slow_place in (low, high) and not problem.period, between is None)


def _range(formulas: Formulas, p: Any, start: float, between: tuple[Any, Any] | None) -> tuple[float, float]:
    low, high, period = formulas.domain(p).numbers[:3]
    if between is not None:
        pair = several(between, where="between", what="(low, high)")
        if len(pair) != 2:
            raise LaunchError(f"between: must be (low, high), got {short(between)}")
        ends = sorted(read_number(end, where="between").value for end in pair)
        if not max(low, ends[0]) <= start <= min(high, ends[1]) or ends[0] < low or ends[1] > high:
            known = f"[{low!r}, {high!r}]"
            raise LaunchError(f"between: must be a range within {known} that contains lam0 = {start!r}, got {ends}")
        return ends[0], ends[1]
    if period:
        return start, start + period
    if not (isfinite(low) and isfinite(high)):
        raise LaunchError(
            f"between: the curve of {formulas.name} extends to infinity; give a range of {formulas.parameter}"
        )
    return low, high


class _SpeedBounds:
    """The lower and upper bounds on v0**2 that contact at each place imposes."""

    def __init__(self, problem: Problem, mass: float, start: float, contact: str) -> None:
        self._problem, self._start = problem, start
        self._side = {"above": 1.0, "below": -1.0, "bilateral": 0.0}[contact]
        self._mass = mass

    def _terms(self, lam: Array) -> tuple[Array, Array, Array]:
        """Return the loss of V**2 since launch, and curvature and static load n0 with the sign of the contact side."""
        f = self._problem.functions
        loss = -speed_squared_at(f.addresses, f.p, self._start, 0.0, 0.0, lam, lam - self._start)
        kappa, load = self._force(lam)
        return loss, self._side * kappa, self._side * load

    def _force(self, lam: Array) -> tuple[Array, Array]:
        """Return the increase of N/m per V**2, and N/m at rest."""
        f = self._problem.functions
        _, _, _, kappa, load = path_and_force_at(f.addresses, f.p, lam, np.zeros_like(lam))
        return kappa, load / self._mass

    def lower(self, lam: Array) -> Array:
        """Return the bound below which V**2 < 0, or N < 0 where the track curves towards the body."""
        loss, kappa, load = self._terms(lam)
        inwards = kappa > 0.0
        return loss + np.where(inwards & (load < 0.0), -load / np.where(inwards, kappa, 1.0), 0.0)

    def by_load(self, place: float) -> bool:
        """Return whether contact decides the lower bound at a place, and not V**2 >= 0."""
        _, kappa, load = self._terms(np.array([place]))
        return bool(kappa[0] > 0.0 and load[0] < 0.0)

    def upper(self, lam: Array) -> Array:
        """Return the bound above which N < 0 where the track curves away from the body; infinite elsewhere."""
        loss, kappa, load = self._terms(lam)
        away = kappa < 0.0
        bound = loss + load / np.where(away, -kappa, 1.0)
        straight = np.where((kappa == 0.0) & (load < 0.0), -np.inf, np.inf)
        out: Array = np.where(away, bound, straight)
        return out


class _BankedSpeedBounds(_SpeedBounds):
    """The same for a space curve, where N is the component of the contact force along the upward direction of riders,
    or any component on a track that holds the body from all sides.
    """

    def _force(self, lam: Array) -> tuple[Array, Array]:
        if not self._side:
            return np.zeros_like(lam), np.zeros_like(lam)
        # At a large V**2 the difference of both loads has all digits.
        slow, fast = (self._upward_load(lam, w) for w in (0.0, LARGE_V2))
        return (fast - slow) / LARGE_V2, slow

    def _upward_load(self, lam: Array, v2: float) -> Array:
        """Return N/m along the upward direction of riders, given V**2."""
        p, still = self._problem.functions.p, np.zeros_like(lam)
        rows = rider_loads(self._problem.formulas, p, lam, np.full_like(lam, v2), still, still)
        load: Array = STANDARD_GRAVITY * rows[FIELDS.index("n_vertical")]
        return load


def _maximum(function: Callable[[Array], Array], low: float, high: float) -> tuple[float, float]:
    """Return the place of the maximum of a function in a range, and the maximum."""
    first = next(grid_peaks(function, low, high, FIRST_STEPS + 1))
    *_, peak = grid_peaks(function, first.low, first.high, FINE_POINTS, FINE_GRIDS)
    return peak.place, peak.value
