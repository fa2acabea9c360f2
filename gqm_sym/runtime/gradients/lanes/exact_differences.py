"""Derivatives of half periods of small swings: the divided differences of `differences` in double-double arithmetic.

About an equilibrium V**2 as a difference of potentials loses as many digits as the square of a swing's width has, and
its derivatives lose as many again. As a divided difference it loses none, and the derivatives those by which the
changes of both turning points exceed that of the half period.
"""

from fractions import Fraction
from functools import lru_cache
from math import factorial

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.double_double.recording import TapeNumber
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.lanes.differences import Places
from gqm_sym.runtime.gradients.lanes.operations import LaneRecorder, WithoutRuleError
from gqm_sym.runtime.gradients.lanes.programs import swing_inputs, swing_of, total_change
from gqm_sym.runtime.gradients.lanes.scaling import Plan, combined, terms_of
from gqm_sym.runtime.gradients.programs import Program, Source, assemble

# The series of cos(t) and of sin(t)/t in t**2, highest power first. For squares up to 1 their rests are below 1e-36.
TERMS = 16
EVEN, ODD = (
    tuple(Fraction((-1) ** k, factorial(2 * k + odd)) for k in reversed(range(TERMS + 1 - odd))) for odd in (0, 1)
)


class SeriesRecorder(LaneRecorder):
    """A tape on which ``S(t**2) = sin(t)/t`` and its divided differences are series.

    Attributes
    ----------
    squares : TapeNumber
        The sum of the squares of all arguments of S. If it is above 1, the series may be too short.
    """

    def __init__(self, parameters: int) -> None:
        super().__init__(parameters, 1)
        self.squares = self.number(0)

    def sinc(self, t: TapeNumber, sign: int) -> TapeNumber:
        """Record sin(t)/t, or sinh(t)/t for the sign -1."""
        square = sign * (t * t)
        return self._series(ODD, square, square)[0]

    def wave_differences(self, p: TapeNumber, tilt: TapeNumber) -> tuple[TapeNumber, TapeNumber]:
        """Record C[q, p] and S[q, p] for ``q = p*tilt**2``."""
        of_even, of_odd = (self._series(terms, p, p * (tilt * tilt))[1] for terms in (EVEN, ODD))
        return of_even, of_odd

    def _series(self, terms: tuple[Fraction, ...], p: TapeNumber, q: TapeNumber) -> tuple[TapeNumber, TapeNumber]:
        """Record the value of a series at p, and its divided difference over p and q."""
        self.squares = self.squares + p * p + q * q
        value, slope = self.number(0), self.number(0)
        for term in terms:
            slope, value = slope * q + value, value * p + term
        return value, slope


@lru_cache(maxsize=64)
def exact_swing_program(source: Source, plan: Plan) -> Program | None:
    """Return dt/dphi and the derivatives of `programs.swing_program` as a program in double-double arithmetic.

    The coordinate of a place is the square of the sine of half the phase angle. On orbits that are too wide for the
    series the results are NaN. It is None if the formulas are too long, or contain an operation without a rule for
    divided differences.
    """
    op = SeriesRecorder(swing_inputs(source, plan))
    try:
        rate, *rates = exact_rates(op, source, plan)
        launch = op.values[source.parameters], op.values[source.parameters + 1]
        return assembled(op, [rate, *combined(op, terms_of(op, source, plan, launch), [rate, *rates])])
    except (WithoutRuleError, SolutionError):
        return None


@lru_cache(maxsize=64)
def exact_rates_program(source: Source, plan: Plan) -> Program | None:
    """Return the program of dt/dphi and its derivatives with respect to the variables by which a plan differentiates
    the formulas; it is None where `exact_swing_program` is.
    """
    op = SeriesRecorder(swing_inputs(source, plan))
    try:
        return assembled(op, exact_rates(op, source, plan))
    except (WithoutRuleError, SolutionError):
        return None


def exact_rates(op: SeriesRecorder, source: Source, plan: Plan) -> list[TapeNumber]:
    """Record dt/dphi and its derivatives with respect to `scaling.Plan.moves`."""
    p, _, (a, b), moves = swing_of(op, source, plan)
    over = Places(op, (a, b), 2 * op.place - 1, 4 * (op.place * (1 - op.place)))
    factor, ds = over.of(source.formulas.effective_potential, p).second, over.of(source.formulas.ds, p).at
    rate = ds / op.sqrt(2 * factor)
    by_inputs = gradient(op, rate, [a, b, *p])
    return [rate, *(total_change(op, by_inputs, move) for move in moves)]


def assembled(op: SeriesRecorder, results: list[TapeNumber]) -> Program:
    """Return the program of results, which are NaN where the series is too short."""
    reach = op.sqrt(1 - op.squares)
    return assemble(op, [result * (reach / reach) for result in results])
