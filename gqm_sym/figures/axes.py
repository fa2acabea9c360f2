"""What all figures share: axes to draw on, and how they are labelled."""

from functools import lru_cache
from io import BytesIO
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def new_axes(axes: "Axes | None") -> "Axes":
    """Axes to draw on: those given, or those of a new figure."""
    if axes is not None:
        return axes
    new: Axes = new_figure(7, 4.5).subplots()
    return new


def new_figure(width: float, height: float) -> "Figure":
    """An empty figure, its size in inches, which notebooks show whether pyplot is in use or not."""
    return _shown()(figsize=(width, height), layout="constrained")


@lru_cache(maxsize=1)
def _shown() -> "type[Figure]":
    from matplotlib.figure import Figure

    class Shown(Figure):
        """A figure that is a picture to IPython."""

        def _repr_png_(self) -> bytes:
            stream = BytesIO()
            self.savefig(stream, format="png")
            return stream.getvalue()

    return Shown


def figure_of(axes: "Axes") -> "Figure":
    """The figure that axes are part of."""
    from matplotlib.figure import Figure

    figure = axes.figure
    while not isinstance(figure, Figure):  # a figure within a figure
        figure = figure.figure
    return figure


def finished(axes: "Axes", x: str, y: str) -> "Figure":
    """Label the axes and list each kind of mark once."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(visible=True, alpha=0.3)
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    if once:
        axes.legend(once.values(), once.keys(), loc="best", fontsize="small")
    return figure_of(axes)
