"""Rolling bodies: whether static friction can hold them, and whether they fit into their track."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gqm_sym.errors import LaunchError, SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import Pair
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.launch.speed import path_and_force_at, potential_at
from gqm_sym.runtime.motion.events import Leg, crossings, sign_changes
from gqm_sym.runtime.motion.trajectory import TimedSegment

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas
    from gqm_sym.runtime.launch.problem import Problem


def slip_times(problem: "Problem", piece: TimedSegment, pace: float) -> list[tuple[Pair, float]]:
    """When, and at which anomalies, a body on a piece of its motion begins to slip; at launch too, if it slips there.

    The motion goes on as if it rolled. Only conservative motions have such times: their effective potential knows F.t.
    """
    if problem.formulas.static_friction_limit is None or problem.formulas.dissipation is not None:
        return []
    values = dict(zip(problem.formulas.parameters, problem.p, strict=True))
    beta, mu, mass = (values[name].value for name in (*problem.formulas.static_friction_limit, "m"))

    def spare(phi: Array) -> Array:
        """The sign of what static friction could carry beyond what it must."""
        f, places = piece.stretch.functions, piece.stretch.places(phi)
        _, _, ds, _, force = path_and_force_at(f.addresses, f.p, places, piece.stretch.speeds(phi) ** 2)
        # The slope of the effective potential by arc length is -F.t/(1 + beta).
        needed = beta * np.abs(potential_at(f.addresses, f.p, places)[1]) / ds
        signs: Array = np.sign(mu * np.abs(force) / mass - needed)
        return signs

    met = crossings(piece, sign_changes(piece.stretch, spare, spare), pace)
    first = met[0][1] if met else piece.phi_stop
    rolls = spare(np.array([0.5 * (piece.phi_start + first)]))[0] >= 0.0
    begun = [] if rolls or piece.t_start[0] != 0.0 else [(piece.t_start, piece.phi_start)]
    return begun + met[0 if rolls else 1 :: 2]


def check_launch(formulas: "Formulas", f: BoundFunctions, lam0: float) -> None:
    """Refuse a launch where the body does not fit."""
    ds = path_and_force_at(f.addresses, f.p, np.array([lam0]), np.zeros(1))[2, 0]
    if not ds > 0.0:
        raise LaunchError(f"lam0: {_what(formulas, lam0)}; launch elsewhere, or {_remedy(formulas)}")


def check_end(formulas: "Formulas", legs: Sequence[Leg]) -> None:
    """Refuse a motion that comes to where the body no longer fits: the centre's path has a cusp there."""
    last = legs[-1] if legs else None
    if last is not None and last.end == "cusp":
        what = f"{_what(formulas, last.lam_end)}, where it comes after {last.t_end!r} s"
        raise SolutionError(f"{what}; {_remedy(formulas)}")


def _what(formulas: "Formulas", place: float) -> str:
    return f"a body of radius {formulas.rolling_radius} does not fit into the track at {formulas.parameter} = {place!r}"


def _remedy(formulas: "Formulas") -> str:
    radius = formulas.rolling_radius
    return f"give {radius} so that 1 - kappa*{radius} > 0, kappa being the track's curvature"
