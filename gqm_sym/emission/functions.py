"""Lowered functions as lines of text: the fields that the template prints, and the names of the functions that they
call.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any, NamedTuple

from sympy import Expr, Function, Symbol

from gqm_sym.emission.ir import Assignment, ExactIR, FunctionIR
from gqm_sym.emission.printer import CodePrinter, ExactPrinter, IntervalPrinter
from gqm_sym.emission.subscripts import at
from gqm_sym.sympy_charts import (
    SPACE_CHARTS,
    TERMS_SIZES,
    TRAIN_LOADS,
    ChartFunction,
    TrainLoad,
    chart_alpha,
    chart_kappa,
    chart_x,
    chart_z,
)

# The names of the arrays of charts in emitted functions, each with its functions and their rows. In space each
# coordinate has a chart, and possibly the roll angle.
CHART_ROWS: dict[str, dict[type[ChartFunction], int]] = {
    "chart": {chart_x: 0, chart_z: 1, chart_alpha: 2, chart_kappa: 3},
    **{f"along_{axis}": dict(zip(heads, (1, 2, 3, 0), strict=False)) for axis, heads in SPACE_CHARTS.items()},
}
for _axis, _size in TERMS_SIZES.items():
    CHART_ROWS[f"along_{_axis}"][_size] = 4

# The names of the charts that follow the run-time parameters, in groups of charts of the same size.
Charts = Sequence[Sequence[str]]

# LLVM vectorises a loop if it can check, before the loop begins, that no row that is written overlaps another one that
# is read or written, and it makes at most 128 such checks.
MAX_OVERLAPS = 128

# The width up to which several loads of array elements are put on one line.
WIDTH = 112


def _statements(assignments: Iterable[Assignment], printer: CodePrinter) -> list[str]:
    """Return one line for each assignment, but put loads of array elements together."""
    lines: list[str] = []
    loads: list[tuple[str, str]] = []
    for a in assignments:
        text = printer.doprint(a.value)
        if isinstance(a.value, Function) and a.value.func.__name__ == "at":
            loads.append((a.name, text))
            continue
        lines += [*_together(loads), f"{a.name} = {text}"]
        loads = []
    return [*lines, *_together(loads)]


def _together(loads: list[tuple[str, str]]) -> list[str]:
    """Return lines such as ``a, b = p[0], p[1]``, with as many loads on a line as fit."""
    lines: list[str] = []
    some: list[tuple[str, str]] = []
    for load in loads:
        if some and len(_loads([*some, load])) > WIDTH:
            lines.append(_loads(some))
            some = []
        some.append(load)
    return [*lines, _loads(some)] if some else lines


def _loads(some: list[tuple[str, str]]) -> str:
    return f"{', '.join(name for name, _ in some)} = {', '.join(value for _, value in some)}"


def _unpacked(parameters: tuple[tuple[str, int], ...], p: str) -> list[str]:
    return _together([(name, f"{p}[{i}]") for name, i in parameters])


class _ChartReading(NamedTuple):
    """A function that reads values of charts from rows, which are filled before its loops.

    Attributes
    ----------
    function
        The function.
    lines
        The lines that fill the rows; none if the function reads no chart.
    charts
        The names of the charts that these lines read.
    calls
        The names that these lines call.
    in_out
        Whether the rows are those of ``out``. Otherwise they are those of a buffer, because ``out`` has too few.
    """

    function: FunctionIR
    lines: Sequence[str] = ()
    charts: Collection[str] = ()
    calls: Collection[str] = ()
    in_out: bool = False


class _ChartCall(NamedTuple):
    """A row of a chart at the places of a function, its divided difference over a fixed place and these, or one of the
    loads on the cars of a train there.

    Attributes
    ----------
    row, chart
        The row's number and the name of the chart.
    place
        The name of the place.
    start, offset
        The names of the fixed place and of the distance of the other from it; empty for the row itself.
    train
        For the loads on cars: the name of the function that fills their rows, that of V**2 or 0, the numbers that it
        needs, and the names of the charts that it reads.
    """

    row: int
    chart: str
    place: str = ""
    start: str = ""
    offset: str = ""
    train: tuple[str, Expr, Sequence[Expr], Sequence[str]] | None = None


def _read_together(function: FunctionIR) -> _ChartReading:
    """Let a function read values of charts at its places from rows, the last ones of ``out`` if it has enough.

    Neighbouring places often share a piece of the chart, which is then searched for only once.
    """
    given = {a.name: str(a.value.args[0]) for a in function.inside if _is_element(a.value)}
    calls = _calls_of_charts(function, given)
    if len({call.place for call in calls.values()}) != 1:
        return _ChartReading(function)
    out, last, lines = function.arguments[-1], len(function.outputs), []
    in_out = len(calls) <= last
    if not in_out:
        out, last = "_spare", len(calls)
        lines.append(f"{out} = spare_rows({last}, {function.arguments[0]})")
    first = last - len(calls)
    names = {a.value: Symbol(a.name, real=True) for a in function.inside}
    read = {call: names.get(call, Symbol(f"_{call.func.__name__}", real=True)) for call in calls}
    inside = [Assignment(name=a.name, value=a.value.xreplace(read)) for a in function.inside if a.value not in read]
    outputs = tuple(value.xreplace(read) for value in function.outputs)
    needed = {s.name for value in (*(a.value for a in inside), *outputs) for s in value.free_symbols}
    kept = [a for a in inside if a.name in needed]
    given_rows = ((name.name, at(out, first + j)) for j, name in enumerate(read.values()))
    rows = [Assignment(name=name, value=value) for name, value in given_rows if name in needed]
    end, used = first, set()
    for (chart, place, start, offset, train), group in groupby(calls.values(), lambda call: call[1:]):
        found = tuple(call.row for call in group)
        end += len(found)
        filled = out if end == last else f"{out}[:{end}]"
        if train:
            fill, speed, numbers, charts_read = train
            speeds = given[str(speed)] if speed else f"speeds_at_rest({function.arguments[0]})"
            printer = CodePrinter()
            texts = [given[place], speeds, *map(printer.doprint, numbers), filled]
            used |= {fill, *printer.used} | (set() if speed else {"speeds_at_rest"})
            several = f"({', '.join(charts_read)}{',' * (len(charts_read) == 1)})"
            lines.append(f"{fill}({several}, {', '.join(texts)})")
        elif offset:
            used.add("chart_differences")
            lines.append(f"chart_differences({chart}, {found}, {start}, {given[place]}, {given[offset]}, {filled})")
        else:
            used.add("chart_rows")
            lines.append(f"chart_rows({chart}, {found}, {given[place]}, {filled})")
    used |= set() if in_out else {"spare_rows"}
    charts = {name for call in calls.values() for name in (call.train[3] if call.train else (call.chart,))}
    return _ChartReading(replace(function, inside=(*rows, *kept), outputs=outputs), lines, charts, used, in_out)


def _is_element(value: Expr) -> bool:
    """Return whether a value is the element of an array that has one for each place."""
    return type(value).__name__ == "at" and len(value.args) == 1


def _calls_of_charts(function: FunctionIR, given: Collection[str]) -> dict[Expr, _ChartCall]:
    """Return the rows of charts, then their differences over a fixed place, and then the loads on the cars of a train
    that a function takes at its places.

    ``given`` are the names of the elements of its arrays.
    """
    values = [*(a.value for a in function.inside), *function.outputs]
    heads = {head.__name__: _ChartCall(row, chart) for chart, rows in CHART_ROWS.items() for head, row in rows.items()}
    assigned = {a.name for a in function.inside}
    made = {Symbol(a.name, real=True): a.value for a in function.inside if a.name not in given}
    plain: dict[Expr, _ChartCall] = {}
    gaps: dict[Expr, _ChartCall] = {}
    loads: dict[Expr, _ChartCall] = {}
    for call in {call for value in values for call in value.atoms(Function)}:
        name, arguments = call.func.__name__, [str(argument) for argument in call.args]
        if isinstance(call, TrainLoad):
            place, speed, *numbers, others = call.args
            while any(symbol in made for number in numbers for symbol in number.free_symbols):
                numbers = [number.xreplace(made) for number in numbers]
            read = (*call.track, *(call.loads if others else ()))
            loads[call] = _ChartCall(call.row, read[0], str(place), train=(call.rows, speed, tuple(numbers), read))
        elif name in heads and arguments[0] in given:
            plain[call] = heads[name]._replace(place=arguments[0])
        elif (head := heads.get(name.removeprefix("divdiff1_"))) and name not in heads:
            start, place, offset = arguments
            if start not in assigned and place in given and offset in given:
                gaps[call] = head._replace(place=place, start=start, offset=offset)
    # A function of the runtime fills all of its rows, whether or not all of them are read.
    filled = {
        head(*call.args): found._replace(row=head.row)
        for call, found in sorted(loads.items(), key=lambda item: item[0].func.rows)
        for head in sorted(TRAIN_LOADS, key=lambda head: head.row)
        if head.rows == call.rows
    }
    order = list(heads)
    rows = {
        call: found[call]
        for found, prefix in ((plain, ""), (gaps, "divdiff1_"))
        for call in sorted(found, key=lambda call: order.index(call.func.__name__.removeprefix(prefix)))
    }
    return rows | filled


def _divided(function: FunctionIR) -> list[tuple[list[int], list[Assignment]]]:
    """Return the rows of ``out`` and the assignments of each of the loops into which a function is divided."""
    parts: list[tuple[list[int], list[Assignment]]] = []
    for row in range(len(function.outputs)):
        rows = [*parts[-1][0], row] if parts else [row]
        assignments = _needed(function, rows)
        loads = sum(type(a.value).__name__ == "at" for a in assignments)
        if len(rows) > 1 and len(rows) * loads + len(rows) * (len(rows) - 1) // 2 > MAX_OVERLAPS:
            parts.append(([row], _needed(function, [row])))
        else:
            parts[-1:] = [(rows, assignments)]
    return parts


def _needed(function: FunctionIR, rows: Sequence[int]) -> list[Assignment]:
    """Return the assignments inside a loop that some rows of ``out`` need, in their order."""
    names = {symbol.name for row in rows for symbol in function.outputs[row].free_symbols}
    kept: list[Assignment] = []
    for a in reversed(function.inside):
        if a.name in names:
            kept.insert(0, a)
            names |= {symbol.name for symbol in a.value.free_symbols}
    return kept


def loop(function: FunctionIR, charts: Charts = ()) -> tuple[dict[str, Any], set[str]]:
    """Return the template's fields of a function over many places, and the names that it calls.

    ``charts`` are the names of the charts that follow the run-time parameters, in groups of one size (`ChartIR`).
    """
    reading = _read_together(function)
    function = reading.function
    taken = {name for name, _ in function.parameters} | {a.name for a in function.inside}
    index = "_i" if "i" in taken else "i"
    printer = CodePrinter(index)
    count, out = function.arguments[0], function.arguments[-1]
    before = [_views(function)]
    before += _unpacked(function.parameters, function.arguments[-2])
    before += _statements(function.before, printer)
    # The first of several loops would overwrite rows of a chart in ``out`` before another could read them.
    one_loop = [(range(len(function.outputs)), function.inside)]
    loops = []
    for rows, assignments in one_loop if reading.in_out else _divided(function):
        lines = _statements(assignments, printer)
        loops.append([*lines, *(f"{out}[{k}, {index}] = {printer.doprint(function.outputs[k])}" for k in rows)])
    printer.used |= set(reading.calls)
    printer.charts |= set(reading.charts)
    before = [*_chart_view(function, printer, charts), *before, *reading.lines]
    fields = {
        "name": function.name,
        "signature": function.signature,
        "arguments": ", ".join(function.arguments),
        "doc": function.doc,
        "before": before,
        "loop": True,
        "index": index,
        "count": count,
        "blocks": loops,
    }
    return fields, printer.used


def _views(function: FunctionIR) -> str:
    """Return the line that makes arrays of pointers."""
    names = ", ".join(name for name, _ in function.views)
    return f"{names} = {', '.join(f'carray({name}, {shape})' for name, shape in function.views)}"


def _chart_view(function: FunctionIR, printer: CodePrinter, charts: Charts) -> list[str]:
    """Return the lines that find the charts of the curve, which are stored after the run-time parameters."""
    if not printer.charts:
        return []
    p, begin = function.views[-2]
    lines: list[str] = []
    for group in charts:
        first, *others = group
        if not lines or printer.charts & set(group):
            lines.append(f"{first} = chart_of({p}, {begin})")
        places = ((name, f"{begin} + {k} * {first}.size") for k, name in enumerate(others, start=1))
        lines += [f"{name} = chart_of({p}, {at})" for name, at in places if name in printer.charts]
        begin = f"{begin} + {len(group)} * {first}.size"
    return lines


def enclosure(function: FunctionIR, parameter: str, charts: Charts = ()) -> tuple[dict[str, Any], set[str]]:
    """Return the template's fields of a function over intervals, and the names that it calls."""
    printer = IntervalPrinter()
    *count, lo, hi, p, out = function.arguments
    index = "_i" if "i" in {parameter} | {name for name, _ in function.parameters} else "i"
    here, row = (f"[{index}]", f", {index}") if function.batch else ("", "")
    values = (*(assignment.value for assignment in function.inside), *function.outputs)
    depends = any(parameter in {symbol.name for symbol in value.free_symbols} for value in values)
    inside = [f"{parameter} = ({lo}{here}, {hi}{here})"] if depends else []
    inside += _together([(name, f"({p}[{i}{row}], {p}[{i}{row}])") for name, i in function.parameters])
    inside += _statements(function.inside, printer)
    for k, e in enumerate(function.outputs):
        inside.append(f"{out}[{2 * k}{row}], {out}[{2 * k + 1}{row}] = {printer.doprint(e)}")
    fields = {
        "name": function.name,
        "signature": function.signature,
        "arguments": ", ".join(function.arguments),
        "doc": function.doc,
        "before": [*_chart_view(function, printer, charts), _views(function)],
        "loop": function.batch,
        "index": index,
        "count": count[0] if count else "",
        "blocks": [inside],
    }
    return fields, printer.used


def exact_formula(function: ExactIR) -> dict[str, Any]:
    """Return the template's fields of a function over a namespace of operations."""
    printer = ExactPrinter()
    p = "_p" if "p" in {*function.places, *(name for name, _ in function.parameters)} else "p"
    inside = _unpacked(function.parameters, p)
    inside += _statements(function.inside, printer)
    values = ["None" if e is None else printer.doprint(e) for e in function.outputs]
    inside.append(f"return {', '.join(values)}")
    arguments = ("op", *function.places, p)
    return {
        "name": function.name,
        "arguments": ", ".join(arguments),
        "doc": function.doc,
        "inside": inside,
    }
