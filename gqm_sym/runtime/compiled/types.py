"""Types of compiled functions' arguments, and of arrays: each has its one name here."""

from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

# Arrays of doubles, for annotations.
Array = NDArray[np.float64]

REAL: Any = types.float64
INTEGER: Any = types.int64
# Contiguous arrays of doubles: one axis, two axes.
VECTOR: Any = types.float64[::1]
MATRIX: Any = types.float64[:, ::1]
# Addresses of a model's compiled functions, in the order of `interface.Addresses`.
ADDRESSES: Any = types.UniTuple(types.int64, 5)
