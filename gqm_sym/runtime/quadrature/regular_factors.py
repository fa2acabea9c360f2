"""The regular factor of the speed along panels, from its Legendre series on each of them."""

import numpy as np

from gqm_sym.runtime.arithmetic.clenshaw import legendre_sum
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR
from gqm_sym.runtime.quadrature.time_panels import panel_of


@entry(VECTOR(VECTOR, MATRIX, VECTOR))
def regular_factors(edges, terms, phi):  # type: ignore[no-untyped-def]
    """Return the sums of the panels' Legendre series at phase angles."""
    out = np.empty(phi.size)
    for i in range(phi.size):
        k = panel_of(edges, phi[i])
        half = 0.5 * (edges[k + 1] - edges[k])
        out[i] = legendre_sum(terms[k], ((phi[i] - edges[k]) - half) / half)
    return out
