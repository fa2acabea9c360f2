"""The programs of variations: the law of a motion with losses and its derivatives, recorded as tapes."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.double_double.recording import Recorder, TapeNumber, scalar_product
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.lanes.assembly import LaneProgram
from gqm_sym.runtime.gradients.lanes.assembly import assemble as assemble_lanes
from gqm_sym.runtime.gradients.lanes.operations import LaneRecorder
from gqm_sym.runtime.gradients.programs import (
    ContactForms,
    Program,
    assemble,
    component_of_contact,
    contact_forms,
    length_of_contact,
    sided_force,
    with_derivatives,
)
from gqm_sym.runtime.interface import ExactChartLaw, ExactLaw


@lru_cache(maxsize=64)
def law_program(law: ExactLaw, parameters: int) -> Program:
    """Return the program of the law of a motion with losses, whose two coordinates are a place and V**2.

    The inputs are the run-time parameters, sgn(dlam/dt) and sgn(N). The results are ds/dlam and its derivatives with
    respect to the place and the parameters, and dW/dlam, where W is V**2, and its derivatives with respect to the
    place, W and the parameters.
    """
    op, ds, slope = _law(law, parameters)
    (lam, w), p = op.places, op.values[:parameters]
    return assemble(op, [ds, *gradient(op, ds, [lam, *p]), slope, *gradient(op, slope, [lam, w, *p])])


@lru_cache(maxsize=64)
def rates_program(law: ExactLaw, parameters: int) -> Program:
    """Return the program of ds/dlam and dW/dlam, whose inputs and coordinates are those of `law_program`."""
    op, *rates = _law(law, parameters)
    return assemble(op, rates)


@lru_cache(maxsize=64)
def law_in_doubles(law: ExactLaw, parameters: int, *, timed: bool) -> LaneProgram:
    """Return the program of `law_program` in double precision; unless ``timed``, without ds/dlam and its derivatives.

    The inputs are the run-time parameters. The coordinates of a place are those of a state (`law.states_of`), of which
    the low double of the place does not matter.
    """
    op = LaneRecorder(parameters, 5)
    (lam, _, w, *signs), p = op.places, op.values
    slope = op.number(law.speed_slope(op, lam, w, *signs, p))
    outputs = [slope, *gradient(op, slope, [lam, w, *p])]
    if timed:
        ds = op.number(law.ds(op, lam, p))
        outputs = [ds, *gradient(op, ds, [lam, *p]), *outputs]
    return assemble_lanes(op, outputs)


@lru_cache(maxsize=64)
def load_program(law: ExactLaw, parameters: int) -> Program:
    """Return the program of the slope of the contact force per mass along a motion with losses, and of its derivatives
    with respect to the place and W.

    The inputs are those of `law_program`.
    """
    op, _, slope = _law(law, parameters)
    lam, w = op.places
    load = length_of_contact(op, contact_forms(op, law, lam, op.values), w, op.values[parameters])
    by_place, by_w = gradient(op, load, [lam, w])
    load_slope = by_place + by_w * slope
    return with_derivatives(op, [load_slope], [lam, w])


@lru_cache(maxsize=64)
def sided_program(law: ExactLaw, parameters: int) -> Program:
    """Return the program of the derivatives of the force whose sign shows on which side of the track a body is, with
    respect to the place, W and the parameters.

    The inputs are those of `law_program`.
    """
    op = Recorder(parameters + 2, coordinates=2)
    lam, w = op.places
    force = sided_force(op, law, (lam, w), op.values[parameters])
    return assemble(op, gradient(op, force, [lam, w, *op.values[:parameters]]))


def _law(law: ExactLaw, parameters: int) -> tuple[Recorder, TapeNumber, TapeNumber]:
    """Return a tape with ds/dlam and dW/dlam."""
    op = Recorder(parameters + 2, coordinates=2)
    (lam, w), p, signs = op.places, op.values[:parameters], op.values[parameters:]
    return op, op.number(law.ds(op, lam, p)), op.number(law.speed_slope(op, lam, w, *signs, p))


@lru_cache(maxsize=64)
def force_program(law: ExactLaw, parameters: int) -> Program:
    """Return the program of dW/dlam at a place and V**2, and its derivative with respect to the place; the inputs are
    those of `law_program`.
    """
    op, _, slope = _law(law, parameters)
    return with_derivatives(op, [slope], [op.place])


class ChartForces(NamedTuple):
    """The formulas from which the programs of motions with losses along charts are recorded.

    Attributes
    ----------
    law : ExactChartLaw
        The formulas of a module.
    parameters, mass : int
        The number of run-time parameters, and the index of the mass among them.
    shaping : tuple of int
        The parameters that shape the curve.
    dimension : int
        The number of coordinates of a point.
    """

    law: ExactChartLaw
    parameters: int
    mass: int
    shaping: tuple[int, ...]
    dimension: int = 2


# The number of derivatives of the coordinates with respect to u, from order 0 on, that describe a point of a chart, and
# the number of those that its curvature needs; each displacement has as many of the latter.
ORDERS, CURVED = 5, 3

# A number that keeps the square of a length that vanishes from being zero.
LEAST_SQUARE = 1e-300


class _ChartPoint:
    """A tape with a point of a chart, as `ShapedPieces.path` gives it with `ORDERS`, and V**2 there.

    The inputs are the run-time parameters, perhaps ``more``, sgn(ds/dt) and sgn(N).
    """

    def __init__(self, forces: ChartForces, more: int = 0) -> None:
        d = forces.dimension
        op = Recorder(forces.parameters + 2 + more, d * (ORDERS + CURVED * len(forces.shaping)) + 1)
        self.op, self._forces, self.w = op, forces, op.places[-1]
        self.p, signs = op.values[: forces.parameters], op.values[-2:]
        place, rates, bends = (op.places[k * d : k * d + d] for k in range(CURVED))
        square = scalar_product(rates, rates)
        self._speed = op.sqrt(square)
        if d == 2:
            self.curvature = (rates[0] * bends[1] - rates[1] * bends[0]) / (square * self._speed)
            curved = [self.curvature]
        else:
            share = scalar_product(rates, bends) / square
            curved = [(bend - share * rate) / square for bend, rate in zip(bends, rates, strict=True)]
            self.curvature = op.sqrt(scalar_product(curved, curved) + LEAST_SQUARE)
        point = (*place, *(rate / self._speed for rate in rates), *curved)
        self.place, self._point = place, point
        law, product, aside = forces.law, None, None
        if law.load_along_curvature is not None:
            product = op.number(law.load_along_curvature(op, *point, self.p))
        if law.coriolis_loads is not None:
            aside = [op.number(part) for part in law.coriolis_loads(op, *point, self.p)]
        load = op.number(law.static_normal_load(op, *point, self.p))
        self.forms, self._direction = ContactForms(self.curvature, load, product, aside), signs[0]
        self.slope = op.number(forces.law.speed_slope(op, *point, self.w, *signs, self.p))
        self.strains = [op.number(0)] * forces.parameters
        for k, moved in self._displacements():
            self.strains[k] = scalar_product(rates, moved[d : 2 * d]) / square

    def _displacements(self) -> list[tuple[int, Sequence[TapeNumber]]]:
        """Return, for each parameter that shapes the curve, the displacement with its derivatives with respect to u."""
        first, count = self._forces.dimension * ORDERS, self._forces.dimension * CURVED
        starts = range(first, first + count * len(self._forces.shaping), count)
        return [(k, self.op.places[i : i + count]) for k, i in zip(self._forces.shaping, starts, strict=True)]

    @property
    def contact(self) -> TapeNumber:
        """N/m, or |N|/m in space."""
        found: TapeNumber = length_of_contact(self.op, self.forms, self.w, self._direction)
        return found

    def sided_force(self, roll: TapeNumber, arc: TapeNumber) -> TapeNumber:
        """Return the force per unit mass whose sign shows on which side of the track a body is, given the roll angle
        and the arc length.
        """
        op, law = self.op, self._forces.law
        if law.load_along_curvature is None:
            return self.contact
        if law.upright_force is None:
            raise SolutionError("gradients: no formula of this track shows on which side of it a body is")
        parts = law.upright_force(op, *self._point, roll, arc, self.p)
        found: TapeNumber = component_of_contact(op, parts, self.w, self._direction)
        return found

    def partials(self, quantity: TapeNumber) -> tuple[TapeNumber, TapeNumber, list[TapeNumber]]:
        """Return the derivatives of a quantity of a point with respect to arc length, V**2, and the run-time
        parameters.
        """
        op, d = self.op, self._forces.dimension
        count = d * (ORDERS - 1)
        *by_places, by_w = gradient(op, quantity, [*op.places[:count], self.w])
        by_parameters = gradient(op, quantity, self.p)
        along = sum((a * b for a, b in zip(by_places, op.places[d:], strict=False)), op.number(0)) / self._speed
        for k, moved in self._displacements():
            for a, b in zip(by_places, moved, strict=False):
                by_parameters[k] = by_parameters[k] + a * b
        return along, by_w, by_parameters


@lru_cache(maxsize=64)
def chart_law_program(forces: ChartForces) -> Program:
    """Return the program of the law at a point of a chart: the relative change of arc lengths there by each parameter,
    and dW/dlabel with derivatives.

    The derivatives are by the place, by W and by the parameters. If arc lengths grow, so does the change of W over
    them.
    """
    chart_point = _ChartPoint(forces)
    along, by_w, by_parameters = chart_point.partials(chart_point.slope)
    by_parameters = [
        part + chart_point.slope * strain for part, strain in zip(by_parameters, chart_point.strains, strict=True)
    ]
    return assemble(chart_point.op, [*chart_point.strains, chart_point.slope, along, by_w, *by_parameters])


@lru_cache(maxsize=64)
def chart_force_program(forces: ChartForces) -> Program:
    """Return the program of dW/ds at a point of a chart, and its derivative with respect to arc length."""
    chart_point = _ChartPoint(forces)
    return assemble(chart_point.op, [chart_point.slope, chart_point.partials(chart_point.slope)[0]])


@lru_cache(maxsize=64)
def chart_load_program(forces: ChartForces) -> Program:
    """Return the program of the slope of the contact force per mass along a motion, and of its derivatives with respect
    to the place and W.
    """
    chart_point = _ChartPoint(forces)
    along, by_w, _ = chart_point.partials(chart_point.contact)
    load_slope = along + by_w * chart_point.slope
    return assemble(chart_point.op, [load_slope, *chart_point.partials(load_slope)[:2]])


@lru_cache(maxsize=64)
def chart_sided_program(forces: ChartForces) -> Program:
    """Return the program of the derivatives of `_ChartPoint.sided_force` with respect to the place, W and the
    parameters for a given roll angle and arc length, and with respect to these two.

    The roll angle and the arc length are inputs behind the run-time parameters.
    """
    chart_point = _ChartPoint(forces, more=2)
    op, (roll, arc) = chart_point.op, chart_point.op.values[forces.parameters : -2]
    force = chart_point.sided_force(roll, arc)
    along, by_w, by_parameters = chart_point.partials(force)
    return assemble(op, [along, by_w, *by_parameters, *gradient(op, force, [roll, arc])])


@lru_cache(maxsize=64)
def chart_path_program(forces: ChartForces) -> Program:
    """Return the program of states at a point, as `gradients.programs.path_program`."""
    chart_point = _ChartPoint(forces)
    op, m, outputs, place = chart_point.op, chart_point.p[forces.mass], list[TapeNumber](), chart_point.place
    curvature, load, product, aside = chart_point.forms
    quantities = [place[0], place[-1], None, m * curvature, m * load, op.number(0)]
    quantities += [place[1]] if forces.dimension > 2 else []
    quantities += [m * m * part for part in ((product,) if product is not None else ()) + tuple(aside or ())]
    for quantity in quantities:
        if quantity is None:
            outputs += [op.number(1), *chart_point.strains, op.number(0)]
        else:
            along, _, by_parameters = chart_point.partials(quantity)
            outputs += [quantity, *by_parameters, along]
    return assemble(op, outputs)
