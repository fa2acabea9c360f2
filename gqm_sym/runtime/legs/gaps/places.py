"""The places kept of a gap for laws whose rows depend on V**2, and V**2 on a gap from them.

Such laws are neither linear in V**2 nor become so without friction, as that of linear drag. What follows from them on
gaps is kept in `flows` and `turn_flows`.
"""

from math import inf, nan

from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.legs.gaps.data import FASTEST, FILLED, FIRST_LINE, FIRST_ROW, LINE_COLUMNS, LINES, TAG
from gqm_sym.runtime.legs.panels.equation import (
    ARC_RATE,
    FORCE,
    NODES,
    OFFSET,
    D,
    March,
    Panel,
    copy,
    copy_row,
    product,
)
from gqm_sym.runtime.legs.panels.polynomials import size_of
from gqm_sym.runtime.legs.panels.resolution import examine, fits
from gqm_sym.runtime.legs.panels.solving import begin_panel, solve_nonlinear
from gqm_sym.runtime.legs.panels.widest import is_force_resolved


@Inlined
def has_flows(forces):  # type: ignore[no-untyped-def]
    """Return whether the law is neither linear in V**2 nor becomes so without friction."""
    return not forces.linear and forces.squared_contact == 0


@Inner
def fill_places(forces, march, panel, width, gaps, at, work):  # type: ignore[no-untyped-def]
    """Keep the places of the nodes of a gap, from ``gaps[at]`` on, and forget its lines."""
    begin_panel(forces, march, panel, width, work)
    copy(gaps, at + FIRST_ROW, work, ARC_RATE)
    for k in range(LINES):
        gaps[at + FIRST_LINE + k * LINE_COLUMNS + TAG] = 0.0
    gaps[at], gaps[at + FASTEST] = FILLED, inf


@Inner
def solve_on_places(forces, v2, width, contact_sign, gaps, at, work):  # type: ignore[no-untyped-def]
    """Do the work of `data.solve_on_gap` by the places that are kept."""
    copy(work, ARC_RATE, gaps, at + FIRST_ROW)
    product(work, OFFSET, NODES, width)
    copy_row(work, D, OFFSET)
    march, panel = March((0.0, 0.0), forces.direction, 0.0, 1.0), Panel(0.0, v2, contact_sign, (-inf, inf))
    if not solve_nonlinear(forces, march, panel, nan, work) < inf:
        return False
    if forces.has_radius and not (fits(forces, work) and is_force_resolved(forces, march, panel, False, work)[0]):
        return False
    return examine(work, FORCE, size_of(work, FORCE))[2]
