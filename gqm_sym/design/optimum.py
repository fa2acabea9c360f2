"""Tracks that minimise a quantity of the motion, under limits on load and shape."""

import tempfile
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from math import inf, isfinite, nan
from typing import Any

import numpy as np

from gqm_sym.arguments import checked, mapping, one_of, short, unknown_argument
from gqm_sym.building import build
from gqm_sym.declare.curve import Curve
from gqm_sym.derivation import derive
from gqm_sym.design.charted_limits import along_chart, along_shaped_chart, start_slopes
from gqm_sym.design.limits import (
    Limit,
    Limited,
    along_formulas,
    along_spline,
    margins_of,
    places_between,
    read_bounds,
    read_limits,
    slopes_of,
)
from gqm_sym.design.moving_points import lossy_limits, problem_of, slopes_by_heights, source_along
from gqm_sym.design.shape import SplineChanges, time_gradient
from gqm_sym.errors import DeclarationError, GQMError, NoisyPointsWarning, SolutionError
from gqm_sym.fitting.least_squares import power_of_two
from gqm_sym.fitting.quotients import central_differences, usual_sizes
from gqm_sym.kernels import Kernel
from gqm_sym.parameters import exact_value
from gqm_sym.runtime.charts.sampled import Sampled
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.interface import ExactFormulas, ExactLaw, ExactPotential
from gqm_sym.runtime.launch.request import LaunchRequest, read_launch
from gqm_sym.runtime.model import CompiledModel
from gqm_sym.runtime.motion.motion import end_of_legs
from gqm_sym.runtime.sweep.quantities import QUANTITIES

# The largest number of steps of the optimiser, and the share by which a limit may be exceeded.
MAX_STEPS, MAX_EXCESS = 200, 1e-6

# A body whose motion ends nearer to the end of the track than this share of it has arrived there.
NEAR_END = 1e-9

# The value, in units of that of the first guess, that is used for a track on which the motion does not have the
# quantity.
PENALTY = 1e3


