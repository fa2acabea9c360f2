"""The first place on a panel at which the body turns, or N changes its sign."""

from math import fabs, nan
from typing import NamedTuple

from gqm_sym.runtime.arithmetic.clenshaw import chebyshev_sum
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.panels.breaks import within
from gqm_sym.runtime.legs.panels.equation import (
    FORCE,
    LOAD,
    MEAN,
    OFFSET,
    SERIES,
    W_FACTOR,
    P,
    Q,
    W,
    as_factor,
    distance,
    fill_rates,
    marched,
)
from gqm_sym.runtime.legs.panels.point import slope_of_v2
from gqm_sym.runtime.legs.panels.polynomials import COUNT, size_of, to_coefficients
from gqm_sym.runtime.legs.panels.resolution import CANCELLATION_NOISE, first_change_of, size_at
from gqm_sym.runtime.legs.panels.solving import begin_panel, solve_panel
from gqm_sym.runtime.legs.panels.widest import MIN_RELATIVE_WIDTH


class Change(NamedTuple):
    """The first places on a panel at which something changes, as x in [-1, 1]; 2 if there is none.

    Attributes
    ----------
    turn : float
        The place where V**2 becomes negative.
    touch : float
        The place where V**2 vanishes within its noise without changing its sign.
    load : float
        The place where N changes its sign.
    first : float
        The smallest of these.
    """

    turn: float
    touch: float
    load: float
    first: float


@Inner
def equilibrium_near(work, direction, touch):  # type: ignore[no-untyped-def]
    """Return the place x near ``touch`` at which the force vanishes, so that V**2, which almost vanishes there, is
    smallest.
    """
    for j in range(COUNT):
        work[MEAN + j] = direction * (work[P + j] - work[Q + j] * work[W + j])
    to_coefficients(work, MEAN, work, SERIES)
    c = work[SERIES : SERIES + COUNT]
    x, new = touch, touch + 1e-4
    before = chebyshev_sum(c, x)
    for _ in range(30):  # the secant method
        value = chebyshev_sum(c, new)
        if value == before:
            break
        x, before, new = new, value, new - value * (new - x) / (value - before)
    return new if fabs(new - touch) <= 1e-2 else touch


@Inner
def first_changes(march, panel, largest_v2, load_change, work):  # type: ignore[no-untyped-def]
    """Return the first changes on a panel, on which N changes its sign at x = ``load_change``."""
    if panel.v2 == 0.0:
        scale = size_of(work, FORCE)
    else:
        scale = max(as_factor(largest_v2, march, panel.left), work[size_at(W_FACTOR)])
    turn, _, touch = first_change_of(work, W_FACTOR, 1, CANCELLATION_NOISE * scale)
    if touch <= -1.0 and panel.v2 == 0.0:
        touch = 2.0
    return Change(turn, touch, load_change, min(turn, touch, load_change))


@Inner
def changes_at_once(march, panel, width, change, run_length):  # type: ignore[no-untyped-def]
    """Return whether N is zero at the panel's start, so that its sign on the panel is decided by what follows."""
    if change.first == change.load and change.first <= 1.0:
        where = distance(panel.left + width * (0.5 * (1.0 + change.first)), march)
        here = march.origin[0] + march.direction * run_length
        return where <= run_length + MIN_RELATIVE_WIDTH * max(fabs(here), run_length)
    return False


@Inner
def cut_panel(forces, march, panel, width, change, run_length, work, point):  # type: ignore[no-untyped-def]
    """Lay a panel once more, so that it ends at the first change; return the march variable there.

    The sum over the shorter panel has more digits than the series of the wider one.
    """
    x = change.first
    if x == change.touch and x != change.turn:
        x = equilibrium_near(work, forces.direction, change.touch)
    right = panel.left + width * (0.5 * (1.0 + x))
    begin_panel(forces, march, panel, right - panel.left, work)
    solve_panel(forces, march, panel, nan, work)
    fill_rates(march, panel, work)
    if change.first == change.turn and forces.linear:
        v2, there = work[W + COUNT], distance(right, march)
        place = within(march.origin[0] + march.direction * there, panel.span)
        slope = slope_of_v2(forces, place, v2, panel.contact_sign, point)
        if fabs(v2) < fabs(slope) * 1e-6 * (there - run_length):
            right = marched(there - v2 / slope, march)
    elif change.first == change.load and change.first != change.touch:
        # N at the panel's end is free of the error of a series, and so is the remaining distance to the zero of N.
        load, load_before = work[LOAD + COUNT], work[LOAD + COUNT - 1]
        rate = (load - load_before) / (work[OFFSET + COUNT] - work[OFFSET + COUNT - 1])
        if fabs(load) < fabs(rate) * 1e-6 * (right - panel.left):
            right -= load / rate
    return right
