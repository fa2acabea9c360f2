"""Columns of a sweep as compiled code reads them: each is given by an address and a step, which is 0 if one number
stands for all launches.

Their order is that of the constants below: the launch (place, speed, direction); the target of ``time_at``; both ends
of the curve's domain and its period; an axis of symmetry (NaN if there is none that can be used) and the distance
to the next one, each as two doubles; and the run-time parameters.
"""

from ctypes import c_double
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.uncompiled import in_python

LAM0, V0, DIRECTION, TARGET, DOMAIN_LOW, DOMAIN_HIGH, DOMAIN_PERIOD, AXIS, PLACE_LOW, AXIS_STEP = range(10)
AXIS_STEP_LOW, PARAMETERS = range(10, 12)


def widen(column: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Broadcast a column to a shape, unless it is a single number."""
    return column if column.size == 1 or column.shape == shape else np.broadcast_to(column, shape)


def lay_out(columns: list[NDArray[np.float64]], begin: int, end: int) -> list[NDArray[np.float64]]:
    """Return the elements ``begin`` to ``end`` of columns of one shape as vectors, as views where that is possible."""
    return [_line(column, begin, end) for column in columns]


def _line(column: NDArray[np.float64], begin: int, end: int) -> NDArray[np.float64]:
    if column.size == 1:
        return column.reshape(1)
    if column.ndim == 1:
        return column[begin:end]
    if column.flags.c_contiguous:
        return column.reshape(-1)[begin:end]
    return np.ascontiguousarray(column.flat[begin:end])


def pointers(lines: list[NDArray[np.float64]]) -> NDArray[np.int64]:
    """Return a row for each vector: its address, its step in bytes, and the number itself where it has only one.

    That number's address is its place in the row, because asking NumPy for an address takes as long as a few launches.
    The caller must keep the other vectors alive.
    """
    rows = np.zeros((len(lines), 3), dtype=np.int64)
    begin, size = rows.ctypes.data, rows.itemsize
    numbers = rows.view(np.float64)
    for k, line in enumerate(lines):
        if line.size == 1:
            rows[k, 0], numbers[k, 2] = begin + (3 * k + 2) * size, line[0]
        else:
            rows[k, 0], rows[k, 1] = line.ctypes.data, line.strides[0]
    return rows


@intrinsic
def number_at(_, address):  # type: ignore[no-untyped-def]
    """Return the double at an address, which need not be aligned: a field of packed records is a column too."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load(builder.inttoptr(args[0], ir.DoubleType().as_pointer()), align=1)

    return types.float64(types.int64), lower


@in_python(number_at)
def _number_at(address: int) -> Any:
    return np.float64(c_double.from_address(int(address)).value)


@Inner
def element(columns, which, k):  # type: ignore[no-untyped-def]
    """Return element k of one column."""
    return number_at(columns[which, 0] + k * columns[which, 1])


@Inner
def fill_row(columns, which, begin, count, row):  # type: ignore[no-untyped-def]
    """Copy ``count`` elements of a column from index ``begin`` to a row, and fill the rest with the last of them."""
    address, step = columns[which, 0] + begin * columns[which, 1], columns[which, 1]
    if step == 0:
        count = 1
    for j in range(count):
        row[j] = number_at(address + j * step)
    last = row[count - 1]
    for j in range(count, row.size):
        row[j] = last
