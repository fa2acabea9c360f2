"""Figures of one motion: its track, its speed and contact force, its portrait, and animations."""

from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.errors import InputError
from gqm_sym.figures.axes import figure_of, finished, new_axes, new_figure
from gqm_sym.figures.portraits import portrait_of
from gqm_sym.optional import require
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.model import CompiledModel
from gqm_sym.runtime.motion.motion import end_of_legs, horizon

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gqm_sym.runtime.motion.events import Event
    from gqm_sym.runtime.motion.motion import Motion
    from gqm_sym.runtime.motion.state import State

# The number of states that are drawn, and the smallest number between two events.
MAX_SAMPLES, MIN_SAMPLES = 801, 33

# The number of states between neighbouring breaks of a track of many pieces, and the largest number of states on it.
SAMPLES_PER_BREAK, MOST_SAMPLES = 40, 4001

# The distance by which a phase portrait extends beyond its motion on each side, as a fraction of the motion's range.
PORTRAIT_MARGIN = 0.4

# An axis in three dimensions is no shorter than this share of the longest, which has so many ticks.
LEAST_SHARE, MOST_TICKS = 0.3, 6
# They lie within this share of the axis about its middle.
INNER_SHARE = 0.9

# The distances of the labels of three-dimensional axes from their ticks, in points.
LABEL_PADS = 16.0, 6.0, 2.0

# The track is orange where the contact force points along the normal (to the left of increasing parameter), and purple
# where it points against it.
FORCE_COLOURS = "PuOr_r"
LINE_COLOUR = "#333333"
FORCE_LABEL = "contact force N (N)"
MARKERS = {
    "launch": (">", "#000000"),
    "turn": ("o", "#0072b2"),
    "rest": ("s", "#000000"),
    "contact-sign": ("D", "#e69f00"),
    "liftoff": ("^", "#d55e00"),
    "corner": ("v", "#009e73"),
    "cusp": ("*", "#cc79a7"),
    "slip": ("P", "#56b4e9"),
}
OTHER_MARKER = ("X", "#666666")


@require("plot")
def track(motion: "Motion", axes: "Axes | None" = None) -> "Figure":
    """Draw the part of the track that the body passes, coloured by the contact force, with the events.

    Parameters
    ----------
    motion : Motion
        The motion; a periodic one is drawn over one period.
    axes : matplotlib Axes, optional
        The axes to draw on, which show the elevation of a space curve. By default a new figure is made, which shows a
        space curve in three dimensions.

    Returns
    -------
    matplotlib.figure.Figure
        Coordinates are in metres, contact forces in newtons.
    """
    from matplotlib.collections import LineCollection

    path = sampled(motion)
    if axes is None and motion.problem.formulas.path_in_space is not None:
        return _track_in_space(motion, path)
    axes = new_axes(axes)
    line = LineCollection(_segments(path.x, path.z), **_coloured(path.normal_force), capstyle="round")
    axes.plot(path.x, path.z, color=LINE_COLOUR, linewidth=5.5, solid_capstyle="round", zorder=1)
    axes.add_collection(line)
    for kind, x, z in _marks(motion):
        axes.plot(x, z, label=kind, **_marker(kind))
    figure = figure_of(axes)
    figure.colorbar(line, ax=axes, label=FORCE_LABEL)
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    return finished(axes, "x (m)", "z (m)")


def _track_in_space(motion: "Motion", path: "State") -> "Figure":
    """Draw a track in three dimensions, coloured by the contact force, with the events."""
    figure = new_figure(8, 6)
    view = figure.add_subplot(projection="3d")
    draw_in_space(view, path, path.normal_force, FORCE_LABEL)
    times = [("launch", 0.0), *((event.kind, event.t) for event in _shown_events(motion) if isfinite(event.t))]
    for kind, time in times:
        state = motion.state(min(time, horizon(motion)))
        view.plot(state.x, state.y, state.z, label=kind, zorder=9, **_marker(kind))
    finished(view, "x (m)", "y (m)")
    return figure


def draw_in_space(view: Any, path: Any, values: Array, label: str) -> None:
    """Draw the places of states on three-dimensional axes, in colours of the given values, with white for 0.

    A colour bar beside the axes shows the values under their ``label``.
    """
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    line = Line3DCollection(_segments(path.x, path.y, path.z), **_coloured(values))
    view.plot(path.x, path.y, path.z, color=LINE_COLOUR, linewidth=5.0)
    view.add_collection3d(line)
    _scale_equally(view)
    for axis, pad in zip("xyz", LABEL_PADS, strict=True):
        getattr(view, f"set_{axis}label")(f"{axis} (m)", labelpad=pad)
    # The bar is smaller than its space, because the layout does not know the width of three-dimensional labels.
    figure_of(view).colorbar(line, ax=view, label=label, shrink=0.7, location="left")


def _scale_equally(view: Any) -> None:
    """Let a metre be as long along all axes, of which none is so short that its labels overlap."""
    ends = np.array([view.get_xlim(), view.get_ylim(), view.get_zlim()])
    middles, spans = ends.mean(axis=1), np.ptp(ends, axis=1)
    shares = np.maximum(spans / spans.max(), LEAST_SHARE)
    for axis, middle, share in zip("xyz", middles, shares, strict=True):
        half = 0.5 * share * spans.max()
        getattr(view, f"set_{axis}lim")(middle - half, middle + half)
        view.locator_params(axis=axis, nbins=max(4, round(MOST_TICKS * share)))
        # Labels at the ends of axes overlap where two of these meet.
        ticks = getattr(view, f"get_{axis}ticks")()
        getattr(view, f"set_{axis}ticks")(ticks[np.abs(ticks - middle) < INNER_SHARE * half])
    view.set_box_aspect(shares, zoom=0.8)


