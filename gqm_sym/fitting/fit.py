"""Launches and run-time parameters fitted to measurements by least squares, with the exact derivatives of motions."""

from collections.abc import Mapping
from itertools import compress
from math import inf, isfinite, nan
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.arguments import compiled_model, short, unknown_argument
from gqm_sym.errors import GQMError, InputError, SolutionError
from gqm_sym.fitting.data import Measurements, read_measurements
from gqm_sym.fitting.least_squares import least_squares_between
from gqm_sym.fitting.quotients import central_differences, usual_sizes
from gqm_sym.fitting.result import Fit
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.model import CompiledModel
from gqm_sym.runtime.motion.motion import end_of_legs

# The step of a difference quotient, as a share of the parameter, for motions without gradients.
STEP = 1e-6

# If a direction in the space of parameters changes the measurements less than this, relative to the direction that
# changes them most, the data do not determine it. The second number is for difference quotients.
RANK_TOLERANCE, RANK_TOLERANCE_OF_DIFFERENCES = 1e-9, 1e-6

# A parameter belongs to such a direction if its share of it is more than this.
MIN_SHARE = 1e-3

# Motions that lose energy are followed further than the last measured time by this factor, and not to their end, which
# may be many swings later.
HORIZON_FACTOR = 1.5

# Arguments of a launch that may be free, and those that select a launch.
LAUNCH, CHOICES = ("lam0", "v0"), ("direction", "contact", "point")


class Free(NamedTuple):
    """The unknowns: names, first guesses and limits, in the same order."""

    names: tuple[str, ...]
    start: Array
    low: Array
    high: Array


def fit(module: ModuleType, data: Any, free: Mapping[str, Any], **fixed: Any) -> Fit:
    """Fit parameters and launch of a motion to measurements by least squares.

    Parameters
    ----------
    module : module
        A generated module.
    data : mapping or DataFrame
        One of: ``t`` in s with one or more of ``lam``, ``s``, ``x``, ``z`` and ``v``, in space also ``y``, at these
        times; ``period`` or ``half_period``, with columns of launch arguments or run-time parameters where these
        differ; or ``passages``, the times of consecutive passages through ``place`` (a value of the curve parameter),
        the first passage first.
        And ``sigma``, their standard deviation: a number, a column, or a mapping with one for each quantity.
    free : mapping
        The unknowns, which are run-time parameters, "lam0" or "v0", each with a first guess, limits ``(low, high)``,
        all three ``(low, guess, high)``, either limit None where there is none, or None for the value that is given by
        keyword or the model's default. With two limits and no guess it begins halfway between them.
    fixed
        All other arguments of the launch and the parameters, as for ``module.solve``.

    Returns
    -------
    Fit
        Estimates, standard deviations, covariance, residuals, and the names that the data cannot distinguish.

    Raises
    ------
    InputError
        If a name is unknown, data are not finite or too few, or limits exclude the first guess.
    SolutionError
        If there is no motion at the first guess.

    Notes
    -----
    Derivatives are those of ``motion.sensitivity`` and of sweeps with ``gradient``, which are exact to rounding, or
    difference quotients of solved motions if there are no such derivatives. Without ``sigma`` all measurements have the
    same unknown standard deviation, which is estimated from the residuals. An estimate on a limit is held there, and
    the deviations of the others are those for this value. First guesses for long series of positions must be so near
    that the fitted motion does not slip by a swing.
    """
    model: CompiledModel = compiled_model(module, where="fit")
    unknown = _free(model, free, fixed)
    known = [*LAUNCH, *CHOICES, *model.parameters]
    for name in fixed:
        if name not in known:
            raise InputError(unknown_argument("fit", name, known))
    measured = read_measurements(data, units_of(model), model.units.get(model.parameter))
    for name in measured.columns:
        if name in unknown.names:
            raise InputError(f"free: {name} is a column of the data, and so it is known")
    if "y" in measured.values and model.path_in_space is None:
        raise InputError("data: y: this curve lies in the plane of x and z; leave the column out")
    size = sum(values.size for values in measured.values.values())
    if size < len(unknown.names):
        raise InputError(f"data: {size} measurements cannot determine {len(unknown.names)} numbers; free fewer of them")
    residuals = Residuals(module, measured, unknown, fixed)
    residuals.predicted(unknown.start)  # the error of a refused launch gives the reason
    with np.errstate(over="ignore", invalid="ignore"):
        if not np.isfinite(residuals(unknown.start)).all():
            raise InputError("sigma: is so small that the first guess is infinitely many deviations away")
    x, held = least_squares_between(residuals, residuals.jacobian, unknown.start, unknown.low, unknown.high)
    return _result(residuals, x, held)