@checked("design.minimise", also=("lam0", "v0", "direction", "lam", "contact"))
def minimise(
    quantity: str,
    track: Any,
    force: Kernel,
    *,
    free: Any,
    limits: Mapping[str, tuple[Any, Any]] | None = None,
    between: tuple[Any, Any] | None = None,
    **given: Any,
) -> Curve:
    """Return the track of a family, or through movable points, that minimises a quantity of the motion.

    Parameters
    ----------
    quantity : str
        A quantity of ``module.sweep`` that is one number, such as "time_at", "period" or "normal_force_max". The place
        of "time_at" is the argument ``lam``, or the end of the track.
    track : Curve or (n, 2) array
        A curve with run-time parameters, or points of which some may move up and down; the track is then the spline
        through them (`Curve.sampled`), in arc length.
    force : Kernel
        As for `derive`.
    free : mapping or sequence
        For a curve, the parameters to be found, each with ``(low, high)`` or ``(low, guess, high)``, in which low or
        high may be None. For points, the indices of those that may move, counted from 0, or a mapping from these to
        limits of their heights.
    limits : mapping, optional
        ``(low, high)``, either of them None, for "height" in m, "slope" (dz/dx), "curvature" in 1/m or "normal_force"
        in N. They are imposed at 201 places along the track.
    between : pair of numbers, optional
        Ends of the part of a curve on which limits are imposed, as values of its parameter; by default the whole
        domain.
    given
        Launch (``lam0``, ``v0``, ``direction``), ``contact``, ``lam`` and all other run-time parameters.

    Returns
    -------
    Curve
        The curve with the parameters found as its defaults, or the track through the points.

    Raises
    ------
    DeclarationError
        If limits contradict each other, or a name is unknown.
    SolutionError
        If no track meets all limits, or the motion does not have the quantity at the first guess.

    Notes
    -----
    The optimiser is SciPy's SLSQP, with exact derivatives if there are such, and difference quotients otherwise. For a
    curve with parameters they are those of ``motion.gradient`` and of all limits. For a track through points they are
    those of all limits and of the solved motion by all its points together. The result is a local minimum.

    Examples
    --------
    The quickest plane to a wall 1 m away descends at 45 degrees:

    >>> import gqm_sym as gqm
    >>> plane = gqm.Curve.graph("-k*x", domain=(0, 1), parameters={"k": 1})
    >>> best = minimise("time_at", plane, gqm.Gravity(), free={"k": (0.1, 0.5, 4)}, lam0=0)
    >>> round(dict(best.defaults)["k"], 6)
    1.0
    """
    from scipy.optimize import minimize

    where = "design.minimise"
    asked = one_of(quantity, tuple(QUANTITIES), where=f"{where}: quantity")
    if asked == "turning_points":
        raise DeclarationError(f"{where}: quantity: turning_points are two numbers; ask for one number")
    held = read_limits(mapping(limits, where=f"{where}: limits", example="{'slope': (-1, 1)}"), where)
    kind = _Family if isinstance(track, Curve) else _Points
    with tempfile.TemporaryDirectory(prefix="gqm-") as folder:
        tracks = kind(track, force, free, given, folder)
        first = tracks.answer(asked, tracks.start)
        if not (isfinite(first) and first != 0.0):
            raise SolutionError(f"{where}: the motion at the first guess has no {asked}; begin elsewhere")

        def value(x: Array) -> float:
            found = tracks.answer(asked, x) / first
            return found if isfinite(found) else PENALTY

        def quotients(function: Callable[[Array], Any], x: Array) -> Array:
            steps = tracks.step * np.maximum(np.abs(x), tracks.sizes)
            return central_differences(function, x, steps, tracks.low, tracks.high)

        def slopes(x: Array) -> Array:
            exact = tracks.gradient(asked, x)
            return quotients(value, x) if exact is None else exact / first

        def margins(x: Array) -> Array:
            return np.concatenate(margins_of(held, tracks.limited(x, between)))

        def steepness(x: Array) -> Array:
            def of_one(limit: Limit) -> Array:
                return quotients(lambda y: margins_of([limit], tracks.limited(y, between))[0], x)

            return np.concatenate(slopes_of(held, tracks.limited(x, between), of_one, x.size))

        # SLSQP's first step is that for unknowns near one; in units that are powers of two, nothing is rounded.
        units = power_of_two(tracks.sizes)
        limited = {"type": "ineq", "fun": lambda y: margins(y * units), "jac": lambda y: steepness(y * units) * units}
        found = minimize(
            lambda y: value(y * units),
            tracks.start / units,
            jac=lambda y: slopes(y * units) * units,
            method="SLSQP",
            bounds=list(zip(tracks.low / units, tracks.high / units, strict=True)),
            constraints=[limited] if held else [],
            options={"maxiter": MAX_STEPS, "ftol": tracks.tolerance},
        )
        best = np.asarray(found.x) * units
        _check(held, tracks.limited(best, between) if held else None)
        if found.status == 9:  # SLSQP's code for this
            raise SolutionError(
                f"{where}: {found.message} after {MAX_STEPS} steps; begin nearer to the minimum, or free less"
            )
        return tracks.track(best)


def _check(held: list[Limit], found: Limited | None) -> None:
    """Refuse a result that violates the limits."""
    for limit, margins in zip(held, margins_of(held, found), strict=True):
        if not margins.min() >= -MAX_EXCESS:
            raise SolutionError(
                f"design.minimise: no track was found that meets all limits; at best {limit.name} exceeds "
                f"({limit.low:.6g}, {limit.high:.6g}) by {-margins.min() * limit.scale:.3g}"
                f"{limit.unit}. Begin elsewhere, or allow more"
            )


