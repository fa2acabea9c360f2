"""Animations of motions, as files."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.errors import InputError
from gqm_sym.figures.axes import new_figure
from gqm_sym.figures.motions import FORCE_LABEL, draw_in_space, sampled, track
from gqm_sym.figures.rides import LOAD_LABEL
from gqm_sym.optional import require
from gqm_sym.runtime.charts.train import TrackOfTrain
from gqm_sym.runtime.motion.motion import end_of_legs, horizon

# Formats of animations, by the extension of the file.
ANIMATED = (".gif", ".mp4")

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gqm_sym.runtime.motion.motion import Motion


@require("plot")
def animate(motion: "Motion", path: "str | Path", *, duration: float | None = None, rate: int = 25) -> None:
    """Write an animation of the body, or of all cars of a train, on its track; a space curve is shown in three
    dimensions.

    Parameters
    ----------
    motion : Motion
        The motion to show.
    path : path
        The file to write. Its extension selects the format: ``.gif``, or ``.mp4`` if ffmpeg is installed.
    duration : float, optional
        Length of the animation in seconds of motion, from the launch on. Without it one period is shown, or the whole
        motion if it does not repeat.
    rate : int
        Frames per second.

    Raises
    ------
    InputError
        If ``duration`` is not positive, or the extension belongs to no such format.
    """
    from matplotlib.animation import FuncAnimation

    end = min(horizon(motion), end_of_legs(motion)) if duration is None else float(duration)
    if not end > 0.0:
        raise InputError(f"animate: duration: must be positive, got {duration!r}")
    if Path(path).suffix.lower() not in ANIMATED:
        raise InputError(f"animate: path: must end in one of {', '.join(ANIMATED)}, got {str(path)!r}")
    times = np.arange(0.0, end, 1.0 / rate)
    frames = motion.state(times)
    is_train = isinstance(motion.problem.formulas.chart, TrackOfTrain)
    bodies = motion.cars(times) if is_train else frames
    in_space = motion.problem.formulas.path_in_space is not None
    figure = _ride(motion) if in_space else track(motion)
    style: dict[str, Any] = {"marker": "o", "color": "black", "markersize": 6 if is_train else 12, "zorder": 9}
    body: Any
    (body,) = figure.axes[0].plot(*([[]] * (3 if in_space else 2)), **style)
    title = figure.axes[0].set_title("")

    def step(k: int) -> tuple[Any, ...]:
        x, y, z = (np.atleast_1d(row[..., k]) for row in (bodies.x, getattr(bodies, "y", bodies.z), bodies.z))
        if in_space:
            body.set_data_3d(x, y, z)
        else:
            body.set_data(x, z)
        title.set_text(f"{times[k]:.2f} s   {abs(frames.v[k]):.2f} m/s")
        return body, title

    FuncAnimation(figure, step, frames=times.size, blit=False).save(path, fps=rate)


def _ride(motion: "Motion") -> "Figure":
    """Return the track in three dimensions, coloured by the vertical load on riders, or by the contact force."""
    figure, states = new_figure(8, 6), sampled(motion)
    view = figure.add_subplot(projection="3d")
    if motion.problem.formulas.rider_loads is None:
        draw_in_space(view, states, states.normal_force, FORCE_LABEL)
    else:
        draw_in_space(view, states, states.n_vertical, f"vertical {LOAD_LABEL}")
    return figure
