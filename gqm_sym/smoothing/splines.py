"""Smoothing splines of degree 5, which minimise the sum of squared distances from points and a cost of the third
derivative.

The spline f minimises ``sum |p_i - f(u_i)|**2 + weight * integral |D^3 f|**2``. A cubic spline, with a cost of the
second derivative, would have kinks in its curvature and therefore in all loads. Beyond the outermost points only the
cost remains, so that the third derivative vanishes at open ends, and the curvature continues linearly there.

SciPy's own smoothing spline is cubic, and that of FITPACK (``splprep``), which may have degree 5, places a few knots
where they fit the noise of the given points. With 1 cm of noise its loads are about as accurate, but the largest errors
are twice as large; with 10 cm they are two to forty times as large, depending on its target; and it reports neither the
effective number of fitted numbers nor their errors. Here the matrices are banded, and one Cholesky factorisation for
each weight gives both.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DEGREE = 5
# The order of the derivative whose square measures roughness.
ORDER = 3
# A step in the logarithm of the weight, for a derivative by central differences: errors of 1e-7 and of rounding/1e-3.
STEP = 1e-3
# The largest number of elements of dense matrices that are stored at a time.
MAX_DENSE_ELEMENTS = 4_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Basis:
    """B-splines between given places.

    Attributes
    ----------
    knots : array
        The knots, including those beyond the ends: repeated ends of an open track, or the next laps of a closed one.
    size : int
        The number of functions.
    closed : bool
        Whether the functions are periodic.
    """

    knots: Array
    size: int
    closed: bool

    @classmethod
    def between(cls, sites: Array, *, closed: bool) -> "Basis":
        """Return functions whose pieces meet at sites, of which the first and the last are the ends, one lap apart if
        closed.
        """
        low, high = sites[0], sites[-1]
        if not closed:
            knots = np.concatenate([[low] * DEGREE, sites, [high] * DEGREE])
            return cls(knots=knots, size=len(knots) - DEGREE - 1, closed=False)
        before, after = sites[-DEGREE - 1 : -1] - (high - low), sites[1 : DEGREE + 1] + (high - low)
        return cls(knots=np.concatenate([before, sites, after]), size=len(sites) - 1, closed=True)

    @property
    def low(self) -> float:
        """The start of the first piece."""
        return float(self.knots[DEGREE])

    @property
    def high(self) -> float:
        """The end of the last piece."""
        return float(self.knots[-DEGREE - 1])

    def rows(self, u: Array, derivative: int = 0) -> Any:
        """Return the functions' values, or those of a derivative, as a sparse matrix with a row for each place."""
        from scipy import sparse
        from scipy.interpolate import BSpline

        if self.closed:
            u = self.low + np.remainder(u - self.low, self.high - self.low)
        knots, degree, every = self.knots, DEGREE, len(self.knots) - DEGREE - 1
        slopes = sparse.eye_array(every, format="csr")
        for _ in range(derivative):
            spans = knots[degree + 1 : -1] - knots[1 : -degree - 1]
            # Functions that begin and end at a repeated end are omitted.
            rates = np.divide(degree, spans, out=np.zeros_like(spans), where=spans > 0.0)
            slopes = sparse.diags_array(rates) @ (slopes[1:] - slopes[:-1])
            knots, degree = knots[1:-1], degree - 1
        values = BSpline.design_matrix(np.clip(u, self.low, self.high), knots, degree) @ slopes
        if not self.closed:
            return sparse.csr_array(values)
        folded = sparse.csr_array(
            (np.ones(every), (np.arange(every), np.arange(every) % self.size)), shape=(every, self.size)
        )
        return sparse.csr_array(values @ folded)

    def spline(self, coefficients: Array) -> Any:
        """Return the spline with a row of coefficients for each function; its end pieces continue beyond open ends."""
        from scipy.interpolate import BSpline

        if not self.closed:
            return BSpline(self.knots, coefficients, DEGREE)
        return BSpline(
            self.knots, np.concatenate([coefficients, coefficients[:DEGREE]]), DEGREE, extrapolate="periodic"
        )

    def roughness(self) -> Any:
        """Return the integrals of products of third derivatives, which three nodes in each piece give exactly."""
        sites = np.unique(self.knots[DEGREE : len(self.knots) - DEGREE])
        nodes, weights = np.polynomial.legendre.leggauss(ORDER)
        half = 0.5 * np.diff(sites)
        places = (sites[:-1] + half)[:, None] + half[:, None] * nodes
        bends = self.rows(places.ravel(), ORDER)
        from scipy import sparse

        return bends.T @ (sparse.diags_array((half[:, None] * weights).ravel()) @ bends)


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """A smoothing spline for one weight.

    Attributes
    ----------
    coefficients : (K, d) array
        The coefficients of its basis functions.
    factor : array
        The Cholesky factor of its matrix, in bands.
    residual : float
        The sum of the squared distances of points from it.
    freedom : float
        The effective number of fitted numbers: the trace of the matrix that maps points to their places on the spline.
    """

    coefficients: Array
    factor: Array
    residual: float
    freedom: float


