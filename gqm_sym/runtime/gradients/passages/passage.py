"""How motions without losses that do not repeat change: the times of places, turning points, ends, and states.

Such a motion has at most one turning point. The time between two places is an integral over the phase angle of
`programs.libration_program` with these places as its ends, whether the body turns there or not, so that it and its
derivatives at the same phase angle are smooth. Beside a turning point a place is moved with it: the derivatives of its
time are then regular, and the rest of the change follows from the speed.
"""

from functools import cached_property
from math import ceil, isfinite, log, log2
from typing import NamedTuple

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import plus, two_product, two_sum
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.nodes import panel_rule
from gqm_sym.runtime.gradients.evaluation import MEAN, fill_panel_means, values
from gqm_sym.runtime.gradients.formula_orbit import PI, source_of, variables_of
from gqm_sym.runtime.gradients.panels import UNDECIDED, rule_with_tails
from gqm_sym.runtime.gradients.passages.beside_cusp import BesideCusp
from gqm_sym.runtime.gradients.path import (
    CURVATURE,
    DS,
    LOAD,
    PRODUCT,
    SPACE_Y,
    PathRows,
    X,
    Z,
    path_rows,
    squared_force,
)
from gqm_sym.runtime.gradients.programs import (
    Program,
    bend_program,
    extreme_program,
    libration_program,
    range_program,
    sided_program,
    turning_point_program,
)
from gqm_sym.runtime.gradients.series import PanelSeries, to_legendre
from gqm_sym.runtime.launch.ends import is_cusp
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.quadrature.trapezoid import LIBRATION

# The number of Newton steps to a turning point, starting from doubles.
NEWTON_STEPS = 2

# Changes along a motion are resolved if the last two Legendre coefficients on all panels of the phase are below this
# share of the largest value; panels are doubled from the first to the second number.
MAX_TAIL, MIN_PANELS, MAX_PANELS = 1e-14, 2, 128

# The widest span that is tried for places beside a cusp.
WIDEST_SPAN = 4.0**8

# The length of a path changes by an integral on panels, which are halved until it changes by less than this share of
# the largest; at most so many times.
MAX_CHANGE, MAX_HALVINGS = 1e-15, 8


class Place(NamedTuple):
    """A place that changes with the variables.

    Attributes
    ----------
    high, low : float
        The place, as two doubles.
    moves : (3, n) array
        Its derivatives with respect to all variables, as two doubles and a bound on the error each.
    """

    high: float
    low: float
    moves: Array

    def beside(self, lam: float) -> "Place":
        """Return another place that moves with this one."""
        return Place(lam, 0.0, self.moves)


