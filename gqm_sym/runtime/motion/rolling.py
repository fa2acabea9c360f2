"""Rolling bodies: whether static friction is sufficient, and whether the body fits into its track."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gqm_sym.errors import LaunchError, SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import Pair
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.launch.speed import path_and_force_at, potential_at
from gqm_sym.runtime.motion.events import Leg, contact_force_on, crossings, sign_changes
from gqm_sym.runtime.motion.trajectory import TimedSegment

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas
    from gqm_sym.runtime.launch.problem import Problem


# The distance from a joint at which the track behind it is looked at, in roundings of the place.
ROUNDINGS_BESIDE = 2.0**12


def slip_times(problem: "Problem", timed: TimedSegment, time_scale_error: float) -> list[tuple[Pair, float]]:
    """Return the times at which a rolling body begins to slip on a timed segment, each with its phase angle.

    A body that slips at launch begins to slip then. The motion is computed as if the body rolled on. Only conservative
    motions are examined, since the slope of the effective potential gives the tangential force F.t.
    """
    if problem.formulas.static_friction_limit is None or problem.formulas.dissipation is not None:
        return []
    values = dict(zip(problem.formulas.parameters, problem.p, strict=True))
    beta, mu, mass = (values[name].value for name in (*problem.formulas.static_friction_limit, "m"))

    def friction_margin(phi: Array) -> Array:
        """Return the sign of the largest possible static friction less the friction that rolling requires."""
        f, places = timed.segment.functions, timed.segment.places(phi)
        ds, force = (
            path_and_force_at(f.addresses, f.p, places, np.zeros(phi.size))[2],
            contact_force_on(problem, timed, phi),
        )
        # The slope of the effective potential with respect to arc length is -F.t/(1 + beta).
        needed = beta * np.abs(potential_at(f.addresses, f.p, places)[1]) / ds
        signs: Array = np.sign(mu * np.abs(force) / mass - needed)
        return signs

    changes = crossings(timed, sign_changes(timed.segment, friction_margin, friction_margin), time_scale_error)
    first = changes[0][1] if changes else timed.phi_stop
    rolls = friction_margin(np.array([0.5 * (timed.phi_start + first)]))[0] >= 0.0
    at_launch = [] if rolls or timed.t_start[0] != 0.0 else [(timed.t_start, timed.phi_start)]
    return at_launch + changes[0 if rolls else 1 :: 2]


def check_track(formulas: "Formulas", f: BoundFunctions) -> None:
    """Refuse a track with corners."""
    if f.corners.size:
        raise LaunchError(
            f"{formulas.rolling_radius}: the track has a corner at {formulas.parameter} = {float(f.corners[0])!r}, "
            "where the centre of a body with a radius has no path beside the track; round the corners off, as by "
            "Curve.piecewise with arcs, or leave the radius out"
        )


def check_launch(formulas: "Formulas", f: BoundFunctions, lam0: float) -> None:
    """Refuse a launch at a place where the body does not fit into the track."""
    ds = path_and_force_at(f.addresses, f.p, np.array([lam0]), np.zeros(1))[2, 0]
    if not ds > 0.0:
        raise LaunchError(f"lam0: {_what(formulas, lam0)}; launch elsewhere, or {_remedy(formulas)}")


def check_end(formulas: "Formulas", f: BoundFunctions, legs: Sequence[Leg]) -> None:
    """Refuse a motion to a place where the body no longer fits: the path of its centre has a cusp there, or turns back
    at a joint of the track's pieces.
    """
    last = legs[-1] if legs else None
    if last is None or last.end not in ("cusp", "singular-point"):
        return
    beyond = math.copysign(ROUNDINGS_BESIDE * math.ulp(last.lam_end), last.lam_end - last.lam_start)
    ds = path_and_force_at(f.addresses, f.p, np.array([last.lam_end + beyond]), np.zeros(1))[2, 0]
    if last.end == "cusp" or ds < 0.0:  # not a number where the range of doubles ends
        what = f"{_what(formulas, last.lam_end)}, where it comes after {last.t_end!r} s"
        raise SolutionError(f"{what}; {_remedy(formulas)}")


def _what(formulas: "Formulas", place: float) -> str:
    return f"with this {formulas.rolling_radius} a body does not fit into the track at {formulas.parameter} = {place!r}"


def _remedy(formulas: "Formulas") -> str:
    radius = formulas.rolling_radius
    return f"give {radius} so that 1 - kappa*{radius} > 0, kappa being the track's curvature"