def units_of(model: CompiledModel) -> dict[str, str | None]:
    """Return the units of all numbers that may be unknown or given."""
    own = model.units.get(model.parameter)
    return {"lam0": own, "v0": "m/s", **{name: model.units.get(name) for name in model.parameters}}


def _free(model: CompiledModel, free: Mapping[str, Any], fixed: Mapping[str, Any]) -> Free:
    """Return names, first guesses and limits of the unknowns."""
    if not isinstance(free, Mapping) or not free:
        raise InputError(f"free: must be a mapping from names to first guesses, as {{'L': 1.2}}, got {short(free)}")
    names = (*LAUNCH, *model.parameters)
    rows = []
    for name, given in free.items():
        if name not in names:
            raise InputError(unknown_argument("free", str(name), names))
        if given is not None and name in fixed:
            raise InputError(f"free: {name} has a first guess here and a value by keyword; give one of them")
        parts = list(given) if isinstance(given, tuple | list) else [given]
        unit = units_of(model)[name]
        numbers = [None if p is None else read_number(p, where=f"free: {name}", unit=unit).value for p in parts]
        if not 1 <= len(numbers) <= 3:
            raise InputError(
                f"free: {name}: must be a guess, (low, high), None, or (low, guess, high), each of which may be None, "
                f"got {given!r}"
            )
        low, *guess, high = numbers if len(numbers) > 1 else (None, *numbers, None)
        start = guess[0] if guess else None
        if start is None and low is not None and high is not None:
            start = 0.5 * (low + high)
        low, high = -inf if low is None else low, inf if high is None else high
        if start is None:
            value = fixed.get(name, 0 if name == "v0" else model.parameters.get(name))
            if value is None:
                raise InputError(f"free: {name}: has no value to begin with; give a first guess")
            start = read_number(value, where=name, unit=unit).value
        if not low < high or not low <= start <= high:
            raise InputError(f"free: {name}: the first guess {start!r} must lie between {low!r} and {high!r}")
        rows.append((start, low, high))
    columns = np.array(rows, dtype=np.float64).T
    return Free(tuple(free), *columns)


