"""Reading of a sweep file, with all mistakes reported by line, as for a curve file."""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from gqm_sym.arguments import file_path, nearest
from gqm_sym.budgets import budget, outside_budgets
from gqm_sym.derivation import Model
from gqm_sym.emission import emit
from gqm_sym.errors import BudgetError, InputError, SpecFileError
from gqm_sym.literals.numbers import read_number
from gqm_sym.literals.units import check_unit, read_unit
from gqm_sym.parameters import in_si
from gqm_sym.specfile import Spec, read_spec
from gqm_sym.specfile.companion_files import companion_path, read_companion, read_rows
from gqm_sym.specfile.explain import explain
from gqm_sym.specfile.locations import locate, node_at, place_of
from gqm_sym.specfile.nodes import MapNode, Mistakes, plain
from gqm_sym.specfile.units import expected_units, launch_units
from gqm_sym.specfile.yamltext import read_text, read_tree
from gqm_sym.studies.plan import POINTS_IN_LOOPS, POINTS_SOLVED, Array, Axis, Plan, evenly, in_doubles
from gqm_sym.studies.schema import MOST_POINTS, SweepFile, Table, model_at

SECONDS = 0.5

# The content of a file, and its schema.
P = TypeVar("P")
S = TypeVar("S", bound=BaseModel)

# The largest number of digits of an exponent; with more, exact numbers would fill the memory.
_DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
_LAUNCH = ("lam0", "v0", "direction", "lam")


def read_sweep(path: Path | str) -> Plan:
    """Read a sweep file, and the curve file that it names.

    Parameters
    ----------
    path
        The path of a YAML file of at most 64 KiB.

    Returns
    -------
    Plan

    Raises
    ------
    SpecFileError
        If the file has mistakes, with a line ``file:line:column: ...`` for each of them.
    """
    return read_study(path, _SweepReader, needed="curve, quantities and grid")


def read_study(path: Path | str, reader: "type[StudyReader[P]]", *, needed: str) -> P:
    """Read a file about motions along the curve of another file, as `read_sweep` does."""
    file = file_path(path, where="path")
    mistakes = Mistakes(path)
    text = read_text(file, mistakes)
    tree = read_tree(text, mistakes, needed=needed)
    if isinstance(tree, MapNode):
        try:
            with budget("reading", SECONDS, "write fewer and simpler numbers"):
                plan = reader(tree, mistakes, text).read()
        except BudgetError as error:
            raise SpecFileError(f"{path}: {error}") from None
        if plan is not None and not mistakes:
            return plan
    elif tree is not None:
        mistakes.add(tree.mark, f"the file holds {tree.kind}, not a mapping", "begin with 'curve: ...'")
    raise mistakes.error()


