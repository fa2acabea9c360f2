"""The coordinates of a charted curve as SymPy functions of its arc length.

A curve that is known as numbers only (implicit, sampled or piecewise) has no formula x(s). These functions stand for
the rows of its chart: they are printed as ``x(s)``, and lowered to calls of the chart. A track in space has a chart of
each coordinate, with its first three derivatives with respect to arc length, and may have one of its roll angle.
"""

from typing import ClassVar

import sympy as sp
from sympy.printing.printer import Printer

from gqm_sym.errors import DerivationError

# The highest order of derivatives of coordinates in space; rates of loads contain third derivatives.
MOST_DERIVATIVES = 3


class ChartFunction(sp.Function):  # type: ignore[misc]
    """A row of a chart, at an arc length."""

    nargs = 1
    is_real = True
    row: ClassVar[str]
    symbol: ClassVar[str]

    def _sympystr(self, printer: Printer) -> str:
        return f"{self.row}({printer._print(self.args[0])})"

    def _latex(self, printer: Printer, exp: str | None = None) -> str:
        power = "" if exp is None else f"^{{{exp}}}"
        return rf"{self.symbol}{power}\left({printer._print(self.args[0])}\right)"


class chart_x(ChartFunction):
    """The horizontal coordinate."""

    row, symbol = "x", "x"


class chart_z(ChartFunction):
    """The height."""

    row, symbol = "z", "z"


class chart_alpha(ChartFunction):
    """The angle of the tangent."""

    row, symbol = "alpha", r"\alpha"


class chart_kappa(ChartFunction):
    """The signed curvature."""

    row, symbol = "kappa", r"\kappa"


class SpaceFunction(ChartFunction):
    """A coordinate of a charted curve in space or its roll angle, or one of their derivatives with respect to arc
    length.

    Attributes
    ----------
    axis
        The coordinate, or ``roll``.
    order
        The order of the derivative.
    """

    axis: ClassVar[str]
    order: ClassVar[int]

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Return the derivative with respect to arc length."""
        heads = SPACE_CHARTS[self.axis]
        if self.order + 1 == len(heads):
            raise DerivationError(f"{self}: no derivative of it is known")
        return heads[self.order + 1](self.args[0])


def _of_axis(axis: str, order: int) -> type[SpaceFunction]:
    row, primes = "d" * order + axis, "'" * order
    named = {"axis": axis, "order": order, "row": row, "symbol": (r"\psi" if axis == ROLL else axis) + primes}
    return type(f"space_{row}", (SpaceFunction,), {**named, "__module__": __name__})


class TrainLoad(sp.Function):  # type: ignore[misc]
    """The mean of |N|/m over the cars of a train, as a function of the place of its middle, V**2, length, number of
    cars, g, twice the rate of a rotating frame times the sign of ds/dt, and whether other potentials than gravity act
    (1) or not (0).

    Attributes
    ----------
    by_speed, by_place
        The functions for its derivatives with respect to V**2 and the place; None if they are not known.
    rows
        The name of the runtime's function that fills it at many places, perhaps with others.
    row
        Which of the rows that this function fills it is.
    track, loads
        The charts that it reads: those of the track, and those of loads if other potentials act.
    """

    nargs = 7
    is_real = True
    by_speed: "ClassVar[type[TrainLoad] | None]" = None
    by_place: "ClassVar[type[TrainLoad] | None]" = None
    rows: ClassVar[str]
    row: ClassVar[int]
    track: ClassVar[tuple[str, ...]]
    loads: ClassVar[tuple[str, ...]]

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Return the derivative with respect to the place, or V**2."""
        head = (self.by_place, self.by_speed)[argindex - 1] if argindex <= 2 else None
        if head is None:
            raise DerivationError(f"{self}: no derivative of it is known")
        return head(*self.args)


LOADS_IN_SPACE, LOAD_IN_PLANE = ("load_x", "load_y", "load_z"), ("load",)
"""The charts of the static load per unit mass on a body across the track under other potentials than gravity."""


class train_load_slope(TrainLoad):
    """The derivative of `train_load` with respect to V**2."""

    rows, row, track, loads = "train_loads", 1, ("along_x", "along_y", "along_z"), LOADS_IN_SPACE


class train_load_rate(TrainLoad):
    """The derivative of `train_load` with respect to the place."""

    rows, row, track, loads = "train_load_rates", 0, train_load_slope.track, LOADS_IN_SPACE


class train_load(TrainLoad):
    """The mean of |N|/m for a track in space."""

    by_speed, by_place, rows, row = train_load_slope, train_load_rate, "train_loads", 0
    track, loads = train_load_slope.track, LOADS_IN_SPACE


class train_load_slope_in_plane(TrainLoad):
    """The derivative of `train_load_in_plane` with respect to V**2."""

    rows, row, track, loads = "train_loads_in_plane", 1, ("chart",), LOAD_IN_PLANE


class train_load_in_plane(TrainLoad):
    """The mean of |N|/m for a planar track."""

    by_speed, rows, row = train_load_slope_in_plane, "train_loads_in_plane", 0
    track, loads = train_load_slope_in_plane.track, LOAD_IN_PLANE


TRAIN_LOADS = (train_load, train_load_slope, train_load_rate, train_load_in_plane, train_load_slope_in_plane)

ROLL = "roll"
AXES = ("x", "y", "z")
SPACE_ROWS: dict[str, tuple[type[SpaceFunction], ...]] = {
    axis: tuple(_of_axis(axis, order) for order in range(MOST_DERIVATIVES + 1)) for axis in (*AXES, ROLL)
}
"""Each coordinate in space, and the roll angle, with their derivatives."""
SPACE: tuple[type[SpaceFunction], ...] = tuple(SPACE_ROWS[axis][0] for axis in AXES)
"""The coordinates x, y and z."""
space_roll: type[SpaceFunction] = SPACE_ROWS[ROLL][0]
"""The roll angle."""
MEAN_HEIGHT: tuple[type[SpaceFunction], ...] = tuple(_of_axis("h", order) for order in range(3))
"""The mean height of a train with its derivatives, by the place of its middle."""
MEAN_PARTS: tuple[tuple[type[SpaceFunction], ...], ...] = tuple(
    tuple(_of_axis(f"u{count}", order) for order in range(3)) for count in (1, 2, 3)
)
"""The means of other parts of a potential over a train, likewise."""
SPACE_CHARTS: dict[str, tuple[type[SpaceFunction], ...]] = {
    **SPACE_ROWS,
    **{heads[0].axis: heads for heads in (MEAN_HEIGHT, *MEAN_PARTS)},
}
"""All functions that have charts of their own, with their derivatives."""


class TermsSize(ChartFunction):
    """The size of the terms whose sum is a function in space on the piece at an arc length."""


TERMS_SIZES: dict[str, type[TermsSize]] = {
    axis: type(f"size_of_{axis}", (TermsSize,), {"row": f"size of {axis}", "symbol": axis, "__module__": __name__})
    for axis in (*AXES, "h")
}
"""Those of the coordinates and of a train's mean height."""
