"""The programs of gradients: formulas of a motion with their derivatives, recorded as tapes.

``half`` below is half of V**2, as a function of a place, the run-time parameters, the launch place lam0, its speed v0,
and a change of the energy, which is zero: ``half = v0**2/2 + energy + U(lam0) - U(lam)``. The variables of
differentiation are the run-time parameters, lam0, v0 and the energy, in this order.
"""

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.arithmetic import UNIT
from gqm_sym.runtime.double_double.interpreter import ERROR, INTERPRETER, LOW, ROW
from gqm_sym.runtime.double_double.recording import Recorder, TapeNumber
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.interface import ExactFormulas, ExactLaw

# The number of variables besides the run-time parameters: the launch place, the launch speed, and the energy.
LAUNCH_VARIABLES = 3

# A program with more registers is not used: its work space would take tens of megabytes.
MAX_REGISTERS = 8000


class Program(NamedTuple):
    """Formulas as operations, with their work space.

    Attributes
    ----------
    operations : (m, 4) array of int
        The operations that the interpreter carries out; those that do not depend on the place come first.
    first : int
        The number of operations that do not depend on the place.
    inputs : int
        The number of inputs, whose registers come first; those of the place's coordinates follow them.
    outputs : array of int
        The start of the registers of the results in the work space.
    work : array
        The registers, of which those of constants are filled.
    constants : tuple
        The positions of these registers, and their exact values: a number, or "pi" or "e".
    """

    operations: NDArray[np.int64]
    first: int
    inputs: int
    outputs: NDArray[np.int64]
    work: Array
    constants: tuple[tuple[int, Fraction | str], ...]

    @property
    def operands(self) -> tuple[Any, ...]:
        """The arguments of compiled code, beginning with the address of the interpreter."""
        return INTERPRETER.address, self.operations, self.first, self.inputs, self.outputs


class LocalMotion(NamedTuple):
    """A motion at a place: half of V**2 and ds/dlam, each with its derivatives with respect to the place and all
    variables.

    Attributes
    ----------
    half, half_slope, half_partials
        Half of V**2, its derivative with respect to the place, and those with respect to the variables at a fixed
        place.
    ds, ds_slope, ds_partials
        The same of ds/dlam; there are derivatives with respect to the run-time parameters only.
    """

    half: TapeNumber
    half_slope: TapeNumber
    half_partials: Sequence[TapeNumber]
    ds: TapeNumber
    ds_slope: TapeNumber
    ds_partials: Sequence[TapeNumber]


class Source(NamedTuple):
    """The formulas that programs are recorded from.

    Attributes
    ----------
    formulas : ExactFormulas
        The formulas of a module.
    domain : callable
        ``f(op, p)`` gives the ends of the parameter's range and its period.
    inertia : callable or None
        ``f(op, p)`` gives 1 + beta; None where it is 1.
    parameters, mass : int
        The number of run-time parameters, and the index of the mass among them.
    """

    formulas: ExactFormulas
    domain: Callable[..., Any]
    inertia: Callable[..., Any] | None
    parameters: int
    mass: int

    @property
    def variables(self) -> int:
        """The number of variables of differentiation."""
        return self.parameters + LAUNCH_VARIABLES

    @property
    def inputs(self) -> int:
        """The number of inputs on which a motion at a place depends."""
        return self.variables

    @property
    def coordinates(self) -> int:
        """The number of coordinates of a place."""
        return 1

    def half(self, op: Recorder, lam: TapeNumber) -> TapeNumber:
        """Record half of V**2 at a place."""
        p = op.values[: self.parameters]
        lam0, v0, energy = op.values[self.parameters : self.variables]
        potential = self.formulas.effective_potential
        found: TapeNumber = (v0 * v0 / 2 + energy) + (potential(op, lam0, p) - potential(op, lam, p))
        return found

    def local(self, op: Recorder, lam: TapeNumber) -> LocalMotion:
        """Record the motion at a place that does not depend on the variables."""
        half, ds = self.half(op, lam), op.number(self.formulas.ds(op, lam, op.values[: self.parameters]))
        half_slope, *half_partials = gradient(op, half, [lam, *op.values[: self.variables]])
        ds_slope, *ds_partials = gradient(op, ds, [lam, *op.values[: self.parameters]])
        return LocalMotion(half, half_slope, half_partials, ds, ds_slope, ds_partials)

    def one_plus_beta(self, op: Recorder) -> TapeNumber:
        """Record 1 + beta."""
        return op.number(1 if self.inertia is None else self.inertia(op, op.values[: self.parameters]))


