"""Smoothing splines of degree 5: the curve near the points that minimises a cost with its third derivative.

The spline f has the least ``sum |p_i - f(u_i)|**2 + weight * integral |D^3 f|**2``. A cubic one, whose cost is that of
the second derivative, would have kinks in its curvature and so in every load. Beyond the outermost points only the cost
is left, so that the third derivative vanishes at open ends, and the curvature continues linearly there.

SciPy's own smoothing spline is cubic, and FITPACK's (``splprep``), which may have degree 5, sets a few knots where they
fit the noise of these very points. With 1 cm of noise its loads are about as good, but the worst of them twice as
wrong; with 10 cm they are two to forty times as wrong, as its target is chosen; and it tells neither how many numbers
it fitted nor how good they are. Here the matrices are banded, and one Cholesky factorisation for each weight gives
both.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DEGREE = 5
# The derivative whose square is what roughness costs.
ORDER = 3
# A step in the logarithm of the weight, for a derivative by central differences: errors of 1e-7 and of rounding/1e-3.
STEP = 1e-3
# Numbers of dense matrices that are held at a time.
AT_ONCE = 4_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Basis:
    """B-splines between given places.

    Attributes
    ----------
    knots : array
        With those beyond the ends: repeated ends of an open track, or the next rounds of a closed one.
    size : int
        The number of functions.
    closed : bool
        Whether they are periodic.
    """

    knots: Array
    size: int
    closed: bool

    @classmethod
    def between(cls, sites: Array, *, closed: bool) -> "Basis":
        """Functions whose pieces meet at sites: the first and the last are the ends, one round apart if closed."""
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
        """The functions' values, or those of a derivative, as a sparse matrix with a row for each place."""
        from scipy import sparse
        from scipy.interpolate import BSpline

        if self.closed:
            u = self.low + np.remainder(u - self.low, self.high - self.low)
        knots, degree, every = self.knots, DEGREE, len(self.knots) - DEGREE - 1
        slopes = sparse.eye_array(every, format="csr")
        for _ in range(derivative):
            spans = knots[degree + 1 : -1] - knots[1 : -degree - 1]
            # Functions that begin and end at a repeated end do not count.
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
        """The integrals of products of third derivatives, exact by three nodes a piece."""
        sites = np.unique(self.knots[DEGREE : len(self.knots) - DEGREE])
        nodes, weights = np.polynomial.legendre.leggauss(ORDER)
        half = 0.5 * np.diff(sites)
        places = (sites[:-1] + half)[:, None] + half[:, None] * nodes
        bends = self.rows(places.ravel(), ORDER)
        from scipy import sparse

        return bends.T @ (sparse.diags_array((half[:, None] * weights).ravel()) @ bends)


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """A smoothing spline of one weight.

    Attributes
    ----------
    coefficients : (K, d) array
        Of its basis.
    factor : array
        The Cholesky factor of its matrix, in bands.
    residual : float
        The sum of the squared distances of points from it.
    freedom : float
        The number of numbers it fitted: the trace of the matrix that leads from points to their places on it.
    """

    coefficients: Array
    factor: Array
    residual: float
    freedom: float


class Smoother:
    """Smoothing splines through the same points at the same places, by weight.

    Parameters
    ----------
    u : (n,) array
        The place of each point on the curve.
    points : (n, d) array
    basis : Basis
    least : float
        The least weight that will be used.
    """

    def __init__(self, u: Array, points: Array, basis: Basis, least: float) -> None:
        self.basis = basis
        rows = basis.rows(u)
        self._sums = rows.T @ points
        gram, rough = (rows.T @ rows).tocoo(), basis.roughness().tocoo()
        # Folded in the middle, a ring of bands is a row of bands of twice the width.
        order = np.arange(basis.size)
        if basis.closed:
            order = np.where(2 * order < basis.size, 2 * order, 2 * (basis.size - 1 - order) + 1)
        self._order = order
        self._width = int(max(np.abs(order[part.row] - order[part.col]).max() for part in (gram, rough)))
        self._gram, self._rough = self._banded(gram), self._banded(rough)
        # Residuals of other splines follow from those of this one without the points, and without cancellation.
        self._product = rows.T @ rows
        self._reference = self._solved(self._factor(least), self._sums)
        left = points - rows @ self._reference
        self._left, self._residual = rows.T @ left, float(np.square(left).sum())

    def _banded(self, matrix: Any) -> Array:
        """The upper bands of a symmetric matrix, as SciPy has them."""
        row, column = self._order[matrix.row], self._order[matrix.col]
        upper = row <= column
        bands: Array = np.zeros((self._width + 1, self.basis.size))
        bands[(self._width + row - column)[upper], column[upper]] = matrix.data[upper]
        return bands

    def _factor(self, weight: float) -> Array:
        from scipy.linalg import cholesky_banded

        factor: Array = cholesky_banded(self._gram + weight * self._rough)
        return factor

    def fit(self, weight: float) -> Fit:
        """The spline of a weight."""
        factor = self._factor(weight)
        coefficients = self._solved(factor, self._sums)
        # The matrix's derivative in log(weight) is the part that is not fitted, and its trace that of log(det).
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
        """The solution with a matrix of which the factor is known."""
        from scipy.linalg import cho_solve_banded

        turned = np.empty_like(right)
        turned[self._order] = right
        solution: Array = cho_solve_banded((factor, False), turned)[self._order]
        return solution

    def spread(self, fit: Fit, u: Array, derivative: int) -> Array:
        """The standard deviation of a derivative of the spline at places, for points with one of 1.

        It is that of all curves that go with the points, where curves of small third derivative are likelier to begin
        with (Wahba 1983), and so holds what smoothing takes from the curve as well as what noise adds to it.
        """
        rows = self.basis.rows(u, derivative)
        spread: Array = np.empty(len(u))
        at_once = max(1, AT_ONCE // self.basis.size)
        for start in range(0, len(u), at_once):
            part = rows[start : start + at_once].toarray().T
            spread[start : start + at_once] = np.einsum("ij,ij->j", part, self._solved(fit.factor, part))
        return np.sqrt(spread)
