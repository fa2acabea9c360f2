"""The changes along an orbit as a series with its integrals: a Fourier series, or Legendre series on panels."""

from collections.abc import Sequence
from functools import cache
from math import cos, pi, sin

import numpy as np
from numba import types
from numpy.polynomial.legendre import legint, legvander

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.arithmetic.elementary import HALF_PI
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import VECTOR, Array
from gqm_sym.runtime.double_double.interpreter import BLOCK
from gqm_sym.runtime.double_double.nodes import RULE, panel_rule
from gqm_sym.runtime.gradients.evaluation import CUBE

# Terms below this share of the largest one are rounding if at least so many follow each other; the last terms may be at
# most the third number.
MIN_TERM, TERMS_IN_A_ROW, MAX_LAST_TERM = 1e-16, 8, 1e-14

# Factors of a series below this share of its largest one are rounding, as those of sines in a function that is even.
MIN_FACTOR = 1e-17


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
        turns = np.divide(1.0, 2j * np.pi * order[:used], where=order[:used] > 0, out=np.zeros(used, complex))
        values, integrals = terms[:, :used], terms[:, :used] * turns
        # The factors of all cosines, of all sines, and of the share; integrals vanish at 0.
        self._table = np.zeros((2, len(samples), 2 * used + 1))
        self._table[:, :, :used], self._table[:, :, used:-1] = (
            (values.real, integrals.real),
            (-values.imag, -integrals.imag),
        )
        self._table[np.abs(self._table) <= MIN_FACTOR * np.abs(self._table).max(axis=2, keepdims=True)] = 0.0
        self._table[1, :, 0] -= integrals.real.sum(axis=1)
        self._table[1, :, -1] = values[:, 0].real

    def __call__(self, share: Array) -> Array:
        """Return the values at shares, and the integrals from 0 to these: a row for each function."""
        found = np.empty((*self._table.shape[:2], share.size))
        fill_series(self._table, share, found)
        return found

    def of(self, functions: Sequence[int]) -> Array:
        """Return the factors of some of the functions, and of their integrals, as `add_series` takes them."""
        return np.ascontiguousarray(self._table[:, functions])


@Inner
def fill_waves(shares, waves):  # type: ignore[no-untyped-def]
    """Fill rows of the cosines of multiples of the phase, from the multiple 0 on, of their sines, and of the shares."""
    n, count = shares.size, waves.shape[0] // 2
    for i in range(n):
        waves[0, i], waves[count, i], waves[2 * count, i] = 1.0, 0.0, shares[i]
    for k in range(1, count):
        for i in range(n):
            if k == 1:
                waves[1, i], waves[count + 1, i] = cos(2.0 * pi * shares[i]), sin(2.0 * pi * shares[i])
            else:  # from two halves, so that rounding grows only with the logarithm of the order
                one, other = k // 2, k - k // 2
                c, s, more_c, more_s = waves[one, i], waves[count + one, i], waves[other, i], waves[count + other, i]
                waves[k, i], waves[count + k, i] = c * more_c - s * more_s, s * more_c + c * more_s


@Inner
def add_series(table, waves, found):  # type: ignore[no-untyped-def]
    """Fill the values and integrals of functions, given the waves at each place."""
    for part in range(2):
        for j in range(table.shape[1]):
            line = found[part, j]
            line[:] = 0.0
            for k in range(table.shape[2]):
                factor, wave = table[part, j, k], waves[k]
                if factor != 0.0:
                    for i in range(line.size):
                        line[i] += factor * wave[i]


@entry(types.void(CUBE, VECTOR, CUBE), checked=False)
def fill_series(table, shares, found):  # type: ignore[no-untyped-def]
    """Fill the values and integrals of functions at shares.

    Parameters
    ----------
    table : (2, k, m) array
        The factors of all cosines, of all sines, and of the share, for the k functions and for their integrals.
    shares : (n,) array
        The shares.
    found : (2, k, n) array
        Filled with the values, and with the integrals.
    """
    for start in range(0, shares.size, BLOCK):
        some = shares[start : start + BLOCK]
        waves, part = np.empty((table.shape[2], some.size)), np.empty((2, table.shape[1], some.size))
        fill_waves(some, waves)
        add_series(table, waves, part)
        found[:, :, start : start + some.size] = part