class Residuals:
    """The differences between a motion and its measurements, in standard deviations, and their derivatives.

    Parameters
    ----------
    module : module
        The generated module.
    measured : Measurements
        The measurements.
    free : Free
        The unknowns.
    fixed : mapping
        All other arguments of ``module.solve``.
    """

    def __init__(self, module: ModuleType, measured: Measurements, free: Free, fixed: Mapping[str, Any]) -> None:
        self.module, self.measured, self.free = module, measured, free
        self.fixed = {name: value for name, value in fixed.items() if name not in free.names}
        self.exact = True
        self.values = np.concatenate([*measured.values.values()])
        sigma = measured.sigma
        self.sigma = np.ones(self.values.size) if sigma is None else np.concatenate([*sigma.values()])
        self._loses = module.MODEL.dissipation is not None
        times = self.values if measured.place is not None else measured.t
        self._last = 0.0 if times is None else float(times.max())
        self._solved: tuple[Array, Any] | None = None

    def arguments(self, x: Array) -> dict[str, Any]:
        """Return all arguments of ``module.solve`` for values of the unknowns."""
        return {**self.fixed, **dict(zip(self.free.names, x.tolist(), strict=True))}

    def motion(self, x: Array) -> Any:
        """Return the motion for values of the unknowns, which serves for residuals and for their derivatives."""
        if self._solved is not None and np.array_equal(self._solved[0], x):
            return self._solved[1]
        arguments = self.arguments(x)
        if self._loses and self._last > 0.0:
            arguments["t_max"] = HORIZON_FACTOR * self._last
        self._solved = x.copy(), self.module.solve(**arguments)
        return self._solved[1]

    def __call__(self, x: Array) -> Array:
        """Return the residuals; NaN if there is no such motion, so that the solver takes a shorter step."""
        try:
            residuals: Array = (self.predicted(x) - self.values) / self.sigma
            return residuals
        except GQMError:
            return np.full(self.values.size, nan)

    def predicted(self, x: Array) -> Array:
        """Return the measurements without errors."""
        names = tuple(self.measured.values)
        if self.measured.t is not None:
            motion = self.motion(x)
            t = self.measured.t
            if names == ("lam",):
                return np.asarray(motion.lam(_until_rest(motion, t)))
            state = motion.state(_until_rest(motion, t))
            return np.concatenate([getattr(state, name) for name in names])
        if self.measured.place is not None:
            return _passages(self.motion(x), self.measured.place)
        shape = next(iter(self.measured.values.values())).shape
        return np.concatenate([np.broadcast_to(self._swept(name, x).values, shape) for name in names])

    def _swept(self, name: str, x: Array, **options: Any) -> Any:
        """Return a sweep over the arguments that differ from one measurement to the next."""
        swept = self.module.sweep(name, **{"lam0": 0.0, **self.arguments(x), **self.measured.columns}, **options)
        if np.any(swept.status):
            raise SolutionError(f"{name}: {'; '.join(swept.status_counts())}")
        return swept

    def jacobian(self, x: Array) -> Array:
        """Return the derivatives of the residuals, a column for each unknown."""
        found = None
        if self.exact:
            try:
                with np.errstate(divide="ignore", over="ignore", invalid="ignore"):  # looked at below
                    found = self._derivatives(x)
            except SolutionError:
                self.exact = False
        jacobian: Array = (self._differences(x) if found is None else found) / self.sigma[:, None]
        if not np.isfinite(jacobian).all():
            raise SolutionError(
                f"fit: the measurements have no finite derivatives at {short(x.tolist())}; begin at other first guesses"
            )
        return jacobian

    def _derivatives(self, x: Array) -> Array:
        names, wrt = tuple(self.measured.values), self.free.names
        if self.measured.t is not None:
            motion = self.motion(x)
            t = _until_rest(motion, self.measured.t)
            if names == ("lam",):
                return np.asarray(motion.place_changes(t, wrt)).T
            found, moves = motion.sensitivity(t, wrt=wrt), {"v": t == self.measured.t}
            return np.concatenate([(getattr(found, name) * moves.get(name, 1.0)).T for name in names])
        if self.measured.place is not None:
            motion = self.motion(x)
            times = _passages(motion, self.measured.place)
            # A change that moves the body forwards lets it pass the place earlier.
            sooner: Array = motion.place_changes(times, wrt) / _rates(motion, times)
            return -sooner.T
        shape = (*next(iter(self.measured.values.values())).shape, len(wrt))
        return np.concatenate([np.broadcast_to(self._swept(name, x, gradient=wrt).gradient, shape) for name in names])

    def _differences(self, x: Array) -> Array:
        """Return the derivatives by difference quotients."""
        free = self.free
        steps = STEP * np.maximum(np.abs(x), 1e-3 * usual_sizes(free.start, free.low, free.high))
        return central_differences(self.predicted, x, steps, free.low, free.high)


