"""The time per phase angle of a libration, with V**2 as a divided difference over a turning point and the place.

Beside a hilltop V**2 vanishes at the turning point of a body and hardly increases from there on. As the difference of
potentials it then loses as many digits as it is small, and its derivatives lose as many again. With the divided
difference over the turning point a, ``V**2 = -2 (lam - a) U[a, lam]``, digits are lost only by the slope of the
potential at the turning point, which is as small as the square root of V**2 (MATHS, section 3). The program serves the
half of the orbit that begins at a; the other half is that of the same program with both turning points exchanged.
"""

from fractions import Fraction
from functools import lru_cache
from math import fsum, sin
from typing import Any

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import ZERO, Pair, minus, plus, two_product
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.nodes import RULE
from gqm_sym.runtime.double_double.recording import TapeNumber
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.evaluation import values
from gqm_sym.runtime.gradients.lanes.exact_differences import SeriesRecorder, assembled
from gqm_sym.runtime.gradients.lanes.operations import WithoutRuleError
from gqm_sym.runtime.gradients.lanes.programs import total_change
from gqm_sym.runtime.gradients.panels import shares_at, shares_on, weights_on
from gqm_sym.runtime.gradients.passages.first_differences import TwoPlaces
from gqm_sym.runtime.gradients.programs import Program, Source
from gqm_sym.runtime.quadrature.trapezoid import LIBRATION

# The number of times that the argument of sinh(t)/t is halved before it is a series. The series serves up to 1.
HALVINGS = 3

# The number of times that panels are halved at most until the times at their edges do not change.
MAX_PANEL_HALVINGS = 4


class WaveRecorder(SeriesRecorder):
    """A tape on which sin(t)/t is a quotient, and sinh(t)/t, of which that would lose digits, follows from a series."""

    def sinc(self, t: TapeNumber, sign: int) -> TapeNumber:
        """Record sin(t)/t, or sinh(t)/t for the sign -1."""
        if sign > 0 or not self.depends(self.register(t)):
            quotient: TapeNumber = (self.sin(t) if sign > 0 else self.sinh(t)) / t
            return quotient
        part = t * Fraction(1, 2**HALVINGS)
        found, even = super().sinc(part, sign), self.cosh(part)
        for _ in range(HALVINGS):
            found, even = found * even, 2 * even * even - 1
        return found


@lru_cache(maxsize=64)
def from_turn_program(source: Source, wanted: tuple[int, ...] | None = None) -> Program | None:
    """Return the program of the integrand over the phase angle, with its derivatives at the same phase angle.

    The coordinate of a place is the square of the sine of half the angle from the first turning point. Inputs and
    results are those of `programs.libration_program`; so is ``wanted``. It is None if the formulas are too long, or
    contain an operation without a rule for divided differences.
    """
    rows = tuple(range(source.variables)) if wanted is None else wanted
    n, op = source.parameters, WaveRecorder(source.inputs + 2 + 2 * len(rows))
    p, (a, b, *ends), share = op.values[:n], op.values[source.inputs :], op.place
    moves = [
        (ends[j], ends[len(rows) + j], *(op.number(int(k == i)) for i in range(n)))  # of a, b and the parameters
        for j, k in enumerate(rows)
    ]
    try:
        over = TwoPlaces(op, (a, b), share)
        slope, ds = over.of(source.formulas.effective_potential, p).first, over.of(source.formulas.ds, p).at[1]
        width = b - a
        rate = ds * op.sqrt((1 - share) * (width / (-2 * slope)))

        def with_changes(quantity: Any) -> list[TapeNumber]:
            by_inputs = gradient(op, quantity, [a, b, *p])
            return [quantity, *(total_change(op, by_inputs, move) for move in moves)]

        results = with_changes(rate)
        if wanted is None:
            results += with_changes(rate * (-2 * width * share * slope) * source.one_plus_beta(op))
            results += gradient(op, ds, p)
        return assembled(op, results)
    except (WithoutRuleError, SolutionError):
        return None


@Inner
def fill_other_side(inputs, first):  # type: ignore[no-untyped-def]
    """Fill the inputs of the program for the half of the orbit that begins at the upper turning point.

    Parameters
    ----------
    inputs : (2, 3, m) array
        The inputs for both halves, of which the former are known.
    first : int
        The number of inputs before the turning points.
    """
    rows = (inputs.shape[2] - first - 2) // 2
    inputs[1, :, :first] = inputs[0, :, :first]
    for part in range(3):
        for side in range(2):
            inputs[1, part, first + side] = inputs[0, part, first + 1 - side]
            for k in range(rows):
                to, source = first + 2 + side * rows + k, first + 2 + (1 - side) * rows + k
                inputs[1, part, to] = inputs[0, part, source]


