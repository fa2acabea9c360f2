"""Panels laid in extended precision, where doubles cannot tell V**2 from nothing (next to a separatrix).

The panels are of the same kind as those of `panels.lay`, with values right to the last bit; only their nodes are
evaluated elsewhere.
Speed is no concern here.
"""

from typing import Any

import numpy as np

from gqm_sym.budgets import budget
from gqm_sym.errors import SolutionError
from gqm_sym.runtime.multiprecision.exact_problem import ExactProblem
from gqm_sym.runtime.quadrature.integrands import FROM_TURN, TURN_TURN
from gqm_sym.runtime.quadrature.kronrod import KRONROD_WEIGHTS, NODES
from gqm_sym.runtime.quadrature.time_panels import CONVERGED, COUNT, DEGREE, EXHAUSTED, NOTHING, TAIL, antiderivative

DIGITS = 80  # a gap of 1e-30 to a barrier still leaves doubles their digits
MOST_PANELS = 400


def exact_ends(
    exact: ExactProblem, digits: int, kind: int, a: float, b: float, known: tuple[Any, Any]
) -> tuple[Any, Any]:
    """The ends of a stretch in extended precision; the launch place is kept as it was given."""
    scale = exact.at(digits)
    turns = {TURN_TURN: (True, True), FROM_TURN: (True, False)}.get(kind, (False, False))
    out = []
    for place, turn, given in zip((a, b), turns, known, strict=True):
        if place == exact.lam0.value and not (turn and exact.v0.value):
            out.append(scale.lam0)
        elif turn:
            out.append(scale.turning_point(place if given is None else given))
        else:
            out.append(scale.mpf(place if given is None else given))
    return out[0], out[1]


@budget("quadrature", 60.0, "launch a little farther from the equilibrium")
def lay_exactly(exact: ExactProblem, kind: int, ends: tuple[Any, Any], stop: float) -> Any:
    """Panels as `panels.lay` returns them."""
    scale = exact.at(DIGITS)
    rate = scale.anomaly_rate(kind, *ends)
    nodes = np.concatenate([-NODES[:0:-1], NODES])
    weights = np.concatenate([KRONROD_WEIGHTS[:0:-1], KRONROD_WEIGHTS])
    edges, times, lengths = [0.0], [0.0], [0.0]
    time_terms, length_terms = [], []
    # The last anomaly is pi itself, not its nearest double: at a barrier the difference takes time.
    end = scale.context.pi if kind == TURN_TURN else scale.mpf(stop)
    joints = scale.anomalies(kind, *ends, scale.track.joints(*ends) or ())
    pending = [stop, *reversed([phi for phi in joints if 0 < phi < stop])]
    left, error, status, most = 0.0, 0.0, CONVERGED, MOST_PANELS + len(pending)
    while pending:
        right = pending[-1]
        # Nodes are not rounded: next to a peak as narrow as 1e-6 that would be noise.
        far = end if right == stop else scale.mpf(right)
        reach, middle = (far - left) / 2, (far + left) / 2
        half = float(reach)
        values = np.empty((2, COUNT))
        for i, x in enumerate(map(float, nodes)):
            duration, w = rate(middle + reach * x)
            if duration.imag or w.imag or not (duration > 0 and w > 0):
                raise SolutionError(
                    f"time of flight from {float(ends[0])!r} to {float(ends[1])!r}: "
                    "V**2 is not positive inside this stretch"
                )
            values[:, i] = float(duration), float(duration * scale.sqrt(w))
        c, terms = np.empty(DEGREE + 1), np.empty((2, DEGREE))
        length_size, length_tail, _ = antiderivative(values[1], half, c, terms[1])
        size, tail, _ = antiderivative(values[0], half, c, terms[0])
        settled = tail <= TAIL * size and length_tail <= 10.0 * TAIL * length_size
        time, length = half * (weights @ values[0]), half * (weights @ values[1])
        settled = settled or (time <= NOTHING * times[-1] and length <= NOTHING * lengths[-1])
        full = len(edges) + len(pending) >= most or half <= 2.0**-50 * stop
        if not settled and not full:
            pending.append((left + right) / 2)
            continue
        status = status if settled else EXHAUSTED
        error += tail / size * float(time) if size else 0.0
        edges.append(float(right))
        times.append(times[-1] + float(time))
        lengths.append(lengths[-1] + float(length))
        time_terms.append(terms[0])
        length_terms.append(terms[1])
        left = pending.pop()
    return (
        np.array(edges),
        np.array(times),
        np.array(lengths),
        np.array(time_terms),
        np.array(length_terms),
        error / times[-1] + 2.3e-16,
        1.0,
        status,
    )
