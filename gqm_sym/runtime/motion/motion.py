"""The motion that begins with a launch, with all its properties."""

from math import inf, isfinite
from typing import TYPE_CHECKING, Any

from gqm_sym.errors import SolutionError, renamed
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.launch.request import LEAST_SPEED, Launch, LaunchRequest
from gqm_sym.runtime.motion.extremes import SPEED, Extreme, extreme, force_of
from gqm_sym.runtime.motion.locking import kept, locked
from gqm_sym.runtime.motion.parts.derivatives import Derivatives
from gqm_sym.runtime.motion.parts.history import History
from gqm_sym.runtime.motion.parts.searched import swings_below
from gqm_sym.runtime.motion.parts.summary import page, summary
from gqm_sym.runtime.motion.riding.cars import Cars, CarsOfRiders, cars
from gqm_sym.runtime.motion.riding.exceedance import Exceedance, exceedance
from gqm_sym.runtime.motion.riding.loads import load_extreme


class Motion(History, Derivatives):
    """A motion along a curve, computed as far as required; many threads may read it at once.

    Attributes
    ----------
    kind : str
        "libration", "circulation", "transit", "asymptotic", "rest" or "dissipative" (MATHS, section 6). A motion to
        infinity is a transit, and any motion with friction, drag or resistance that moves at all is dissipative.
    direction : int
        The sign of ds/dt after launch.
    problem : Problem
        The launch with its module.
    """

    if not TYPE_CHECKING:
        __getattr__ = renamed({"conditioning": "condition_number"}, "a motion")

    # -- ends and periods ---------------------------------------------------------------------

    @property
    def turning_points(self) -> tuple[float, ...]:
        """The turning points, as values of the curve parameter in the order of time.

        A launch from rest counts as a turning point at t = 0.
        """
        return ()

    @property
    def rest_position(self) -> float:
        """The place at which the body comes to rest, as a value of the curve parameter.

        Raises
        ------
        SolutionError
            If the motion does not come to rest, or not before ``t_max``.
        """
        if self.kind == "rest":
            return self.problem.lam0
        if not self.t_end < inf:
            raise SolutionError("rest_position: this motion goes on for ever and does not come to rest")
        end, place = self._last_end()
        if end != "rest":
            raise SolutionError(f"rest_position: this motion does not come to rest; it ends with {end!r}")
        return place

    @property
    def half_period(self) -> float:
        """Time in s from one turning point to the other (libration only; MATHS, section 4).

        Raises
        ------
        SolutionError
            If the motion is of another kind.
        """
        raise SolutionError(f"half_period: only a libration has one; this motion is of kind {self.kind!r}")

    @property
    def period(self) -> float:
        """Time in s after which the motion repeats (libration and circulation).

        Raises
        ------
        SolutionError
            If the motion does not repeat.
        """
        raise SolutionError(f"period: this motion is of kind {self.kind!r} and does not repeat")

    def period_to(self, digits: int) -> str:
        """Return the period in s as a decimal string.

        Parameters
        ----------
        digits : int
            The number of correct digits, from 1 to 1000.

        Returns
        -------
        str
            The decimal string, rounded to nearest.

        Raises
        ------
        InputError
            If the number of digits is out of range.
        SolutionError
            If the motion does not repeat, or its curve is known in doubles only.
        """
        raise SolutionError(f"period_to: this motion is of kind {self.kind!r} and does not repeat")

    # -- extremes, and what passengers feel ---------------------------------------------------

    @property
    @kept
    def v_max(self) -> Extreme:
        """The largest speed, its time and its place, over one period or over the whole motion.

        A swing that dies away for ever has its extremes in its first swings.

        Raises
        ------
        SolutionError
            If the motion goes on for ever in another way, or approaches the value without reaching it; give it a
            horizon, ``t_max``; or if it is so small that its square is beyond the range of doubles.
        """
        lasts = self._known_end() > 0.0
        if not (lasts and self.kind == "libration" and swings_below(self, LEAST_SPEED)):
            found = extreme(self, SPEED, 1)
            if not (lasts and found.value < LEAST_SPEED and self.kind != "rest"):
                return found
        raise SolutionError(f"v_max: the speed is below {LEAST_SPEED:g} m/s, and its square is beyond doubles")

    @property
    @kept
    def v_min(self) -> Extreme:
        """The least speed; as `v_max`. It is 0 at a turning point."""
        return extreme(self, SPEED, -1)

    @property
    @kept
    def normal_force_max(self) -> Extreme:
        """The largest contact force along the normal; as `v_max`."""
        return extreme(self, force_of(self.problem), 1)

    @property
    @kept
    def normal_force_min(self) -> Extreme:
        """The least contact force along the normal, which may be negative; as `v_max`."""
        return extreme(self, force_of(self.problem), -1)

    n_vertical_max, n_vertical_min = load_extreme("vertical", 1), load_extreme("vertical", -1)
    n_lateral_max, n_lateral_min = load_extreme("lateral", 1), load_extreme("lateral", -1)
    n_longitudinal_max, n_longitudinal_min = load_extreme("longitudinal", 1), load_extreme("longitudinal", -1)

    @locked
    def exceedance(self, load: str, levels: Any, *, side: str = "above", limits: Any = None) -> Exceedance:
        """Return the times for which a load on a rider is beyond given levels, over one period or the whole motion.

        Parameters
        ----------
        load : {"vertical", "lateral", "longitudinal"}
            The load.
        levels : number or array_like
            Levels in units of 9.80665 m/s**2.
        side : {"above", "below"}
            The side of a level that counts as beyond it.
        limits : sequence of pairs, optional
            Permitted loads: pairs of a duration in s and a level, both numbers. Levels decrease with increasing
            duration (increase, if the side is "below"), and the limit is linear between them.

        Returns
        -------
        Exceedance
            The ``total`` and ``longest`` times in s, and the ``allowed`` times within the limits.

        Raises
        ------
        InputError
            If there is no such load, no roll was declared, or levels or limits are not numbers.
        SolutionError
            If the motion goes on for ever without repeating; give it a horizon, ``t_max``.
        """
        return exceedance(self, load, levels, side, limits)

    @locked
    def cars(self, t: Any) -> Cars | CarsOfRiders:
        """Return the places, contact forces and coupling forces of the cars of a train, on banked tracks with loads.

        Parameters
        ----------
        t : number or array_like
            Times in s from launch, as for `lam`.

        Returns
        -------
        Cars, or CarsOfRiders on a banked track
            Arrays whose first axis is the cars, or the couplings between them.

        Raises
        ------
        InputError
            If the body is not a train, or a time is not a number.
        """
        return cars(self, t)

    # -- pictures, tables and copies ----------------------------------------------------------

    def plot(self, what: str = "track", *, axes: Any = None) -> Any:
        """Draw the motion with Matplotlib.

        Parameters
        ----------
        what : {"track", "speed_and_force", "portrait"}
            The track, coloured by the sign and size of the contact force; speed and contact force against arc
            length; or the phase portrait round the orbit. All events are marked on the first two.
        axes : matplotlib Axes, optional
            The axes to draw on (a pair for "speed_and_force"); by default a new figure is made.

        Returns
        -------
        matplotlib.figure.Figure
            The figure.

        Raises
        ------
        InputError
            If ``what`` is another word.
        """
        from gqm_sym.figures.motions import drawing

        return drawing(self, what, axes)

    def to_pandas(self, t: Any = None) -> Any:
        """Return the states at given times as a table with a row for each time.

        Parameters
        ----------
        t : array_like, optional
            Times in s from launch; by default equally spaced over one period or over the whole motion.

        Returns
        -------
        pandas.DataFrame
            A column for each field of `State`.
        """
        from gqm_sym.export.datasets import motion_frame

        return motion_frame(self, t)

    def to_xarray(self, t: Any = None) -> Any:
        """Return the states at given times as an xarray Dataset, with units and provenance.

        Parameters
        ----------
        t : array_like, optional
            Times in s from launch; by default equally spaced over one period or over the whole motion.

        Returns
        -------
        xarray.Dataset
            One variable for each field of `State`, over the coordinate t.
        """
        from gqm_sym.export.datasets import dataset

        return dataset(self, t)

    def _repr_html_(self) -> str:
        return page(self)

    def __str__(self) -> str:
        """Describe the motion in a few lines: kind, launch, times and parameters."""
        rows = summary(self)
        width = max(len(label) for label, _ in rows)
        texts = ((label, repr(value) if isinstance(value, float) else value) for label, value in rows)
        lines = (f"  {label:<{width}}  {text}" for label, text in texts)
        return "\n".join([f"Motion of {self.problem.formulas.name}", *lines])

    def __repr__(self) -> str:
        launch = self.problem.launch
        return f"<{self.kind} of {self.problem.formulas.name}: lam0 = {launch.lam0.text}, v0 = {launch.v0.text}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the motion by its model, launch and parameters; the copy is solved again, and has the same digits."""
        problem = self.problem
        return _solved_again, (problem.formulas, problem.launch, tuple(problem.p))

    def _last_end(self) -> tuple[str, float]:
        """Return how and where a motion with an end ends."""
        last = self.legs[-1]
        return last.end, last.lam_end

    def _end_of_legs(self) -> float:
        """Return the time in s at which `legs` end with the motion or its horizon; infinite if they do not."""
        return self.t_end

    def _shown_time(self) -> float:
        """Return the time in s up to which a motion without an end is shown in pictures and tables."""
        return max((leg.t_end for leg in self.legs if isfinite(leg.t_end)), default=1.0)


def _solved_again(model: Any, launch: Launch, parameters: tuple[Number, ...]) -> "Motion":
    """Return the motion that begins with a launch of a compiled model, in the same way as the original one."""
    lam0, v0, direction, contact, t_max, point = launch
    place = (lam0, None) if point is None else (None, point)
    request = LaunchRequest(place[0], v0, direction, place[1], t_max, contact)
    motion: Motion = model.solve(request, parameters)
    return motion


def horizon(motion: "Motion") -> float:
    """Return the time in s from launch up to which a motion is shown: one period, its end, or the end of its computed
    part.
    """
    if motion.kind in ("libration", "circulation"):
        return motion.period
    end = end_of_legs(motion)
    return end if isfinite(end) else motion._shown_time()


def end_of_legs(motion: "Motion") -> float:
    """Return the time in s at which a motion ends, infinite if it has no end or one only after too many turns."""
    return motion._end_of_legs()
