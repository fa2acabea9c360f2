"""The changes along an orbit as a series with its integrals: a Fourier series, or Legendre series on panels."""

import numpy as np
from numpy.polynomial.legendre import legint, legvander

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.nodes import RULE, panel_rule

# Terms below this share of the largest one are rounding if at least so many follow each other; the last terms may be at
# most the third number.
MIN_TERM, TERMS_IN_A_ROW, MAX_LAST_TERM = 1e-16, 8, 1e-14

# The number of places that are evaluated together.
BLOCK = 2048


class Series:
    """Functions of a share u, periodic with period 1, given by their values at the midpoints of N equal intervals.

    Parameters
    ----------
    samples : (k, N) array
        The values of k functions.
    """

    def __init__(self, samples: Array) -> None:
        count = samples.shape[1]
        terms = np.fft.rfft(samples) / count
        order = np.arange(terms.shape[1])
        terms = terms * np.exp(-1j * np.pi * order / count)
        terms[:, 1:] *= 2.0
        size = np.abs(terms).max(axis=1, keepdims=True)
        shares = np.abs(terms) / np.where(size > 0.0, size, 1.0)
        if shares[:, -3:].max() > MAX_LAST_TERM:
            raise SolutionError("gradients: the motion bends too sharply along its orbit for its Fourier series")
        counts = (shares > MIN_TERM).any(axis=0)
        used = next((k for k in range(1, counts.size) if not counts[k : k + TERMS_IN_A_ROW].any()), counts.size)
        self._terms, self._order = terms[:, :used], order[:used]

    def __call__(self, share: Array) -> tuple[Array, Array]:
        """Return the values at shares, and the integrals from 0 to these: a row for each function."""
        count = self._order.size
        found = np.empty((2, self._terms.shape[0], share.size))
        factor = np.divide(1.0, 2j * np.pi * self._order, where=self._order > 0, out=np.zeros(count, complex))
        values, integrals = (np.hstack([terms.real, -terms.imag]) for terms in (self._terms, self._terms * factor))
        for start in range(0, share.size, BLOCK):
            part = slice(start, start + BLOCK)
            powers = _powers(np.exp(2j * np.pi * share[part]), count)
            waves = np.vstack([powers.real, powers.imag])
            found[0, :, part] = values @ waves
            waves[:count] -= 1.0
            found[1, :, part] = self._terms[:, :1].real * share[part] + integrals @ waves
        return found[0], found[1]


def _powers(bases: Array, count: int) -> Array:
    """Return the powers 0 to count - 1 of complex numbers, a row for each; rounding grows with the logarithm of the
    power.
    """
    powers = np.ones((count, bases.size), dtype=complex)
    powers[1:2] = bases
    done = 2
    while done < count:
        more = min(done, count - done)
        powers[done : done + more] = powers[:more] * (powers[done - 1] * bases)
        done += more
    return powers


class PanelSeries:
    """Functions of a share of the phase, given by their values at the nodes of panels.

    Parameters
    ----------
    edges : (m+1,) array
        The edges of the panels.
    samples : (k, m, RULE) array
        The values of k functions.
    """

    def __init__(self, edges: Array, samples: Array) -> None:
        self._edges = edges
        terms = samples @ to_legendre()
        halves = 0.5 * np.diff(edges)[:, None]
        integrals = np.moveaxis(legint(np.moveaxis(terms, -1, 0), lbnd=-1), 0, -1) * halves
        totals = np.cumsum(integrals.sum(axis=-1), axis=1)
        integrals[:, 1:, 0] += totals[:, :-1]
        self._terms = np.concatenate([np.pad(terms, ((0, 0), (0, 0), (0, 1))), integrals])

    def __call__(self, share: Array) -> tuple[Array, Array]:
        """Return the values at shares, and the integrals from 0 to these: a row for each function."""
        panel = np.clip(np.searchsorted(self._edges, share, side="right") - 1, 0, len(self._edges) - 2)
        left, right = self._edges[panel], self._edges[panel + 1]
        waves = legvander(np.clip((2.0 * share - left - right) / (right - left), -1.0, 1.0), RULE)
        parts = [
            np.einsum("knj,nj->kn", self._terms[:, panel[i : i + BLOCK]], waves[i : i + BLOCK])
            for i in range(0, max(share.size, 1), BLOCK)
        ]
        found, integrals = np.split(np.concatenate(parts, axis=1), 2)
        return found, integrals


def to_legendre() -> Array:
    """Return the matrix that maps values at the nodes to Legendre coefficients, multiplied from the right."""
    rule = panel_rule()
    table: Array = rule[2][:, None] * legvander(2.0 * rule[0] - 1.0, RULE - 1) * (2.0 * np.arange(RULE) + 1.0)
    return table
