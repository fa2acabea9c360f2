"""The picture of a curve alone."""

from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.figures.axes import finished, new_axes
from gqm_sym.optional import require

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@require("plot")
def drawn(x: Any, z: Any, title: str, axes: Any = None) -> "Figure":
    """Draw the points of a curve, with its start and its direction.

    Parameters
    ----------
    x, z : array_like
        Coordinates in m, in the order of the parameter.
    title : str
        One line above it.
    axes : matplotlib Axes, optional
        Where to draw. Without it a new figure is made.
    """
    axes = new_axes(axes)
    x, z = np.asarray(x), np.asarray(z)
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