def _segments(*coordinates: Array) -> list[Array]:
    """Return the lines between points."""
    points = np.stack(coordinates, axis=1)
    return list(np.stack([points[:-1], points[1:]], axis=1))


def _coloured(values: Array) -> dict[str, Any]:
    """Return the arguments that draw lines in the colours of values at their ends, with white for 0."""
    from matplotlib.colors import TwoSlopeNorm

    largest = float(np.nanmax(np.abs(values), initial=0.0)) or 1.0
    return {
        "array": 0.5 * (values[1:] + values[:-1]),
        "cmap": FORCE_COLOURS,
        "norm": TwoSlopeNorm(0.0, -largest, largest),
        "linewidth": 4,
    }


def _marker(kind: str) -> dict[str, Any]:
    """Return the arguments that draw the marker of an event."""
    marker, colour = MARKERS.get(kind, OTHER_MARKER)
    return {"marker": marker, "color": colour, "markeredgecolor": "white", "markersize": 9, "linestyle": "none"}


@require("plot")
def speed_and_force(motion: "Motion", axes: Any = None) -> "Figure":
    """Draw the speed and the contact force against the arc length, with the events.

    Parameters
    ----------
    motion : Motion
        The motion; a periodic one is drawn over one period.
    axes : pair of matplotlib Axes, optional
        The axes to draw on: the speed on the first, the contact force on the second; by default a new figure is made.

    Returns
    -------
    matplotlib.figure.Figure
        Arc length from the launch in metres, speed in m/s, contact force along the normal in newtons.
    """
    if axes is None:
        axes = new_figure(7, 5).subplots(2, 1, sharex=True)
    above, below = axes
    path = sampled(motion)
    above.plot(path.s, np.abs(path.v), color="#0072b2")
    below.plot(path.s, path.normal_force, color="#d55e00")
    below.axhline(0.0, color=LINE_COLOUR, linewidth=0.8)
    for event in _shown_events(motion):
        state = motion.state(min(event.t, horizon(motion)))
        marker, colour = MARKERS.get(event.kind, OTHER_MARKER)
        for axis, value in ((above, abs(state.v)), (below, state.normal_force)):
            axis.plot(state.s, value, marker, color=colour, markeredgecolor="white", linestyle="none", label=event.kind)
    above.set_ylabel("speed |V| (m/s)")
    above.grid(visible=True, alpha=0.3)
    return finished(below, "arc length s (m)", "contact force N (N)")


@require("plot")
def portrait(motion: "Motion", axes: "Axes | None" = None) -> "Figure":
    """Draw the phase portrait around the orbit of a conservative motion, with its separatrices; see `phase_portrait`.

    Parameters
    ----------
    motion : Motion
        A motion without friction, drag or resistance.
    axes : matplotlib Axes, optional
        The axes to draw on; by default a new figure is made.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    SolutionError
        If the motion loses energy.
    """
    problem = motion.problem
    span = None
    if not problem.period:
        lam = sampled(motion).lam
        low, high = float(lam.min()), float(lam.max())
        margin = PORTRAIT_MARGIN * (high - low) or 1.0
        span = (max(low - margin, problem.low), min(high + margin, problem.high))
    launch = (problem.launch.lam0.value, motion.direction * problem.launch.v0.value)
    given = tuple(number.text for number in problem.p)
    assert isinstance(problem.formulas, CompiledModel)
    return portrait_of(problem.formulas, given, span, through=[launch], axes=axes)


def sampled(motion: "Motion") -> "State":
    """Return states at times that lie closer together next to events, for smooth lines.

    Parameters
    ----------
    motion : Motion
        A periodic motion is sampled over one period, any other from the launch to its end.

    Returns
    -------
    State
        Arrays of some 800 states, in order of time, and of more along a track of many pieces.
    """
    end = horizon(motion)
    marks = sorted({0.0, end, *(event.t for event in _shown_events(motion) if event.t < end)})
    whole = max(MAX_SAMPLES, min(SAMPLES_PER_BREAK * motion.problem.functions.breaks.size, MOST_SAMPLES))
    count = max(whole // max(len(marks) - 1, 1), MIN_SAMPLES)
    # Steps that shorten towards both ends resolve the turning points, where the curves of speed and force are steep.
    fractions = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, count))
    times: Array = np.concatenate(
        [start + (stop - start) * fractions for start, stop in pairwise(marks)] or [np.zeros(1)]
    )
    return motion.state(np.minimum(times, end_of_legs(motion)))


def _marks(motion: "Motion") -> list[tuple[str, float, float]]:
    start = motion.state(0.0)
    return [("launch", start.x, start.z), *((event.kind, event.x, event.z) for event in _shown_events(motion))]


def _shown_events(motion: "Motion") -> list["Event"]:
    """Return the events up to the end of the drawn part of the motion, and the equilibrium that it approaches for
    ever.
    """
    end = horizon(motion)
    return [event for event in motion.events if event.t <= end or event.kind == "asymptote"]


def drawing(motion: "Motion", what: str, axes: Any) -> "Figure":
    """Draw one of the figures of a motion, given by name; the public method is `Motion.plot`."""
    figures = {"track": track, "speed_and_force": speed_and_force, "portrait": portrait}
    if what not in figures:
        raise InputError(f"plot: what: must be one of {', '.join(figures)}, got {what!r}")
    return figures[what](motion, axes)
