"""What smoothing did to surveyed points, and how good the track is that came of it."""

from dataclasses import dataclass

import numpy as np

from gqm_sym.smoothing.splines import Array

# The standard acceleration of free fall, in which loads are told.
STANDARD_GRAVITY = 9.80665


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Smoothing:
    """What smoothing did to surveyed points; lengths in metres.

    Attributes
    ----------
    given : float or None
        The standard deviation that was given; None if the points told it by cross-validation.
    standard_deviation : float
        Of the points in each coordinate, as far as they tell it themselves: from their distances to the track.
    rms, largest_shift : float
        Root mean square and largest of the distances from the points to the track.
    parameter : float
        The spline's sum of squared distances + parameter * integral of the squared third derivative is the least.
    width : float
        What the parameter means: waves longer than about 2 pi width are kept, shorter ones are smoothed away.
    degrees_of_freedom : float
        How many numbers each coordinate was fitted with.
    s, curvature, curvature_error : array
        Arc lengths from the start of the track, its curvature there in 1/m, and the standard error of that curvature.
        It holds what noise adds and what smoothing takes away, at open ends as well, where it is several times as
        large. What a track does between two points is not in it. In space the curvature has no sign, and the error is
        that of each of its components.
    points, places : (n, d) array
        The points as measured, and the places of the track that are nearest to them.
    places_s, shifts : (n,) array
        Arc lengths of these places, and how far from them the points are; positive to the left of growing arc length,
        in space without a sign.
    """

    given: float | None
    standard_deviation: float
    rms: float
    largest_shift: float
    parameter: float
    width: float
    degrees_of_freedom: float
    s: Array
    curvature: Array
    curvature_error: Array
    points: Array
    places: Array
    places_s: Array
    shifts: Array

    def load_error(self, speed: float) -> Array:
        """The standard error of the load at a speed [m/s], in units of 9.80665 m/s**2, at the arc lengths ``s``."""
        return self.curvature_error * (speed * speed / STANDARD_GRAVITY)

    def __str__(self) -> str:
        how = "by cross-validation" if self.given is None else f"given {self.given:.3g} m"
        return "\n".join(
            (
                f"{len(self.points)} points, smoothed ({how})",
                f"  shifts           {self.rms:.3g} m root mean square, {self.largest_shift:.3g} m at most",
                f"  scatter          {self.standard_deviation:.3g} m standard deviation, as the points tell",
                f"  kept             waves longer than {2.0 * np.pi * self.width:.3g} m; "
                f"{self.degrees_of_freedom:.1f} degrees of freedom",
                f"  curvature error  {np.median(self.curvature_error):.2g} 1/m median, "
                f"{self.curvature_error.max():.2g} 1/m at most",
            )
        )
