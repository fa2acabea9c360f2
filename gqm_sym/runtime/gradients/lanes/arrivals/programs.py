"""The program of what the first time at a place depends on, at the launch and at the place itself."""

from functools import lru_cache

from gqm_sym.runtime.double_double.recording import Recorder
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.lanes.exact_differences import exact_rates_program
from gqm_sym.runtime.gradients.lanes.operations import LaneRecorder
from gqm_sym.runtime.gradients.lanes.scaling import Plan
from gqm_sym.runtime.gradients.programs import Program, Source, assemble

# The results of the program. The derivatives of the phase follow.
BELOW, ABOVE, DS, SQUARE, SLOPE, MOVED, SHIFTS = range(7)


@lru_cache(maxsize=64)
def place_program(source: Source, wanted: tuple[int, ...]) -> Program:
    """Return the program of a libration at a place in lam.

    Its inputs are those of `programs.libration_program`. The results are the distances from both turning points,
    ds/dlam, V**2, the slope of the potential, and the number MOVED: 1 less the change, per change of the launch place,
    of the place with the phase of the launch. Then, for each variable, the distance by which the place with the same
    phase moves the other way. The last one of the variables is the energy; without it, MOVED is 1.
    """
    op = LaneRecorder(source.inputs + 2 + 2 * len(wanted), 1)
    a, b, *ends = op.values[source.inputs :]
    below, above, half = op.place - a, b - op.place, source.half(op, op.place)
    slope = -gradient(op, half, [op.place])[0]
    shifts = [-((low * above + high * below) / (b - a)) for low, high in zip(ends, ends[len(wanted) :], strict=False)]
    moved = 1 + slope * shifts[0] if source.variables - 1 in wanted else op.number(1)
    ds = source.formulas.ds(op, op.place, op.values[: source.parameters])
    return assemble(op, [below, above, ds, 2 * half, slope, moved, *shifts])


def small_swing_program(source: Source, wanted: tuple[int, ...]) -> Program | None:
    """Return the program of `programs.libration_program` for swings of which that loses too many digits.

    The energy is the first variable, if it is one, and then parameters follow in their order.
    """
    has_energy = source.variables - 1 in wanted
    return exact_rates_program(source, Plan((), (), wanted[1:] if has_energy else wanted, has_energy))


@lru_cache(maxsize=64)
def has_fixed_laps(source: Source) -> bool:
    """Return whether the length of a lap in lam does not depend on the run-time parameters."""
    op = Recorder(source.parameters)
    parameters = op.values[: source.parameters]
    lap = op.number(source.domain(op, parameters)[2])
    return all(by.known == 0 for by in gradient(op, lap, parameters))
