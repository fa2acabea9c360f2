"""The programs of gradients along charts: the formulas of a motion over coordinates of the plane, recorded as tapes.

A chart has no formulas for its coordinates, so they are inputs at each place: x and z, their derivatives with respect
to the parameter u of a piece (`charts.double_double.pieces`), and the curvature. The place itself is arc length. A
parameter that shapes the curve moves each of its points across the curve: only the normal part of a displacement
counts. Arc lengths between such points change by the curvature times the displacement. The arc length of a point from
the start point of the curve then grows by a known ``shift``. Since the arc length of the launch is given, the launch
moves to another point.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from gqm_sym.runtime.double_double.recording import Recorder, TapeNumber
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.programs import LAUNCH_VARIABLES, LocalMotion, Program, assemble


def size_of_point(dimension: int) -> int:
    """Return the number of coordinates of a point: those of its place, their derivatives with respect to u, and the
    curvature.
    """
    return 5 if dimension == 2 else 9


class ChartSource(NamedTuple):
    """The formulas that programs of motions along charts are recorded from.

    Attributes
    ----------
    potential : callable
        ``f(op, x, z, p)`` gives the effective potential and its derivatives with respect to x and z.
    inertia : callable or None
        ``f(op, p)`` gives 1 + beta; None where it is 1.
    parameters, mass : int
        The number of run-time parameters, and the index of the mass among them.
    shaping : tuple of int
        The parameters that shape the curve.
    coriolis : callable or None
        That of `interface.ExactPotential`, for a curve in space in a rotating frame.
    """

    potential: Callable[..., Any]
    inertia: Callable[..., Any] | None
    parameters: int
    mass: int
    shaping: tuple[int, ...]
    coriolis: Callable[..., Any] | None = None

    @property
    def dimension(self) -> int:
        """The number of coordinates of a place."""
        return 2

    @property
    def variables(self) -> int:
        """The number of variables of differentiation."""
        return self.parameters + LAUNCH_VARIABLES

    @property
    def inputs(self) -> int:
        """The variables, then the point of the launch with its displacements, and the shift of each."""
        return self.variables + self.point + len(self.shaping)

    @property
    def point(self) -> int:
        """The coordinates of a point, and those of its displacements."""
        return size_of_point(self.dimension) + self.dimension * len(self.shaping)

    @property
    def coordinates(self) -> int:
        """The share of the phase, then a point with its displacements."""
        return 1 + self.point

    def _at(self, op: Recorder, numbers: Sequence[TapeNumber]) -> tuple[TapeNumber, TapeNumber, list[TapeNumber]]:
        """Return the potential at a point, and its derivatives with respect to arc length and the run-time
        parameters.
        """
        (x, z, dx, dz), p = numbers[:4], op.values[: self.parameters]
        value, by_x, by_z = map(op.number, self.potential(op, x, z, p))
        partials, speed = gradient(op, value, p), op.sqrt(dx * dx + dz * dz)
        for k, across in self._displacements(op, numbers):
            partials[k] = partials[k] + across * (by_z * dx - by_x * dz) / speed
        return value, (by_x * dx + by_z * dz) / speed, partials

    def _displacements(self, op: Recorder, numbers: Sequence[TapeNumber]) -> list[tuple[int, TapeNumber]]:
        """Return the displacement of a point to the left of the curve by each parameter that shapes it."""
        dx, dz = numbers[2:4]
        moves = self._moves(numbers)
        speed = op.sqrt(dx * dx + dz * dz)
        return [(k, (z * dx - x * dz) / speed) for k, (x, z) in zip(self.shaping, moves, strict=True)]

    def _moves(self, numbers: Sequence[TapeNumber]) -> list[Sequence[TapeNumber]]:
        """Return the displacement of a point by each parameter that shapes the curve."""
        return [
            numbers[i : i + self.dimension] for i in range(size_of_point(self.dimension), self.point, self.dimension)
        ]

    def _strains(self, op: Recorder, numbers: Sequence[TapeNumber]) -> list[tuple[int, TapeNumber]]:
        """Return the relative change of arc length at a point with each parameter that shapes the curve."""
        return [(k, -(numbers[4] * across)) for k, across in self._displacements(op, numbers)]

    def local(self, op: Recorder, lam: TapeNumber) -> LocalMotion:
        """Record the motion at the point with the given coordinates."""
        n, end = self.variables, self.variables + self.point
        v0, energy = op.values[n - LAUNCH_VARIABLES + 1 : n]
        value, slope, partials = self._at(op, op.places[1:])
        launched, launch_slope, launch_partials = self._at(op, op.values[n:end])
        by_parameters = [b - a for a, b in zip(partials, launch_partials, strict=True)]
        for k, shift in zip(self.shaping, op.values[end : self.inputs], strict=True):
            by_parameters[k] = by_parameters[k] - launch_slope * shift
        half, one, zero = (v0 * v0 / 2 + energy) + (launched - value), op.number(1), op.number(0)
        strains = [zero] * self.parameters
        for k, strain in self._strains(op, op.places[1:]):
            strains[k] = strain
        return LocalMotion(half, -slope, [*by_parameters, launch_slope, v0, one], one, zero, strains)

    def one_plus_beta(self, op: Recorder) -> TapeNumber:
        """Record 1 + beta."""
        return op.number(1 if self.inertia is None else self.inertia(op, op.values[: self.parameters]))


@lru_cache(maxsize=64)
def chart_circulation_program(source: ChartSource) -> Program:
    """Return the integrands over a lap, as `programs.circulation_program` does; the last input is the length of the
    lap.

    The results are dt/dshare with its derivatives with respect to all variables, V**2 dt/dshare (1+beta) with its
    derivatives, and the derivatives of ds/dlam.
    """
    op = Recorder(source.inputs + 1, source.coordinates)
    here, inertia = source.local(op, op.place), source.one_plus_beta(op)
    rate = op.values[-1] / op.sqrt(2 * here.half)
    power = 2 * rate * here.half * inertia
    rates, powers = [rate], [power]
    strains = [*here.ds_partials, *[op.number(0)] * LAUNCH_VARIABLES]
    by_inertia = gradient(op, inertia, op.values[: source.variables])
    for strain, change, by in zip(strains, here.half_partials, by_inertia, strict=True):
        faster = change / (2 * here.half)
        rates.append(rate * (strain - faster))
        powers.append(power * (strain + faster + by / inertia))
    return assemble(op, [*rates, *powers, *here.ds_partials])


@lru_cache(maxsize=64)
def chart_path_program(source: ChartSource) -> Program:
    """Return the program of states at a point, as `programs.path_program` does, with derivatives at points of the
    curve.

    The coordinates are x and z with their first three derivatives with respect to u, and for each parameter that shapes
    the curve the displacement of x and z with its first two.
    """
    count, p = len(source.shaping), source.parameters
    op = Recorder(p, 8 + 6 * count)
    values, places = op.values, op.places
    (x, z, dx, dz, bend_x, bend_z), following = places[:6], places[2:8]
    square = dx * dx + dz * dz
    speed = op.sqrt(square)
    value, by_x, by_z = map(op.number, source.potential(op, x, z, values))
    curvature = (dx * bend_z - dz * bend_x) / (square * speed)
    load = source.one_plus_beta(op) * (by_z * dx - by_x * dz) / speed
    outputs: list[Any] = []
    for quantity in (x, z, None, values[source.mass] * curvature, values[source.mass] * load, value):
        partials = [op.number(0)] * (p + 6) if quantity is None else gradient(op, quantity, [*values, *places[:6]])
        by_values, by_places = partials[:p], partials[p:]
        along = sum((a * b for a, b in zip(by_places, following, strict=True)), op.number(0)) / speed
        for i, k in enumerate(source.shaping):
            moved = places[8 + 6 * i : 14 + 6 * i]
            if quantity is None:
                by_values[k] = curvature * (moved[0] * dz - moved[1] * dx) / speed
                continue
            for a, b in zip(by_places, moved, strict=True):
                by_values[k] = by_values[k] + a * b
            by_values[k] = by_values[k] - along * (moved[0] * dx + moved[1] * dz) / speed
        outputs += [op.number(1) if quantity is None else quantity, *by_values, along]
    return assemble(op, outputs)


@lru_cache(maxsize=64)
def speed_program(source: ChartSource) -> Program:
    """Return the program of half of V**2 at a point, and its derivatives with respect to arc length and all
    variables.
    """
    op = Recorder(source.inputs, source.coordinates)
    here = source.local(op, op.place)
    return assemble(op, [here.half, here.half_slope, *here.half_partials])
