"""The text of a module, made from lowered functions by the templates."""

import hashlib
import re
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
from jinja2 import meta
from sympy import Equality
from sympy.printing.str import StrPrinter

from gqm_sym.emission.functions import enclosure, exact_formula, loop
from gqm_sym.emission.ir import ExactIR, ModuleIR, SeparatedIR
from gqm_sym.emission.printer import FUNCTIONS
from gqm_sym.errors import EmissionError

# The version of gqm_sym.runtime.interface that emitted code is written for (a test holds the two together).
INTERFACE = 21

# Functions that the runtime has in vectorised forms; all others are those of the standard library.
_ELEMENTARY = frozenset({"atan", "cos", "cosh", "exp", "sin", "sinh", "tanh"})
_MATH = frozenset({*FUNCTIONS.values(), "sqrt", "pi", "e"} - _ELEMENTARY)
_RUNTIME = ("CompiledFunctions", "CompiledModel")
# The width of the emitted import list.
_WIDTH = 116

# Formulas for speed that only some modules have, by the names under which the record of formulas has them.
_BY_KEYWORD = {
    "exact_agm_arguments": "agm_arguments",
    "exact_coriolis_loads": "coriolis_loads",
    "exact_time_integrand": "time_integrand",
    "exact_upright_force": "upright_force",
}
# The functions of one motion, as the interface orders them.
_COMPILED_FUNCTIONS = (
    "path_and_contact_force",
    "effective_potential",
    "potential_divdiff1",
    "potential_divdiff2",
    "bounds",
)
# Names that have a meaning in every emitted module, so that no run-time parameter may have them.
_OWN = frozenset(
    {
        *_RUNTIME,
        *("Any", "BatchFunctions", "CHART", "DissipativeFunctions", "ExactFormulas", "ExactPotential", "MODEL"),
        *("Motion", "PARAMETERS", "Sweep", "TYPE_CHECKING", "carray", "chart", "chart_of", "compiled"),
        *("along_x", "along_y", "along_z", "along_h", "along_u1", "along_u2", "along_u3"),
        *("compiler", "fabs"),
        *("op", "pass1", "place_from_ends", "range", "self", "solve", "sweep"),
        *("Pass1", "Pass1InSpace", "Pass1OfRider", "path_in_space", "rider_loads"),
        *("Equilibrium", "ExactChartLaw", "ExactLaw", "SeparatedTerms", "between", "equilibria", "unknown"),
    }
)


@dataclass
class _Functions:
    """The compiled functions of a module as the template prints them, and the names that they call."""

    single: list[dict[str, Any]] = field(default_factory=list)
    batch: list[dict[str, Any]] = field(default_factory=list)
    called: set[str] = field(default_factory=set)
    intervals: set[str] = field(default_factory=set)

    def add(self, module: ModuleIR) -> None:
        """Add all functions of a module, in the order in which they are printed."""
        chart, separated = module.chart, module.separated
        charts = [group for group in (chart.names, chart.means, chart.loads) if group] if chart else []
        groups = (
            (self.single, (*module.functions, *(chart.functions if chart else ())), module.bounds),
            (self.batch, (*module.batch, *((separated.function,) if separated else ())), module.bounds_batch),
        )
        for texts, functions, enclosing in groups:
            for function in functions:
                text, names = loop(function, charts)
                texts.append(text)
                self.called |= names
            if enclosing is not None:
                text, names = enclosure(enclosing, module.parameter, charts)
                texts.append(text)
                self.intervals |= names

    @property
    def all(self) -> list[dict[str, Any]]:
        """The functions for one motion and those for many."""
        return [*self.single, *self.batch]


