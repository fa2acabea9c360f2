"""Chebyshev series at the places of a row agree with NumPy, and Python gives the bits of compiled code."""

import numpy as np
from numba import types

from gqm_sym.runtime.compiled import jit
from gqm_sym.runtime.compiled.series_rows import series_rows
from gqm_sym.runtime.compiled.trial import Trial
from gqm_sym.runtime.compiled.types import VECTOR
from gqm_sym.runtime.compiled.uncompiled import PlainEntry

WIDTH, COUNT = 24, 23
fill = series_rows(WIDTH, COUNT)


def at_places(line):  # type: ignore[no-untyped-def]
    """Fill the first row with the series behind the second, at places twice which are in the second."""
    fill(line, 1, 30, 60)


def test_a_series_at_the_places_of_a_row() -> None:
    """The row is the series, with the same bits in Python, and nothing beside it changes."""
    rng = np.random.default_rng(3)
    line = rng.normal(size=90)
    line[30 : 30 + WIDTH] = np.append(rng.uniform(-2.0, 2.0, WIDTH - 2), [-2.0, 2.0])
    before, other = line.copy(), line.copy()
    jit.COMPILER.entry(at_places, types.void(VECTOR), nogil=False, checked=True)(line)
    PlainEntry(at_places, (VECTOR,), Trial(1e9))((other,))
    terms, places = before[60 : 60 + COUNT], 0.5 * before[30 : 30 + WIDTH]
    expected = np.polynomial.chebyshev.chebval(places, terms)
    assert np.abs(line[1 : 1 + WIDTH] - expected).max() <= 1e-14 * np.abs(terms).sum()
    assert np.array_equal(line.view(np.int64), other.view(np.int64))
    assert np.array_equal(np.delete(line, np.arange(1, 1 + WIDTH)), np.delete(before, np.arange(1, 1 + WIDTH)))
