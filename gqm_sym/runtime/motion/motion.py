"""The motion that a launch begins, as a value that answers questions."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from itertools import pairwise
from math import inf, isfinite
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.errors import InputError, SolutionError
from gqm_sym.export.html import page
from gqm_sym.literals.numbers import read_number, read_numbers
from gqm_sym.runtime.arithmetic.doubledouble import ULP, Pair
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.motion.events import Event, Leg, contact_changes, corners_met, crossings, passages
from gqm_sym.runtime.motion.rolling import slip_times
from gqm_sym.runtime.motion.rows import Rows
from gqm_sym.runtime.motion.trajectory import PhasePoints, TimedSegment, Trajectory, locate


class State(NamedTuple):
    """The state of the body at times; arrays of the times' shape.

    ``s`` is arc length, 0 at launch and growing with the parameter; ``v`` is ds/dt with its sign; ``error`` is what
    ``lam`` can be off by (`Motion.error_bound`).
    """

    t: Any
    lam: Any
    s: Any
    x: Any
    z: Any
    v: Any
    v2: Any
    kappa: Any
    normal_force: Any
    error: Any


class Motion(ABC):
    """A motion along a curve.

    Attributes
    ----------
    kind : str
        "libration", "circulation", "transit", "asymptotic" or "rest" (MATHS, section 6).
    direction : int
        The sign of ds/dt after launch.
    t_end : float
        When the motion ends; infinite if it does not.
    """

    kind: str
    direction: int
    t_end: float = inf

    def __init__(self, problem: Problem, kind: str, direction: int) -> None:
        self.problem = problem
        self.kind = kind
        self.direction = direction
        horizon = problem.launch.t_max
        if horizon is not None:
            self.t_end = horizon.value

    # -- what subclasses say ------------------------------------------------------------------

    @property
    def _joints(self) -> tuple[str, ...]:
        """Ends of pieces that end no leg."""
        return ("",)

    @abstractmethod
    def _course(self, reach: float) -> Trajectory:
        """The pieces of the motion, good for times up to ``reach`` from launch."""

    @abstractmethod
    def _clock_error(self, t: Array) -> Array:
        """Estimated error of the time at which the body comes to its piece of the course."""

    @property
    def turning_points(self) -> tuple[float, ...]:
        """Values of the curve's parameter, in the order met; a launch from rest counts as met at t = 0."""
        return ()

    # -- periods ------------------------------------------------------------------------------

    @property
    def half_period(self) -> float:
        """Time from one turning point to the other (libration only)."""
        raise SolutionError(f"half_period: only a libration has one; this motion is of kind {self.kind!r}")

    @property
    def period(self) -> float:
        """Time after which the motion repeats (libration and circulation)."""
        raise SolutionError(f"period: this motion is of kind {self.kind!r} and does not repeat")

    def period_to(self, digits: int) -> str:
        """The period as a decimal string with that many correct digits."""
        raise SolutionError(f"period_to: this motion is of kind {self.kind!r} and does not repeat")

    # -- how far to trust it --------------------------------------------------------------------

    @property
    def quadrature_error(self) -> float:
        """Estimated relative error of a time of flight by quadrature, for the numbers that were given."""
        return max((piece.stretch.relative_error for piece in self._course(0.0).pieces), default=0.0)

    @property
    def conditioning(self) -> float:
        """How many times a relative change of those numbers may change a time of flight.

        A property of the problem: near a separatrix it is large, and 16 digits of a launch then say that much less
        about the motion. From 100 on, the computation itself runs in extended precision.
        """
        return max((piece.stretch.conditioning for piece in self._course(0.0).pieces), default=1.0)

    # -- positions ----------------------------------------------------------------------------

    def lam(self, t: Any) -> Any:
        """The curve's parameter at times.

        Parameters
        ----------
        t : number or array_like
            Times in seconds from launch, at most ``t_end``; negative ones too where the motion is periodic.
            Strings, ints and Fractions are taken exactly.

        Returns
        -------
        float or ndarray
            Of the shape of ``t``. In circulation the parameter grows lap by lap.
        """
        times, low, shape = self._times(t)
        located = self._located(times, low)
        return _shaped(self._places(located) + located.laps * located.course.lap, shape)

    def state(self, t: Any) -> State:
        """Everything about the body at times: parameter, arc length, position, speed, curvature, contact force.

        Times as in `lam`.
        """
        times, low, shape = self._times(t)
        located = self._located(times, low)
        f, course = self.problem.functions, located.course
        reduced, s, v = self._places(located), located.arc_lengths(), self._velocities(located)
        v2 = v**2
        x, z, ds, kappa, force = path_and_force_at(f.addresses, f.p, reduced, v2)
        error = self._bound(times, located, reduced, v, ds)
        lam = reduced + located.laps * course.lap
        s = (s + located.laps * course.lap_length) + self.problem.arc_origin
        return State(*(_shaped(array, shape) for array in (times, lam, s, x, z, v, v2, kappa, force, error)))

    def time_at(self, lam: Any) -> float:
        """When the body is first at a place of the curve."""
        place = read_number(lam, where=self.problem.formulas.parameter)
        origin = self.problem.launch.lam0
        if place.value == origin.value and place.low == origin.low:
            return 0.0
        times = self._first_passages(place.value, place.low)
        times = [t for t in times if t <= self.t_end]
        if not times:
            raise SolutionError(
                f"time_at: the motion is never at {self.problem.formulas.parameter} = {place.text}; {self._extent()}"
            )
        return min(times)

    def error_bound(self, t: Any) -> Any:
        """What ``lam(t)`` can be off by: the clock's part and the inversion's (paper, eq. 32), rounding included.

        It holds for the exact numbers that were given, and for times that are exact.
        """
        times, low, shape = self._times(t)
        located = self._located(times, low)
        f, reduced, v = self.problem.functions, self._places(located), self._velocities(located)
        ds = path_and_force_at(f.addresses, f.p, reduced, v**2)[2]
        return _shaped(self._bound(times, located, reduced, v, ds), shape)

    def _bound(self, times: Array, located: PhasePoints, reduced: Array, v: Array, ds: Array) -> Array:
        """`error_bound`, with the places within the lap, the velocities and ds/dlam there."""
        with np.errstate(divide="ignore", invalid="ignore"):
            rate = np.where(ds > 0.0, np.abs(v) / ds, 0.0)
        clock, inversion = self._clock_error(times), np.zeros_like(times)
        for piece, mask, phi in located.pieces:
            clock[mask] += piece.stretch.clock_error(phi)
            inversion[mask] = piece.stretch.inversion_error(phi)
        # A lap is rounded, and so are so many of them and the sum.
        rounding = ULP * (1.5 * np.abs(located.laps * located.course.lap) + 2.0 * np.abs(reduced))
        bound: Array = rate * clock + inversion + rounding
        return bound

    # -- history ------------------------------------------------------------------------------

    @property
    def legs(self) -> tuple[Leg, ...]:
        """The motion leg by leg; over one period from launch where it is periodic."""
        legs = []
        pace, lap = self._course(0.0).pace, self._course(0.0).lap
        for piece in self._history():
            marks = [(piece.t_start, piece.phi_start), *corners_met(piece, pace), (piece.t_stop, piece.phi_stop)]
            lam = self._marked(piece, marks) + piece.laps * lap
            for k, ((start, _), (stop, _)) in enumerate(pairwise(marks)):
                end = piece.end if k == len(marks) - 2 else "corner"
                legs.append(Leg(float(lam[k]), float(lam[k + 1]), start[0], stop[0], piece.direction, end))
        return Rows(self._told(_merged(legs, self._joints)))

    def _marked(self, piece: TimedSegment, marks: Sequence[tuple[Pair, float]]) -> Array:
        """Places at times and anomalies of a piece; the one at launch is the one given, to its last bit."""
        lam = piece.stretch.places(np.array([phi for _, phi in marks]))
        lam[[when[0] == 0.0 for when, _ in marks]] = self.problem.lam0
        return lam

    @property
    def events(self) -> tuple[Event, ...]:
        """What happens, in the order of time; over one period from launch where the motion is periodic."""
        found = []
        course = self._course(0.0)
        for piece in self._history():
            met = [("contact-sign", *m) for m in self._contact_changes(piece)]
            met += [("corner", *m) for m in corners_met(piece, course.pace)]
            met += [("slip", *m) for m in slip_times(self.problem, piece, course.pace)]
            found += [self._event(kind, when, piece, phi) for kind, when, phi in sorted(met, key=lambda m: m[1])]
            if piece.end not in ("", "horizon"):
                found.append(self._event(piece.end, piece.t_stop, piece, piece.phi_stop))
        if self.t_end < inf and not (found and found[-1].t == self.t_end):
            found = [event for event in found if event.t < self.t_end]
            state = self.state(self.t_end)
            found.append(Event("horizon", self.t_end, state.lam, state.x, state.z))
        return Rows(found)

    def events_between(self, t1: Any, t2: Any) -> tuple[Event, ...]:
        """Events at times from t1 to t2."""
        start, stop = read_number(t1, where="t1").value, read_number(t2, where="t2").value
        return Rows(event for event in self.events if start <= event.t <= stop)

    def _told(self, legs: list[Leg]) -> list[Leg]:
        """Legs as far as the horizon."""
        out = [leg for leg in legs if leg.t_start < self.t_end or leg.t_end == self.t_end]
        if out and (out[-1].t_end > self.t_end or out[-1].end == ""):
            last = out.pop()
            cut = last.t_end > self.t_end
            place, when = (float(self.lam(self.t_end)), self.t_end) if cut else (last.lam_end, last.t_end)
            out.append(Leg(last.lam_start, place, last.t_start, when, last.direction, "horizon"))
        return out

    # -- pictures -----------------------------------------------------------------------------

    def plot(self, what: str = "track", *, axes: Any = None) -> Any:
        """Draw the motion with Matplotlib.

        Parameters
        ----------
        what : {"track", "speed_and_force", "portrait"}
            The track, coloured by the sign and size of the contact force; speed and contact force against arc
            length; or the phase portrait round the orbit. All events are marked on the first two.
        axes : matplotlib Axes, optional
            Where to draw (a pair of them for "speed_and_force"); a new figure if not given.

        Returns
        -------
        matplotlib.figure.Figure
        """
        from gqm_sym.figures.motions import drawing

        return drawing(self, what, axes)

    def to_xarray(self, t: Any = None) -> Any:
        """The states at times as an xarray Dataset, with units and provenance; evenly over the motion without ``t``."""
        from gqm_sym.export.datasets import dataset

        return dataset(self, t)

    def _repr_html_(self) -> str:
        return page(self)

    # -- inside -------------------------------------------------------------------------------

    def _history(self) -> tuple[TimedSegment, ...]:
        """The pieces that `legs` and `events` tell of."""
        return self._course(0.0).pieces

    def _contact_changes(self, piece: TimedSegment) -> list[tuple[Pair, float]]:
        """When N changes sign within a piece, and the anomalies there."""
        return crossings(piece, contact_changes(piece.stretch), self._course(0.0).pace)

    def _event(self, kind: str, when: Pair, piece: TimedSegment, phi: float) -> Event:
        f = self.problem.functions
        lam = self._marked(piece, [(when, phi)])
        x, z = path_and_force_at(f.addresses, f.p, lam, np.zeros(1))[:2, 0]
        return Event(kind, when[0], float(lam[0]) + piece.laps * self._course(0.0).lap, float(x), float(z))

    def _times(self, t: Any) -> tuple[Array, Array, tuple[int, ...]]:
        times, low, shape = read_numbers(t, where="t")
        if times.size:
            if np.isnan(times).any():
                raise InputError("t: must be numbers, got NaN")
            self._check_end(float(times.max()))
            if times.min() < 0.0 and self._course(0.0).period is None:
                raise InputError(f"t: cannot be negative for a motion that does not repeat, got {float(times.min())!r}")
        return times, low, shape

    def _check_end(self, t: float) -> None:
        """Refuse a time beyond the motion's end."""
        if t > self.t_end:
            raise InputError(f"t: the motion ends at {self.t_end!r} s ({self._how_it_ends()}), got {t!r}")

    def _how_it_ends(self) -> str:
        return "the horizon t_max"

    def _extent(self) -> str:
        return "it moves " + ", ".join(f"from {leg.lam_start!r} to {leg.lam_end!r}" for leg in self.legs)

    def _located(self, t: Array, t_low: Array) -> PhasePoints:
        return locate(self._course(float(np.abs(t).max()) if t.size else 0.0), t, t_low)

    def _places(self, located: PhasePoints) -> Array:
        """The parameter within the lap; exactly the launch place at launch."""
        return located.places(self.problem.lam0)

    def _velocities(self, located: PhasePoints) -> Array:
        return located.velocities(self.direction * self.problem.launch.v0.value)

    def _first_passages(self, lam: float, low: float) -> list[float]:
        """Times of passing a place, the first on each piece."""
        course = self._course(0.0)
        return passages(course.pieces, course, lam, low)


def _shaped(array: Array, shape: tuple[int, ...]) -> Any:
    return float(array[0]) if shape == () else array.reshape(shape)


def _merged(legs: list[Leg], joints: tuple[str, ...]) -> list[Leg]:
    """Legs without the joints that end none: those that only the computation knows of, first of all."""
    out: list[Leg] = []
    for leg in legs:
        if out and out[-1].end in joints:
            last = out.pop()
            leg = Leg(last.lam_start, leg.lam_end, last.t_start, leg.t_end, leg.direction, leg.end)
        out.append(leg)
    return out


def horizon(motion: "Motion") -> float:
    """How long to show a motion that may never end."""
    if motion.kind in ("libration", "circulation"):
        return motion.period
    if isfinite(motion.t_end):
        return motion.t_end
    legs = motion.legs
    if motion.kind == "rest" or not legs:
        return 1.0
    return max(leg.t_end for leg in legs if isfinite(leg.t_end))
