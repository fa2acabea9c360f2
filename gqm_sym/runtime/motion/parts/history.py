"""The legs and the events of a motion."""

from collections.abc import Sequence
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np

from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.arithmetic.doubledouble import Pair
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.motion.events import Event, Leg, contact_changes, corner_crossings, crossings
from gqm_sym.runtime.motion.locking import kept, locked
from gqm_sym.runtime.motion.parts.positions import Positions
from gqm_sym.runtime.motion.rolling import slip_times
from gqm_sym.runtime.motion.rows import Rows
from gqm_sym.runtime.motion.trajectory import TimedSegment


class History(Positions):
    """The events and legs of a motion."""

    @property
    def _internal_ends(self) -> tuple[str, ...]:
        """Kinds of ends of timed segments at which no leg ends."""
        return ("",)

    @property
    @kept
    def legs(self) -> tuple[Leg, ...]:
        """The legs of the motion in the order of time, over one period from launch if it is periodic.

        Returns
        -------
        tuple of Leg
            For a motion that goes on for ever without repeating, or turns more than 20 000 times before it ends, the
            legs up to its first turn; a horizon ``t_max`` extends them.
        """
        legs = []
        trajectory = self._listed_trajectory
        for timed in self._history():
            corners = corner_crossings(timed, timed.segment.functions.corners, trajectory.time_scale_error)
            last = "corner" if corners and corners[-1][1] == timed.phi_stop else timed.end
            corners = corners[:-1] if last != timed.end else corners
            marks = [(timed.t_start, timed.phi_start), *corners, (timed.t_stop, timed.phi_stop)]
            lam = self._places_at(timed, marks) + timed.laps * trajectory.lap
            for k, ((start, _), (stop, _)) in enumerate(pairwise(marks)):
                end = last if k == len(marks) - 2 else "corner"
                legs.append(Leg(float(lam[k]), float(lam[k + 1]), start[0], stop[0], timed.direction, end))
            if timed.end == "asymptote":
                legs[-1] = legs[-1]._replace(lam_end=timed.segment.b + timed.laps * trajectory.lap, t_end=inf)
        return Rows(self._up_to_horizon(merged(legs, self._internal_ends)))

    def _places_at(self, timed: TimedSegment, marks: Sequence[tuple[Pair, float]]) -> Array:
        """Return the places at phase angles of a segment, given with their times; at launch it is exactly the launch
        place.
        """
        lam = timed.segment.places(np.array([phi for _, phi in marks]))
        lam[[time[0] == 0.0 for time, _ in marks]] = self.problem.lam0
        return lam

    @property
    @kept
    def events(self) -> tuple[Event, ...]:
        """The events of the motion in the order of time, over one period from launch if it is periodic.

        Returns
        -------
        tuple of Event
            For a periodic motion, `events_between` returns the events of other periods. For any other motion that goes
            on for ever, these are the events up to its first turn.
        """
        return Rows(self._events_along(self._history()))

    def _events_along(self, segments: Sequence[TimedSegment], until: float = inf) -> list[Event]:
        """Return the events on timed segments from launch, and the horizon if it is not later than a time in s."""
        found: list[Event] = []
        time_scale_error = self._listed_trajectory.time_scale_error
        for timed in segments:
            found_here = [("contact-sign", *m) for m in self._contact_changes(timed)]
            found_here += [
                ("corner", *m) for m in corner_crossings(timed, timed.segment.functions.corners, time_scale_error)
            ]
            found_here += [("slip", *m) for m in slip_times(self.problem, timed, time_scale_error)]
            found += [self._event(kind, when, timed, phi) for kind, when, phi in sorted(found_here, key=lambda m: m[1])]
            if timed.end == "asymptote":
                found.append(self._asymptote(timed))
            elif timed.end not in ("", "horizon"):
                found.append(self._event(timed.end, timed.t_stop, timed, timed.phi_stop))
        end = self._known_end()
        if end < inf and end <= until and not (found and found[-1].t == end):
            found = [event for event in found if event.t < end]
            state = self.state(end)
            found.append(Event("horizon", end, state.lam, state.x, state.z))
        return found

    @locked
    def events_between(self, t1: Any, t2: Any) -> tuple[Event, ...]:
        """Return the events from one time to another, over as many periods as necessary.

        Parameters
        ----------
        t1, t2 : number
            Times in s from launch, both of them included.

        Returns
        -------
        tuple of Event
            The events in the order of time; none beyond ``t_end``.

        Raises
        ------
        InputError
            If a time is not a number.
        """
        start, stop = read_number(t1, where="t1", unit="s").value, read_number(t2, where="t2", unit="s").value
        found = self._events_along(self._trajectory(min(stop, self._horizon)).segments, stop)
        return Rows(event for event in found if start <= event.t <= stop)

    def _up_to_horizon(self, legs: list[Leg]) -> list[Leg]:
        """Return the legs up to the horizon, at which the last one is cut."""
        end = self._horizon
        out = [leg for leg in legs if leg.t_start < end or leg.t_end == end]
        if out and (out[-1].t_end > end or out[-1].end == ""):
            last = out.pop()
            cut = last.t_end > end
            place, when = (self._place_on_last_leg(end), end) if cut else (last.lam_end, last.t_end)
            out.append(Leg(last.lam_start, place, last.t_start, when, last.direction, "horizon"))
        return out

    def _place_on_last_leg(self, t: float) -> float:
        """Return the curve parameter at a time on the last of the legs."""
        return float(self.lam(t))

    def _contact_changes(self, timed: TimedSegment) -> list[tuple[Pair, float]]:
        """Return the times at which N changes sign on a timed segment, each with its phase angle."""
        return crossings(timed, contact_changes(self.problem.formulas, timed), self._listed_trajectory.time_scale_error)

    def _asymptote(self, timed: TimedSegment) -> Event:
        """Return the event of an approach to an equilibrium, which the body reaches after infinite time."""
        f, lam = self.problem.functions, timed.segment.b
        x, z = path_and_force_at(f.addresses, f.p, np.array([lam]), np.zeros(1))[:2, 0]
        return Event("asymptote", inf, lam + timed.laps * self._listed_trajectory.lap, float(x), float(z))

    def _event(self, kind: str, when: Pair, timed: TimedSegment, phi: float) -> Event:
        f = self.problem.functions
        lam = self._places_at(timed, [(when, phi)])
        x, z = path_and_force_at(f.addresses, f.p, lam, np.zeros(1))[:2, 0]
        return Event(kind, when[0], float(lam[0]) + timed.laps * self._listed_trajectory.lap, float(x), float(z))


def merged(legs: list[Leg], internal_ends: tuple[str, ...]) -> list[Leg]:
    """Return the legs, joined at ends that matter only to the computation."""
    out: list[Leg] = []
    for leg in legs:
        if out and out[-1].end in internal_ends:
            last = out.pop()
            leg = Leg(last.lam_start, leg.lam_end, last.t_start, leg.t_end, leg.direction, leg.end)
        out.append(leg)
    return out
