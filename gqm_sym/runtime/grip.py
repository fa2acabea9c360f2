"""Whether a rolling body rolls: what static friction must carry, beta/(1 + beta)*m*|F.t|, against mu_static*|N|."""

from typing import TYPE_CHECKING

import numpy as np

from gqm_sym.runtime.course import Pair, Piece
from gqm_sym.runtime.entries import climb_at, frame_at
from gqm_sym.runtime.events import crossings, sign_changes
from gqm_sym.runtime.stretch import Array

if TYPE_CHECKING:
    from gqm_sym.runtime.problem import Problem


def slips(problem: "Problem", piece: Piece, pace: float) -> list[tuple[Pair, float]]:
    """When, and at which anomalies, a body on a piece of its motion begins to slip; at launch too, if it slips there.

    The motion goes on as if it rolled. Told of conservative motions, whose climb knows F.t.
    """
    if problem.formulas.grip is None or problem.formulas.dissipation is not None:
        return []
    values = dict(zip(problem.formulas.parameters, problem.p, strict=True))
    beta, mu, mass = (values[name].value for name in (*problem.formulas.grip, "m"))

    def spare(phi: Array) -> Array:
        """The sign of what static friction could carry beyond what it must."""
        f, places = piece.stretch.functions, piece.stretch.places(phi)
        _, _, ds, _, force = frame_at(f.addresses, f.p, places, piece.stretch.speeds(phi) ** 2)
        # Half the slope of the climb by arc length is |F.t|/(1 + beta).
        needed = 0.5 * beta * np.abs(climb_at(f.addresses, f.p, places)[1]) / ds
        signs: Array = np.sign(mu * np.abs(force) / mass - needed)
        return signs

    met = crossings(piece, sign_changes(piece.stretch, spare, spare), pace)
    first = met[0][1] if met else piece.phi_stop
    rolls = spare(np.array([0.5 * (piece.phi_start + first)]))[0] >= 0.0
    begun = [] if rolls or piece.t_start[0] != 0.0 else [(piece.t_start, piece.phi_start)]
    return begun + met[0 if rolls else 1 :: 2]