def render(module: ModuleIR, *, source: str) -> str:
    """Return the text of a module. ``source`` is the canonical text from which it is made, for its digest."""
    functions, chart = _Functions(), module.chart
    functions.add(module)
    runtime = _imported(module, functions)
    _refuse_own_names(module, functions.called | functions.intervals | runtime | {f["name"] for f in functions.all})
    defaults = ", ".join(f"{name!r}: {value!r}" for name, value in module.defaults)
    environment = _environment()
    fields: dict[str, Any] = {
        "interface": INTERFACE,
        "title": _quoted(module.title or module.name),
        "forms": [_quoted(line) for line in _forms(module)],
        "math": sorted(functions.called & _MATH),
        "runtime": _listed(sorted(runtime | (functions.called - _MATH) | functions.intervals, key=_as_imported)),
        "defaults": [(repr(name), repr(value)) for name, value in module.defaults],
        "defaults_line": defaults if len(defaults) <= _WIDTH - len("PARAMETERS = {}") else "",
        "functions": functions.single,
        "batch_functions": functions.batch,
        "exact": [exact_formula(f) for f in _exact_functions(module) if f.name not in _BY_KEYWORD],
        "exact_for_speed": [exact_formula(f) for f in module.exact if f.name in _BY_KEYWORD],
        "data": list(chart.data) if chart else [],
        "parameter": module.parameter,
        "keywords": [f"{name}: Any = {value!r}" for name, value in module.defaults],
        "names": f"({', '.join(name for name, _ in module.defaults)}{',' if len(module.defaults) == 1 else ''})",
        **_model_fields(module, [f["name"] for f in functions.all]),
    }
    body = _tidied(_fill(environment, "body.py.j2", fields))
    header = {
        "name": module.name,
        "interface": INTERFACE,
        "input_digest": _digest(source),
        "body_digest": _digest(body),
    }
    return _fill(environment, "header.py.j2", header) + body


def _imported(module: ModuleIR, functions: _Functions) -> set[str]:
    """Return the names of the runtime that a module needs besides the functions that its formulas call."""
    names = {*_RUNTIME, _pass1(module), *(f["signature"] for f in functions.all)}
    names |= set(module.chart.imports if module.chart else ())
    if _exact_formulas(module):
        names.add(_exact_class(module))
    if module.dissipation:
        names.add("DissipativeFunctions")
    if module.separated:
        names.add("SeparatedTerms")
    if module.bounds_batch is not None:
        names.add("BatchFunctions")
    if any("chart_" in name for name in functions.called | functions.intervals):
        names.add("chart_of")
    return names


def _model_fields(module: ModuleIR, names: list[str]) -> dict[str, Any]:
    """Return the arguments of ``CompiledModel`` as text; empty ones are omitted from the module."""
    compiled = [name for name in _COMPILED_FUNCTIONS if name in names]
    squared = [(name, name) for name in names if name == "squared_contact"]
    of_a_motion = 1 if module.dissipation else len(compiled)
    return {
        "name_text": repr(module.name),
        "parameter_text": repr(module.parameter),
        "positive": repr(module.positive),
        "units": repr(dict(sorted(module.units))) if module.units else "",
        "at_least": repr(module.at_least) if module.at_least else "",
        "rolling_radius": repr(module.rolling_radius) if module.rolling_radius else "",
        "static_friction_limit": repr(module.static_friction_limit) if module.static_friction_limit else "",
        "compiled_functions": _listed(compiled[:of_a_motion], _WIDTH - 8),
        "for_equilibria": ", ".join(f"{name}={name}" for name in compiled[of_a_motion:]),
        "inertia": next((f.name for f in module.exact if f.name == "exact_inertia"), ""),
        "trigonometric": next((f.name for f in module.exact if f.name == "exact_trigonometric"), ""),
        "pass1": _pass1(module),
        "in_space": module.in_space,
        "signed": module.signed,
        "sided": module.sided,
        "directed": module.directed,
        "banked": module.banked,
        "load_map": "load_map" if "load_map" in names else "",
        "batch": _listed(_batch(module), _WIDTH - 8),
        "chart": module.chart.statement if module.chart else "",
        "separated": _separated(module.separated) if module.separated else "",
        "axes": next((f.name for f in module.exact if f.name == "exact_axes"), ""),
        "monotone": module.monotone,
        "dissipation": ", ".join(f"{flag}={value}" for flag, value in (*module.dissipation, *squared)),
        "exact_class": _exact_class(module),
        "exact_formulas": _listed(_exact_formulas(module), _WIDTH - 8),
    }


def _exact_functions(module: ModuleIR) -> list[ExactIR]:
    """Return all formulas of a module over a namespace of operations, in the order in which they are printed."""
    chart, separated = module.chart, module.separated
    of_parts = (separated.factors, *((separated.parts,) if separated.parts else ())) if separated else ()
    return [*module.exact, *(chart.exact if chart else ()), *of_parts]


