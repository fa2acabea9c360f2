"""The coordinates of a charted curve as SymPy functions of its arc length.

A curve that is known by numbers only (implicit, sampled, put together from pieces) has no formula x(s). These heads
stand for what its chart holds: they are read as ``x(s)``, and lowered to calls of the chart. A track in space has a
chart of each coordinate, with its first two derivatives by arc length.
"""

from typing import ClassVar

import sympy as sp
from sympy.printing.printer import Printer


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
    """Horizontal coordinate."""

    row, symbol = "x", "x"


class chart_z(ChartFunction):
    """Height."""

    row, symbol = "z", "z"


class chart_alpha(ChartFunction):
    """Angle of the tangent."""

    row, symbol = "alpha", r"\alpha"


class chart_kappa(ChartFunction):
    """Signed curvature."""

    row, symbol = "kappa", r"\kappa"


class SpaceFunction(ChartFunction):
    """A coordinate of a charted curve in space, or one of its first two derivatives by arc length.

    Attributes
    ----------
    axis
        The coordinate.
    order
        How often it is differentiated.
    """

    axis: ClassVar[str]
    order: ClassVar[int]


def _of_axis(axis: str, order: int) -> type[SpaceFunction]:
    row, primes = "d" * order + axis, "'" * order
    named = {"axis": axis, "order": order, "row": row, "symbol": axis + primes}
    return type(f"space_{row}", (SpaceFunction,), {**named, "__module__": __name__})


SPACE_ROWS: dict[str, tuple[type[SpaceFunction], ...]] = {
    axis: tuple(_of_axis(axis, order) for order in range(3)) for axis in "xyz"
}
"""Each coordinate in space with its derivatives."""
SPACE: tuple[type[SpaceFunction], ...] = tuple(rows[0] for rows in SPACE_ROWS.values())
"""The coordinates x, y and z."""
MEAN_HEIGHT: tuple[type[SpaceFunction], ...] = tuple(_of_axis("h", order) for order in range(3))
"""The mean height of a train with its derivatives, by the place of its middle."""
