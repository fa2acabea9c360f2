"""The first place of an orbit at which the track would have to pull, on a tabulated curve."""

from math import fabs, sqrt
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.motion.events import ROUNDING_SHARE
from gqm_sym.runtime.sweep.tables.layout import (
    CORIOLIS_SAMPLES,
    CORIOLIS_TERMS,
    HALF,
    KAPPA_SAMPLES,
    KAPPA_TERMS,
    LOAD_SAMPLES,
    LOAD_TERMS,
    POTENTIAL_SAMPLES,
    SAMPLE_POINTS,
    SAMPLES,
)
from gqm_sym.runtime.sweep.tables.panel_forces import FAR, LOAD, NEAR, prepare
from gqm_sym.runtime.sweep.tables.places import edge_place, locate
from gqm_sym.runtime.sweep.tables.potential import potential_on, value_on

# The number of steps of the search for a zero of N between two samples.
MAX_STEPS = 80


class Stop(NamedTuple):
    """The place at which a motion ends before the body has passed its whole orbit: there it loses contact, or the last
    time is over.

    Attributes
    ----------
    place : float
        The place in lam, which is NaN if the body passes the whole orbit.
    panel : int
        The panel of the passage on which it is; -1 if there is none.
    x : float
        The place on that panel.
    turns : int
        How often the body has turned before.
    """

    place: float
    panel: int
    x: float
    turns: int


NO_STOP = Stop(np.nan, -1, 0.0, 0)


@Inner
def signed_force(curve, k, slack, side, sense, x):  # type: ignore[no-untyped-def]
    """Return N per unit mass at a place of panel k for one direction of motion, positive if the track pushes, and zero
    if it is zero within rounding.
    """
    rows, v2 = curve.rows, 2.0 * (slack - potential_on(curve.rows, k, x))
    inertia = value_on(curve.table.paths, k, KAPPA_TERMS, x) * v2
    if curve.directed:
        inertia += sense * sqrt(max(v2, 0.0)) * value_on(curve.table.paths, k, CORIOLIS_TERMS, x)
    load = value_on(rows, k, LOAD_TERMS, x)
    force = inertia + load
    return side * force if fabs(force) > ROUNDING_SHARE * (fabs(inertia) + fabs(load)) else 0.0


@Inner
def change_between(curve, k, slack, side, sense, before, after):  # type: ignore[no-untyped-def]
    """Return the place at which N changes its sign, between a place of panel k at which the track pushes and one at
    which it pulls.
    """
    pushes, pulls = before, after
    f, g = signed_force(curve, k, slack, side, sense, pushes), signed_force(curve, k, slack, side, sense, pulls)
    for step in range(MAX_STEPS):
        middle = 0.5 * (pushes + pulls)
        x = middle if step % 3 == 2 or not f > g else pushes + (pulls - pushes) * f / (f - g)
        if not min(pushes, pulls) < x < max(pushes, pulls):
            return x if fabs(pulls - pushes) > 2.0**-50 else middle
        value = signed_force(curve, k, slack, side, sense, x)
        if value < 0.0:
            pulls, g = x, value
        else:
            pushes, f = x, value
        if value == 0.0 or fabs(pulls - pushes) <= 2.0**-52:
            return x
    return pulls


@Inner
def loss_on_way(curve, passage, half_v2_at_edges, side, begin, sense):  # type: ignore[no-untyped-def]
    """Return the first place between ``begin`` and one end of a passage at which the track would pull.

    Parameters
    ----------
    side : int
        1 if the track can only push along the normal, -1 if only against it.
    begin : (j, x)
        A panel of the passage and a place on it.
    sense : int
        1 towards the upper end, -1 towards the lower one.

    Returns
    -------
    j, x : the place; j is -1 if there is none
    """
    rows, paths, count, last = curve.rows, curve.table.paths, curve.levels.size, passage.panels - 1
    j, start = begin
    while 0 <= j <= last:
        k, slack = (passage.first + j) % count, half_v2_at_edges[j]
        prepare(curve, k, FAR | LOAD)
        stop = float(sense)
        if j == (last if sense > 0 else 0):
            stop = passage.high_x if sense > 0 else passage.low_x
        before, whole = start, fabs(stop - start) == 2.0
        for i in range(SAMPLES):
            x = start + (stop - start) * 0.5 * (1.0 + SAMPLE_POINTS[i])
            if whole:
                at = i if sense > 0 else SAMPLES - 1 - i
                v2 = 2.0 * (slack - rows[k, POTENTIAL_SAMPLES + at])
                force = side * (paths[k, KAPPA_SAMPLES + at] * v2 + rows[k, LOAD_SAMPLES + at])
                if curve.directed:
                    force += side * sense * sqrt(max(v2, 0.0)) * paths[k, CORIOLIS_SAMPLES + at]
            if not whole or force < 0.0:
                prepare(curve, k, NEAR)
                force = signed_force(curve, k, slack, side, sense, x)
            if force < 0.0:
                return j, change_between(curve, k, slack, side, sense, before, x) if i > 0 else x
            before = x
        j, start = j + sense, -float(sense)
    return -1, 0.0


@Inner
def launch_on(curve, orbit, passage):  # type: ignore[no-untyped-def]
    """Return the panel of a passage on which the launch is, and its place there."""
    index, x, _ = locate(curve.table, curve.period, orbit.lam0)
    last = passage.panels - 1
    if not orbit.circulates and (orbit.low == 0.0 or orbit.high == 0.0):
        return (0, passage.low_x) if orbit.low == 0.0 else (last, passage.high_x)
    return last if orbit.circulates and orbit.direction < 0 else index - passage.first, x


@Inner
def loss_of_contact(curve, orbit, passage, half_v2_at_edges, side):  # type: ignore[no-untyped-def]
    """Return where a body leaves the track before it reaches an end of it, as a `Stop`.

    A body that turns passes places once more in the other direction. There N differs only if it depends on that.
    """
    launch = begin = launch_on(curve, orbit, passage)
    if orbit.direction < 0 and begin[0] > 0 and begin[1] == -1.0:  # from an edge the body moves to the panel before
        launch = begin = begin[0] - 1, 1.0
    passes = 1 if orbit.circulates or orbit.leaves == orbit.direction else 2
    for turns in range(passes + (1 if curve.directed and passes == 2 and orbit.leaves == 0 else 0)):
        sense = orbit.direction if turns != 1 else -orbit.direction
        if curve.directed and turns > 0:
            begin = (0, passage.low_x) if sense > 0 else (passage.panels - 1, passage.high_x)
        j, x = loss_on_way(curve, passage, half_v2_at_edges, side, begin, sense)
        if turns == 0 and (j, x) == launch:
            return Stop(orbit.lam0, j, x, 0)
        if j >= 0:
            return Stop(place_in_lam(curve, passage, j, x), j, x, turns)
    return NO_STOP


@Inner
def place_in_lam(curve, passage, j, x):  # type: ignore[no-untyped-def]
    """Return the place in lam of a place on panel j of a passage."""
    k = (passage.first + j) % curve.levels.size
    return edge_place(curve.table, curve.period, passage.first + j) + curve.table.paths[k, HALF] * (1.0 + x)
