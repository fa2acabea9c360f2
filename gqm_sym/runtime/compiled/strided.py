"""Columns of a sweep as compiled code reads them: an address and a step each, for one number may stand for many.

They come in this order: the launches, the place that is asked about; of their curves both ends, the period, a place of
symmetry, what it leaves over as a double (NaN where that is not known), and the step to the next; and all parameters.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.jit import Inner

LAM0, V0, DIRECTION, TARGET, DOMAIN_LOW, DOMAIN_HIGH, DOMAIN_PERIOD, AXIS, PLACE_LOW, AXIS_STEP, PARAMETERS = range(11)


def widen(column: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """A column of this shape; one number stays one."""
    return column if column.size == 1 or column.shape == shape else np.broadcast_to(column, shape)


def lay_out(columns: list[NDArray[np.float64]], begin: int, end: int) -> list[NDArray[np.float64]]:
    """Elements ``begin`` to ``end`` of columns of one shape, each as a line: a view, where the column is one."""
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
    """A row for each line: where it begins, and the step to its next element, in bytes. Keep the lines alive."""
    return np.array([(line.ctypes.data, line.strides[0] if line.size > 1 else 0) for line in lines], dtype=np.int64)


@intrinsic
def number_at(_, address):  # type: ignore[no-untyped-def]
    """The double at an address, which need not be a multiple of eight: a field of packed records is a column too."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load(builder.inttoptr(args[0], ir.DoubleType().as_pointer()), align=1)

    return types.float64(types.int64), lower


@Inner
def element(columns, which, k):  # type: ignore[no-untyped-def]
    """Element k of one column."""
    return number_at(columns[which, 0] + k * columns[which, 1])


@Inner
def fill_row(columns, which, begin, count, row):  # type: ignore[no-untyped-def]
    """Copy ``count`` elements of a column from ``begin`` on, and repeat the last of them to the row's end."""
    address, step = columns[which, 0] + begin * columns[which, 1], columns[which, 1]
    if step == 0:
        count = 1
    for j in range(count):
        row[j] = number_at(address + j * step)
    last = row[count - 1]
    for j in range(count, row.size):
        row[j] = last
