"""Read a curve file: text -> tree -> checked sections -> what they declare.

Every stage notes what it finds wrong and goes on with the rest, so that all mistakes of a file are
reported together. What is only a consequence of an earlier mistake is not reported.
"""

import difflib
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias, TypeVar

import sympy as sp
from pydantic import BaseModel, ValidationError

from gqm_sym.declare import Curve
from gqm_sym.errors import InputError
from gqm_sym.kernels import KERNELS, Kernel
from gqm_sym.parameters import exact_value
from gqm_sym.specfile.explain import explain
from gqm_sym.specfile.nodes import MapNode, Mark, Mistakes, plain
from gqm_sym.specfile.places import locate, mention, node_at, place_of
from gqm_sym.specfile.schema import (
    CURVES,
    CurveFile,
    CurveSection,
    KernelSection,
    Launch,
    Parameter,
    read_default,
)
from gqm_sym.specfile.spec import Note, Spec
from gqm_sym.specfile.yamltext import read_text, read_tree

Parameters: TypeAlias = Mapping[str, Parameter | None]
T = TypeVar("T", bound=BaseModel)

_NO_NUMBERS = (sp.nan, sp.zoo, sp.oo, -sp.oo)


def read_spec(path: Path | str) -> Spec:
    """Read a curve file.

    Parameters
    ----------
    path
        Of a YAML file, at most 1 MiB.

    Raises
    ------
    SpecFileError
        With every mistake of the file, one line each: ``file:line:column: what; what would be
        right``.
    """
    mistakes = Mistakes(path)
    tree = read_tree(read_text(Path(path), mistakes), mistakes)
    if isinstance(tree, MapNode):
        spec = _Reader(tree, mistakes).read()
        if spec is not None and not mistakes:
            return spec
    elif tree is not None:
        what = f"the file holds {tree.kind}, not a mapping"
        mistakes.add(tree.mark, what, "begin with 'name: ...'")
    raise mistakes.error()


class _Reader:
    """Goes through one file's tree, section by section."""

    def __init__(self, tree: MapNode, mistakes: Mistakes) -> None:
        self.tree = tree
        self.data = plain(tree)
        self.mistakes = mistakes
        self.bad: list[tuple[str | int, ...]] = []  # paths at which the structure is wrong

    def read(self) -> Spec | None:
        try:
            CurveFile.model_validate(self.data)
        except ValidationError as error:
            spoilt = self.mistakes.places()
            for detail in error.errors(include_url=False, include_input=False):
                self.bad.append(detail["loc"])
                explain(detail, self.tree, self.mistakes, spoilt=spoilt)
        curve, kernel = self._curve(), self._kernel()
        declared = {name: self._section(Parameter, "parameters", name) for name in self._declared()}
        if curve is not None and kernel is not None:
            self._check_names(curve, kernel, declared)
        launch = self._section(Launch, "launch")
        if launch is not None:
            self._check_launch(launch, curve, declared)
        if self.mistakes or curve is None or kernel is None:
            return None
        entries = {name: entry for name, entry in declared.items() if entry is not None}
        return Spec(
            path=self.mistakes.path,
            name=self.data["name"],
            title=self.data.get("title", ""),
            curve=curve,
            kernel=kernel,
            parameters=MappingProxyType({name: entry.value for name, entry in entries.items()}),
            notes=MappingProxyType(
                {
                    name: Note(unit=entry.unit, description=entry.description)
                    for name, entry in entries.items()
                    if entry.unit or entry.description
                }
            ),
            launch=None if launch is None else MappingProxyType(_arguments(launch)),
            tree=self.tree,
        )

    def _section(self, model: type[T], *path: str) -> T | None:
        """Return a section of the file as its model; None if it is not there, or is wrong."""
        value = self.data
        for step in path:
            if not isinstance(value, dict) or step not in value:
                return None
            value = value[step]
        if any(loc[: len(path)] == path for loc in self.bad):
            return None
        return model.model_validate(read_default(value) if model is Parameter else value)

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
            return CURVES[kind].declare(_arguments(getattr(section, kind)))
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
        """Note names that have no value, and values that have no use."""
        defaults = {**dict(kernel.defaults), **dict(curve.defaults)}
        right = [name for name, entry in declared.items() if entry is not None]
        unused = [name for name in right if name not in defaults and name != "m"]
        for name, default in defaults.items():
            if default is not None or name in declared:
                continue
            near = difflib.get_close_matches(name, unused, n=1, cutoff=0.5)
            remedy = f"add it there, as in {name}: 1 (null: to be given at run time)"
            if near:
                remedy += f", or did you mean {near[0]}?"
            self.mistakes.add(self._origin(name), f"{name!r} is not in parameters", remedy)
        for name in unused:
            what = f"parameters: {name!r} is used neither by the curve nor by the kernel"
            remedy = "add gravity: {} to kernel" if name == "g" else "remove it, or use it"
            self.mistakes.add(place_of(self.tree, ("parameters", name)), what, remedy)

    def _origin(self, name: str) -> Mark:
        """Return the place where a parameter comes from."""
        for path in (("curve",), ("kernel",)):
            if found := mention(node_at(self.tree, path), name):
                return found
        for key in self.data["kernel"]:
            if name in KERNELS[key].arguments:
                return place_of(self.tree, ("kernel", key))
        return place_of(self.tree, ("curve", "family"))

    def _check_launch(self, launch: Launch, curve: Curve | None, declared: Parameters) -> None:
        """Note a launch that cannot be."""

        def note(key: str, what: str, remedy: str) -> None:
            mark = node_at(self.tree, ("launch", key)).mark
            self.mistakes.add(mark, f"launch.{key}: {what}", remedy)

        if _is_true(exact_value(launch.v0) < 0):
            remedy = "give a speed, and direction: -1 to launch against growing parameter"
            note("v0", f"must not be negative, got {launch.v0}", remedy)
        if launch.t_max is not None and not _is_true(exact_value(launch.t_max) > 0):
            note("t_max", f"must be positive, got {launch.t_max}", "give a time in seconds")
        if curve is None or any(entry is None for entry in declared.values()):
            return
        values = dict(curve.defaults)
        values |= {name: entry.value for name, entry in declared.items() if entry is not None}
        known = {sp.Symbol(name, real=True): exact_value(value) for name, value in values.items() if value is not None}
        lam0 = exact_value(launch.lam0)
        low, high = (None if end is None else end.xreplace(known) for end in curve.domain)
        for end in (low, high):
            if end is not None and (end.is_real is False or end.has(*_NO_NUMBERS)):
                what = f"the curve's domain ends at {end} with these parameters, no real number"
                note("lam0", what, "change the parameters or the domain")
                return
        if (low is not None and _is_true(lam0 < low)) or (high is not None and _is_true(lam0 > high)):
            domain = f"[{'-oo' if low is None else low}, {'oo' if high is None else high}]"
            what = f"{launch.lam0} is outside the curve's domain"
            note("lam0", what, f"give one within {domain}")


def _is_true(relation: Any) -> bool:
    # A relation that SymPy cannot decide (two equal numbers in disguise) is no reason to refuse.
    return bool(relation is sp.true or relation is True)


def _arguments(section: BaseModel) -> dict[str, Any]:
    """Keyword arguments: what the file gives, and nothing else."""
    return section.model_dump(exclude_unset=True, exclude_none=True)