def panel_widths(left: Array, right: Array) -> tuple[Array, Array]:
    """Return the widths of panels between phase angles, or shares of a lap, as two doubles.

    The upper turning point is at the angle pi itself and not at its nearest double: beside a hilltop the body takes a
    long time for the difference.
    """
    width, low = two_sum.py_func(right, -left)
    return width, low + np.where(right == 2.0 * HALF_PI[0], 2.0 * HALF_PI[1], 0.0)


class PanelSeries:
    """Functions of a share of the phase, given by their values at the nodes of panels.

    Parameters
    ----------
    edges : (m+1,) array
        The edges of the panels, as phases.
    samples : (k, m, RULE) array
        The values of k functions.
    whole : float
        The phase of which shares are meant. A share of a panel's edge would be rounded, which matters where panels are
        narrow.
    begin : float
        The share at which integrals begin.
    """

    def __init__(self, edges: Array, samples: Array, whole: float = 1.0, begin: float = 0.0) -> None:
        self._edges, self._samples, self._whole = edges, samples, whole
        width, low = panel_widths(edges[:-1], edges[1:])
        terms, halves = samples @ to_legendre(), 0.5 * ((width + low) / whole)
        here, start = place_on.py_func(edges, begin * whole)
        # Each panel's integrals begin at the end of it that is nearer to the beginning.
        integrals = np.empty((*terms.shape[:2], terms.shape[2] + 1))
        for panels, bound in ((slice(0, here), 1.0), (slice(here, here + 1), start), (slice(here + 1, None), -1.0)):
            given = np.moveaxis(terms[:, panels], -1, 0)
            integrals[:, panels] = np.moveaxis(legint(given, lbnd=bound), 0, -1) * halves[panels, None]
        at_edges = integrals.sum(axis=-1), (integrals * (-1.0) ** np.arange(integrals.shape[2])).sum(axis=-1)
        integrals[:, here + 1 :, 0] += np.cumsum(at_edges[0][:, here:-1], axis=1)
        integrals[:, :here, 0] += np.cumsum(at_edges[1][:, here:0:-1], axis=1)[:, ::-1]
        both = np.array([np.pad(terms, ((0, 0), (0, 0), (0, 1))), integrals])
        self._table = np.ascontiguousarray(both.transpose(2, 3, 0, 1)).reshape(len(edges) - 1, RULE + 1, -1)

    def begun_at(self, share: float) -> "PanelSeries":
        """Return the same functions with integrals that begin at a share: nothing cancels in those to places nearby."""
        return PanelSeries(self._edges, self._samples, self._whole, share)

    def __call__(self, share: Array) -> Array:
        """Return the values at shares, and the integrals from 0 to these: a row for each function."""
        found = np.empty((2, self._table.shape[2] // 2, share.size))
        fill_polynomials(self._edges, self._table, share * self._whole, found)
        return found


@Inner
def place_on(edges, phase):  # type: ignore[no-untyped-def]
    """Return the panel that contains a phase, and the place on it, from -1 to 1."""
    panel = min(max(np.searchsorted(edges, phase, side="right") - 1, 0), edges.size - 2)
    left, right = edges[panel], edges[panel + 1]
    return panel, min(max(((phase - left) + (phase - right)) / (right - left), -1.0), 1.0)


@entry(types.void(VECTOR, CUBE, VECTOR, CUBE), checked=False)
def fill_polynomials(edges, table, phases, found):  # type: ignore[no-untyped-def]
    """Fill values and integrals of Legendre series on panels at phases.

    The table has for each panel and degree the coefficients of the values, and then those of the integrals.
    """
    degrees, functions = table.shape[1], table.shape[2]
    sums = np.empty(functions)
    for i in range(phases.size):
        panel, x = place_on(edges, phases[i])
        before, now = 0.0, 1.0
        sums[:] = 0.0
        for k in range(degrees):
            for j in range(functions):
                sums[j] += now * table[panel, k, j]
            before, now = now, ((2.0 * k + 1.0) * x * now - k * before) / (k + 1.0)
        for j in range(functions // 2):
            found[0, j, i], found[1, j, i] = sums[j], sums[functions // 2 + j]


@cache
def to_legendre() -> Array:
    """Return the matrix that maps values at the nodes to Legendre coefficients, multiplied from the right."""
    rule = panel_rule()
    table: Array = rule[2][:, None] * legvander(2.0 * rule[0] - 1.0, RULE - 1) * (2.0 * np.arange(RULE) + 1.0)
    return table
