"""The report on a smoothed track: its distances from the measured points, and the errors of its curvature."""

from dataclasses import dataclass

import numpy as np

from gqm_sym.smoothing.splines import Array

# The standard acceleration of free fall, the unit of loads.
STANDARD_GRAVITY = 9.80665


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Smoothing:
    """The changes that smoothing made to surveyed points, and the accuracy of the track; lengths in metres.

    Attributes
    ----------
    given : float or None
        The standard deviation that was given; None if it was found by cross-validation.
    standard_deviation : float
        The standard deviation of each coordinate of the points, estimated from their distances to the track.
    rms, largest_shift : float
        The root mean square and the largest of the distances from the points to the track.
    parameter : float
        The spline minimises the sum of squared distances + parameter * integral of the squared third derivative.
    width : float
        The meaning of the parameter: waves longer than about 2 pi width are kept, and shorter ones are removed.
    degrees_of_freedom : float
        The effective number of fitted numbers for each coordinate.
    s, curvature, curvature_error : array
        Arc lengths from the start of the track, its curvature there in 1/m, and the standard error of that curvature.
        The error contains the remaining noise and the bias of smoothing, at open ends as well, where it is several
        times as large. It does not contain deviations of the real track between two points. In space the curvature has
        no sign, and the error is that of each of its components.
    points, places : (n, d) array
        The measured points, and the places of the track that are nearest to them.
    places_s, shifts : (n,) array
        Arc lengths of these places, and the distances of the points from them; positive to the left of increasing arc
        length, in space without a sign.
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
        """Return the standard error of the load at a speed.

        Parameters
        ----------
        speed : float
            The speed in m/s.

        Returns
        -------
        array
            The error in units of 9.80665 m/s**2, at the arc lengths ``s``.
        """
        return self.curvature_error * (speed * speed / STANDARD_GRAVITY)

    def __str__(self) -> str:
        how = "by cross-validation" if self.given is None else f"given {self.given:.3g} m"
        return "\n".join(
            (
                f"{len(self.points)} points, smoothed ({how})",
                f"  shifts           {self.rms:.3g} m root mean square, {self.largest_shift:.3g} m at most",
                f"  scatter          {self.standard_deviation:.3g} m standard deviation, estimated from the points",
                f"  kept             waves longer than {2.0 * np.pi * self.width:.3g} m; "
                f"{self.degrees_of_freedom:.1f} degrees of freedom",
                f"  curvature error  {np.median(self.curvature_error):.2g} 1/m median, "
                f"{self.curvature_error.max():.2g} 1/m at most",
            )
        )

    def __repr__(self) -> str:
        return (
            f"<smoothing of {len(self.points)} points: standard deviation {self.standard_deviation:.3g} m, "
            f"largest shift {self.largest_shift:.3g} m>"
        )
