"""The Python versions of operations of compiled code give the same bits."""

from typing import Any

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic import exponential_rows, matrices
from gqm_sym.runtime.arithmetic.clenshaw import GROUP, sum_group
from gqm_sym.runtime.charts.evaluate import LANES, SEVERAL, TERMS, fill_lanes, fill_several
from gqm_sym.runtime.compiled import jit
from gqm_sym.runtime.compiled.intrinsics import (
    bits,
    choose,
    floor_of,
    fma,
    from_bits,
    item_at,
    nearest_whole,
    polynomial,
    polynomial_pair,
)
from gqm_sym.runtime.compiled.registers import borrowed, copied, on_stack, over_rows
from gqm_sym.runtime.compiled.streaming import put
from gqm_sym.runtime.compiled.strided import element, fill_row, pointers
from gqm_sym.runtime.compiled.trial import Trial
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR
from gqm_sym.runtime.compiled.uncompiled import PlainEntry
from gqm_sym.runtime.double_double.arithmetic import series

RNG = np.random.default_rng(11)
SERIES = tuple(RNG.normal(size=6))
WIDTH = 24

combine = over_rows(lambda a, b, c: abs(a - 2.0 * b) / c + 1.0, WIDTH)
root = over_rows(lambda a: np.sqrt(abs(a)) * a, WIDTH)
grow = over_rows(lambda a: exponential_rows.expm1(abs(a)), WIDTH)
times_square = matrices.multiply(RNG.normal(size=(WIDTH, WIDTH)))
times_wide = matrices.multiply(RNG.normal(size=(7, 40)))
ends = matrices.span(WIDTH - 3)
size = matrices.largest(WIDTH)
copy = copied(WIDTH)
scratch = on_stack(WIDTH)


def everything(x, y, columns, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with results of all operations."""
    line = borrowed(x)
    combine(line, 0, WIDTH, 2 * WIDTH, 0.7)
    root(line, WIDTH, 3 * WIDTH)
    grow(line, 2 * WIDTH, 4 * WIDTH)
    times_square(line, 5, out[0], 3)
    times_wide(line, 2, out[1], 1)
    out[2, 0], out[2, 1] = ends(line, 4)
    out[2, 2], own = size(line, 9), scratch()
    copy(own, 0, line, 11)
    out[3, :WIDTH] = own[:WIDTH]
    sum_group(y[:30], x, 1, out[4], out[5])
    a, b = x[0], y[1]
    out[6, 0], out[6, 1], out[6, 2] = fma(a, b, -a * b), nearest_whole(3.7 * a), floor_of(5.1 * b)
    out[6, 3], out[6, 4] = from_bits(bits(a) + 1), choose(a > b, a, b)
    out[6, 5], (out[6, 6], out[6, 7]) = polynomial(SERIES, a), polynomial_pair(SERIES, a, b)
    out[6, 8], out[6, 9] = series(SERIES, 0.01 * a, 1e-18 * b, 0.1)
    out[6, 10], out[6, 11] = item_at(out, 41), element(columns, 1, 3)
    fill_row(columns, 0, 2, 5, out[7])
    put(out[8], 3, y, 1, 50, True)
    put(out[9], 3, y, 1, 50, False)
    fill_lanes(y, 5, x, 2, out, 10 * out.shape[1] + 4, 3, (0.1, 0.2, 0.8, 1.0, 2.0, 1e-17))
    fill_several(y, 30, x, 40, out, 10 * out.shape[1] + 20, 2, (0.1, 0.2, 0.8, 1.0, 2.0, 1e-17))


def _results(run: Any) -> np.ndarray:
    rng = np.random.default_rng(5)
    x, y, out = rng.normal(size=200), rng.normal(size=200), np.zeros((11, 200))
    lines = [rng.normal(size=40), rng.normal(size=40)]
    run(x, y, pointers(lines), out)
    return np.concatenate([x, out.ravel()]).view(np.int64)


def test_python_gives_the_bits_of_each_operation() -> None:
    """Python gives the same bits for operations of vector registers, of tables and of arrays by their address."""
    signature = types.void(VECTOR, VECTOR, types.int64[:, ::1], MATRIX)
    compiled = jit.COMPILER.entry(everything, signature, nogil=False, checked=True)
    plain = PlainEntry(everything, signature.args, Trial(1e9))
    expected, found = _results(compiled), _results(lambda *arguments: plain(arguments))
    assert np.count_nonzero(expected) > 500
    assert np.flatnonzero(expected != found).tolist() == []
    assert LANES * 4 == LANES * SEVERAL == GROUP
    assert TERMS == 16