class StudyReader(ABC, Generic[P]):
    """A reader of one file's tree that records all mistakes."""

    known: tuple[str, ...]
    units: dict[str, str]

    def __init__(self, tree: MapNode, mistakes: Mistakes, text: str) -> None:
        self.tree, self.mistakes, self.text = tree, mistakes, text
        self.folder = Path(mistakes.path).parent
        self.origin: dict[str, str] = {}

    @abstractmethod
    def read(self) -> P | None:
        """Return the content of the file; None if it cannot be determined."""

    def validated(self, schema: type[S], model_at: Callable[[tuple[str, ...]], Any]) -> S | None:
        """Return the file as an instance of its schema."""
        try:
            return schema.model_validate(plain(self.tree))
        except ValidationError as error:
            refused_places = self.mistakes.places()
            for detail in error.errors(include_url=False, include_input=False):
                explain(detail, self.tree, self.mistakes, model_at, refused_places=refused_places)
            return None

    def curve(self, name: str) -> tuple[Spec, Model] | None:
        """Return the curve file and its model; mistakes in the curve file are reported as its own."""
        try:
            path = companion_path(name, self.folder, wanted="a curve file")
        except InputError as error:
            self.mistakes.add(*locate(self.tree, str(error), ("curve",)))
            return None
        spec = read_spec(self.folder / name)
        self.origin["curve_file"] = path.read_text(encoding="utf-8-sig")
        model = spec.derive()
        self.known = (*_LAUNCH, *(name for name, _ in model.defaults))
        kernel = spec.kernel.along(spec.curve.parameter, in_space=spec.curve.in_space)
        units = {**expected_units(plain(spec.tree), spec.curve, kernel), **launch_units(spec.curve)}
        self.units = {**units, "direction": "1", **({"lam": units["lam0"]} if "lam0" in units else {})}
        return spec, model

    def table(self, table: Table, key: str) -> Iterator[tuple[str, Array]]:
        """Yield the columns of a table in SI units."""
        name, units = table.file, table.units
        try:
            text = read_companion(name, self.folder, wanted="a CSV file whose first line names its columns")
            header, rows = read_rows(name, text)
            columns = _columns(name, header, rows)
        except InputError as error:
            self.mistakes.add(*locate(self.tree, str(error), (key,)))
            return
        self.origin["table"] = text
        for column in units:
            if column not in columns:
                mark = place_of(self.tree, (key, "units", column))
                what = f"{key}.units: {name!r} has no column {column!r}"
                self.mistakes.add(mark, what, f"it has {', '.join(columns)}")
            else:
                self.check_unit(column, units[column], key, "units", column)
        for column, cells in columns.items():
            yield column, in_doubles(cells, read_unit(units.get(column) or "1", where="unit"))

    def fixed(self, file: Any, spec: Spec) -> dict[str, str]:
        """Return the fixed arguments: those of the curve file's launch and those of this file."""
        launch = {key: str(value) for key, value in (spec.launch or {}).items() if key != "point"}
        given = {}
        for name, entry in file.fixed.items():
            self.check_unit(name, entry.unit, "fixed", name, "unit")
            given[name] = in_si(entry.value, entry.unit)
        if "contact" in file.model_fields_set:
            launch["contact"] = file.contact
        if launch.get("contact") == "bilateral":
            del launch["contact"]
        return launch | given

    def check_unit(self, name: str, unit: str, *path: str) -> None:
        """Record a unit whose dimension is not that of its value."""
        if unit:
            try:
                check_unit(unit, self.units.get(name))
            except InputError as error:
                self.mistakes.add(node_at(self.tree, path).mark, f"{'.'.join(path)}: {error}")

    def check_known(self, path: tuple[str, ...], spec: Spec, known: Sequence[str]) -> bool:
        """Record a name, the last one of its path, that does not exist."""
        name = path[-1]
        if name in known:
            return True
        near = nearest(name, known)
        remedy = f"did you mean {near}?" if near else f"known are {', '.join(known)}"
        self.mistakes.add(place_of(self.tree, path), f"{path[0]}: there is no {name!r} in {spec.path}", remedy)
        return False


def _columns(name: str, header: list[str], rows: list[list[str]]) -> dict[str, list[str]]:
    """Return the cells of a table by its columns, each of which must be a finite decimal number."""
    if not header or not rows:
        raise InputError(f"{name!r}, row 1: must name the columns, as in lam0,v0, with values in the rows below")
    if len(set(header)) < len(header):
        raise InputError(f"{name!r}, row 1: names a column twice: {', '.join(header)}")
    for number, row in enumerate(rows, start=2):
        if len(row) != len(header):
            raise InputError(f"{name!r}, row {number}: must have {len(header)} numbers, has {len(row)}")
        for cell in row:
            if not _is_decimal(cell):
                raise InputError(f"{name!r}, row {number}: {cell!r:.60} is not a finite decimal number")
    return dict(zip(header, map(list, zip(*rows, strict=True)), strict=True))