class AnySource(Protocol):
    """The source from which programs get a motion at a place: formulas of the curve, or its coordinates along a
    chart.
    """

    @property
    def parameters(self) -> int:
        """The number of run-time parameters."""

    @property
    def variables(self) -> int:
        """The number of variables of differentiation."""

    @property
    def inputs(self) -> int:
        """The number of inputs on which a motion at a place depends; the variables come first among them."""

    @property
    def coordinates(self) -> int:
        """The number of coordinates of a place."""

    def local(self, op: Recorder, lam: TapeNumber) -> LocalMotion:
        """Record the motion at a place."""

    def one_plus_beta(self, op: Recorder) -> TapeNumber:
        """Record 1 + beta."""

    def __hash__(self) -> int: ...


def assemble(op: Recorder, outputs: Sequence[Any]) -> Program:
    """Return the program of the given results, with no registers for other operations."""
    wanted = [op.register(output) for output in outputs]
    inputs = len(op.values)
    live, pending = set(range(inputs + len(op.places))), list(wanted)
    while pending:
        k = pending.pop()
        if k in live:
            continue
        code, *operands = op.entries[k]
        if not isinstance(code, str):
            pending += operands
        live.add(k)
        if code == "cosine":
            pending.append(k - 1)
        elif not isinstance(code, str) and op.entries[k + 1 : k + 2] == [("cosine", *operands)]:
            live.add(k + 1)  # the sine's operation fills this register too
    slots = {k: ROW * slot for slot, k in enumerate(sorted(live))}
    if len(slots) > MAX_REGISTERS:
        raise SolutionError("gradients: the formulas of this curve are too long for derivatives by their tape")
    depends = op.depend_on_place()
    operations = [k for k in slots if not isinstance(op.entries[k][0], str)]
    before = [k for k in operations if not depends[k]]
    codes = np.zeros((len(operations), 4), dtype=np.int64)
    for row, k in zip(codes, [*before, *(k for k in operations if depends[k])], strict=True):
        code, *operands = op.entries[k]
        row[: 2 + len(operands)] = code, slots[k], *(slots[operand] for operand in operands)
    work = np.zeros(ROW * len(slots))
    for k, slot in slots.items():
        code, *pair = op.entries[k]
        if code == "constant":
            work[slot : slot + LOW], work[slot + LOW : slot + ERROR] = pair
            work[slot + ERROR : slot + ROW] = 0.25 * UNIT * abs(pair[0]) if pair[1] else 0.0
    constants = tuple((slots[k] // ROW, value) for k, value in op.exact.items() if k in slots)
    return Program(codes, len(before), inputs, np.array([slots[k] for k in wanted], dtype=np.int64), work, constants)


def with_derivatives(op: Recorder, quantities: Sequence[Any], variables: Sequence[Any]) -> Program:
    """Return the program of quantities, each followed by its derivatives."""
    return assemble(op, [part for q in quantities for part in (q, *gradient(op, q, variables))])


@lru_cache(maxsize=64)
def turning_point_program(source: AnySource, wanted: tuple[int, ...] | None = None) -> Program:
    """Return the program of the Newton step from the place to a turning point, and of the turning point's derivatives
    with respect to all variables, or to those that are ``wanted``.
    """
    op = Recorder(source.inputs, source.coordinates)
    here = source.local(op, op.place)
    rows = range(source.variables) if wanted is None else wanted
    parts = here.half, *(here.half_partials[k] for k in rows)
    return assemble(op, [-(part / here.half_slope) for part in parts])


@lru_cache(maxsize=64)
def libration_program(
    source: AnySource, wanted: tuple[int, ...] | None = None, recorder: Callable[[int, int], Recorder] = Recorder
) -> Program:
    """Return the program of the integrand over the phase angle of a libration, with its derivatives at the same phase
    angle.

    The coordinate of a place is the square of the sine of half the phase angle. The inputs after those of the source
    are both turning points and then the derivatives of each. The results are dt/dphi, its derivatives with respect to
    all variables, V**2 dt/dphi (1+beta) with its derivatives, and the derivatives of ds/dlam with respect to the
    run-time parameters at the same place. If variables are ``wanted``, there are derivatives of the turning points with
    respect to these alone, and the results are dt/dphi and its derivatives with respect to them. ``recorder`` makes the
    tape.
    """
    n, rows = source.variables, range(source.variables) if wanted is None else wanted
    op = recorder(source.inputs + 2 + 2 * len(rows), source.coordinates)
    share, (a, b, *ends) = op.place, op.values[source.inputs :]
    width, inertia = b - a, source.one_plus_beta(op)
    half, half_slope, half_partials, ds, ds_slope, ds_partials = source.local(op, a + width * share)
    rate = width * op.sqrt(share * (1 - share)) * ds / op.sqrt(2 * half)
    power = 2 * rate * half * inertia
    rates, powers = [rate], [power]
    by_launch = [op.number(0)] * LAUNCH_VARIABLES
    by_all = gradient(op, inertia, op.values[:n])
    for j, k in enumerate(rows):
        low, high, strain, by = ends[j], ends[len(rows) + j], [*ds_partials, *by_launch][k], by_all[k]
        moved = low + (high - low) * share
        # The small change of V**2 is computed as a whole first, because its parts are large near the turning points.
        faster = (half_partials[k] + half_slope * moved) / (2 * half)
        longer = (high - low) / width + (strain + ds_slope * moved) / ds
        rates.append(rate * (longer - faster))
        powers.append(power * (longer + faster + by / inertia))
    if wanted is not None:
        return assemble(op, rates)
    return assemble(op, [*rates, *powers, *ds_partials])


def on_lap(
    op: Recorder, source: Source, direction: int, share: TapeNumber
) -> tuple[TapeNumber, TapeNumber, TapeNumber]:
    """Return the length of a lap in lam, with the sign of the direction, and ds/dlam and V**2 at a share of the lap."""
    p = op.values[: source.parameters]
    lap = direction * op.number(source.domain(op, p)[2])
    lam = op.values[source.variables] + lap * share
    return lap, op.number(source.formulas.ds(op, lam, p)), 2 * source.half(op, lam)


def lap_rate(source: Source, direction: int) -> tuple[Recorder, TapeNumber, TapeNumber, TapeNumber, TapeNumber]:
    """Return a tape with the length of a lap in lam, and with ds/dlam, V**2 and dt/dshare at a share of the lap."""
    op = Recorder(source.variables + 1)
    lap, ds, v2 = on_lap(op, source, direction, op.place)
    return op, lap, ds, v2, direction * lap * ds / op.sqrt(v2)


@lru_cache(maxsize=64)
def circulation_program(source: Source, direction: int, wanted: tuple[int, ...] | None = None) -> Program:
    """Return the program of the integrand over a lap, with the place as a share of the lap, and of its derivatives at
    the same share.

    The inputs are the variables and the place where the lap begins, which is that of the launch but does not change
    with it. The results are dt/dshare, its derivatives with respect to all variables, V**2 dt/dshare (1+beta) with its
    derivatives, ds/dshare with its derivatives, and the length of the lap in lam with its derivatives. ``wanted`` is as
    in `libration_program`.
    """
    op, lap, ds, v2, rate = lap_rate(source, direction)
    if wanted is not None:
        return with_derivatives(op, [rate], [op.values[k] for k in wanted])
    quantities = rate, rate * v2 * source.one_plus_beta(op), lap * ds, lap
    return with_derivatives(op, quantities, op.values[: source.variables])


@lru_cache(maxsize=64)
def path_program(formulas: ExactFormulas | ExactLaw, parameters: int, mass: int) -> Program:
    """Return the program of states at a place, with derivatives with respect to run-time parameters and to the place.

    The inputs are the run-time parameters, of which ``mass`` is the number of the mass. The results are of x, z,
    ds/dlam, m*kappa, m*n0, U (0 with losses), y of a space curve, m**2 times ``load_along_curvature`` of one in no
    vertical plane, and m**2 times both ``coriolis_loads`` of one in a rotating frame.
    """
    op = Recorder(parameters)
    arguments, m = (op, op.place, op.values), op.values[mass]
    quantities = [formula(*arguments) for formula in (formulas.x, formulas.z, formulas.ds)]
    for formula in (formulas.kappa, formulas.static_normal_load):
        quantities.append(m * formula(*arguments))
    quantities.append(formulas.effective_potential(*arguments) if isinstance(formulas, ExactFormulas) else op.number(0))
    if formulas.y is not None:
        quantities.append(formulas.y(*arguments))
    if formulas.load_along_curvature is not None:
        quantities.append(m * m * formulas.load_along_curvature(*arguments))
    if formulas.coriolis_loads is not None:
        quantities += [m * m * part for part in formulas.coriolis_loads(*arguments)]
    return with_derivatives(op, quantities, [*op.values, op.place])


@lru_cache(maxsize=64)
def bend_program(source: Source) -> Program:
    """Return the program of the second derivatives of x and z, and of y of a space curve, with respect to the place.

    The inputs are the run-time parameters.
    """
    op, formulas = Recorder(source.parameters), source.formulas
    coordinates = [f(op, op.place, op.values) for f in (formulas.x, formulas.z, formulas.y) if f is not None]
    rates = [gradient(op, coordinate, [op.place])[0] for coordinate in coordinates]
    return assemble(op, [gradient(op, rate, [op.place])[0] for rate in rates])


@lru_cache(maxsize=64)
def range_program(domain: Callable[..., Any], parameters: int) -> Program:
    """Return the program of both ends of the parameter's range and its period, each with its derivatives with respect
    to the run-time parameters.

    Those that do not exist are zero.
    """
    op = Recorder(parameters)
    numbers = [0 if number is None else number for number in domain(op, op.values)]
    return with_derivatives(op, numbers, op.values)


class ContactForms(NamedTuple):
    """The parts of the contact force at a place, per unit mass.

    Attributes
    ----------
    curvature, load
        kappa, and N/m at rest.
    product
        ``load_along_curvature``; None in a vertical plane.
    aside
        ``coriolis_loads``; None in a frame that does not turn.
    """

    curvature: Any
    load: Any
    product: Any = None
    aside: Any = None


def contact_forms(op: Recorder, formulas: ExactFormulas | ExactLaw, lam: TapeNumber, p: Any) -> ContactForms:
    """Record the parts of the contact force at a place by the formulas of a module."""
    known = formulas.kappa, formulas.static_normal_load, formulas.load_along_curvature, formulas.coriolis_loads
    return ContactForms(*(None if formula is None else formula(op, lam, p) for formula in known))


def length_of_contact(op: Recorder, forms: ContactForms, w: Any, direction: Any) -> Any:
    """Record N/m for V**2 = ``w`` and the sign of ds/dt; for a curve that lies in no vertical plane, ``|N|/m``."""
    curvature, load, product, aside = forms
    if product is None:
        return curvature * w + load
    square = curvature * curvature * w * w + 2 * product * w + load * load
    if aside is not None:
        square = square + 2 * direction * op.sqrt(w) * (aside[0] + aside[1] * w)
    return op.sqrt(square)


def sided_force(op: Recorder, formulas: ExactFormulas | ExactLaw, place: tuple[TapeNumber, Any], direction: Any) -> Any:
    """Record the force per unit mass whose sign shows on which side of the track a body is, given a place, V**2 there
    and the sign of ds/dt: N/m, or its component along the upward direction of the riders of a banked track in space.
    """
    lam, w = place
    if formulas.load_along_curvature is None:
        return length_of_contact(op, contact_forms(op, formulas, lam, op.values), w, direction)
    if formulas.upright_force is None:
        raise SolutionError("gradients: no formula of this track shows on which side of it a body is")
    return component_of_contact(op, formulas.upright_force(op, lam, op.values), w, direction)


def component_of_contact(op: Recorder, parts: Sequence[Any], w: Any, direction: Any) -> Any:
    """Record a component of N/m from its parts at rest and by V**2, and in a rotating frame by ds/dt."""
    at_rest, by_square, *by_velocity = parts
    found = at_rest + by_square * w
    for part in by_velocity:
        found = found + direction * op.sqrt(w) * part
    return op.number(found)


@lru_cache(maxsize=64)
def sided_program(source: Source, direction: int) -> Program:
    """Return the program of `sided_force` at a place, and of its derivatives with respect to the place and the
    variables.

    The inputs are the variables; ``direction`` is the sign of ds/dt.
    """
    op = Recorder(source.variables)
    force = sided_force(op, source.formulas, (op.place, 2 * source.half(op, op.place)), direction)
    return with_derivatives(op, [force], [op.place, *op.values])


def extreme_quantity(op: Recorder, source: Source, of_speed: bool, direction: int = 1) -> TapeNumber:
    """Record half of V**2, or the contact force, at the place of a tape whose inputs are the variables."""
    half = source.half(op, op.place)
    if of_speed:
        return half
    forms = contact_forms(op, source.formulas, op.place, op.values)
    force: TapeNumber = op.values[source.mass] * length_of_contact(op, forms, 2 * half, direction)
    return force


@lru_cache(maxsize=64)
def extreme_program(
    source: Source,
    of_speed: bool,
    direction: int = 1,
    wanted: tuple[int, ...] | None = None,
    recorder: Callable[[int, int], Recorder] = Recorder,
) -> Program:
    """Return the program of half of V**2, or of the contact force, at a place, with its first and second derivative
    with respect to the place.

    The inputs are the variables; the derivatives with respect to them, or to those that are ``wanted``, follow.
    ``direction`` is the sign of ds/dt, and ``recorder`` makes the tape.
    """
    op = recorder(source.variables, 1)
    quantity = extreme_quantity(op, source, of_speed, direction)
    rows = range(source.variables) if wanted is None else wanted
    slope, *partials = gradient(op, quantity, [op.place, *(op.values[k] for k in rows)])
    return assemble(op, [quantity, slope, *gradient(op, slope, [op.place]), *partials])
