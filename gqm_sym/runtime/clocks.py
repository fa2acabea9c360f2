"""What the panels of a stretch say of time, beyond what compiled code reads off them."""

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.doubledouble import two_sum

Array = NDArray[np.float64]


def running_totals(times: Array, terms: Array) -> tuple[Array, Array]:
    """Running totals of the panels' own times, each as two doubles, up to the last of ``times``."""
    own = terms.sum(axis=1)  # every Legendre polynomial is 1 at the right edge
    own *= times[-1] / (own.sum() or 1.0)  # from a place to itself there are none
    high, low = np.zeros(len(own) + 1), np.zeros(len(own) + 1)
    for k, part in enumerate(own):
        high[k + 1], error = two_sum.py_func(high[k], part)
        low[k + 1] = low[k] + error
    high[-1], low[-1] = times[-1], 0.0
    return high, low