class PassageChanges:
    """The changes of a motion without losses that does not repeat, along a curve with formulas.

    The variables are those of `programs.Source`. Nothing is asked of the last of them, the energy, with which the
    turning point leaves a launch at rest.

    Parameters
    ----------
    problem : Problem
        The launch.
    heading : int
        The sign of ds/dt after the launch.
    turn : float or None
        The turning point to the accuracy of doubles; the launch, if the body is released at rest; None if there is
        none.
    limit : float
        The place where the motion ends, or that it tends to; infinite if it is not known.
    has_asymptote : bool
        Whether it tends to an equilibrium there.
    """

    def __init__(
        self, problem: Problem, heading: int, turn: float | None, limit: float, *, has_asymptote: bool
    ) -> None:
        self._problem, self._heading, self._near = problem, heading, turn
        self._limit, self._has_asymptote = limit, has_asymptote
        has_to_turn = turn is not None and problem.w0 != 0.0
        self._side = -heading if has_to_turn else heading
        self._known: dict[float, PanelSeries | None] = {}
        self._beside_cusp: dict[float, BesideCusp] = {}
        self._before_turn: Array | None = None
        self.source, self.variables = source_of(problem.formulas), variables_of(problem)
        self._parameters = np.ascontiguousarray(self.variables[:, : self.source.parameters])

    @cached_property
    def launch(self) -> Place:
        """The launch place. At a cusp it counts as fixed: times after a release at rest there do not depend on it to
        first order.
        """
        moves, lam0 = np.zeros((3, self.source.variables)), self._problem.launch.lam0
        moves[0, self.source.parameters] = 0.0 if self._starts_at_cusp else 1.0
        return Place(lam0.value, lam0.low, moves)

    @cached_property
    def _starts_at_cusp(self) -> bool:
        """Whether the body is released at rest from a cusp."""
        return self._problem.w0 == 0.0 and is_cusp(self._problem, self._problem.lam0)

    @cached_property
    def turn(self) -> Place:
        """The turning point."""
        if self._problem.w0 == 0.0:
            return self.launch
        assert self._near is not None
        program, place = turning_point_program(self.source), (self._near, 0.0)
        for _ in range(NEWTON_STEPS):
            step = values(program, self.variables, np.array([place[0]]), np.array([place[1]]))[0, :, 0]
            place = plus(place, (float(step[0]), float(step[1])))
        found = values(program, self.variables, np.array([place[0]]), np.array([place[1]]))[1:, :, 0]
        return Place(*place, np.ascontiguousarray(found.T))

    @cached_property
    def _base(self) -> Place:
        """The place from which times are counted: the turning point, or the launch if there is none."""
        return self.launch if self._near is None else self.turn

    def _program(self, a: Place, b: Place) -> tuple[Program, Array]:
        """Return the program of the time per phase from a place to a later one and its derivatives, and its inputs."""
        program = libration_program(self.source, tuple(range(self.source.variables - 1)))
        places = np.array([[a.high, b.high], [a.low, b.low], [0.0, 0.0]])
        inputs = np.hstack([self.variables, places, a.moves[:, :-1], b.moves[:, :-1]])
        return program, np.ascontiguousarray(inputs)

    def _time(self, a: Place, b: Place) -> Array:
        """Return the derivatives of the time from one place to another, or from that to the former."""
        if (a.high, a.low) == (b.high, b.low):
            return np.zeros(self.source.variables)
        a, b = (a, b) if (a.high, a.low) < (b.high, b.low) else (b, a)
        program, inputs = self._program(a, b)
        found = np.zeros((program.outputs.size, MEAN))
        given = (program.operands, program.work, inputs[np.newaxis], LIBRATION, rule_with_tails(), found)
        if fill_panel_means(*given) <= 0:
            raise SolutionError(UNDECIDED)
        slopes = PI * (found[:, 0] + found[:, 1])
        return np.append(slopes[1:], 0.0)  # without the time itself

    def _span(self, distance: float) -> float:
        """Return how far from the base a series reaches that serves a place at this distance.

        It depends on nothing else, so that derivatives do not depend on other times that are asked for together.
        """
        if not isfinite(self._limit):
            return float(4.0 ** ceil(log(distance, 4.0)))
        whole = abs(self._limit - self._base.high)
        if self._has_asymptote:
            return whole * (1.0 - 0.5 ** max(1, ceil(-log2(max(1.0 - distance / whole, 2.0**-60)))))
        return max(distance, min(float(4.0 ** ceil(log(distance, 4.0))), whole))

    def _series(self, span: float) -> PanelSeries | None:
        """Return the derivatives of the time and of the arc length along the phase from the base to this distance from
        it, all of which moves with the base; None if panels do not resolve them.
        """
        if span not in self._known:
            self._known[span] = self._made(span)
        return self._known[span]

    def _resolved(self, span: float) -> tuple[float, PanelSeries | None]:
        """Return a span with its series: beside a cusp V**2 loses its digits, and ds too, and a wider span has its
        nodes farther from there.
        """
        series, widest = self._series(span), min(abs(self._limit - self._base.high), WIDEST_SPAN)
        while series is None and self._starts_at_cusp and 4.0 * span <= widest:
            span *= 4.0
            series = self._series(span)
        return span, series

    def _made(self, span: float) -> PanelSeries | None:
        base, end = self._base, self._base.beside(self._base.high + self._side * span)
        a, b = (base, end) if self._side > 0 else (end, base)
        program, inputs = self._program(a, b)
        panels, rule = MIN_PANELS, panel_rule()[0]
        while panels <= MAX_PANELS:
            edges = np.linspace(0.0, np.pi, panels + 1)
            phi = (edges[:-1, None] + np.diff(edges)[:, None] * rule).ravel()
            rest = np.cos(0.5 * phi) ** 2
            share = np.where(phi < 0.5 * np.pi, np.sin(0.5 * phi) ** 2, 1.0 - rest)
            low = np.where(phi < 0.5 * np.pi, 0.0, (1.0 - share) - rest)  # the end has its digits too
            rates, _, errors = np.moveaxis(values(program, inputs, share, low), 1, 0)
            lam, width = a.high + (b.high - a.high) * share, b.high - a.high
            path = path_rows(self.source.formulas, self._parameters, self.source.mass, lam)
            arcs = 0.5 * width * np.sin(phi) * path.ds[1:-1]
            samples = np.vstack([rates[1:], arcs]).reshape(-1, panels, rule.size)
            sizes = np.abs(samples).max(axis=(1, 2))
            if not (np.isfinite(sizes).all() and errors[0].max() <= MAX_TAIL * np.abs(rates[0]).min()):
                return None
            tails = np.abs((samples @ to_legendre())[:, :, -2:]).max(axis=(1, 2))
            rounding = np.append(errors[1:].max(axis=1), np.zeros(len(arcs)))
            if (tails <= MAX_TAIL * sizes + rounding).all():
                if self._starts_at_cusp:
                    near = (samples / np.sin(phi).reshape(panels, -1))[:, 0 if self._side > 0 else -1]
                    self._beside_cusp[span] = BesideCusp(edges[1], near[:, :: self._side])
                return PanelSeries(edges, samples)
            panels *= 2
        return None

    def _from_base(self, lam: Array) -> tuple[Array, Array]:
        """Return, for places that move with the base, the derivatives of the time between them and it, and those of
        the arc length from it at fixed places, which have a sign.
        """
        count, base, side = self.source.parameters, self._base, self._side
        distances = np.maximum(0.0, side * ((lam - base.high) - base.low))
        slopes, arcs = np.zeros((self.source.variables, lam.size)), np.zeros((count, lam.size))
        spans = np.array([self._span(distance) if distance > 0.0 else 0.0 for distance in distances.tolist()])
        for wanted in np.unique(spans[spans > 0.0]).tolist():
            here = np.flatnonzero(spans == wanted)
            span, series = self._resolved(wanted)
            near = distances[here]
            if series is None:
                for k in here.tolist():
                    slopes[:, k] = self._time(base, base.beside(float(lam[k])))
                    arcs[:, k] = self._stretch(float(lam[k]))
                continue
            phi = 2.0 * np.arctan2(np.sqrt(near), np.sqrt(np.maximum(0.0, span - near)))
            found = series(phi if side > 0 else np.pi - phi)[1]
            if side < 0:
                found = series(np.array([np.pi]))[1] - found
            if span in self._beside_cusp:
                self._beside_cusp[span].fill(phi, found)
            slopes[:-1, here], arcs[:, here] = found[:-count], side * found[-count:]
        return slopes, arcs

    @cached_property
    def _launch_arcs(self) -> Array:
        """The derivatives of the arc length from the base to the launch place; they are the same place after a release
        at rest, whose second double would be a distance otherwise.
        """
        if self._base is self.launch:
            return np.zeros((self.source.parameters, 1))
        return self._from_base(np.array([self.launch.high]))[1]

    def arrivals(self, lam: Array, has_turned: Array) -> tuple[Array, Array]:
        """Return the derivatives of the times at which the body is at places that move with the base, and those of arc
        lengths from the launch at fixed places.
        """
        slopes, arcs = self._from_base(lam)
        return self._since_launch(slopes, has_turned), arcs - self._launch_arcs

    def _since_launch(self, slopes: Array, has_turned: Array) -> Array:
        """Return the derivatives of times from the launch, given those of the times between places and the base."""
        problem = self._problem
        if self._near is None:
            return slopes
        if problem.w0 != 0.0:
            if self._before_turn is None:
                self._before_turn = self._time(self.launch, self.turn)
            return self._before_turn[:, None] + np.where(has_turned, slopes, -slopes)
        # With a speed the body passes the launch later than its turning point, or comes back to it.
        at = np.array([self.launch.high])
        _, half_slope, half_bend = self._local(at)[:3, 0, 0]
        if not self._starts_at_cusp:
            delay = self._path(at)[DS, 0, 0] / abs(half_slope)
        elif problem.launch.direction == self._heading:
            # The slope of half of V**2 and ds/dlam vanish. The delay is the limit of their ratio from ahead, which is
            # that of their derivatives: 1 over the acceleration.
            bends = values(bend_program(self.source), self._parameters, at)[:, 0, 0]
            delay = np.hypot.reduce(bends) / abs(half_bend)
        else:
            delay = np.nan  # in that direction the body would leave the curve
        if self._starts_at_cusp:
            slopes[self.source.parameters] = 0.0  # but for the rounding of the place
        slopes[self.source.parameters + 1] -= problem.launch.direction * self._heading * delay
        return slopes

    def _local(self, lam: Array) -> Array:
        """Return half of V**2 with its first two derivatives, and those by all variables, as two doubles each."""
        return values(extreme_program(self.source, of_speed=True), self.variables, lam)[:, :2]

    def _path(self, lam: Array) -> Array:
        """Return the path at places (`path.PathRows`)."""
        return path_rows(self.source.formulas, self._parameters, self.source.mass, lam).rows

    def time_slopes(self, lam: float, v: float, moved: Array, *, has_turned: bool) -> Array:
        """Return the derivatives of the time at which the body is at a place that changes by ``moved``."""
        at, base = np.array([lam]), self._base
        try:
            slopes = self._time(base, base.beside(lam))
        except SolutionError:  # the place is rounded, and lies beyond the base, or digits are lost
            slopes = self._from_base(at)[0][:, 0]
        slopes = self._since_launch(slopes[:, np.newaxis], np.array([has_turned]))[:, 0]
        found: Array = slopes + (moved - self._base.moves[0]) * self._path(at)[DS, 0, 0] / v
        return found

    def states(self, lam: Array, v: Array, has_turned: Array) -> Array:
        """Return the derivatives of lam, s, x, z, v, N and y at fixed times: of shape (7, variables, times)."""
        slopes, arcs = self.arrivals(lam, has_turned)
        path, local = self._path(lam), self._local(lam)
        if self._starts_at_cusp and self.launch.high != 0.0:
            # The place is rounded, and beside the cusp V changes with it as much as ds.
            v = np.where(local[0, 0] > 0.0, np.copysign(np.sqrt(2.0 * local[0, 0]), v), v)
        count, base = self.source.parameters, self._base.moves
        # At a launch from a cusp ds, V and the slope of V**2 vanish, so that the place does not change.
        is_at_cusp = np.logical_not(has_turned) & (lam == self.launch.high) & self._starts_at_cusp
        ds = np.where(is_at_cusp, 1.0, path[DS, 0])
        moved = base[0][:, None] - slopes * v / ds
        # Beside a turning point half of V**2 and its change at a place that moves with it are small; their ratio is
        # smooth.
        half, slope, partials = local[0, 0], local[1], local[3:]
        product, rest = two_product.py_func(base[0][:, None], slope[0])
        rest = rest + base[0][:, None] * slope[1] + base[1][:, None] * slope[0]
        total, error = two_sum.py_func(partials[:, 0], product)
        change = total + (error + (rest + partials[:, 1]))
        ratio = np.divide(change, 2.0 * half, where=half > 0.0, out=np.zeros_like(change))
        faster = v * ratio - local[1, 0] / ds * slopes
        if self._starts_at_cusp:
            faster[count] = 0.0
        faster[count + 1] += self._problem.launch.direction * is_at_cusp

        def whole(row: int) -> Array:
            found: Array = path[row, -1] * moved
            found[:count] += path[row, 1:-1]
            return found

        if len(path) <= PRODUCT:
            force = v * v * whole(CURVATURE) + 2.0 * v * path[CURVATURE, 0] * faster + whole(LOAD)
        else:
            square = squared_force(PathRows(path), v, v * v)
            changes = np.array([whole(row) for row in range(len(path))])
            force = square.half_change(changes) + (v * square.even + square.odd) * faster
            force /= np.sqrt(square.square)
        launched = self._path(np.array([self.launch.high]))[DS, 0, 0] * self.launch.moves[0]
        arc = ds * moved - launched[:, None]
        arc[:count] += arcs
        across = whole(SPACE_Y) if len(path) > SPACE_Y else np.zeros_like(moved)
        return np.array([moved, arc, whole(X), whole(Z), faster, force, across])

    def direction(self, *, has_turned: bool) -> int:
        """Return the sign of ds/dt before or after the turn."""
        return -self._heading if has_turned else self._heading

    def extreme_rows(self, lam: float, direction: int, *, of_speed: bool) -> Array:
        """Return half of V**2, or the contact force, at a place, with two derivatives with respect to the place and
        those with respect to all variables; ``direction`` is the sign of ds/dt.
        """
        program = extreme_program(self.source, of_speed, 1 if of_speed else direction)
        rows: Array = values(program, self.variables, np.array([lam]))[:, 0, 0]
        return rows

    def end(self, what: str, lam: float, direction: int) -> Array:
        """Return the derivatives of the place where the motion ends, by the reason for it; ``direction`` is the sign of
        ds/dt.
        """
        count, moved = self.source.parameters, np.zeros(self.source.variables)
        if what == "liftoff":
            rows = values(sided_program(self.source, direction), self.variables, np.array([lam]))[:, 0, 0]
            moved = -rows[2:] / rows[1]
        elif what == "domain-end":
            found = values(range_program(self.source.domain, count), self._parameters, np.zeros(1))[:, 0, 0]
            at_high = abs(lam - self._problem.high) < abs(lam - self._problem.low)
            moved[:count] = found.reshape(-1, 1 + count)[int(at_high), 1:]
        else:
            raise SolutionError(f"gradient: the end of a motion by {what!r} has none")
        return moved

    def _stretch(self, lam: float) -> Array:
        """Return the derivatives of the arc length from the base to a place by the parameters, at fixed places."""
        low, high, rule, last = self._base.high, lam, panel_rule(), None
        for halving in range(MAX_HALVINGS):
            edges = np.linspace(low, high, 2**halving + 1)
            nodes = (edges[:-1, None] + np.diff(edges)[:, None] * rule[0]).ravel()
            found = path_rows(self.source.formulas, self._parameters, self.source.mass, nodes).rows[DS, 1:-1]
            now: Array = found.reshape(len(found), -1, rule.shape[1]) @ rule[2] @ np.diff(edges)
            if last is not None and np.abs(now - last).max() <= MAX_CHANGE * abs(high - low):
                break
            last = now
        return now
