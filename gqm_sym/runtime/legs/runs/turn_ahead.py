"""The turn ahead of a body by a law that contains the speed itself, as that of linear drag.

Up to a turn at the distance d such a law contains the root of d, so that no polynomial in the place resolves V**2
there. Seen from the turn, V**2 is smooth in the root of the distance (`panels.equation`). The distance of the turn is
that for which V**2, computed back from the turn to the body, is V**2 of the body; Newton's method finds it.
"""

from math import exp, fabs, inf, nan, sqrt

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.panels.breaks import place_after, within
from gqm_sym.runtime.legs.panels.equation import FORCE, LOAD, March, P, Panel, W, marched
from gqm_sym.runtime.legs.panels.point import LEAST_V2, ZERO_TOLERANCE, law_at_rest, slope_of_v2
from gqm_sym.runtime.legs.panels.polynomials import COUNT
from gqm_sym.runtime.legs.panels.resolution import examine, first_change_of, fits, set_sizes, size_at
from gqm_sym.runtime.legs.panels.solving import begin_panel, solve_panel
from gqm_sym.runtime.legs.panels.widest import ALWAYS, PanelRequest, are_all_resolved, next_panel
from gqm_sym.runtime.legs.runs.ends import END_NONE, END_TURN, end_at_once

# The largest number of distances that are tried, and the step as a share of the distance after which the next one would
# be rounding only.
MAX_TRIES, LAST_STEP = 12, 1e-8

# The largest noise of the force as a share of its size. With more, narrower panels follow the body farther.
MAX_NOISE = 1e-12


@Inner
def ends_at_turn(forces, place, contact_sign):  # type: ignore[no-untyped-def]
    """Return whether a law contains roots of V**2, if only with the coefficient 0: no panel goes beyond a turn then."""
    return law_at_rest(forces, place, contact_sign).grade > 0


@Inner
def distance_to_turn(forces, march, panel, run_length, limits, work, point):  # type: ignore[no-untyped-def]
    """Return the distance to the turn ahead of a body; NaN if no turn is found that a single panel resolves, on which N
    keeps its sign.

    Parameters
    ----------
    forces : Forces
    march : March
    panel : Panel
        The start of the panel that would be next.
    run_length : float
        The distance that the body has run.
    limits : (float, float)
        The distance at which the turn is expected, not positive if that is unknown, and the one up to which the curve
        is smooth.
    work, point : array
        Buffers.
    """
    v, span, (d, room) = march.direction, panel.span, limits
    here = place_after(march.origin, v * run_length)
    linear = -panel.v2 / slope_of_v2(forces, within(here[0], span), panel.v2, panel.contact_sign, point)
    # Next to the turn V**2 is nearly linear, and what was expected before may be farther off than the turn.
    if linear > 0.0:
        d = min(d, 2.0 * linear) if d > 0.0 else linear
    request = PanelRequest(inf, 0.0, 0.0, ALWAYS, True, False, False)
    for _ in range(MAX_TRIES):
        if not 0.0 < d < room:
            return nan
        turn = place_after(here, v * d)
        back, from_turn = March(turn, -v, 1.0, 0.0), Panel(0.0, 0.0, panel.contact_sign, span)
        begin_panel(forces, back, from_turn, sqrt(d), work)
        q = solve_panel(forces, back, from_turn, nan, work)
        steepness = -slope_of_v2(forces, within(turn[0], span), LEAST_V2, panel.contact_sign, point)
        if not (q < inf and steepness > 0.0):
            return nan
        set_sizes(0.0, 0.0, work)
        nu, noise = panel.contact_sign, ZERO_TOLERANCE * work[size_at(LOAD)]
        if not are_all_resolved(forces, back, from_turn, request, P, work)[0]:
            return nan
        if not fits(forces, work) or examine(work, FORCE, work[size_at(FORCE)])[0] > MAX_NOISE * work[size_at(FORCE)]:
            return nan
        if nu != 0 and first_change_of(work, LOAD, nu, noise)[0] <= 1.0:
            return nan
        # If the turn moves, V**2 at a fixed place changes as it does at the turn, less what resistance takes of it.
        step = (panel.v2 - work[W + COUNT]) / (steepness * exp(-q))
        d += step
        if fabs(step) <= LAST_STEP * d:
            return d if d < room else nan
    return nan


@Inner
def panel_or_end(forces, march, panel, request, start, limits, work, point):  # type: ignore[no-untyped-def]
    """Find the next panel of a run (`panels.widest.next_panel`), or the end of the run if there is none.

    Parameters
    ----------
    forces, march, panel, request
        As for `next_panel`.
    start : Start
        The start of the run.
    limits : (float, float)
        The distance that the body has run, and the one at which the curve has a break or ends.
    work, point : array
        Buffers.

    Returns
    -------
    width, step, timed
        As from `next_panel`.
    end : (int, float, float)
        The code of the end of the run, its distance and V**2; END_NONE and those at the panel's start if the width is
        not 0.
    """
    run_length, stop = limits
    here = within(march.origin[0] + march.direction * run_length, panel.span)
    if request.timing != ALWAYS and panel.left > 0.0 and ends_at_turn(forces, here, panel.contact_sign):
        expected = start.width - run_length if start.v2 == 0.0 else 0.0
        far = distance_to_turn(forces, march, panel, run_length, (expected, stop - run_length), work, point)
        if far == far:
            return 0.0, marched(run_length + far, march) - panel.left, False, (END_TURN, run_length + far, 0.0)
    width, step, timed = next_panel(forces, march, panel, request, work)
    end = (END_NONE, run_length, panel.v2)
    if width == 0.0:
        end = end_at_once(forces, march, panel, run_length, point)
    return width, step, timed, end
