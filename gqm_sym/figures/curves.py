"""The picture of a curve alone."""

from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.errors import InputError
from gqm_sym.figures.axes import figure_of, finished, new_axes, new_figure
from gqm_sym.optional import require

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@require("plot")
def drawn(points: Any, title: str, axes: Any = None) -> "Figure":
    """Draw the points of a curve, with its start and its direction; those of a space curve in three dimensions.

    Parameters
    ----------
    points : sequence of array_like
        The coordinates x and z, or x, y and z, in m and in the order of the parameter.
    title : str
        One line of text above it.
    axes : matplotlib Axes, optional
        The axes to draw on; by default a new figure is made.
    """
    if len(points) > 2:
        return _in_space(points, title, axes)
    axes = new_axes(axes)
    x, z = (np.asarray(coordinate) for coordinate in points)
    axes.plot(x, z, color="black")
    shown = np.flatnonzero(np.isfinite(x) & np.isfinite(z))
    if shown.size > 1:
        k, middle = shown[0], shown[shown.size // 2]
        axes.plot(x[k], z[k], "o", color="black")
        step = (x[middle] - x[middle - 1], z[middle] - z[middle - 1])
        axes.annotate(
            "", (x[middle], z[middle]), (x[middle] - step[0], z[middle] - step[1]), arrowprops={"arrowstyle": "->"}
        )
    axes.set_aspect("equal")
    axes.set_title(title)
    return finished(axes, "x (m)", "z (m)")


def _in_space(points: Any, title: str, axes: Any) -> "Figure":
    if axes is None:
        axes = new_figure(7, 5.5).add_subplot(projection="3d")
    elif not hasattr(axes, "set_zlabel"):
        raise InputError(
            "axes: a space curve needs axes in three dimensions, as add_subplot(projection='3d') makes them"
        )
    x, y, z = (np.asarray(coordinate) for coordinate in points)
    axes.plot(x, y, z, color="black")
    shown = np.flatnonzero(np.isfinite(x) & np.isfinite(y) & np.isfinite(z))
    if shown.size > 1:
        k, middle = shown[0], shown[shown.size // 2]
        axes.plot(x[k : k + 1], y[k : k + 1], z[k : k + 1], "o", color="black")
        ahead = [coordinate[middle] - coordinate[middle - 1] for coordinate in (x, y, z)]
        size = max(float(np.ptp(coordinate[shown])) for coordinate in (x, y, z))
        axes.quiver(x[middle], y[middle], z[middle], *ahead, length=0.1 * size, normalize=True, color="black")
    axes.set_aspect("equal")
    axes.set(title=title, xlabel="x (m)", ylabel="y (m)", zlabel="z (m)")
    return figure_of(axes)