class _SweepReader(StudyReader[Plan]):
    """A reader of a sweep file."""

    def read(self) -> Plan | None:
        """Return the plan of the sweep."""
        self.origin["sweep_file"] = self.text
        file = self.validated(SweepFile, model_at)
        if file is None:
            return None
        with outside_budgets():  # curve files, derivations and emissions have budgets of their own
            found = self.curve(file.curve)
            if found is None:
                return None
            spec, model = found
            axes = self._axes(file)
        fixed = self.fixed(file, spec)
        self._check_names(axes, fixed, file, spec, model)
        self._check_values(axes, fixed, model)
        if self.mistakes:
            return None
        notes = {name: note.unit for name, note in spec.notes.items() if note.unit}
        with outside_budgets():
            module = emit(model, name=spec.name)
        solved_singly = model.curve.charted or model.dissipation is not None or {"t_max", "contact"} & set(fixed)
        return Plan(
            title=file.title,
            quantities=tuple(dict.fromkeys(file.quantities)),
            axes=tuple(axes),
            grid="grid" in file.model_fields_set,
            fixed=fixed,
            units={**{name: _si(unit) for name, unit in self.units.items()}, **notes},
            name=spec.name,
            module=module,
            origin=self.origin,
            part=POINTS_SOLVED if solved_singly else POINTS_IN_LOOPS,
        )

    # -- what varies, and what does not -----------------------------------------------------------

    def _axes(self, file: SweepFile) -> list[Axis]:
        given = {"grid", "table"} & file.model_fields_set
        if len(given) != 1:
            what = "grid and table are given" if given else "grid is missing"
            remedy = "give one of them" if given else "say what varies, as in grid: {lam0: [0.5, 1]}, or give a table"
            self.mistakes.add(place_of(self.tree, ("table",)), what, remedy)
            return []
        if "grid" in given:
            return list(self._grid(file))
        return [Axis(name=name, values=values) for name, values in self.table(file.table, "table")]

    def _grid(self, file: SweepFile) -> Iterator[Axis]:
        points = 1
        for name, axis in file.grid.items():
            mark, given = place_of(self.tree, ("grid", name)), axis.model_fields_set - {"unit"}
            if given == {"values"} and axis.values:
                exact = [in_si(value, axis.unit) for value in axis.values]
                points *= len(exact)
            elif given == {"start", "stop", "num"}:
                exact = [in_si(value, axis.unit) for value in (axis.start, axis.stop)]
                points *= axis.num
            else:
                what = f"grid.{name}: does not say what its values are"
                self.mistakes.add(mark, what, "give start, stop and num, or values")
                continue
            self.check_unit(name, axis.unit, "grid", name, "unit")
            if points > MOST_POINTS:
                self.mistakes.add(mark, f"grid: has more than {MOST_POINTS} points", "give fewer values")
                return
            values = [read_number(value, where=name).value for value in exact] if "values" in given else None
            yield Axis(name=name, values=evenly(exact[0], exact[1], axis.num) if values is None else np.array(values))

    # -- what is wrong with it --------------------------------------------------------------------

    def _check_names(self, axes: list[Axis], fixed: dict[str, str], file: SweepFile, spec: Spec, model: Model) -> None:
        """Record unknown names, and names without a value."""
        grid = "grid" in file.model_fields_set
        places = {axis.name: ("grid", axis.name) if grid else ("table",) for axis in axes}
        for name, path in [*places.items(), *((name, ("fixed", name)) for name in file.fixed)]:
            known = (*self.known, "t_max") if path[0] == "fixed" else self.known
            if self.check_known((*path, name) if path == ("table",) else path, spec, known) and (
                path[0] == "fixed" and name in places
            ):
                self.mistakes.add(place_of(self.tree, path), f"fixed: {name!r} varies", "give its values in one place")
        for axis in axes:
            fixed.pop(axis.name, None)
        given = {axis.name for axis in axes} | set(fixed)
        needed = ["lam0", *(name for name, value in model.defaults if value is None)]
        for name in needed:
            if name not in given:
                self.mistakes.add(self.tree.mark, f"{name} has no value", f"add fixed: {{{name}: ...}}, or let it vary")
        asks = "time_at" in file.quantities
        if asks != ("lam" in given):
            what = (
                "'time_at' needs lam, the place that it asks about"
                if asks
                else "lam is for 'time_at', which is not asked"
            )
            self.mistakes.add(place_of(self.tree, ("quantities",)), what, "add it" if asks else "ask it, or remove lam")

    def _check_values(self, axes: list[Axis], fixed: Mapping[str, str], model: Model) -> None:
        """Record values that no motion can have, wherever they are given."""
        columns = [(axis.name, axis.values, True) for axis in axes]
        columns += [
            (name, np.array([read_number(v, where=name).value]), False)
            for name, v in fixed.items()
            if name != "contact"
        ]
        for name, values, varies in columns:
            wrong = ""
            if name == "v0" and (values < 0.0).any():
                wrong = "is a speed and cannot be negative; use direction: -1 to launch the other way"
            elif name == "direction" and (np.abs(values) != 1.0).any():
                wrong = "must be 1 or -1 (the sign of ds/dt at launch)"
            elif name in (*model.positive, "m", "t_max") and (values <= 0.0).any():
                wrong = "must be positive"
            if wrong:
                place = (
                    ("grid", name) if varies and "grid" in self.tree.items else ("table" if varies else "fixed", name)
                )
                self.mistakes.add(place_of(self.tree, place), f"{place[0]}: {name} {wrong}")


def _si(unit: str) -> str:
    """Return the SI unit of the dimension of a unit; none for a number."""
    return read_unit(unit, where="unit").name if unit != "1" else ""


def _is_decimal(cell: str) -> bool:
    return bool(_DECIMAL.fullmatch(cell)) and isfinite(float(cell))
