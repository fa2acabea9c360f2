"""The facts of a motion, and its HTML for notebooks."""

from html import escape
from math import isfinite
from typing import Any

from gqm_sym.runtime.motion.rows import Rows, as_html


def summary(motion: Any) -> list[tuple[str, Any]]:
    """Return the kind, launch, turning points, times and parameters of a motion as pairs of label and value."""
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
    elif isfinite(end := motion._end_of_legs()):
        rows.append(("ends after (s)", end))
    rows += [(key, number.text) for key, number in zip(problem.formulas.parameters, problem.p, strict=True)]
    return rows


def page(motion: Any) -> str:
    """Return the summary and the events of a motion as HTML."""
    lines = "".join(f"<tr><th>{escape(label)}</th><td>{as_html(value)}</td></tr>" for label, value in summary(motion))
    events = Rows(motion.events)._repr_html_()
    return f"<p><b>{escape(motion.problem.formulas.name)}</b></p><table><tbody>{lines}</tbody></table>{events}"