def _until_rest(motion: Any, t: Array) -> Array:
    """Return times, with those after the body has come to rest replaced by the time of rest, because it stays there."""
    end = end_of_legs(motion) if motion.kind == "dissipative" else inf
    return np.minimum(t, end) if isfinite(end) and motion.legs[-1].end == "rest" else t


def _rates(motion: Any, t: Array) -> Array:
    """Return the rate of change of the curve parameter at given times."""
    state, f = motion.state(t), motion.problem.functions
    rates: Array = state.v / path_and_force_at(f.addresses, f.p, state.lam, state.v2)[2]
    return rates


def _passages(motion: Any, places: Array) -> Array:
    """Return the times of consecutive passages through places after the launch, the k-th one through the k-th place."""
    repeats = motion.kind in ("libration", "circulation")
    period, lap = (motion.period, motion.problem.period) if repeats else (0.0, 0.0)
    legs = [leg for leg in motion.legs if leg.t_end > leg.t_start]
    times: list[float] = []
    for turn in range(places.size + 1 if repeats else 1):
        for leg in legs:
            while len(times) < places.size:
                t = _passage(motion, leg, places[len(times)], lap)
                t = nan if t is None else t + turn * period
                if not t > (times[-1] if times else 0.0):
                    break
                times.append(t)
    if len(times) < places.size:
        raise SolutionError(f"passages: the body passes only {len(times)} times, and {places.size} were measured")
    return np.array(times)


def _passage(motion: Any, leg: Any, place: float, lap: float) -> float | None:
    """Return the time at which a body is at a place on a leg, the end of which belongs to the next leg."""
    from scipy.optimize import brentq

    low, high = sorted((leg.lam_start, leg.lam_end))
    if lap and motion.kind == "circulation":
        place += lap * np.ceil((low - place) / lap)
    if not low <= place <= high or place == leg.lam_end:
        return None
    if place == leg.lam_start:
        return float(leg.t_start)
    return float(brentq(lambda t: float(motion.lam(t)) - place, leg.t_start, leg.t_end, xtol=1e-300, rtol=1e-15))


def _result(residuals: Residuals, x: Array, held: NDArray[np.bool_]) -> Fit:
    """Return the description of a fit, in which some of the unknowns are held at limits."""
    names, measured = residuals.free.names, residuals.measured
    off, jacobian, moving = residuals(x), residuals.jacobian(x)[:, ~held], tuple(compress(names, ~held))
    size = np.linalg.norm(jacobian, axis=0)
    scale = np.where(size > 0.0, size, 1.0)
    _, values, rows = np.linalg.svd(jacobian / scale, full_matrices=False)
    tolerance = RANK_TOLERANCE if residuals.exact else RANK_TOLERANCE_OF_DIFFERENCES
    rank = int(np.count_nonzero(values > tolerance * values.max(initial=0.0)))
    blind = np.abs(rows[rank:]) > MIN_SHARE
    free = max(residuals.values.size - rank, 0)
    chi2 = float(off @ off)
    variance = 1.0 if measured.sigma is not None else (chi2 / free if free else nan)
    kept = rows[:rank].T / values[:rank]
    moved = variance * (kept @ kept.T) / np.outer(scale, scale)
    for row in blind:
        moved[np.ix_(row, row)] = inf
    covariance = np.zeros((x.size, x.size))
    covariance[np.ix_(~held, ~held)] = moved
    split = np.split(-off * residuals.sigma, np.cumsum([v.size for v in measured.values.values()])[:-1])
    return Fit(
        names=names,
        estimates=dict(zip(names, x.tolist(), strict=True)),
        std=dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True)),
        covariance=covariance,
        residuals=dict(zip(measured.values, split, strict=True)),
        chi2=chi2,
        degrees_of_freedom=free,
        rank=rank,
        unidentified=tuple(tuple(compress(moving, row)) for row in blind),
        at_limits=tuple(compress(names, held)),
        arguments=residuals.arguments(x),
        measured=measured,
    )
