"""Lowered functions as the text of a module, through the templates."""

import hashlib
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import jinja2
from jinja2 import meta
from sympy import Equality
from sympy.printing.str import StrPrinter

from gqm_sym.emission.ir import Assignment, ExactIR, FunctionIR, ModuleIR
from gqm_sym.emission.printer import FUNCTIONS, CodePrinter, ExactPrinter, IntervalPrinter
from gqm_sym.errors import EmissionError

# The version of gqm_sym.runtime.interface that emitted code is written for (a test holds the two together).
INTERFACE = 8

# Functions that the runtime has in forms that fill vector registers; the rest is the standard library's.
_ELEMENTARY = frozenset({"atan", "cos", "cosh", "exp", "sin", "sinh"})
_MATH = frozenset({*FUNCTIONS.values(), "sqrt", "pi", "e"} - _ELEMENTARY)
_RUNTIME = ("Addresses", "CompiledModel", "LaunchRequest", "Pass1")
# Columns of the emitted import list.
_WIDTH = 116
# Functions that every module hands over, as the interface orders them.
_ADDRESSES = ("frame", "climb", "rise", "bend", "bounds")
# Names that mean something in every emitted module: no run-time parameter may take them.
_OWN = frozenset(
    {
        *_RUNTIME,
        "Any",
        "CHART",
        "Dissipation",
        "Each",
        "ExactClimb",
        "ExactFormulas",
        "MODEL",
        "Motion",
        "PARAMETERS",
        "Sweep",
        "TYPE_CHECKING",
        "carray",
        "chart",
        "chart_of",
        "compiled",
        "compiler",
        "fabs",
        "range",
        "op",
        "self",
        "nearest",
    }
)
_OWN |= {"pass1", "solve", "sweep"}


def render(module: ModuleIR, *, source: str) -> str:
    """The text of a module. ``source`` is the canonical text of what it was made from, for its digest."""
    functions, used = [], set[str]()
    chart = module.chart
    for function in (*module.functions, *(chart.functions if chart else ())):
        text, names = _loop(function)
        functions.append(text)
        used |= names
    intervals = set[str]()
    for enclosing in (module.bounds, module.bounds_each):
        if enclosing is not None:
            bounds, names = _bounds(enclosing, module.parameter)
            functions.append(bounds)
            intervals |= names
    runtime = {*_RUNTIME, *(f["signature"] for f in functions)}
    if chart:
        runtime |= set(chart.imports)
    exact = _exact_formulas(module)
    runtime |= {exact.partition("(")[0]} if exact else set()
    if module.dissipation:
        runtime.add("Dissipation")
    if module.bounds_each is not None:
        runtime.add("Each")
    if any(name.removeprefix("i").startswith("chart_") for name in used | intervals):
        runtime.add("chart_of")
    _refuse_own_names(module, used | intervals | runtime | {f["name"] for f in functions})
    environment = _environment()
    fields: dict[str, Any] = {
        "interface": INTERFACE,
        "title": _quoted(module.title or module.name),
        "forms": [_quoted(line) for line in _forms(module)],
        "math": sorted(used & _MATH),
        "runtime": _listed(sorted(runtime | (used - _MATH) | intervals, key=_as_imported)),
        "defaults": [(repr(name), repr(value)) for name, value in module.defaults],
        "functions": functions,
        "exact": [_exact(f) for f in (*module.exact, *(chart.exact if chart else ()))],
        "chart": chart.statement if chart else "",
        "data": list(chart.data) if chart else [],
        "name_text": repr(module.name),
        "parameter": module.parameter,
        "parameter_text": repr(module.parameter),
        "positive": repr(module.positive),
        "at_least": repr(module.at_least) if module.at_least else "",
        "body": repr(module.body) if module.body else "",
        "grip": repr(module.grip) if module.grip else "",
        "addresses": ", ".join(f"{f['name']}.address" for f in functions if f["name"] in _ADDRESSES),
        "exact_formulas": exact,
        "axes": next((f.name for f in module.exact if f.name == "exact_axes"), ""),
        "monotone": module.monotone,
        "loads": next((f["name"] for f in functions if f["signature"] == "LOADS"), ""),
        "each": ", ".join(_each(module, [f["name"] for f in functions if f["each"]])),
        "dissipation": ", ".join(f"{flag}={value}" for flag, value in module.dissipation),
        "keywords": ", ".join(f"{name}: Any = {value!r}" for name, value in module.defaults),
        "names": ", ".join(name for name, _ in module.defaults),
    }
    body = _tidied(_fill(environment, "body.py.j2", fields))
    header = {
        "name": module.name,
        "interface": INTERFACE,
        "input_digest": _digest(source),
        "body_digest": _digest(body),
    }
    return _fill(environment, "header.py.j2", header) + body


