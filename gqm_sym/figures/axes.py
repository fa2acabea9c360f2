"""Axes, labels and legends, which all figures share."""

from functools import lru_cache
from io import BytesIO
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def new_axes(axes: "Axes | None") -> "Axes":
    """Return the given axes, or those of a new figure if none are given."""
    if axes is not None:
        return axes
    new: Axes = new_figure(7, 4.5).subplots()
    return new


def new_figure(width: float, height: float) -> "Figure":
    """Return an empty figure of a size in inches. Notebooks show it with and without pyplot."""
    return _displayable_figure()(figsize=(width, height), layout="constrained")


@lru_cache(maxsize=1)
def _displayable_figure() -> "type[Figure]":
    from matplotlib.figure import Figure

    class DisplayableFigure(Figure):
        """A figure that IPython displays as an image."""

        def _repr_png_(self) -> bytes:
            stream = BytesIO()
            self.savefig(stream, format="png")
            return stream.getvalue()

    return DisplayableFigure


def figure_of(axes: "Axes") -> "Figure":
    """Return the figure to which the axes belong."""
    from matplotlib.figure import Figure

    figure = axes.figure
    while not isinstance(figure, Figure):  # a SubFigure
        figure = figure.figure
    return figure


def finished(axes: "Axes", x: str, y: str) -> "Figure":
    """Label the axes, put each kind of mark once into the legend, and return the figure."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(visible=True, alpha=0.3)
    handles, labels = axes.get_legend_handles_labels()
    entries = dict(zip(labels, handles, strict=True))
    if entries:
        axes.legend(entries.values(), entries.keys(), loc="best", fontsize="small")
    return figure_of(axes)
