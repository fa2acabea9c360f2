"""The figure of a surveyed track: its points, the effect of smoothing on them, and the error of its curvature."""

from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.errors import InputError
from gqm_sym.figures.axes import finished, new_figure
from gqm_sym.optional import require

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINT, TRACK, BAND = "#d55e00", "#333333", "#0072b2"
# The largest number of points that are drawn.
MAX_DRAWN_POINTS = 20_000
# The number of standard errors on each side of the band, which contains some 95 of 100 places.
ERRORS = 2.0
# The distance from the track at which the largest shift is drawn, as a share of the track's size.
LARGEST_SHIFT_SHARE = 0.06
MILLIMETRES = 1e3


@require("plot")
def smoothing(curve: Any, axes: Any = None) -> "Figure":
    """Draw the effect of smoothing on the points of a sampled track: shifts, and the curvature with its error band.

    A track in space is drawn from above.

    Parameters
    ----------
    curve : Curve
        A curve that was declared with ``Curve.sampled(points, smoothing=...)``.
    axes : three matplotlib Axes, optional
        The axes of the track with its points, of the shifts, and of the curvature; by default a new figure is made.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the curve was not smoothed.
    """
    report = getattr(curve, "smoothing", None)
    if report is None:
        raise InputError("smoothing: the curve was not smoothed; declare it by Curve.sampled(points, smoothing=...)")
    if axes is None:
        figure = new_figure(7, 8)
        above, middle, below = figure.subplots(3, 1, height_ratios=(1.4, 1, 1))
        below.sharex(middle)
    else:
        above, middle, below = axes
    kept = np.unique(np.linspace(0, len(report.points) - 1, MAX_DRAWN_POINTS).astype(np.int64))
    order = np.argsort(report.places_s)
    size = float(np.ptp(report.places, axis=0).max())
    enlarged = _round(LARGEST_SHIFT_SHARE * size / report.largest_shift) if report.largest_shift > 0.0 else 1.0
    drawn = report.places + enlarged * (report.points - report.places)
    in_space = report.points.shape[1] > 2
    above.plot(*report.places[order, :2].T, color=TRACK, linewidth=1.2, label="smooth track")
    what = f"measured points, their shifts enlarged {enlarged:g} times" if enlarged > 1.0 else "measured points"
    above.plot(
        *drawn[kept, :2].T, ".", color=POINT, markersize=3, label=what, rasterized=len(kept) > MAX_DRAWN_POINTS // 4
    )
    above.set_aspect("equal", adjustable="datalim")
    finished(above, "x (m)", "y (m)" if in_space else "z (m)")
    above.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize="small", frameon=False)
    middle.plot(
        report.places_s[kept],
        MILLIMETRES * report.shifts[kept],
        ".",
        color=POINT,
        markersize=3,
        rasterized=len(kept) > MAX_DRAWN_POINTS // 4,
    )
    middle.axhline(0.0, color=TRACK, linewidth=0.8)
    rms = f"root mean square {MILLIMETRES * report.rms:.3g} mm, largest {MILLIMETRES * report.largest_shift:.3g} mm"
    middle.set_title(rms, fontsize="small")
    finished(middle, "arc length s (m)", "shift (mm)" if in_space else "shift to the left (mm)")
    off = ERRORS * report.curvature_error
    below.fill_between(
        report.s,
        report.curvature - off,
        report.curvature + off,
        color=BAND,
        alpha=0.3,
        linewidth=0.0,
        label=f"± {ERRORS:g} standard errors",
    )
    below.plot(report.s, report.curvature, color=BAND, linewidth=1.2, label="curvature")
    return finished(below, "arc length s (m)", "curvature (1/m)")


def _round(number: float) -> float:
    """Return the largest of 1, 2, 5, 10, 20 and so on that does not exceed a number; at least 1."""
    if number <= 1.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(number))
    return float(power * max(digit for digit in (1.0, 2.0, 5.0) if digit <= number / power))
