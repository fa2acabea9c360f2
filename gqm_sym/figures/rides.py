"""The figure of a ride on a banked track: the track, and the loads on riders."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.arguments import one_of, short
from gqm_sym.errors import InputError
from gqm_sym.figures.axes import finished, new_figure
from gqm_sym.figures.motions import FORCE_COLOURS, LINE_COLOUR, sampled
from gqm_sym.optional import require
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.kinds import LOADS
from gqm_sym.runtime.launch.rider import check_banked

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gqm_sym.runtime.motion.motion import Motion

COLOURS = {"vertical": "#d55e00", "lateral": "#0072b2", "longitudinal": "#009e73"}


@require("plot")
def ride(motion: "Motion", *, limits: Mapping[str, Sequence[float]] | None = None) -> "Figure":
    """Draw a ride in three dimensions, coloured by the vertical load, with plan, elevation and all loads.

    Parameters
    ----------
    motion : Motion
        A motion on a banked track; a periodic one is drawn over one period.
    limits : mapping, optional
        Levels that are drawn beside the loads, in their unit: ``{"vertical": (-1, 5), "lateral": (-1.5, 1.5)}``.

    Returns
    -------
    matplotlib.figure.Figure
        Lengths are in metres, loads in units of 9.80665 m/s**2, and arc length is measured from the launch.

    Raises
    ------
    InputError
        If no roll was declared, or the limits are not pairs of numbers.
    """
    check_banked(motion.problem.formulas, "ride")
    levels = _levels({} if limits is None else limits)
    path = sampled(motion)
    figure = new_figure(11, 9)
    grid = figure.add_gridspec(3, 2, height_ratios=(1.5, 1.5, 2), width_ratios=(1.3, 1))
    view = figure.add_subplot(grid[:2, 0], projection="3d")
    line = _coloured(view, np.stack([path.x, path.y, path.z], axis=1), path.n_vertical)
    view.plot(path.track_x, path.track_y, path.track_z, color=LINE_COLOUR, linewidth=0.8)
    view.plot(path.x[:1], path.y[:1], path.z[:1], ">", color="black", label="launch")
    view.set_aspect("equal")
    # Smaller than its place, because the layout ignores the width of labels in three dimensions.
    view.set_box_aspect([np.ptp(ends()) for ends in (view.get_xlim, view.get_ylim, view.get_zlim)], zoom=0.85)
    view.locator_params(nbins=5)
    view.locator_params(axis="z", nbins=3)
    view.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)")
    figure.colorbar(line, ax=view, label="vertical load (9.80665 m/s²)", shrink=0.7, location="left")
    plan, elevation = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
    plan.plot(path.x, path.y, color=LINE_COLOUR)
    plan.plot(path.x[:1], path.y[:1], ">", color="black", label="launch")
    plan.set_aspect("equal", adjustable="datalim")
    finished(plan, "x (m)", "y (m)")
    elevation.plot(path.s, path.z, color=LINE_COLOUR)
    finished(elevation, "arc length s (m)", "z (m)")
    felt = figure.add_subplot(grid[2, :])
    felt.axhline(0.0, color=LINE_COLOUR, linewidth=0.8)
    for load, colour in COLOURS.items():
        felt.plot(path.s, getattr(path, f"n_{load}"), color=colour, label=load)
        for level in levels.get(load, ()):
            felt.axhline(level, color=colour, linestyle="--", linewidth=1.0, label=f"{load}, limit")
    return finished(felt, "arc length s (m)", "load (9.80665 m/s²)")


def _levels(limits: Any) -> dict[str, list[float]]:
    """The limits of each load, checked."""
    if not isinstance(limits, Mapping):
        raise InputError(f"limits: must be levels by load, as in {{'vertical': (-1, 5)}}, got {short(limits)}")
    found = {}
    for load, levels in limits.items():
        one_of(load, LOADS, where="limits")
        try:
            values = np.asarray(levels, dtype=np.float64).reshape(-1)
        except (TypeError, ValueError):
            values = np.full(1, np.nan)
        if not np.isfinite(values).all():
            raise InputError(f"limits: {load}: must be finite numbers, got {short(levels)}")
        found[load] = values.tolist()
    return found


def _coloured(view: Any, points: Array, values: Array) -> Any:
    """Draw a line in three dimensions in the colours of values at its points, white where these are 0."""
    from matplotlib.colors import TwoSlopeNorm
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    largest = float(np.nanmax(np.abs(values), initial=0.0)) or 1.0
    line = Line3DCollection(
        list(np.stack([points[:-1], points[1:]], axis=1)),
        array=0.5 * (values[1:] + values[:-1]),
        cmap=FORCE_COLOURS,
        norm=TwoSlopeNorm(0.0, -largest, largest),
        linewidth=4,
    )
    view.add_collection3d(line)
    return line