def _exact_formulas(module: ModuleIR) -> str:
    """What a conservative module hands over of its formulas over a namespace; nothing where there are none."""
    names = [function.name for function in module.exact if function.places]
    kind = "ExactClimb" if module.chart else "ExactFormulas"
    return f"{kind}({', '.join(names)})" if names else ""


def _each(module: ModuleIR, names: list[str]) -> list[str]:
    """What a module hands over of its functions for sweeps."""
    rows = {f.name: len(f.outputs) for f in module.functions}
    held = [f"{row}={rows[name]}" for row, name in (("held", "orbit_each"), ("top_held", "top_each")) if name in rows]
    return [*(f"{name.removesuffix('_each')}={name}" for name in names), *held]


def body_digests(text: str) -> tuple[str, str] | None:
    """The body's digest as the header states it, and as it is; None if the text has no such header."""
    first, _, rest = text.partition("\n")
    second, _, body = rest.partition("\n")
    if not first.startswith("# Made by gqm-gen") or " body " not in second:
        return None
    return second.rpartition(" body ")[2].strip(), _digest(body)


def _listed(names: list[str]) -> list[str]:
    """Names with commas, as many on a line as fit."""
    lines = [""]
    for name in names:
        if lines[-1] and len(lines[-1]) + len(name) + 2 > _WIDTH:
            lines.append("")
        lines[-1] += f"{' ' if lines[-1] else ''}{name},"
    return lines


def _as_imported(name: str) -> tuple[int, str]:
    """The order in which names of one import stand: constants, classes, functions."""
    return (0 if name.isupper() else 1 if name[0].isupper() else 2, name)


def _tidied(text: str) -> str:
    """No blanks at ends of lines, at most two empty lines together, one newline at the end."""
    lines = "\n".join(line.rstrip() for line in text.splitlines())
    return re.sub(r"\n{4,}", "\n\n\n", lines).strip() + "\n"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode(errors="backslashreplace")).hexdigest()[:12]


def _quoted(text: str) -> str:
    """Text as it may stand inside a docstring, whatever it holds."""
    plain = "".join(c if c.isprintable() else " " for c in text)
    return plain.replace("\\", "\\\\").replace('"', "'")


def _refuse_own_names(module: ModuleIR, helpers: set[str]) -> None:
    for name in (module.parameter, *(n for n, _ in module.defaults)):
        if name in _OWN or name in helpers or name.startswith("exact_"):
            raise EmissionError(f"{name}: means something in emitted modules; choose another name for this symbol")


def _forms(module: ModuleIR) -> list[str]:
    printer = StrPrinter({"order": None})
    width = max((len(label) for label, _ in module.forms), default=0)
    lines = []
    for label, form in module.forms:
        if isinstance(form, Equality):
            lines.append(f"{label:<{width}} : {printer.doprint(form.lhs)} = {printer.doprint(form.rhs)}")
        else:
            lines.append(f"{label:<{width}} = {printer.doprint(form)}")
    return [*lines, *(["", *module.notes] if module.notes else [])]