def _separated(terms: SeparatedIR) -> str:
    """Return the arguments of ``SeparatedTerms``."""
    held, loads = tuple(index for _, index in terms.function.parameters), len(terms.factors.outputs) - terms.potentials
    counts = f"potentials={terms.potentials}, loads={loads}, held={held!r}"
    counts += f", parts={terms.parts.name}" if terms.parts else ""
    return f"{terms.function.name}, {terms.factors.name}, {counts}"


def _exact_formulas(module: ModuleIR) -> list[str]:
    """Return the formulas over a namespace that a module passes to the runtime; empty if there are none."""
    names = (function.name for function in module.exact if function.places)
    return [f"{_BY_KEYWORD[name]}={name}" if name in _BY_KEYWORD else name for name in names]


def _pass1(module: ModuleIR) -> str:
    """Return the description of a load map for the runtime."""
    if module.banked:
        return "Pass1OfRider"
    return "Pass1InSpace" if module.in_space else "Pass1"


def _exact_class(module: ModuleIR) -> str:
    """Return the name of the record for these formulas."""
    if module.dissipation:
        return "ExactChartLaw" if module.chart else "ExactLaw"
    return "ExactPotential" if module.chart else "ExactFormulas"


def _batch(module: ModuleIR) -> list[str]:
    """Return the functions for many orbits that a module passes to the runtime, and the numbers of rows that the
    invariants fill.
    """
    if module.bounds_batch is None:
        return []
    rows = {f.name: len(f.outputs) for f in (*module.batch, module.bounds_batch) if f.batch}
    counted = (("orbit_rows", "orbit_invariants_batch"), ("integrand_rows", "integrand_invariants_batch"))
    return [
        *(f"{name.removesuffix('_batch')}={name}" for name in rows),
        *(f"{keyword}={rows[name]}" for keyword, name in counted if name in rows),
    ]


def body_digests(text: str) -> tuple[str, str] | None:
    """Return the body's digest as the header states it, and as computed; None if the text has no such header."""
    first, _, following = text.partition("\n")
    second, _, body = following.partition("\n")
    if not first.startswith("# Made by gqm-gen") or " body " not in second:
        return None
    return second.rpartition(" body ")[2].strip(), _digest(body)


def _listed(names: list[str], width: int = _WIDTH) -> list[str]:
    """Return names followed by commas, as many on each line as fit."""
    lines = [""] if names else []
    for name in names:
        if lines[-1] and len(lines[-1]) + len(name) + 2 > width:
            lines.append("")
        lines[-1] += f"{' ' if lines[-1] else ''}{name},"
    return lines


def _as_imported(name: str) -> tuple[int, str]:
    """Return the key that orders the names of an import: constants, classes, functions."""
    return (0 if name.isupper() else 1 if name[0].isupper() else 2, name)


def _tidied(text: str) -> str:
    """Remove blanks at ends of lines, all but two of consecutive empty lines, and all but one newline at the end."""
    lines = "\n".join(line.rstrip() for line in text.splitlines())
    return re.sub(r"\n{4,}", "\n\n\n", lines).strip() + "\n"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode(errors="backslashreplace")).hexdigest()[:12]


def _quoted(text: str) -> str:
    """Change a text so that it can be part of a docstring."""
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


def _environment() -> jinja2.Environment:
    """Return the templates of the installed package, or of the checkout from which it is run."""
    package = Path(__file__).resolve().parent.parent
    folder = next((f for f in (package / "_templates", package.parent / "templates") if f.is_dir()), None)
    if folder is None:
        raise EmissionError(f"{package}: its templates are missing; install gqm_sym again")
    return _templates_in(folder)


@cache
def _templates_in(folder: Path) -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    environment.filters["listed"] = _listed
    return environment


@cache
def _wanted_by(environment: jinja2.Environment, template: str) -> set[str]:
    """Return the names of the fields of a template."""
    loader = environment.loader
    assert loader is not None
    return meta.find_undeclared_variables(environment.parse(loader.get_source(environment, template)[0]))


def _fill(environment: jinja2.Environment, template: str, fields: dict[str, Any]) -> str:
    wanted = _wanted_by(environment, template)
    if wanted != set(fields):
        raise EmissionError(f"{template}: wants {sorted(wanted)}, is given {sorted(fields)}")
    return environment.get_template(template).render(fields)
