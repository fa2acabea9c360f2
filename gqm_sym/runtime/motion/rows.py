"""Legs and events as tuples that display as tables."""

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any, NamedTuple, TypeVar

T = TypeVar("T", bound=NamedTuple)

# The titles of columns that have a unit; that of the curve parameter depends on the curve.
HEADINGS = {
    **{"t": "t (s)", "x": "x (m)", "z": "z (m)", "t_start": "t from (s)", "t_end": "t to (s)", "s": "s (m)"},
    **{"v": "v (m/s)", "v2": "v2 (m2/s2)", "kappa": "kappa (1/m)", "normal_force": "normal_force (N)"},
    **{"frequency": "frequency (rad/s)", "y": "y (m)"},
    **{f"normal_{axis}": f"normal_{axis} (N)" for axis in "xyz"},
    **{f"track_{axis}": f"track_{axis} (m)" for axis in "xyz"},
    **{f"n_{load}": f"n_{load} (9.80665 m/s2)" for load in ("vertical", "lateral", "longitudinal")},
    **{f"onset_{load}": f"onset_{load} (9.80665 m/s3)" for load in ("vertical", "lateral", "longitudinal")},
    "roll": "roll (rad)",
}


class Rows(tuple[T, ...]):
    """A tuple of named tuples of one class, which notebooks display as a table."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        if not self:
            return "<p>none</p>"
        return table([HEADINGS.get(name, name) for name in self[0]._fields], self)


def table(titles: Sequence[str], rows: Iterable[Iterable[Any]]) -> str:
    """Return an HTML table; each number is the shortest text that is read back as the same double."""
    head = "".join(f"<th>{escape(title)}</th>" for title in titles)
    body = "".join(f"<tr>{''.join(f'<td>{as_html(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def text_table(titles: Sequence[str], rows: Iterable[Iterable[Any]]) -> list[str]:
    """Return aligned lines of text; each number is written as in `table`."""
    cells = [list(titles), *([repr(float(c) + 0.0) if isinstance(c, float) else str(c) for c in row] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return ["  " + "  ".join(c.ljust(width) for c, width in zip(row, widths, strict=True)).rstrip() for row in cells]


def as_html(cell: Any) -> str:
    """Return the text of a table's cell, in which characters that mean something else in HTML are escaped."""
    return repr(float(cell) + 0.0) if isinstance(cell, float) else escape(str(cell))