def on_both_sides(inputs: Array, first: int) -> Array:
    """Return the inputs of the program for both halves of a libration, from those for the half that begins at the lower
    turning point; ``first`` is the number of inputs before the turning points.
    """
    both = np.stack([inputs, inputs])
    fill_other_side.py_func(both, first)
    return both


def values_from_turns(program: Program, inputs: Array, first: int, shares: Array) -> Array:
    """Return the results of the program at places of both halves of the orbit.

    Parameters
    ----------
    program : Program
        The result of `from_turn_program`.
    inputs : (3, m) array
        Its inputs for the half that begins at the lower turning point, as two doubles and a bound on the error each.
    first : int
        The number of inputs before the turning points.
    shares : (2, n) array
        The shares of the orbit's width at the places, as two doubles each.

    Returns
    -------
    array
        Of shape (k, 3, n): two doubles and a bound on the error for each of the k results.
    """
    found, both = np.empty((program.outputs.size, 3, shares.shape[1])), on_both_sides(inputs, first)
    rest = (1.0 - shares[0]) - shares[1]
    from_upper = np.array([rest, ((1.0 - shares[0]) - rest) - shares[1]])
    halves = shares[0] < 0.5, shares[0] >= 0.5
    for half, places, given in zip(halves, (shares, from_upper), both, strict=True):
        found[:, :, half] = values(program, given, *np.ascontiguousarray(places[:, half]))
    return found


def time_beside(source: Source, variables: Array, ends: Array, phase: float, distance: Pair) -> float:
    """Return the time from a phase angle to a place next to it, which differs only by the rounding of the angle.

    The place is at a ``distance`` from the lower turning point; the other arguments are those of `times_from_turns`.
    """
    program = from_turn_program(source, ())
    assert program is not None
    shares, (width, low) = shares_at(LIBRATION, np.array([phase])), minus(tuple(ends[:2, 1]), tuple(ends[:2, 0]))
    (share, rest), inputs = shares[:, 0].tolist(), np.ascontiguousarray(np.hstack([variables, ends]))
    there, lost = two_product.py_func(share, width)
    beyond, _ = minus(distance, (there, lost + (share * low + rest * width)))
    rate = values_from_turns(program, inputs, source.inputs, shares)[0, 0, 0]
    return float(rate * beyond / (0.5 * width * sin(phase)))


def times_from_turns(
    source: Source, variables: Array, ends: Array, edges: Array, most: float
) -> tuple[Array, float] | None:
    """Return the times from the lower turning point to phase angles of a libration, as two doubles each, and a bound on
    their errors in s; None if there is no program, or the error is larger than ``most``.

    Parameters
    ----------
    source : Source
        The formulas.
    variables : (3, n) array
        The variables of the launch, as two doubles and a bound on the error each.
    ends : (3, 2) array
        The lower and the upper turning point, in the same form.
    edges : array
        The phase angles, from 0 to pi. The integrand is smooth between them.
    most : float
        The largest error in s.
    """
    program = from_turn_program(source, ())
    if program is None:
        return None
    inputs, before, last = np.ascontiguousarray(np.hstack([variables, ends])), None, edges
    for halving in range(MAX_PANEL_HALVINGS):
        left, right = last[:-1], last[1:]
        high, low, bound = values_from_turns(program, inputs, source.inputs, shares_on(LIBRATION, left, right))[0]
        if not np.isfinite(bound).all():
            return None
        weight, rest = (part.ravel() for part in weights_on(left, right))
        term, term_low = two_product.py_func(high, weight)
        terms = np.stack([term, term_low + (high * rest + low * weight)]).reshape(2, -1, RULE)
        totals = [ZERO]
        for numbers in terms.swapaxes(0, 1).reshape(len(left), -1).tolist():
            part = fsum(numbers)
            totals.append(plus(totals[-1], (part, fsum([*numbers, -part]))))
        times, error = np.array(totals).T[:, :: 2**halving], float(bound @ weight)
        if before is not None:
            error += float(np.abs((times[0] - before[0]) + (times[1] - before[1])).max())
            if error <= most:
                return times, error
        before = times
        last = np.sort(np.concatenate([last, 0.5 * (left + right)]))
    return None
