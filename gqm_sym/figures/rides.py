"""The figure of a ride on a banked track: the track, and the loads on riders."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.arguments import one_of, short
from gqm_sym.errors import InputError
from gqm_sym.figures.axes import finished, new_figure
from gqm_sym.figures.motions import LINE_COLOUR, draw_in_space, sampled
from gqm_sym.optional import require
from gqm_sym.runtime.launch.kinds import LOADS
from gqm_sym.runtime.launch.rider import check_banked
from gqm_sym.runtime.motion.motion import end_of_legs, horizon

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gqm_sym.runtime.motion.motion import Motion

COLOURS = {"vertical": "#d55e00", "lateral": "#0072b2", "longitudinal": "#009e73"}
SEATS = {"first": "#d55e00", "middle": "#333333", "last": "#0072b2"}
# The number of times at which the loads in these cars are compared.
SEAT_TIMES = 4001
LOAD_LABEL = "load (9.80665 m/s²)"


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
    view.plot(path.track_x, path.track_y, path.track_z, color=LINE_COLOUR, linewidth=0.8)
    view.plot(path.x[:1], path.y[:1], path.z[:1], ">", color="black", label="launch")
    draw_in_space(view, path, path.n_vertical, f"vertical {LOAD_LABEL}")
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
        _limit(felt, levels.get(load, ()), colour, f"{load}, limit")
    finished(felt, "arc length s (m)", LOAD_LABEL)
    # Loads fill their axes, so that the legend stands above them.
    handles, labels = felt.get_legend_handles_labels()
    entries = dict(zip(labels, handles, strict=True))
    felt.legend(
        entries.values(),
        entries.keys(),
        loc="lower center",
        bbox_to_anchor=(0.5, 1.0),
        ncols=len(entries),
        fontsize="small",
    )
    return figure


@require("plot")
def seats(motion: "Motion", *, limits: Mapping[str, Sequence[float]] | None = None) -> "Figure":
    """Draw the loads on riders in the first, the middle and the last car of a train, against the place of their car.

    Parameters
    ----------
    motion : Motion
        The motion of a train on a banked track; a periodic one is drawn over one period.
    limits : mapping, optional
        Levels that are drawn beside the loads, as for `ride`.

    Returns
    -------
    matplotlib.figure.Figure
        Arc length is that of the curve in metres, loads are in units of 9.80665 m/s**2.

    Raises
    ------
    InputError
        If the body is not a train, no roll was declared, or the limits are not pairs of numbers.
    """
    check_banked(motion.problem.formulas, "seats")
    levels = _levels({} if limits is None else limits)
    cars = motion.cars(sampled(motion).t)
    figure = new_figure(9, 8)
    rows = figure.subplots(len(COLOURS), 1, sharex=True)
    for axes, load in zip(rows, COLOURS, strict=True):
        axes.axhline(0.0, color=LINE_COLOUR, linewidth=0.8)
        for seat, car in _seats(cars.lam.shape[0]):
            felt = getattr(cars, f"n_{load}")[car]
            axes.plot(cars.lam[car], felt, color=SEATS[seat], label=f"{seat} car", linewidth=1.2)
        _limit(axes, levels.get(load, ()), LINE_COLOUR, "limit")
        finished(axes, "arc length of the car s (m)" if axes is rows[-1] else "", f"{load} {LOAD_LABEL}")
        if axes is not rows[0]:
            axes.get_legend().remove()
    return figure


def seat_extremes(motion: "Motion") -> Iterator[tuple[Any, ...]]:
    """Yield the first, the middle and the last car of a train, each with the smallest and the largest of its loads."""
    cars = motion.cars(np.linspace(0.0, min(horizon(motion), end_of_legs(motion)), SEAT_TIMES))
    loads = [getattr(cars, f"n_{load}") for load in LOADS]
    for seat, car in _seats(cars.lam.shape[0]):
        yield seat, *(end(felt[car]) for felt in loads for end in (np.min, np.max))


def _seats(count: int) -> list[tuple[str, int]]:
    """Return three cars of a train by name and number."""
    return list(zip(SEATS, (count - 1, count // 2, 0), strict=True))


def _limit(axes: Any, levels: Sequence[float], colour: str, label: str) -> None:
    """Draw levels across axes."""
    for level in levels:
        axes.axhline(level, color=colour, linestyle="--", linewidth=1.0, label=label)


def _levels(limits: Any) -> dict[str, list[float]]:
    """Check and return the limits of each load."""
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
