"""The data of each panel in the table of a curve: the parts of the potential and of the contact force.

The curve is cut into panels on which they are polynomials to rounding. The potential on a panel is stored relative to
its value at the left edge, so that it keeps all its digits however small the panel is. Potential and load are sums of
parts, each times a factor that depends on run-time parameters alone (`interface.SeparatedTerms`). The table has the
parts, and for each launch they are combined on the panels that it reaches (`panel_forces`).
"""

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.polynomial.legendre import leggauss, legvander

from gqm_sym.runtime.compiled.types import MATRIX, REAL, VECTOR, Array

# The number of Gauss points of a panel, that of the rule for panels far from turning points, and the number of places
# at which loads are sampled.
NODES, FEW_NODES, SAMPLES = 16, 8, 10

# Bernstein ellipses (sums of half axes) in which V**2 must not vanish for these rules to be accurate to rounding.
ELLIPSE, FEW_ELLIPSE = 3.2, 10.0

# The data of the path on a panel: weights in m at the Gauss points of both rules; coefficients of ds/dlam and kappa in
# powers of x in [-1, 1]; kappa at the samples; whether ds may vanish; and half the panel's length in lam. Then
# coefficients and samples of what is added to N/m for each unit of ds/dt. Of a space curve on which a body may lose
# contact, kappa and the load belong to the component of N along the upward direction of riders.
WEIGHTS, FEW_WEIGHTS, DS_TERMS, KAPPA_TERMS = 0, NODES, NODES + FEW_NODES, 2 * NODES + FEW_NODES
KAPPA_SAMPLES = KAPPA_TERMS + NODES
MAY_STOP = KAPPA_SAMPLES + SAMPLES
HALF = MAY_STOP + 1
CORIOLIS_TERMS = HALF + 1
CORIOLIS_SAMPLES = CORIOLIS_TERMS + NODES
PATH_ROW = CORIOLIS_SAMPLES + SAMPLES
# The data of a part of the potential on a panel. These numbers suffice far from turning points: the potential at the
# left edge relative to the reference, as two doubles; its increase from edge to edge; its mean; the largest difference
# from the mean on the panel and in both ellipses; the size of the terms of the first number; and the potential at the
# samples.
BASE, BASE_LOW, INCREASE, MIDDLE, SPREAD, REACH, FEW_REACH, BASE_SIZE, POTENTIAL_SAMPLES = range(9)
FEW_POTENTIAL = POTENTIAL_SAMPLES + 1
# Then the potential relative to either edge: relative to the left edge it is r*(c0 + c1*r + c2*r**2 + ...) with r = 1 +
# x, and relative to the right edge the same with r = x - 1, so that it keeps all its digits next to an edge even if the
# first coefficients vanish there. Then the coefficients of x, x**2, ... about the middle of the panel; finally its
# values at the Gauss points, and its Legendre coefficients.
LEFT_TERMS = POTENTIAL_SAMPLES + SAMPLES
RIGHT_TERMS, MIDDLE_TERMS, POTENTIAL, SERIES = (LEFT_TERMS + k * NODES for k in range(1, 5))
POTENTIAL_ROW = SERIES + NODES
# The data of a part of the load n0 on a panel: coefficients of powers of x, and values at the samples. A row of
# `panel_forces` has both kinds of data.
LOAD_TERMS, LOAD_SAMPLES = POTENTIAL_ROW, POTENTIAL_ROW + NODES
LOAD_ROW = NODES + SAMPLES


def _gauss(n: int) -> tuple[Array, Array, Array]:
    """Return Gauss points, their weights, and the matrix that maps values at the points to Legendre coefficients.

    Weights and matrix are accurate for the points as doubles; the weights of `leggauss` have errors of 70 units in the
    last place.
    """
    points = leggauss(n)[0]
    values = legvander(points.astype(np.longdouble), n - 1)
    factors = np.linalg.inv(values.astype(np.float64)).astype(np.longdouble)
    for _ in range(2):
        factors = factors + factors @ (np.eye(n) - values @ factors)
    return points, (2.0 * factors[0]).astype(np.float64), factors.T.astype(np.float64)


# FIT maps values at the Gauss points to Legendre coefficients, and `powers` maps these to coefficients of powers.
POINTS, GAUSS_WEIGHTS, FIT = _gauss(NODES)
FEW_POINTS, FEW_GAUSS_WEIGHTS, _ = _gauss(FEW_NODES)
SAMPLE_POINTS = np.concatenate([[-1.0], FEW_POINTS, [1.0]])
# The largest values of Legendre polynomials in the ellipses.
GROWTH, FEW_GROWTH = (legvander(np.array([0.5 * (e + 1.0 / e)]), NODES - 1)[0] for e in (ELLIPSE, FEW_ELLIPSE))


class CurveTable(NamedTuple):
    """A tabulated curve.

    Attributes
    ----------
    edges : (n+1,) array
        The places at the edges of the panels; n is 0 if there is no table.
    edge_lows : (n+1,) array
        The rounding errors of the edges.
    paths : (n, PATH_ROW) array
        The data of the path on each panel.
    parts : (n, potentials*POTENTIAL_ROW + loads*LOAD_ROW) array
        The data of the parts of the potential and of the load on each panel.
    potentials : int
        The number of parts of the potential.
    is_exact : bool
        Whether potential and lengths were rounded from double-double arithmetic.
    least_slope : float
        The slope of the potential below which the table of a curve with formulas has fewer digits than these; 0 for
        charts.
    """

    edges: Any
    edge_lows: Any
    paths: Any
    parts: Any
    potentials: Any
    is_exact: Any
    least_slope: Any


TABLE = types.NamedTuple((VECTOR, VECTOR, MATRIX, MATRIX, types.int64, types.boolean, REAL), CurveTable)
NO_TABLE = CurveTable(np.empty(0), np.empty(0), np.empty((0, PATH_ROW)), np.empty((0, 0)), 0, False, 0.0)
