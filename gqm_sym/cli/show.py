"""Closed forms, parameters, motions and sweeps as text."""

from collections.abc import Iterable, Iterator, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from xarray import Dataset

    from gqm_sym.derivation import Model
    from gqm_sym.runtime.motion.motion import Motion
    from gqm_sym.specfile import Spec


def forms(spec: "Spec", model: "Model") -> Iterator[str]:
    """Yield the closed forms of a model and its parameters, line by line."""
    import sympy as sp

    def text(form: Any) -> str:
        if isinstance(form, sp.Equality):
            return f"{sp.sstr(form.lhs)} = {sp.sstr(form.rhs)}"
        return str(sp.sstr(form))

    yield f"{spec.name}: {model.title}" if model.title else spec.name
    yield ""
    width = max(len(label) for label, _ in model.closed_forms())
    for label, form in model.closed_forms():
        # The label of an equation says what the equation describes; any other form is equal to its label.
        sign = "  " if isinstance(form, sp.Equality) else " ="
        yield f"  {label:<{width}}{sign} {text(form)}"
    yield ""
    yield from table((_parameter(spec, *pair) for pair in model.defaults), right=())
    for note in model.notes:
        yield f"  note: {note}"
    if spec.curve.smoothing is not None:
        yield ""
        yield from (f"  {line}" for line in str(spec.curve.smoothing).splitlines())


def _parameter(spec: "Spec", name: str, value: object) -> tuple[str, ...]:
    """Return one row of the table of parameters."""
    note = spec.notes.get(name)
    unit, description = (note.unit, note.description) if note else ("", "")
    given = "to be given at run time" if value is None else f"= {value}"
    origin = f"({note.given})" if note and note.given else ""
    return (name, f"{given} {unit}".strip(), f"{origin} {description}".strip())


def motion(found: "Motion", parameter: str) -> Iterator[str]:
    """Yield a motion line by line: its kind and times, its legs and its events."""
    from gqm_sym.runtime.motion.motion import end_of_legs

    yield f"  kind            {found.kind}"
    if found.turning_points:
        places = ", ".join(_number(place) for place in found.turning_points)
        yield f"  turning points  {parameter} = {places}"
    if found.kind == "libration":
        yield f"  half period     {_number(found.half_period)} s"
    if found.kind in ("libration", "circulation"):
        yield f"  period          {_number(found.period)} s"
    elif isfinite(end := end_of_legs(found)):
        yield f"  ends after      {_number(end)} s"
    yield f"  quadrature      {found.quadrature_error:.1e} (estimated relative error of a time)"
    yield f"  condition       {found.condition_number:.1e} (relative change of a time per that of the launch)"
    if found.legs:
        yield ""
        yield from table(_legs(found, parameter), right=range(1, 6))
    yield ""
    events = [("launch", 0.0), *((event.kind, event.t) for event in found.events)]
    yield from table(_states(found, parameter, "event", events), right=range(1, 8))


def _legs(found: "Motion", parameter: str) -> Iterator[tuple[str, ...]]:
    """Yield the rows of the table of legs."""
    yield ("leg", "t from", "to", f"{parameter} from", "to", "direction", "end")
    for number, leg in enumerate(found.legs, start=1):
        ends = (leg.t_start, leg.t_end, leg.lam_start, leg.lam_end)
        yield (str(number), *map(_number, ends), f"{leg.direction:+d}", leg.end)


def moments(found: "Motion", parameter: str, times: Iterable[str]) -> Iterator[str]:
    """Yield the states of a motion at times, line by line."""
    rows = _states(found, parameter, "", (("at", t) for t in times))
    yield from table(rows, right=range(1, 8))


def _states(
    found: "Motion", parameter: str, title: str, labelled: Iterable[tuple[str, Any]]
) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a table of states at labelled times."""
    yield (title, "t", parameter, "x", "z", "v", "N", "error bound")
    for label, t in labelled:
        state = found.state(t)
        values = (state.t, state.lam, state.x, state.z, state.v, state.normal_force)
        yield (label, *map(_number, values), f"{state.error:.1e}")


def swept(quantities: Iterable[str], data: "Dataset") -> Iterator[str]:
    """Yield the result of a sweep line by line: its size, how many values are missing, and why."""
    from gqm_sym.runtime.sweep.quantities import STATUS_SENTENCES

    yield f"  {' x '.join(f'{size} {name}' for name, size in data.sizes.items())}: {', '.join(quantities)}"
    refused: dict[str, None] = {}
    for quantity in quantities:
        status = data[f"{quantity}_status"]
        for code, reason in enumerate(STATUS_SENTENCES):
            count = int((status == code).sum())
            if reason and count:
                yield f"  {quantity}: {count} without a value: {reason}"
        refused[status.attrs.get("first_refused", "")] = None
    yield from (f"  first refused launch: {first}" for first in refused if first)


def table(rows: Iterable[Sequence[str]], *, right: Iterable[int]) -> Iterator[str]:
    """Yield aligned rows, indented by two spaces; the columns listed in ``right`` are right-aligned."""
    rows = [tuple(row) for row in rows]
    flush = frozenset(right)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = (
            cell.rjust(width) if index in flush else cell.ljust(width)
            for index, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        yield f"  {'  '.join(cells)}".rstrip()


def _number(value: float) -> str:
    # The shortest text that is read back as the same double; adding 0.0 avoids "-0.0".
    return repr(float(value) + 0.0)
