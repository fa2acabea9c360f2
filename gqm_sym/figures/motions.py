"""Figures of one motion: its track, its speed and contact force, its portrait, and animations."""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.errors import InputError
from gqm_sym.figures.axes import figure_of, finished, new_axes, new_figure
from gqm_sym.figures.portraits import portrait_of
from gqm_sym.optional import require
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.model import CompiledModel
from gqm_sym.runtime.motion.motion import horizon

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gqm_sym.runtime.motion.motion import Motion, State

SAMPLES = 801

# How far a portrait reaches beyond its motion, as a share of the motion's extent.
MARGIN = 0.4

# Orange where the contact force is along the normal (left of growing parameter), purple where against it.
COLOURS = "PuOr_r"
LINE = "#333333"
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
OTHER = ("X", "#666666")


@require("plot")
def track(motion: "Motion", axes: "Axes | None" = None) -> "Figure":
    """Draw the part of the track that a motion runs through, coloured by the contact force, with its events.

    Parameters
    ----------
    motion : Motion
        A periodic one is drawn over one period.
    axes : matplotlib Axes, optional
        Where to draw; a new figure if not given.
    """
    from matplotlib.collections import LineCollection
    from matplotlib.colors import TwoSlopeNorm

    axes = new_axes(axes)
    path = sampled(motion)
    points = np.stack([path.x, path.z], axis=1)
    force = 0.5 * (path.normal_force[1:] + path.normal_force[:-1])
    largest = float(np.nanmax(np.abs(path.normal_force), initial=0.0)) or 1.0
    line = LineCollection(
        list(np.stack([points[:-1], points[1:]], axis=1)),
        array=force,
        cmap=COLOURS,
        norm=TwoSlopeNorm(0.0, -largest, largest),
        linewidth=4,
        capstyle="round",
    )
    axes.plot(path.x, path.z, color=LINE, linewidth=5.5, solid_capstyle="round", zorder=1)
    axes.add_collection(line)
    for kind, x, z in _marks(motion):
        marker, colour = MARKERS.get(kind, OTHER)
        axes.plot(x, z, marker, color=colour, markeredgecolor="white", markersize=9, linestyle="none", label=kind)
    figure = figure_of(axes)
    figure.colorbar(line, ax=axes, label="contact force N (N)")
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    return finished(axes, "x (m)", "z (m)")


@require("plot")
def loads(motion: "Motion", axes: Any = None) -> "Figure":
    """Draw speed and contact force against arc length, with the events.

    Parameters
    ----------
    axes : pair of matplotlib Axes, optional
        Above for the speed, below for the load.
    """
    if axes is None:
        axes = new_figure(7, 5).subplots(2, 1, sharex=True)
    above, below = axes
    path = sampled(motion)
    above.plot(path.s, np.abs(path.v), color="#0072b2")
    below.plot(path.s, path.normal_force, color="#d55e00")
    below.axhline(0.0, color=LINE, linewidth=0.8)
    for event in motion.events:
        state = motion.state(min(event.t, motion.t_end))
        marker, colour = MARKERS.get(event.kind, OTHER)
        for axis, value in ((above, abs(state.v)), (below, state.normal_force)):
            axis.plot(state.s, value, marker, color=colour, markeredgecolor="white", linestyle="none", label=event.kind)
    above.set_ylabel("speed |V| (m/s)")
    above.grid(visible=True, alpha=0.3)
    return finished(below, "arc length s (m)", "contact force N (N)")


@require("plot")
def portrait(motion: "Motion", axes: "Axes | None" = None) -> "Figure":
    """Draw the phase portrait round the orbit of a conservative motion, with its separatrices; see `phase_portrait`.

    Parameters
    ----------
    axes : matplotlib Axes, optional
        Where to draw; a new figure if not given.
    """
    problem = motion.problem
    span = None
    if not problem.period:
        lam = sampled(motion).lam
        low, high = float(lam.min()), float(lam.max())
        margin = MARGIN * (high - low) or 1.0
        span = (max(low - margin, problem.low), min(high + margin, problem.high))
    launch = (problem.launch.lam0.value, motion.direction * problem.launch.v0.value)
    given = tuple(number.text for number in problem.p)
    assert isinstance(problem.formulas, CompiledModel)
    return portrait_of(problem.formulas, given, span, through=[launch], axes=axes)


@require("plot")
def animate(motion: "Motion", path: "str | Path", *, duration: float | None = None, rate: int = 25) -> None:
    """Write an animation of the body on its track.

    Parameters
    ----------
    path : path
        Of the file; its ending says the format (gif, or mp4 where ffmpeg is installed).
    duration : float, optional
        Seconds of motion to show; one period, or the whole motion, if not given.
    rate : int
        Frames a second.
    """
    from matplotlib.animation import FuncAnimation

    end = horizon(motion) if duration is None else float(duration)
    if not end > 0.0:
        raise InputError(f"duration: must be positive, got {duration!r}")
    frames = motion.state(np.arange(0.0, end, 1.0 / rate))
    figure = track(motion)
    (body,) = figure.axes[0].plot([], [], "o", color="black", markersize=12, zorder=9)

    def step(k: int) -> tuple[Any, ...]:
        body.set_data([frames.x[k]], [frames.z[k]])
        return (body,)

    FuncAnimation(figure, step, frames=len(frames.t), blit=True).save(path, fps=rate)


def sampled(motion: "Motion") -> "State":
    """States at times that crowd where the body is fast."""
    end = horizon(motion)
    marks = sorted({0.0, end, *(event.t for event in motion.events if event.t < end)})
    share = max(SAMPLES // max(len(marks) - 1, 1), 33)
    # Even steps in the angle of a half turn: a body is slow next to a turning point.
    turn = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, share))
    times: Array = np.concatenate([start + (stop - start) * turn for start, stop in pairwise(marks)] or [np.zeros(1)])
    return motion.state(np.minimum(times, motion.t_end))


def _marks(motion: "Motion") -> list[tuple[str, float, float]]:
    start = motion.state(0.0)
    return [("launch", start.x, start.z), *((event.kind, event.x, event.z) for event in motion.events)]


def drawing(motion: "Motion", what: str, axes: Any) -> "Figure":
    """Draw one of the figures of a motion by its name."""
    figures = {"track": track, "loads": loads, "portrait": portrait}
    if what not in figures:
        raise InputError(f"plot: what: must be one of {', '.join(figures)}, got {what!r}")
    return figures[what](motion, axes)