class _Tracks(ABC):
    """Tracks that differ in some numbers, the unknowns.

    Attributes
    ----------
    start, low, high : (n,) arrays
        First guesses and limits of the unknowns.
    sizes : (n,) array
        The sizes that the unknowns have, in their units.
    step, tolerance : float
        The step of a difference quotient as a share of the size, and the relative change of the quantity at which the
        optimiser ends.
    """

    start: Array
    low: Array
    high: Array
    sizes: Array
    step: float = 1e-5
    tolerance: float = 1e-13

    def __init__(self, track: Any, force: Kernel, free: Any, given: Mapping[str, Any], folder: str) -> None:
        self._read(track, free)
        self._given = dict(given)
        module = build(derive(self._curve, force), name="designed_track", folder=folder)
        self._compiled: CompiledModel = module.MODEL
        known = ("lam0", "v0", "direction", "contact", "lam", *self._compiled.parameters)
        for name in given:
            if name not in known:
                raise DeclarationError(unknown_argument("design.minimise", name, known))

    _curve: Curve

    @abstractmethod
    def _read(self, track: Any, free: Any) -> None:
        """Read the track and the unknowns."""

    @abstractmethod
    def _candidate(self, x: Array) -> tuple[CompiledModel, dict[str, Any]]:
        """Return the compiled model of one track, and its run-time parameters."""

    @abstractmethod
    def track(self, x: Array) -> Curve:
        """Return one track as a declared curve."""

    def gradient(self, quantity: str, x: Array) -> Array | None:
        """Return the exact derivatives of a quantity; None if there are none."""
        return None

    def _launch(self, x: Array) -> tuple[CompiledModel, LaunchRequest, tuple[Any, ...], tuple[float, float]]:
        """Return a model, a launch, run-time parameters, and both ends of the curve."""
        model, own = self._candidate(x)
        given = self._given | own
        parameters = tuple(given.get(name, default) for name, default in model.parameters.items())
        low, high, *_ = model.domain(model.numbers(parameters)).numbers
        start = given.get("lam0", low)
        request = LaunchRequest(
            start, given.get("v0", 0.0), given.get("direction", 1), None, None, given.get("contact", "bilateral")
        )
        return model, request, parameters, (low, high)

    def answer(self, quantity: str, x: Array) -> float:
        """Return the quantity along one track; NaN where it has none."""
        try:
            model, request, parameters, ends = self._launch(x)
            if quantity == "time_at" and "lam" not in self._given:
                return _arrival(model.solve(request, parameters), *ends)
            lam = self._given["lam"] if quantity == "time_at" else None
            return float(np.ravel(model.sweep(quantity, request, parameters, lam=lam, client=None).values)[0])
        except GQMError:
            if x is self.start:
                raise
            return nan

    def limited(self, x: Array, between: Any) -> Limited | None:
        """Return the quantities that may be limited at places along one track; None where there is no motion."""
        try:
            return self._limited(x, between)
        except DeclarationError:
            raise
        except GQMError:
            if x is self.start:
                raise
            return None

    def _limited(self, x: Array, between: Any) -> Limited:
        """Return what `limited` does; with derivatives where they are known."""
        model, request, parameters, ends = self._launch(x)
        return along_chart(model, request, parameters, ends, between)


def _arrival(motion: Any, low: float, high: float) -> float:
    """Return the time at which a body leaves the track at its upper end; NaN if it does not."""
    t_end = end_of_legs(motion)
    ends = isfinite(t_end) and abs(motion.legs[-1].lam_end - high) <= NEAR_END * (high - low)
    return float(t_end) if ends else nan


class _Family(_Tracks):
    """Curves that differ in their run-time parameters."""

    def _read(self, track: Curve, free: Any) -> None:
        self._curve = track
        if not isinstance(free, Mapping) or not free:
            raise DeclarationError(
                "design.minimise: free: must be a mapping from parameters to limits, as in {'a': (0, 1)}, got "
                f"{short(free)}"
            )
        defaults, rows = dict(track.defaults), []
        for name, limits in free.items():
            if name not in defaults:
                raise DeclarationError(unknown_argument("design.minimise: free", str(name), defaults, what="parameter"))
            default = defaults[name]
            guess = None if default is None else float(exact_value(default))
            rows.append(read_bounds(limits, guess, str(name)))
        self._names = tuple(free)
        self.low, self.start, self.high = np.array(rows, dtype=np.float64).T.copy()
        self.sizes = usual_sizes(self.start, self.low, self.high)

    def _candidate(self, x: Array) -> tuple[CompiledModel, dict[str, Any]]:
        return self._compiled, dict(zip(self._names, x.tolist(), strict=True))

    @property
    def _from_end(self) -> bool:
        """Whether the launch is at the lower end of the curve, and moves with it."""
        return "lam0" not in self._given

    def gradient(self, quantity: str, x: Array) -> Array | None:
        """Return the derivatives of a solved motion; the time to the end of the track is that at which it ends."""
        model, request, parameters, _ = self._launch(x)
        lam = self._given.get("lam") if quantity == "time_at" else None
        asked = "t_end" if quantity == "time_at" and lam is None else quantity
        p = model.numbers(parameters)
        moved = start_slopes(model, p, self._names) if self._from_end else np.zeros(len(self._names))
        if moved is None:
            return None
        try:
            found = model.solve(request, parameters).gradient(asked, (*self._names, "lam0"), lam=lam)
        except GQMError:
            return None
        slopes: Array = np.array([found[name] for name in self._names]) + found["lam0"] * moved
        return slopes

    def _limited(self, x: Array, between: Any) -> Limited:
        """Return the quantities along a curve, with their derivatives where they are known."""
        model, request, parameters, _ = self._launch(x)
        if not isinstance(model.exact, ExactFormulas | ExactLaw):
            found = along_shaped_chart(model, request, parameters, self._names, between, from_end=self._from_end)
            return super()._limited(x, between) if found is None else found
        return along_formulas(model, request, parameters, self._names, between, from_end=self._from_end)

    def track(self, x: Array) -> Curve:
        """Return the curve with other defaults."""
        found = dict(zip(self._names, x.tolist(), strict=True))
        return replace(
            self._curve, defaults=tuple((name, found.get(name, value)) for name, value in self._curve.defaults)
        )


