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


class SquaredForce(NamedTuple):
    """|N|**2 along a curve in no vertical plane, and how it changes.

    Attributes
    ----------
    square : (n,) array
        |N|**2.
    factors : (k, n) array
        The factors of the changes of ``kinds`` in half of its change.
    kinds : list of int
        The quantities of the path that it depends on.
    even, odd : (n,) arrays
        Parts of the derivative of half of it with respect to ds/dt = v, which is ``v * even + odd``.
    """

    square: Array
    factors: Array
    kinds: list[int]
    even: Array
    odd: Array

    def half_change(self, changes: Array) -> Array:
        """Return half of the change that follows from changes of all quantities of the path at a fixed speed."""
        found: Array = np.einsum("kn,k...n->...n", self.factors, changes[self.kinds])
        return found


def squared_force(path: PathRows, v: Array, w: Array) -> SquaredForce:
    """Return |N|**2 along a curve in no vertical plane, given velocities ds/dt along the path and their squares."""
    rows, kinds = path.rows[:, 0], [CURVATURE, PRODUCT, LOAD]
    kappa, load, product = rows[CURVATURE], rows[LOAD], rows[PRODUCT]
    factors = [kappa * w * w, w, load]
    square, even, odd = (kappa * w) ** 2 + 2.0 * product * w + load * load, 2.0 * (kappa * kappa * w + product), 0.0 * w
    if len(rows) > ASIDE:
        aside, turning = rows[ASIDE], rows[ASIDE_TURN]
        kinds, factors = [*kinds, ASIDE, ASIDE_TURN], [*factors, v, v * w]
        square, odd = square + 2.0 * v * (aside + turning * w), aside + 3.0 * turning * w
    return SquaredForce(square, np.array(factors), kinds, even, odd)


def squared_force_rate(path: PathRows, v: Array) -> Array:
    """Return half of d(N**2)/dt along a space curve in a rotating frame, given velocities ds/dt along the path."""
    force = squared_force(path, v, v * v)
    along = path.rows[:, -1] * (v / path.ds[0])
    rate: Array = force.half_change(along) - (v * force.even + force.odd) * path.rows[POTENTIAL, -1] / path.ds[0]
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
    in_space, signed, turns = path.shape[0] > SPACE_Y, path.shape[0] <= PRODUCT, path.shape[0] > ASIDE
    kappa, still, spare = path[CURVATURE, 0], path[LOAD, 0], np.empty((4 if turns else 1 if signed else 2, v.size))
    kappa_change, product, aside, aside_turn = spare[0], spare[0 if signed else 1], spare[-2 if turns else 0], spare[-1]
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
