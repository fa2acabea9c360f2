"""The data of each panel in the table of a curve: the parts of the potential and of the contact force.

The curve is cut into panels on which they are polynomials to rounding. The potential on a panel is that above its left
edge, so that it has all its digits however small the panel is. Potential and load are sums of parts, each times a
factor that depends on run-time parameters alone (`interface.SeparatedTerms`): the table has the parts, and a launch
puts together its own potential on the panels that it comes to (`panel_forces`).
"""

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.polynomial.legendre import leggauss, legvander

from gqm_sym.runtime.compiled.types import MATRIX, VECTOR, Array

# Gauss points of a panel, of the rule for panels far from turning points, and places at which loads are sampled.
NODES, FEW_NODES, SAMPLES = 16, 8, 10

# Bernstein ellipses (sums of half axes) in which V**2 must not vanish for these rules to be accurate to rounding.
ELLIPSE, FEW_ELLIPSE = 3.2, 10.0

# What a panel has of the path: weights in m at the Gauss points, and at fewer of them; powers of x in [-1, 1] for
# ds/dlam and kappa; kappa at the samples; whether ds may vanish; and half the panel's length in lam.
WEIGHTS, FEW_WEIGHTS, DS_TERMS, KAPPA_TERMS = 0, NODES, NODES + FEW_NODES, 2 * NODES + FEW_NODES
KAPPA_SAMPLES = KAPPA_TERMS + NODES
MAY_STOP = KAPPA_SAMPLES + SAMPLES
HALF = MAY_STOP + 1
PATH_ROW = HALF + 1
# What it has of a part of the potential. Numbers that suffice far from turning points: the potential of the left edge
# above the reference, two doubles; its increase from edge to edge; its mean; by how much it differs from that on the
# panel and in both ellipses, at most; the size of what the first is a sum of; and the potential at the samples.
BASE, BASE_LOW, INCREASE, MIDDLE, SPREAD, REACH, FEW_REACH, BASE_SIZE, POTENTIAL_SAMPLES = range(9)
FEW_POTENTIAL = POTENTIAL_SAMPLES + 1
# Then the potential from either edge: above that of the left edge it is r*(c0 + c1*r + c2*r**2 + ...) with r = 1 + x,
# and above that of the right edge the same with r = x - 1, so that it has all its digits next to an edge, however many
# of the first coefficients vanish there. Then the coefficients of x, x**2, ... about the middle of the panel; at last
# its values at the Gauss points, and its Legendre coefficients.
LEFT_TERMS = POTENTIAL_SAMPLES + SAMPLES
RIGHT_TERMS, MIDDLE_TERMS, POTENTIAL, SERIES = (LEFT_TERMS + k * NODES for k in range(1, 5))
POTENTIAL_ROW = SERIES + NODES
# What it has of a part of the load n0: powers of x, and values at the samples. A row of `panel_forces` has both.
LOAD_TERMS, LOAD_SAMPLES = POTENTIAL_ROW, POTENTIAL_ROW + NODES
LOAD_ROW = NODES + SAMPLES


def _gauss(n: int) -> tuple[Array, Array, Array]:
    """Gauss points, their weights, and factors that take values at the points to Legendre coefficients.

    They are exact for the points as doubles; the weights of `leggauss` are off by 70 last places.
    """
    points = leggauss(n)[0]
    values = legvander(points.astype(np.longdouble), n - 1)
    factors = np.linalg.inv(values.astype(np.float64)).astype(np.longdouble)
    for _ in range(2):
        factors = factors + factors @ (np.eye(n) - values @ factors)
    return points, (2.0 * factors[0]).astype(np.float64), factors.T.astype(np.float64)


# FIT takes values at the Gauss points to Legendre coefficients, and `powers` takes these to powers.
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
        What these are rounded by.
    paths : (n, PATH_ROW) array
        What the panels have of the path.
    parts : (n, potentials*POTENTIAL_ROW + loads*LOAD_ROW) array
        What they have of the parts of the potential and of the load.
    potentials : int
        The number of parts of the potential.
    is_exact : bool
        Whether potential and lengths were rounded from double-double arithmetic.
    """

    edges: Any
    edge_lows: Any
    paths: Any
    parts: Any
    potentials: Any
    is_exact: Any


TABLE = types.NamedTuple((VECTOR, VECTOR, MATRIX, MATRIX, types.int64, types.boolean), CurveTable)
NO_TABLE = CurveTable(np.empty(0), np.empty(0), np.empty((0, PATH_ROW)), np.empty((0, 0)), 0, False)
