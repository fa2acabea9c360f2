"""The time per phase angle of a libration, with V**2 as a divided difference over a turning point and the place.

Beside a hilltop V**2 vanishes at the turning point of a body and hardly increases from there on. As the difference of
potentials it then loses as many digits as it is small, and its derivatives lose as many again. With the divided
difference over the turning point a, ``V**2 = -2 (lam - a) U[a, lam]``, digits are lost only by the slope of the
potential at the turning point, which is as small as the square root of V**2 (MATHS, section 3). The program serves the
half of the orbit that begins at a; the other half is that of the same program with both turning points exchanged.
"""

from fractions import Fraction
from functools import lru_cache
from typing import Any

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.double_double.recording import TapeNumber
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.lanes.differences import Places
from gqm_sym.runtime.gradients.lanes.exact_differences import SeriesRecorder, assembled
from gqm_sym.runtime.gradients.lanes.operations import LaneRecorder, WithoutRuleError
from gqm_sym.runtime.gradients.lanes.programs import total_change
from gqm_sym.runtime.gradients.programs import Program, Source

# The number of times that the argument of sinh(t)/t is halved before it is a series. The series serves up to 1.
HALVINGS = 3


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

    def sinc_pair(self, p: TapeNumber, q: TapeNumber) -> tuple[TapeNumber, TapeNumber]:
        """Record S(p) + S(q) and S[p, q], which divided differences over two places do not need."""
        return LaneRecorder.sinc_pair(self, p, q)


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
        over = Places(op, (a, b), (share, 1 - share))
        slope, ds = over.of(source.formulas.effective_potential, p).first[0], over.of(source.formulas.ds, p).at[1]
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
