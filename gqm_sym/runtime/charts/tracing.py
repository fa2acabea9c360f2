"""Charts of implicit curves F(x, z) = 0, traced in both directions from a start point.

The parameter is arc length, 0 at the start point, and grows along ±(-F_z, F_x)/|grad F|; for the upper sign the
curvature is the Hessian form (F_xx F_z**2 - 2 F_xz F_x F_z + F_zz F_x**2)/|grad F|**3, for the lower its negative
(paper, eq. 36; ERRATA A9). `level_pieces` solves for a piece, and `continuation` lays pieces one by one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import hypot, inf, isfinite, pi
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.errors import LaunchError, SolutionError
from gqm_sym.literals.namespaces import FLOATS
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.arithmetic import doubledouble
from gqm_sym.runtime.charts.chart import NODES, Chart, PieceData, assemble
from gqm_sym.runtime.charts.continuation import CLOSED, FAR, MAX_PIECES, PIECE_ROWS, SINGULAR, trace_one_way
from gqm_sym.runtime.charts.double_double.level_samples import sample_beside, sample_level
from gqm_sym.runtime.charts.double_double.making import Samples, TruePieces, sample_places, starting_context
from gqm_sym.runtime.charts.evaluate import TERMS
from gqm_sym.runtime.charts.level_pieces import ANCHOR, CORNER, POINTS, SMOOTH, LevelCurve, evaluate_points
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import VECTOR, Array
from gqm_sym.runtime.double_double.recording import BoundTape
from gqm_sym.runtime.double_double.tapes import bound_by_coordinates
from gqm_sym.runtime.multiprecision.exact_problem import two_doubles

# The largest distance of a start point from the curve, as a share of its larger coordinate; a nearer point is moved
# onto the curve.
MAX_DISTANCE = 1e-6

# Newton steps from a start point to the foot of the perpendicular; they have converged below this share.
MAX_STEPS = 100
MAX_LAST_STEP = 1e-12

# A start point is singular if grad F changes over less than this share of its larger coordinate.
MIN_GRADIENT_SCALE = 1e-9


@entry(VECTOR(types.int64, VECTOR, types.float64, VECTOR))
def _rows_at(field, p, sign, at):  # type: ignore[no-untyped-def]
    """Return whether all values are finite, and the rows that `evaluate_points` fills at a place (x and z as two
    doubles each).
    """
    piece = np.zeros((PIECE_ROWS, POINTS))
    found = evaluate_points(LevelCurve(field, p, sign), at, piece)
    out = piece[:, ANCHOR].copy()
    out[0] = 1.0 if found else 0.0
    return out


class Branch(NamedTuple):
    """Pieces on one side of the start, in the order and the direction of increasing arc length.

    Attributes
    ----------
    edges : (n+1,) array
        Arc length at their edges.
    anchors : (n, 4) array
        x and z at their left edges, two doubles each.
    tangents : (n, 2, TERMS) array
        At the nodes.
    angles, curvatures : (n, TERMS) arrays
        At the nodes.
    jumps : (n+1,) array
        The kinds of the edges, as `continuation.trace_one_way` returns them.
    end : int
        The code for the far end, as `continuation.trace_one_way` returns it.
    """

    edges: Array
    anchors: Array
    tangents: Array
    angles: Array
    curvatures: Array
    jumps: Array
    end: int

    def split(self, at: int) -> tuple["Branch", "Branch"]:
        """Return the pieces before an edge, and those after it."""
        return self._between(0, at), self._between(at, self.edges.size - 1)

    def _between(self, one: int, two: int) -> "Branch":
        return Branch(
            self.edges[one : two + 1],
            self.anchors[one:two],
            self.tangents[one:two],
            self.angles[one:two],
            self.curvatures[one:two],
            self.jumps[one : two + 1],
            self.end,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Traced:
    """An implicit curve, which makes its chart for values of the run-time parameters.

    Attributes
    ----------
    field : int
        Address of the compiled function that fills F, F_x, F_z, F_xx, F_xz and F_zz.
    start
        ``f(op, p)``: x and z of the start point.
    tangent : int
        1 or -1: the sign of the tangent.
    level
        ``f(op, x, z, p)``: F, F_x and F_z.
    domain
        ``f(op, p)``: both ends in arc length, each None if there is none; None instead of a function if there are none.
    shaped_by
        The run-time parameters that the curve depends on, by their place; None if that is not known.
    """

    field: int
    start: Callable[..., Any]
    tangent: int
    level: Callable[..., Any]
    domain: Callable[..., Any] | None = None
    shaped_by: tuple[int, ...] | None = None

    def chart(self, p: tuple[float, ...]) -> Chart:
        """Trace the curve.

        It is followed in each direction until it closes or reaches a singular point (grad F = 0) or the end of its
        domain. Without a domain it is followed over `continuation.MAX_PIECES` pieces or `continuation.MAX_REACH` times
        the length of the first. It also ends where F is no longer real.

        Raises
        ------
        LaunchError
            If the start point is not near the curve, or is a singular point, or lies outside the domain.
        SolutionError
            If the end of the domain is farther than that many pieces.
        """
        values = np.array(p, dtype=np.float64)
        low, high = self._domain(p)
        start = self._start(values, p)
        ahead = self._side(values, start, 1, high)
        if ahead.end == CLOSED:
            return _closed(ahead)
        behind = self._side(values, start, -1, -low)
        both = _pieces(_joined(behind, ahead))
        return assemble(**both, ends=(_what(behind.end), _what(ahead.end)))

    def is_exact(self, chart: Chart) -> bool:
        """Return whether F is smooth everywhere on the chart."""
        return chart.breaks.size == 0

    def true_curve(self, context: Any, p: tuple[Any, ...], chart: Chart) -> "Zeros":
        """Return the curve in extended precision."""
        return Zeros(self, context, p)

    def true_pieces(self, p: Sequence[Number], chart: Chart) -> TruePieces | None:
        """Return the curve in double-double arithmetic; None if F is too long a formula, or not smooth."""
        return self._sampled(p, chart, sample_level, ())

    def true_pieces_beside(self, p: Sequence[Number], chart: Chart, base: Sequence[Number]) -> TruePieces | None:
        """Return the curve for parameters next to those of a chart, likewise. Its points are those at which the normals
        of the curve for ``base`` meet it, so that displacements change as smoothly as the curve.
        """
        formulas = self._formulas(base, chart)
        return None if formulas is None else self._sampled(p, chart, sample_beside, (formulas.operands,))

    def _formulas(self, p: Sequence[Number], chart: Chart) -> BoundTape | None:
        return bound_by_coordinates(self.level, p) if self.is_exact(chart) else None

    def _sampled(
        self, p: Sequence[Number], chart: Chart, sample: Callable[..., Samples], others: tuple[Any, ...]
    ) -> TruePieces | None:
        formulas, context = self._formulas(p, chart), starting_context()
        if formulas is None:
            return None
        x, z = Zeros(self, context, tuple(number.at(context) for number in p)).start
        if isinstance(x, context.mpc) or isinstance(z, context.mpc):
            return None
        given = chart.block, sample_places(), formulas.operands, *others
        count = chart.edges.size - 1

        def at(k: int) -> Samples:
            following = (k + 1) % count if chart.period or k + 1 < count else -1
            return sample(k, following, *given)

        return TruePieces(chart, at, (*two_doubles(x), *two_doubles(z)))

    def _domain(self, p: tuple[float, ...]) -> tuple[float, float]:
        low, high = (None, None) if self.domain is None else self.domain(FLOATS, p)
        low, high = -inf if low is None else float(low), inf if high is None else float(high)
        if not (low <= 0.0 <= high and low < high):
            raise LaunchError(f"domain: must contain 0, where the start point is; got [{low!r}, {high!r}]")
        return low, high

    def _start(self, values: Array, p: tuple[float, ...]) -> Array:
        """Return the start point, moved onto the curve: x and z as two doubles each."""
        x, z = (float(c) for c in self.start(FLOATS, p))
        if not (isfinite(x) and isfinite(z)):
            raise LaunchError(f"start: ({x!r}, {z!r}) is not a finite point; give one on the curve")
        size = max(abs(x), abs(z)) or 1.0
        point = np.array([x, 0.0, z, 0.0])
        moved, regular = inf, True
        for _ in range(MAX_STEPS):
            found, _, tx, tz, _, bends, level, slope, fall, *_ = _rows_at(self.field, values, 1.0, point)
            regular = bool(found) and slope > MIN_GRADIENT_SCALE * size * (bends * slope + abs(fall))
            if not regular:
                break
            # Newton's method across the curve; along it to the foot of the perpendicular from the start point.
            across, along = -level / slope, (x - point[0]) * tx + (z - point[2]) * tz
            point[:2] = doubledouble.add.py_func(point[0], point[1], along * tx + across * tz, 0.0)
            point[2:] = doubledouble.add.py_func(point[2], point[3], along * tz - across * tx, 0.0)
            before, moved = moved, hypot(along, across)
            if moved <= MAX_LAST_STEP * size and moved >= 0.5 * before:
                break
        away = hypot(point[0] - x, point[2] - z)
        if regular and moved <= MAX_LAST_STEP * size and away <= MAX_DISTANCE * size:
            return point
        if not regular and away <= MAX_DISTANCE * size:
            raise LaunchError(
                f"start: ({x!r}, {z!r}) is a singular point: grad F vanishes there, or F is not smooth or not real; "
                "start from a regular point of the curve"
            )
        what = f"start: ({x!r}, {z!r}) is not on the curve"
        if regular and moved <= MAX_LAST_STEP * size:
            raise LaunchError(f"{what}: it is {away:.3g} from it; the nearest point is ({point[0]!r}, {point[2]!r})")
        raise LaunchError(f"{what}, and no point of the curve was found near it; give a point with F = 0")

    def _side(self, values: Array, start: Array, direction: int, limit: float) -> Branch:
        """Return the pieces ahead of the start (direction 1), or behind it (-1)."""
        sign = float(direction * self.tangent)
        end, edges, anchors, nodes, jumps, last = trace_one_way(self.field, values, sign, start, limit, direction > 0)
        if end == FAR and isfinite(limit):
            raise SolutionError(
                f"the curve cannot be followed to the end of its domain: {MAX_PIECES} pieces reach s = "
                f"{direction * edges[-1]:.9g} only, near ({anchors[-1, 0]:.9g}, {anchors[-1, 2]:.9g}); "
                "end the domain before that place"
            )
        tangents, curvatures = nodes[:, :2], nodes[:, 2]
        if end == SINGULAR and last[3] > 0.0:
            # A straight piece covers the rest of the way to the singular point, which is far shorter than the radius of
            # curvature.
            edges, jumps = np.append(edges, edges[-1] + last[3]), np.append(jumps, SMOOTH)
            beyond = anchors[-1] + last[3] * np.array([last[0], 0.0, last[1], 0.0])
            anchors = np.append(anchors, [beyond], axis=0)
            turned = last[2] * 0.5 * last[3] * (1.0 + NODES)
            straight = [last[0] - turned * last[1], last[1] + turned * last[0]]
            tangents = np.append(tangents, [straight], axis=0)
            curvatures = np.append(curvatures, np.full((1, TERMS), last[2]), axis=0)
        if direction > 0:
            anchors = anchors[:-1]
        else:
            edges, anchors, jumps = -edges[::-1], anchors[:0:-1], jumps[::-1]
            tangents, curvatures = -tangents[::-1, :, ::-1], -curvatures[::-1, ::-1]
        # The nodes of a piece are in decreasing order.
        angles = np.unwrap(np.arctan2(tangents[:, 1], tangents[:, 0])[:, ::-1].ravel()).reshape(-1, TERMS)[:, ::-1]
        return Branch(edges, anchors, tangents, angles, curvatures, jumps, end)


class Zeros:
    """The curve F = 0 at one precision, by Newton's method from the chart (`exact_normals.TrueCurve`)."""

    def __init__(self, maker: Traced, context: Any, p: tuple[Any, ...]) -> None:
        self._level, self._tangent, self._context, self._p = maker.level, maker.tangent, context, p
        x, z = at_x, at_z = maker.start(context, p)
        for _ in range(MAX_STEPS):
            f, fx, fz = self._level(context, at_x, at_z, p)
            square = fx * fx + fz * fz
            # Newton's method across the curve; along it to the foot of the perpendicular.
            if isinstance(square, context.mpc):  # F is not real there
                at_x = at_z = square
                break
            across, along = f / square, ((x - at_x) * fz - (z - at_z) * fx) / square
            at_x, at_z = at_x - across * fx + along * fz, at_z - across * fz - along * fx
            if (abs(across) + abs(along)) * context.sqrt(square) <= context.ldexp(abs(x) + abs(z), 16 - context.prec):
                break
        self.start = at_x, at_z

    def ends(self, k: int) -> None:
        """Return None: F = 0 is smooth, so pieces may begin anywhere."""
        return

    def length(self, k: int) -> None:
        """Return None: the ends of pieces are not prescribed."""
        return

    def intersect_normal(
        self, k: int, u: float, x: Any, z: Any, dx: Any, dz: Any, size: float
    ) -> tuple[Any, Any, Any, Any, None]:
        """Return the point at which the line through (x, z) perpendicular to (dx, dz) meets the curve, the tangent
        there, and None for its arc length, which has no closed form.
        """
        context, at_x, at_z = self._context, x, z
        enough = context.ldexp(size, -context.prec // 2)
        for _ in range(MAX_STEPS):
            f, fx, fz = self._level(context, at_x, at_z, self._p)
            step = f / (fz * dx - fx * dz)
            at_x, at_z = at_x + step * dz, at_z - step * dx
            if abs(step) <= enough:  # convergence is quadratic: the next step would be below rounding
                _, fx, fz = self._level(context, at_x, at_z, self._p)
                slope = self._tangent * context.sqrt(fx * fx + fz * fz)
                return at_x, at_z, -fz / slope, fx / slope, None
        raise SolutionError(
            f"the curve near ({float(x)!r}, {float(z)!r}): Newton's method does not converge to F = 0; "
            "is there a singular point?"
        )


def _what(end: int) -> str:
    return "singular-point" if end == SINGULAR else "domain-end"


def _closed(loop: Branch) -> Chart:
    """Return the chart of a closed curve, from half a period before the start to half a period after it.

    In this way places on both sides of the start keep all their digits. The edges are moved without rounding.
    """
    period = float(loop.edges[-1])
    turn = 2.0 * pi * round((loop.angles[-1, 0] - loop.angles[0, -1]) / (2.0 * pi))
    far = np.where((loop.jumps == SMOOTH) & (loop.edges >= 0.5 * period), loop.edges, inf)
    ahead, behind = loop.split(int(np.argmin(far)))
    behind = behind._replace(edges=behind.edges - period)
    return assemble(**_pieces(_joined(behind, ahead)), period=period, turn=turn)


def _joined(behind: Branch, ahead: Branch) -> Branch:
    """Join both sides of the start; the angle is continuous, and between -pi and pi just after it."""
    angles = behind.angles
    if angles.size and ahead.angles.size:
        angles = angles + 2.0 * pi * round((ahead.angles[0, -1] - angles[-1, 0]) / (2.0 * pi))
    return Branch(
        np.append(behind.edges[:-1], ahead.edges),
        np.append(behind.anchors, ahead.anchors, axis=0),
        np.append(behind.tangents, ahead.tangents, axis=0),
        np.append(angles, ahead.angles, axis=0),
        np.append(behind.curvatures, ahead.curvatures, axis=0),
        np.append(behind.jumps[:-1], ahead.jumps),
        ahead.end,
    )


def _pieces(side: Branch) -> dict[str, Any]:
    """Return the arguments of `assemble` that every chart has."""
    return {
        "edges": side.edges,
        "data": PieceData(
            side.anchors[:, ::2],
            side.angles,
            side.curvatures,
            tangents=side.tangents,
            anchor_lows=side.anchors[:, 1::2],
        ),
        "breaks": side.edges[side.jumps != SMOOTH],
        "corners": side.edges[side.jumps == CORNER],
    }