class Smoother:
    """Smoothing splines through the same points at the same places, for different weights.

    Parameters
    ----------
    u : (n,) array
        The place of each point on the curve.
    points : (n, d) array
    basis : Basis
    least : float
        The smallest weight that will be used.
    """

    def __init__(self, u: Array, points: Array, basis: Basis, least: float) -> None:
        self.basis = basis
        rows = basis.rows(u)
        self._sums = rows.T @ points
        gram, rough = (rows.T @ rows).tocoo(), basis.roughness().tocoo()
        # A cyclic band matrix that is folded in the middle is a band matrix of twice the width.
        order = np.arange(basis.size)
        if basis.closed:
            order = np.where(2 * order < basis.size, 2 * order, 2 * (basis.size - 1 - order) + 1)
        self._order = order
        self._width = int(max(np.abs(order[part.row] - order[part.col]).max() for part in (gram, rough)))
        self._gram, self._rough = self._banded(gram), self._banded(rough)
        # Residuals of other splines follow from those of this one, without the points and without cancellation.
        self._product = rows.T @ rows
        self._reference = self._solved(self._factor(least), self._sums)
        left = points - rows @ self._reference
        self._left, self._residual = rows.T @ left, float(np.square(left).sum())

    def _banded(self, matrix: Any) -> Array:
        """Return the upper bands of a symmetric matrix in SciPy's form."""
        row, column = self._order[matrix.row], self._order[matrix.col]
        upper = row <= column
        bands: Array = np.zeros((self._width + 1, self.basis.size))
        bands[(self._width + row - column)[upper], column[upper]] = matrix.data[upper]
        return bands

    def _factor(self, weight: float) -> Array:
        """Return the Cholesky factor of the matrix for a weight.

        LAPACK is called directly: a choice of the weight takes over a thousand factors of small matrices, for which
        `scipy.linalg.cholesky_banded` needs eight times as long.

        Raises
        ------
        numpy.linalg.LinAlgError
            If the matrix is not positive definite in doubles.
        """
        from scipy.linalg.lapack import dpbtrf

        factor: Array
        factor, status = dpbtrf(self._gram + weight * self._rough, overwrite_ab=True)
        if status != 0 or not np.isfinite(factor[-1]).all():
            raise np.linalg.LinAlgError("the matrix of a smoothing spline is not positive definite")
        return factor

    def fit(self, weight: float) -> Fit:
        """Return the spline for a weight."""
        factor = self._factor(weight)
        coefficients = self._solved(factor, self._sums)
        # The derivative of the matrix with respect to log(weight) is its roughness part, and the trace of its solution
        # is the derivative of log(det).
        more, less = (np.log(self._factor(weight * np.exp(step))[-1]).sum() for step in (STEP, -STEP))
        change = coefficients - self._reference
        gained = float((change * (self._product @ change - 2.0 * self._left)).sum())
        return Fit(
            coefficients=coefficients,
            factor=factor,
            residual=max(self._residual + gained, 0.0),
            freedom=float(self.basis.size - (more - less) / STEP),
        )

    def _solved(self, factor: Array, right: Array) -> Array:
        """Return the solution with a matrix whose factor is given."""
        from scipy.linalg.lapack import dpbtrs

        turned = np.empty(right.shape, order="F")
        turned[self._order] = right
        solution: Array = dpbtrs(factor, turned, overwrite_b=True)[0][self._order]
        return solution

    def spread(self, fit: Fit, u: Array, derivative: int) -> Array:
        """Return the standard deviation of a derivative of the spline at places, for points with a standard deviation
        of 1.

        It is that of all curves that are compatible with the points, if curves with small third derivatives have a
        higher prior probability (Wahba 1983). So it contains the bias of smoothing as well as the noise.
        """
        rows = self.basis.rows(u, derivative)
        spread: Array = np.empty(len(u))
        at_once = max(1, MAX_DENSE_ELEMENTS // self.basis.size)
        for start in range(0, len(u), at_once):
            part = rows[start : start + at_once].toarray().T
            spread[start : start + at_once] = np.einsum("ij,ij->j", part, self._solved(fit.factor, part))
        return np.sqrt(spread)
