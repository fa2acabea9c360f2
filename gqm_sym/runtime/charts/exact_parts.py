"""Curves that consist of parts with formulas, in extended precision (`exact_normals.TrueCurve`)."""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.charts.chart import Chart
from gqm_sym.runtime.charts.double_double.making import Samples, sample_places
from gqm_sym.runtime.double_double.arithmetic import UNIT
from gqm_sym.runtime.multiprecision.exact_problem import two_doubles
from gqm_sym.runtime.multiprecision.fixed_point import Polynomials
from gqm_sym.runtime.multiprecision.gauss_legendre import gauss

# The type of a part: a function of the part's own parameter that returns x, z and their derivatives with respect to the
# parameter.
Part = Callable[[Any], tuple[Any, Any, Any, Any]]

# Steps of Newton's method.
MAX_STEPS = 60


class Parts:
    """Successive parts of a curve at one precision; the chart's ``origins`` say which piece belongs to which part.

    Parameters
    ----------
    part
        Gives each part.
    speed
        Gives the derivative of arc length with respect to the parameter of a part if it is the same everywhere, else
        None.
    """

    def __init__(
        self,
        context: Any,
        chart: Chart,
        part: Callable[[int], Part],
        speed: Callable[[int], Any] = lambda part: None,
    ) -> None:
        self._context, self._part, self._speed = context, cache(part), cache(speed)
        self._origins = [(int(part), low, high) for part, low, high in chart.origins.tolist()]
        self.ends = cache(self._ends)
        self.start = self.ends(int(np.argmin(np.abs(chart.edges[:-1]))))[0]  # where arc length is 0

    def _ends(self, k: int) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
        """Return the points at which a piece begins and ends."""
        part, *places = self._origins[k]
        begin, end = (self._part(part)(self._context.mpf(place))[:2] for place in places)
        return begin, end

    def length(self, k: int) -> Any:
        """Return the arc length between them."""
        context, (part, *places) = self._context, self._origins[k]
        low, high = (context.mpf(place) for place in places)
        constant = self._speed(part)
        if constant is not None:
            return (high - low) * constant

        def speed(place: Any) -> Any:
            return context.hypot(*self._part(part)(place)[2:])

        return gauss(context, speed, [low, high], context.dps)[0]

    def sample(self, k: int) -> Samples:
        """Return a piece at the Chebyshev points in double-double arithmetic (`double_double.pieces`)."""
        part, low, high = self._origins[k]
        at = self._part(part)
        return samples_between(self._context, lambda place: at(place)[:2], low, high)

    def intersect_normal(
        self, k: int, u: float, x: Any, z: Any, dx: Any, dz: Any, size: float
    ) -> tuple[Any, Any, Any, Any, Any]:
        """Return the point at which the line through (x, z) perpendicular to (dx, dz) meets the curve, the tangent
        there, and the arc length from the beginning of the part if the speed is constant on it, else None.
        """
        context, (part, low, high) = self._context, self._origins[k]
        at, enough = self._part(part), context.ldexp(size, -context.prec // 2)
        place = context.mpf(low + 0.5 * (1.0 + u) * (high - low))
        for _ in range(MAX_STEPS):
            at_x, at_z, rate_x, rate_z = at(place)
            ahead = (x - at_x) * dx + (z - at_z) * dz
            place += ahead / (rate_x * dx + rate_z * dz)
            if abs(ahead) <= enough:  # convergence is quadratic: the next step would be below rounding
                at_x, at_z, rate_x, rate_z = at(place)
                speed = context.sqrt(rate_x * rate_x + rate_z * rate_z)
                constant = self._speed(part)
                length = None if constant is None else place * constant
                return at_x, at_z, rate_x / speed, rate_z / speed, length
        raise SolutionError(f"the track near ({float(x)!r}, {float(z)!r}): Newton's method does not converge to it")


def samples_between(context: Any, coordinates: Callable[[Any], Sequence[Any]], low: float, high: float) -> Samples:
    """Return coordinates at the Chebyshev points between two places in double-double arithmetic
    (`double_double.pieces`).
    """
    middle, half = (context.mpf(high) + low) / 2, (context.mpf(high) - low) / 2
    places = (middle + half * sum(map(context.mpf, node)) for node in sample_places().T.tolist())
    found = np.array([[two_doubles(value) for value in coordinates(place)] for place in places])
    samples = np.ascontiguousarray(found.transpose(1, 2, 0))
    return samples, 4.0 * UNIT * float(np.abs(samples).max())


def polynomial(context: Any, begin: Any, unit: Any, x: Sequence[Any], z: Sequence[Any]) -> Part:
    """Return a part whose coordinates are polynomials in ``(place - begin)/unit``, lowest power first."""
    rows = Polynomials(context, (x, z))

    def at(place: Any) -> tuple[Any, Any, Any, Any]:
        (at_x, rate_x, _), (at_z, rate_z, _) = rows((place - begin) / unit)
        return at_x, at_z, rate_x / unit, rate_z / unit

    return at


def spiral(context: Any, pose: tuple[Any, Any, Any], length: Any, first: Any, last: Any, count: int) -> Part:
    """Return a line, an arc or a clothoid as Taylor series about the middles of ``count`` equal steps of length.

    Parameters
    ----------
    pose
        x, z and the angle of the tangent at its beginning.
    first, last
        Its curvature at the beginning and at the end.
    """
    step, bent = length / count, (last - first) / length
    x, z, angle = pose
    steps: list[Part] = []
    for k in range(count):
        middle = (k + context.mpf(1) / 2) * step
        turned = angle + middle * (first + middle * bent / 2)
        waves = _waves(context, turned, (first + middle * bent) * step, bent * step**2)
        terms = [[context.mpf(0), *(step * term / n for n, term in enumerate(row, start=1))] for row in waves]
        for row, begin in zip(terms, (x, z), strict=True):
            row[0] = begin - context.polyval(row[::-1], context.mpf(-1) / 2)
        x, z = (context.polyval(row[::-1], context.mpf(1) / 2) for row in terms)
        steps.append(polynomial(context, k + context.mpf(1) / 2, 1, *terms))

    def at(place: Any) -> tuple[Any, Any, Any, Any]:
        return steps[min(max(int(place), 0), count - 1)](place)

    return at


def _waves(context: Any, angle: Any, kappa: Any, bent: Any) -> tuple[list[Any], list[Any]]:
    """Return the Taylor coefficients in v of cos(a) and sin(a), with a(0) = ``angle`` and a' = kappa + bent*v.

    They follow from c' = -a' s and s' = a' c, and there are enough of them for |v| up to 1/2.
    """
    cosines, sines = [context.mpf(0), context.cos(angle)], [context.mpf(0), context.sin(angle)]
    n = 0
    while max(abs(value) for row in (cosines, sines) for value in row[-2:]) > context.ldexp(1, n - context.prec - 10):
        n += 1
        c, s = -kappa * sines[-1] - bent * sines[-2], kappa * cosines[-1] + bent * cosines[-2]
        cosines.append(c / n)
        sines.append(s / n)
    return cosines[1:], sines[1:]
