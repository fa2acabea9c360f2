"""Arc lengths on panels, which keep their digits next to turning points, where they grow with the square of the phase
angle.
"""

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.clenshaw import growth_beside_rest, legendre_growth
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR
from gqm_sym.runtime.quadrature.time_panels import panel_of

# A phase angle whose distance from an edge is below this share of half the width of the panel is beside the edge.
BESIDE_EDGE = 1.0 / 32.0


@Inner
def length_from_edge(edges, terms, k, phi, to_end, rests):  # type: ignore[no-untyped-def]
    """Return the index of an edge of the k-th panel, and the arc length in m from there to a phase angle.

    Parameters
    ----------
    edges : (n+1,) array
        Phase angles at the edges of the panels.
    terms : (n, m) array
        Legendre coefficients of the arc length on each panel.
    k : int
        The panel.
    phi, to_end : float
        The phase angle on it, and its distance from the last edge.
    rests : (bool, bool)
        Whether the rate of the arc length vanishes at the first edge and at the last one.
    """
    half = 0.5 * (edges[k + 1] - edges[k])
    distance = (phi - edges[k]) / half
    if rests[0] and k == 0 and distance < BESIDE_EDGE:
        return k, growth_beside_rest(terms[k], distance, 1.0)
    if rests[1] and k == edges.size - 2 and to_end < BESIDE_EDGE * half:
        return k + 1, growth_beside_rest(terms[k], to_end / half, -1.0)
    return k, legendre_growth(terms[k], distance)


@entry(types.UniTuple(VECTOR, 2)(VECTOR, VECTOR, MATRIX, types.UniTuple(types.boolean, 2), VECTOR, VECTOR))
def lengths_from_edges(edges, marks, terms, rests, phi, to_end):  # type: ignore[no-untyped-def]
    """Return the arc lengths in m from the first edge to edges near phase angles, and from there to these.

    ``marks`` are the arc lengths at the edges; the other arguments are those of `length_from_edge`.
    """
    whole, parts = np.empty(phi.size), np.empty(phi.size)
    for i in range(phi.size):
        k, parts[i] = length_from_edge(edges, terms, panel_of(edges, phi[i]), phi[i], to_end[i], rests)
        whole[i] = marks[k]
    return whole, parts
