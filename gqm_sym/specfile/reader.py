"""Reading of a curve file, from text to a tree, to checked sections, and to declarations.

Every stage records its mistakes and continues, so that all mistakes of a file are reported together. Consequences of an
earlier mistake are not reported.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias, TypeVar

import sympy as sp
from pydantic import BaseModel, ValidationError

from gqm_sym.arguments import file_path, nearest
from gqm_sym.budgets import budget, check_budget, outside_budgets
from gqm_sym.declare import Curve
from gqm_sym.errors import BudgetError, InputError, SpecFileError
from gqm_sym.kernels import KERNELS, Kernel
from gqm_sym.literals.units import check_unit, read_unit
from gqm_sym.parameters import exact_value, in_si, refuse_out_of_range
from gqm_sym.specfile.explain import explain
from gqm_sym.specfile.fields import split_value
from gqm_sym.specfile.locations import locate, mention, node_at, place_of
from gqm_sym.specfile.nodes import MapNode, Mark, Mistakes, plain
from gqm_sym.specfile.schema import (
    CURVES,
    CurveFile,
    CurveSection,
    KernelSection,
    Launch,
    Parameter,
    Quantity,
    model_at,
)
from gqm_sym.specfile.spec import Note, Spec
from gqm_sym.specfile.units import expected_units, launch_units
from gqm_sym.specfile.yamltext import read_text, read_tree

Parameters: TypeAlias = Mapping[str, Parameter | None]
T = TypeVar("T", bound=BaseModel)

# The limit of processor time; a file of usual size takes a hundredth of it.
SECONDS = 0.5

_NO_NUMBERS = (sp.nan, sp.zoo, sp.oo, -sp.oo)


def read_spec(path: Path | str) -> Spec:
    """Read a curve file.

    Parameters
    ----------
    path
        The path of a YAML file of at most 64 KiB.

    Returns
    -------
    Spec
        The curve, the force law and the launch; ``spec.derive()`` returns the model.

    Raises
    ------
    SpecFileError
        If the file has mistakes, with a line ``file:line:column: ...`` for each of them.
    """
    file = file_path(path, where="read_spec: path")
    mistakes = Mistakes(path)
    tree = read_tree(read_text(file, mistakes), mistakes)
    if isinstance(tree, MapNode):
        try:
            with budget("reading", SECONDS, "write fewer and simpler expressions"):
                spec = _Reader(tree, mistakes).read()
        except BudgetError as error:
            raise SpecFileError(f"{path}: {error}") from None
        if spec is not None and not mistakes:
            return spec
    elif tree is not None:
        what = f"the file holds {tree.kind}, not a mapping"
        mistakes.add(tree.mark, what, "begin with 'name: ...'")
    raise mistakes.error()


class _Reader:
    """A reader of one file's tree, section by section."""

    def __init__(self, tree: MapNode, mistakes: Mistakes) -> None:
        self.tree = tree
        self.data = plain(tree)
        self.mistakes = mistakes
        self.bad: list[tuple[str | int, ...]] = []  # paths at which the structure is wrong

    def read(self) -> Spec | None:
        try:
            CurveFile.model_validate(self.data)
        except ValidationError as error:
            refused_places = self.mistakes.places()
            for detail in error.errors(include_url=False, include_input=False):
                self.bad.append(detail["loc"])
                explain(detail, self.tree, self.mistakes, model_at, refused_places=refused_places)
        curve, kernel = self._curve(), self._kernel()
        declared = {name: self._section(Parameter, "parameters", name) for name in self._declared()}
        if curve is not None and kernel is not None:
            self._check_names(curve, kernel, declared)
            self._check_ranges(kernel, declared)
        launch = self._section(Launch, "launch")
        if isinstance(self.data.get("launch"), dict):
            self._check_place({"lam0", "point"} & set(self.data["launch"]), curve)
        self._check_units(declared, launch, curve, kernel)
        if launch is not None:
            self._check_launch(_arguments(launch), curve, declared)
        if self.mistakes or curve is None or kernel is None:
            return None
        entries = {name: entry for name, entry in declared.items() if entry is not None}
        return Spec(
            path=self.mistakes.path,
            name=self.data["name"],
            title=self.data.get("title", ""),
            curve=curve,
            kernel=kernel,
            parameters=MappingProxyType({name: _value(entry) for name, entry in entries.items()}),
            notes=MappingProxyType(
                {name: _note(entry) for name, entry in entries.items() if entry.unit or entry.description}
            ),
            launch=None if launch is None else MappingProxyType(_arguments(launch)),
            tree=self.tree,
        )

    def _section(self, model: type[T], *path: str) -> T | None:
        """Return a section of the file as its model; None if it is missing or wrong."""
        value = self.data
        for step in path:
            if not isinstance(value, dict) or step not in value:
                return None
            value = value[step]
        if any(loc[: len(path)] == path for loc in self.bad):
            return None
        return model.model_validate(split_value(value) if model is Parameter else value)

    # -- what it declares --------------------------------------------------------------------

    def _declared(self) -> Iterable[str]:
        given = self.data.get("parameters")
        return given if isinstance(given, dict) else ()

    def _curve(self) -> Curve | None:
        section = self._section(CurveSection, "curve")
        if section is None:
            return None
        kinds = list(self.data["curve"])
        if len(kinds) != 1:
            what = f"declared as {' and as '.join(kinds)}" if kinds else "is empty"
            mark = place_of(self.tree, ("curve", *kinds[1:2]))
            self.mistakes.add(mark, f"curve: {what}", f"give exactly one of {', '.join(CURVES)}")
            return None
        (kind,) = kinds
        try:
            row, given = CURVES[kind], _arguments(getattr(section, kind))
            if not row.reads_files:
                return row.declare(given)
            with outside_budgets():  # such files have limits of their own
                return row.declare(given, Path(self.mistakes.path).parent)
        except InputError as error:
            self.mistakes.add(*locate(self.tree, str(error), ("curve", kind)))
            return None

    def _kernel(self) -> Kernel | None:
        section = self._section(KernelSection, "kernel")
        if section is None:
            return None
        total: Kernel | None = Kernel(terms=())
        for key in self.data["kernel"]:
            try:
                term = KERNELS[key].make(**_arguments(getattr(section, key)))
                total = None if total is None else total + term
            except InputError as error:
                self.mistakes.add(*locate(self.tree, str(error), ("kernel", key)))
                total = None
        return total

    def _check_names(self, curve: Curve, kernel: Kernel, declared: Parameters) -> None:
        """Record names that have no value, and values that have no use."""
        defaults = {**dict(kernel.along(curve.parameter, in_space=curve.in_space).defaults), **dict(curve.defaults)}
        right = [name for name, entry in declared.items() if entry is not None]
        unused = [name for name in right if name not in defaults and name != "m"]
        for name, default in defaults.items():
            if default is not None or name in declared:
                continue
            check_budget()
            near = nearest(name, unused)
            remedy = f"add it there, as in {name}: 1 (null: to be given at run time)"
            if near:
                remedy += f", or did you mean {near}?"
            self.mistakes.add(self._origin(name), f"{name!r} is not in parameters", remedy)
        for name in unused:
            what = f"parameters: {name!r} is used neither by the curve nor by the kernel"
            remedy = "add gravity: {} to kernel" if name == "g" else "remove it, or use it"
            self.mistakes.add(place_of(self.tree, ("parameters", name)), what, remedy)

    def _check_ranges(self, kernel: Kernel, declared: Parameters) -> None:
        """Record a value that a force does not allow."""
        values = dict(kernel.defaults) | {name: _value(entry) for name, entry in declared.items() if entry is not None}
        try:
            refuse_out_of_range(values, kernel.positive, kernel.at_least, where="parameters")
        except InputError as error:
            self.mistakes.add(*locate(self.tree, str(error), ()))

    def _origin(self, name: str) -> Mark:
        """Return the place in the file from which a parameter comes."""
        for path in (("curve",), ("kernel",)):
            if found := mention(node_at(self.tree, path), name):
                return found
        for key in self.data["kernel"]:
            if name in KERNELS[key].arguments:
                return place_of(self.tree, ("kernel", key))
        return place_of(self.tree, ("curve", "family"))

    def _check_place(self, given: set[str], curve: Curve | None) -> None:
        """Record a launch without a place, or with a place in a form that the curve does not have."""
        mark = place_of(self.tree, ("launch",))
        if "point" in given and curve is not None and not curve.charted:
            what = "launch: point is for implicit curves, tracks and rails"
            remedy = "give lam0, the curve's parameter at launch"
            self.mistakes.add(place_of(self.tree, ("launch", "point")), what, remedy)
        elif len(given) == 2:
            self.mistakes.add(mark, "launch: lam0 and point are given", "give one of them; both say where to launch")
        elif not given:
            self.mistakes.add(mark, "launch: lam0 is missing", "add lam0: -pi/2 + 6/5")

    def _check_units(
        self, declared: Parameters, launch: Launch | None, curve: Curve | None, kernel: Kernel | None
    ) -> None:
        """Record units whose dimension is not that of their values, whatever else is wrong."""
        written = {name: entry.unit for name, entry in declared.items() if entry is not None and entry.unit}
        if kernel is not None and curve is not None:
            kernel = kernel.along(curve.parameter, in_space=curve.in_space)
        units, starts = expected_units(self.data, curve, kernel, written), launch_units(curve)
        given = [(("parameters", name), entry, units.get(name)) for name, entry in declared.items()]
        given += [(("launch", key), entry, starts.get(key)) for key, entry in launch or ()]
        for path, entry, wanted in given:
            if isinstance(entry, Quantity) and entry.unit:
                try:
                    check_unit(entry.unit, wanted)
                except InputError as error:
                    mark = node_at(self.tree, (*path, "unit")).mark
                    self.mistakes.add(mark, f"{'.'.join(path)}.unit: {error}")

    def _check_launch(self, launch: Mapping[str, Any], curve: Curve | None, declared: Parameters) -> None:
        """Record a launch that is not possible."""

        def note(key: str, what: str, remedy: str) -> None:
            mark = node_at(self.tree, ("launch", key, "value")).mark
            self.mistakes.add(mark, f"launch.{key}: {what}", remedy)

        if "v0" in launch and _is_true(exact_value(launch["v0"]) < 0):
            remedy = "give a speed, and direction: -1 to launch towards decreasing parameter"
            note("v0", f"must not be negative, got {launch['v0']}", remedy)
        if "t_max" in launch and not _is_true(exact_value(launch["t_max"]) > 0):
            note("t_max", f"must be positive, got {launch['t_max']}", "give a time in seconds")
        if "lam0" not in launch or curve is None or any(entry is None for entry in declared.values()):
            return
        values = dict(curve.defaults)
        values |= {name: _value(entry) for name, entry in declared.items() if entry is not None}
        known = {sp.Symbol(name, real=True): exact_value(value) for name, value in values.items() if value is not None}
        lam0 = exact_value(launch["lam0"])
        low, high = (None if end is None else end.xreplace(known) for end in curve.domain)
        for end in (low, high):
            if end is not None and (end.is_real is False or end.has(*_NO_NUMBERS)):
                what = f"the curve's domain ends at {end} with these parameters, no real number"
                note("lam0", what, "change the parameters or the domain")
                return
        if (low is not None and _is_true(lam0 < low)) or (high is not None and _is_true(lam0 > high)):
            domain = f"[{'-oo' if low is None else low}, {'oo' if high is None else high}]"
            what = f"{launch['lam0']} is outside the curve's domain"
            note("lam0", what, f"give one within {domain}")


def _is_true(relation: Any) -> bool:
    # A relation that SymPy cannot decide (two equal numbers in different forms) is accepted.
    return bool(relation is sp.true or relation is True)


def _value(entry: Quantity) -> str | None:
    """Return the exact text of a number in SI units."""
    return None if entry.value is None else in_si(entry.value, entry.unit)


def _note(entry: Parameter) -> Note:
    unit = read_unit(entry.unit, where="unit") if entry.unit else None
    if unit is None or unit.is_si:
        return Note(unit=entry.unit, description=entry.description)
    given = "" if entry.value is None else f"{entry.value} {entry.unit}"
    return Note(unit=unit.name, description=entry.description, given=given)


def _arguments(section: BaseModel) -> dict[str, Any]:
    """Return the keyword arguments that the file gives, with quantities as numbers in SI units."""
    given = section.model_dump(exclude_unset=True, exclude_none=True)
    return {key: _value(entry) if isinstance(entry := getattr(section, key), Quantity) else given[key] for key in given}
