"""What every launch of a conservative model needs, in one crossing: its ends, what lies there, and the time between."""

import numpy as np
from numba import types

from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import ADDRESSES, REAL
from gqm_sym.runtime.launch.ends import END_TYPE, ends
from gqm_sym.runtime.launch.zeros import LIMIT, TURN
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION, time_by_trapezoid


@entry(
    types.Tuple((types.int64, END_TYPE, END_TYPE, REAL))(
        ADDRESSES,
        types.float64[::1],
        REAL,
        REAL,
        types.int64,
        REAL,
        REAL,
        REAL,
        REAL,
        REAL,
    ),
    checked=False,
)
def survey(fns, p, lam0, v0, direction, low, high, period, place, step):  # type: ignore[no-untyped-def]
    """Find both ends of a motion, and its half period or loop time where that is easy.

    Returns
    -------
    direction, ahead, behind
        As `entries.ends` returns them.
    time : float
        Half period of a libration, loop time of a circulation, within some units in the last place; NaN where the
        trapezoidal rule does not settle, or too little of V**2 is left for doubles, and of any other motion.
    """
    direction, ahead, behind = ends(fns, p, lam0, v0, direction, low, high, period, place, step)
    turns = ahead[0] == TURN and behind[0] == TURN
    if direction == 0 or not (turns or (ahead[0] == LIMIT and period > 0.0 and v0 > 0.0)):
        return direction, ahead, behind, np.nan
    near, far = min(ahead[1], behind[1]), max(ahead[1], behind[1])
    kind, width = (LIBRATION, far - near) if turns else (CIRCULATION, direction * period)
    a, b = (lam0 + near, lam0 + far) if turns else (lam0, lam0 + width)
    return direction, ahead, behind, time_by_trapezoid(fns, p, kind, lam0, v0 * v0, a, b, width)
