"""The path at given places with its derivatives, and the changes of coordinates and forces along a changed motion."""

from math import sqrt
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.evaluation import values
from gqm_sym.runtime.gradients.programs import path_program
from gqm_sym.runtime.interface import ExactFormulas, ExactLaw

# The quantities of a path (`programs.path_program`).
X, Z, DS, CURVATURE, LOAD, POTENTIAL, SPACE_Y, PRODUCT, ASIDE, ASIDE_TURN = range(10)

# The rows of changes of states along a path. The change of the velocity is given.
CHANGED_X, CHANGED_Z, CHANGED_V, CHANGED_FORCE, CHANGED_Y = range(5)


class PathRows(NamedTuple):
    """The results of `path_program` at n places.

    Attributes
    ----------
    rows : (k, m + 2, n) array
        For x, z, ds/dlam, m*kappa, m*n0 and U (0 of a motion with losses) the values, and the derivatives with respect
        to m parameters and the place. Those of y follow for a space curve, and those of m**2 times
        ``load_along_curvature`` for one in no vertical plane, and of m**2 times both ``coriolis_loads`` in a rotating
        frame.
    """

    rows: Array

    @property
    def ds(self) -> Array:
        """ds/dlam with its derivatives."""
        ds: Array = self.rows[DS]
        return ds

    @property
    def curvature(self) -> Array:
        """m*kappa with its derivatives."""
        curvature: Array = self.rows[CURVATURE]
        return curvature

    @property
    def load(self) -> Array:
        """m*n0 with its derivatives."""
        load: Array = self.rows[LOAD]
        return load


def path_rows(
    formulas: ExactFormulas | ExactLaw, parameters: Array, mass: int, high: Array, low: Array | None = None
) -> PathRows:
    """Return the path at places, with derivatives."""
    count = parameters.shape[1]
    found = values(path_program(formulas, count, mass), parameters, high, low, parts=1)
    return PathRows(found.reshape(len(found) // (count + 2), count + 2, high.size))


def squared_force_rate(path: PathRows, v: Array) -> Array:
    """Return half of d(N**2)/dt along a space curve in a rotating frame, given velocities ds/dt along the path."""
    ds, along, w = path.ds[0], path.rows[:, -1] * (v / path.ds[0]), v * v
    kinds = CURVATURE, LOAD, PRODUCT, ASIDE, ASIDE_TURN
    (kappa, load, product, aside, turning), rates = path.rows[kinds, 0], along[list(kinds)]
    factors = np.array([kappa * w * w, load, w, v, v * w])
    by_speed = 2.0 * v * (kappa * kappa * w + product) + aside + 3.0 * turning * w
    rate: Array = (factors * rates).sum(axis=0) - by_speed * path.rows[POTENTIAL, -1] / ds
    return rate


@Inner
def fill_changed(rows, variable, places, out):  # type: ignore[no-untyped-def]
    """Fill the changes of a quantity of a path with a variable; beyond the parameters only the place changes it."""
    last = rows.shape[0] - 1
    by_place = rows[last]
    if variable + 1 < last:
        by_variable = rows[1 + variable]
        for i in range(out.size):
            out[i] = by_variable[i] + by_place[i] * places[i]
    else:
        for i in range(out.size):
            out[i] = by_place[i] * places[i]


@Inner
def path_changes(path, v, places, found):  # type: ignore[no-untyped-def]
    """Fill the changes of coordinates and contact forces along a path.

    Parameters
    ----------
    path : (k, m + 2, n) array
        The path (`PathRows`).
    v : (n,) array
        The velocities.
    places : (variables, n) array
        The changes of the places.
    found : (5, variables, n) array
        The changes of x, z, v, N and y. That of v is given; the others are filled.
    """
    in_space, signed, spare = path.shape[0] > SPACE_Y, path.shape[0] <= PRODUCT, np.empty((2, v.size))
    kappa, still, kappa_change, product = path[CURVATURE, 0], path[LOAD, 0], spare[0], spare[1]
    turns, aside, aside_turn = path.shape[0] > ASIDE, np.empty(v.size), np.empty(v.size)
    for j in range(places.shape[0]):
        faster, force = found[CHANGED_V, j], found[CHANGED_FORCE, j]
        fill_changed(path[X], j, places[j], found[CHANGED_X, j])
        fill_changed(path[Z], j, places[j], found[CHANGED_Z, j])
        if in_space:
            fill_changed(path[SPACE_Y], j, places[j], found[CHANGED_Y, j])
        else:
            found[CHANGED_Y, j] = 0.0
        fill_changed(path[CURVATURE], j, places[j], kappa_change)
        fill_changed(path[LOAD], j, places[j], force)
        if signed:
            for i in range(v.size):
                force[i] += v[i] * v[i] * kappa_change[i] + 2.0 * v[i] * kappa[i] * faster[i]
        else:
            fill_changed(path[PRODUCT], j, places[j], product)
            if turns:
                fill_changed(path[ASIDE], j, places[j], aside)
                fill_changed(path[ASIDE_TURN], j, places[j], aside_turn)
            for i in range(v.size):
                w, level = v[i] * v[i], path[PRODUCT, 0, i]
                half_square = kappa[i] * w * w * kappa_change[i] + w * product[i] + still[i] * force[i]
                half_square += 2.0 * v[i] * (kappa[i] * kappa[i] * w + level) * faster[i]
                square = (kappa[i] * w) ** 2 + 2.0 * level * w + still[i] * still[i]
                if turns:
                    at_rest, turning = path[ASIDE, 0, i], path[ASIDE_TURN, 0, i]
                    half_square += v[i] * (aside[i] + aside_turn[i] * w) + (at_rest + 3.0 * turning * w) * faster[i]
                    square += 2.0 * v[i] * (at_rest + turning * w)
                # |N| has a kink where it vanishes.
                force[i] = half_square / sqrt(square)
