"""Motions and their events as tables, for notebooks and reports."""

from collections.abc import Iterable, Sequence
from dataclasses import astuple, fields
from html import escape
from math import isfinite
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from gqm_sym.runtime.motion import Motion

T = TypeVar("T")

HEADINGS = {"t": "t (s)", "x": "x (m)", "z": "z (m)", "t_start": "t from (s)", "t_end": "t to (s)"}


class Rows(tuple[T, ...]):
    """A tuple of records of one kind, which notebooks show as a table."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        if not self:
            return "<p>none</p>"
        titles = [field.name for field in fields(self[0])]  # type: ignore[arg-type]
        return table([HEADINGS.get(name, name) for name in titles], (astuple(row) for row in self))  # type: ignore[call-overload]


def table(titles: Sequence[str], rows: Iterable[Iterable[Any]]) -> str:
    """An HTML table; numbers are the shortest texts that read back as the same doubles."""
    head = "".join(f"<th>{escape(title)}</th>" for title in titles)
    body = "".join(f"<tr>{''.join(f'<td>{_text(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def summary(motion: "Motion") -> list[tuple[str, Any]]:
    """What there is to say of a motion in a few lines: its launch, kind, turning points and times."""
    problem = motion.problem
    name = problem.formulas.parameter
    rows: list[tuple[str, Any]] = [("kind", motion.kind), (f"launch at {name}", problem.launch.lam0.text)]
    rows.append(("launch speed (m/s)", problem.launch.v0.text))
    if motion.turning_points:
        rows.append((f"turning points {name}", ", ".join(map(repr, motion.turning_points))))
    if motion.kind == "libration":
        rows.append(("half period (s)", motion.half_period))
    if motion.kind in ("libration", "circulation"):
        rows.append(("period (s)", motion.period))
    elif isfinite(motion.t_end):
        rows.append(("ends after (s)", motion.t_end))
    rows += [(key, number.text) for key, number in zip(problem.formulas.parameters, problem.p, strict=True)]
    return rows


def page(motion: "Motion") -> str:
    """A motion as HTML: its summary and its events."""
    lines = "".join(f"<tr><th>{escape(label)}</th><td>{_text(value)}</td></tr>" for label, value in summary(motion))
    events = Rows(motion.events)._repr_html_()
    return f"<p><b>{escape(motion.problem.formulas.name)}</b></p><table><tbody>{lines}</tbody></table>{events}"


def _text(cell: Any) -> str:
    return repr(float(cell) + 0.0) if isinstance(cell, float) else escape(str(cell))