class _Points(_Tracks):
    """Splines through points that differ in some of their heights; the lengths of a spline are accurate to 1e-9."""

    step, tolerance = 1e-4, 1e-9

    def _read(self, track: Any, free: Any) -> None:
        self._curve = Curve.sampled(track)
        self._points = np.array([[float(number) for number in row] for row in np.asarray(track).tolist()])
        listed = free if isinstance(free, Iterable) and not isinstance(free, str) else ()
        self._moved = [int(number) if isinstance(number, np.integer) else number for number in listed]
        rows = []
        for number in self._moved:
            if not (isinstance(number, int) and 0 <= number < len(self._points)):
                raise DeclarationError(
                    f"design.minimise: free: {short(number)} is none of the points 0 to {len(self._points) - 1}"
                )
            limits = free[number] if isinstance(free, Mapping) else None
            rows.append(read_bounds(limits or (-inf, inf), self._points[number, 1], f"point {number}"))
        if not rows:
            raise DeclarationError("design.minimise: free: no point may move; give their numbers, as in range(1, 9)")
        self.low, self.start, self.high = np.array(rows, dtype=np.float64).T.copy()
        self.sizes = np.full(self.start.size, np.ptp(self._points, axis=0).max())

    def _heights(self, x: Array) -> Array:
        points = self._points.copy()
        points[self._moved, 1] = x
        return points

    def _candidate(self, x: Array) -> tuple[CompiledModel, dict[str, Any]]:
        text = "\n".join(f"{a!r} {b!r}" for a, b in self._heights(x).tolist())
        return replace(self._compiled, chart=Sampled(text, keeps_all=True)), {}

    def gradient(self, quantity: str, x: Array) -> Array | None:
        """Return the derivatives of a quantity by all heights together.

        Those of the time to the end of the track, for a body that loses no energy and is launched from the first point,
        which does not move, are an integral along the track. Others are those of a solved motion.
        """
        model, request, parameters, (low, _) = self._launch(x)
        numbers, points = model.numbers(parameters), self._heights(x)
        launch = read_launch(model, numbers, request)
        if model.rolling_radius:
            return None
        begins = (quantity, launch.direction, launch.lam0.value) == ("time_at", 1, low) and 0 not in self._moved
        if isinstance(model.exact, ExactPotential) and begins and "lam" not in self._given:
            p = tuple(number.value for number in numbers)
            return time_gradient(points, self._moved, model.exact.effective_potential, p, launch.v0.value)
        lam = self._given.get("lam") if quantity == "time_at" else None
        asked = "t_end" if quantity == "time_at" and lam is None else quantity
        try:
            return slopes_by_heights(problem_of(model, request, parameters, points, self._moved), asked, lam)
        except GQMError:
            return None

    def _limited(self, x: Array, between: Any) -> Limited:
        """Return the quantities along a spline, with their derivatives."""
        model, request, parameters, ends = self._launch(x)
        points = self._heights(x)
        if points.shape[1] > 2 or model.rolling_radius:
            return super()._limited(x, between)
        if not isinstance(model.exact, ExactPotential):
            force = model.pass1(request, parameters, places_between(ends, between)).normal_force
            return lossy_limits(problem_of(model, request, parameters, points, self._moved), force, between)
        numbers, changes = model.numbers(parameters), SplineChanges(points, self._moved)
        launch, p = read_launch(model, numbers, request), tuple(number.value for number in numbers)
        return along_spline(changes, source_along(model), (p, launch.lam0.value, launch.v0.value), ends, between)

    def track(self, x: Array) -> Curve:
        """Return the track through the points with these heights. They are not measured, so they have no scatter."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NoisyPointsWarning)
            return Curve.sampled(self._heights(x))
