"""numba's types of the arguments of compiled functions, and the type of arrays in annotations."""

from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.runtime.interface import Addresses, BatchAddresses

# Arrays of doubles, for annotations.
Array = NDArray[np.float64]

REAL: Any = types.float64
INTEGER: Any = types.int64
# Contiguous arrays of doubles with one axis and with two axes.
VECTOR: Any = types.float64[::1]
MATRIX: Any = types.float64[:, ::1]
# Addresses of a model's compiled functions: for one orbit, and for a batch of them.
ADDRESSES: Any = types.NamedUniTuple(types.int64, len(Addresses._fields), Addresses)
BATCH_ADDRESSES: Any = types.NamedUniTuple(types.int64, len(BatchAddresses._fields), BatchAddresses)