def _statements(assignments: Iterable[Assignment], printer: CodePrinter) -> list[str]:
    return [f"{a.name} = {printer.doprint(a.value)}" for a in assignments]


def _unpacked(parameters: tuple[tuple[str, int], ...], p: str) -> list[str]:
    return [f"{name} = {p}[{i}]" for name, i in parameters]


def _loop(function: FunctionIR) -> tuple[dict[str, Any], set[str]]:
    taken = {name for name, _ in function.parameters} | {a.name for a in function.inside}
    index = "_i" if "i" in taken else "i"
    printer = CodePrinter(index)
    count, out = function.arguments[0], function.arguments[-1]
    before = [_views(function)]
    if function.parameters:
        left = ", ".join(n for n, _ in function.parameters)
        right = ", ".join(f"{function.arguments[-2]}[{i}]" for _, i in function.parameters)
        before.append(f"{left} = {right}")
    before += _statements(function.before, printer)
    inside = _statements(function.inside, printer)
    inside += [f"{out}[{row}, {index}] = {printer.doprint(e)}" for row, e in enumerate(function.outputs)]
    before = _chart_view(function, printer) + before
    fields = {
        "name": function.name,
        "signature": function.signature,
        "arguments": ", ".join(function.arguments),
        "doc": function.doc,
        "before": before,
        "loop": True,
        "index": index,
        "count": count,
        "inside": inside,
        "each": function.each,
        "later": function.each or function.later,
    }
    return fields, printer.used


def _views(function: FunctionIR) -> str:
    """Arguments that are seen as arrays."""
    names = ", ".join(name for name, _ in function.views)
    return f"{names} = {', '.join(f'carray({name}, {shape})' for name, shape in function.views)}"


def _chart_view(function: FunctionIR, printer: CodePrinter) -> list[str]:
    """Where a function reads its curve's chart: behind the run-time parameters."""
    p, count = function.views[-2]
    return [f"chart = chart_of({p}, {count})"] if any("chart_" in name for name in printer.used) else []


def _bounds(function: FunctionIR, parameter: str) -> tuple[dict[str, Any], set[str]]:
    printer = IntervalPrinter()
    *count, lo, hi, p, out = function.arguments
    index = "_i" if "i" in {parameter} | {name for name, _ in function.parameters} else "i"
    here, row = (f"[{index}]", f", {index}") if function.each else ("", "")
    inside = [f"{parameter} = ({lo}{here}, {hi}{here})"]
    inside += [f"{name} = ({p}[{i}{row}], {p}[{i}{row}])" for name, i in function.parameters]
    inside += _statements(function.inside, printer)
    for k, e in enumerate(function.outputs):
        inside.append(f"{out}[{2 * k}{row}], {out}[{2 * k + 1}{row}] = {printer.doprint(e)}")
    fields = {
        "name": function.name,
        "signature": function.signature,
        "arguments": ", ".join(function.arguments),
        "doc": function.doc,
        "before": [*_chart_view(function, printer), _views(function)],
        "loop": function.each,
        "index": index,
        "count": count[0] if count else "",
        "inside": inside,
        "each": function.each,
        "later": function.each or function.later,
    }
    return fields, printer.used


def _exact(function: ExactIR) -> dict[str, Any]:
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


def _environment() -> jinja2.Environment:
    """Templates of the installed package, or of the checkout it is run from."""
    package = Path(__file__).resolve().parent.parent
    folder = next((f for f in (package / "_templates", package.parent / "templates") if f.is_dir()), None)
    if folder is None:
        raise EmissionError(f"{package}: its templates are missing; install gqm_sym again")
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )


def _fill(environment: jinja2.Environment, template: str, fields: dict[str, Any]) -> str:
    loader = environment.loader
    assert loader is not None
    wanted = meta.find_undeclared_variables(environment.parse(loader.get_source(environment, template)[0]))
    if wanted != set(fields):
        raise EmissionError(f"{template}: wants {sorted(wanted)}, is given {sorted(fields)}")
    return environment.get_template(template).render(fields)
