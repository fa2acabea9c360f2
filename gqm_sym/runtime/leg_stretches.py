"""Stretches of a dissipative motion, from the panels of its legs."""

from functools import lru_cache
from math import inf

import numpy as np

from gqm_sym.runtime.chebyshev import COUNT, TO_COEFFICIENTS
from gqm_sym.runtime.clocks import Array
from gqm_sym.runtime.integrands import FROM_TURN, REGULAR, TO_EQUILIBRIUM
from gqm_sym.runtime.panels import CONVERGED, DEGREE
from gqm_sym.runtime.stretch import ULP, Functions, Stretch

# An equilibrium is approached until the distance left is exp(-this) of the leg: all that doubles have.
CLOSEST = 690.0


@lru_cache(maxsize=1)
def _to_legendre() -> tuple[Array, Array]:
    """Legendre coefficients of a function on [-1, 1], and of its integral from -1, from values at a panel's nodes."""
    # x P_j = ((j + 1) P_(j+1) + j P_(j-1))/(2 j + 1), and T_(k+1) = 2 x T_k - T_(k-1).
    j = np.arange(DEGREE + 2)
    series = np.zeros((COUNT, DEGREE + 2))
    series[0, 0] = series[1, 1] = 1.0
    for k in range(2, COUNT):
        row = series[k - 1]
        series[k, 1:] += 2.0 * (j[1:] / (2 * j[1:] - 1)) * row[:-1]
        series[k, :-1] += 2.0 * (j[1:] / (2 * j[1:] + 1)) * row[1:]
        series[k] -= series[k - 2]
    plain = TO_COEFFICIENTS.T @ series
    integral = np.empty((COUNT, DEGREE))
    integral[:, 0] = plain[:, 0] - plain[:, 1] / 3.0
    i = np.arange(1, DEGREE)
    integral[:, 1:] = plain[:, i - 1] / (2 * i - 1) - plain[:, i + 1] / (2 * i + 3)
    return np.ascontiguousarray(plain[:, :DEGREE]), integral


def along_panels(f: Functions, a: float, b: float, slack: float, time: float, panels: Array) -> Stretch:
    """A stretch by its panels (`leg_panels`), whose times add up to ``time``.

    ``slack`` is c/2 of their march variable, infinite where that is the distance.
    """
    plain, integral = _to_legendre()
    rights = panels[:, 0]
    last = float(rights[-1])
    halves = 0.5 * np.diff(rights, prepend=0.0)[:, None]
    pace, arc, speed = (panels[:, 3 + k * COUNT : 3 + (k + 1) * COUNT] for k in range(3))
    time_terms, length_terms = halves * (pace @ integral), halves * (arc @ integral)
    edges, times, lengths = np.zeros((3, len(panels) + 1))
    edges[1:], times[1:], lengths[1:] = rights / last, panels[:, 1].cumsum(), length_terms.sum(axis=1).cumsum()
    times[-1] = time
    error = float(panels[:, 2].sum()) / time + ULP if time > 0.0 else ULP
    return Stretch(
        functions=f,
        kind=REGULAR if slack == inf else FROM_TURN,
        a=a,
        b=b,
        slack=0.0 if slack == inf else slack / last,
        laid=(edges, times, lengths, time_terms, length_terms, error, 1.0, CONVERGED),
        paces=(last, speed @ plain),
    )


def along_field(f: Functions, a: float, b: float, field: Array) -> Stretch:
    """A stretch towards an equilibrium b where V**2 is a field; its panels begin where the field's do."""
    hints = tuple(float(place) for place in b + np.sign(a - b) * field[:-1, 1])
    return Stretch(functions=f, kind=TO_EQUILIBRIUM, a=a, b=b, v2=field, stop=CLOSEST, hints=hints)
