"""Who imports whom: the table of ARCHITECTURE.md, held against the imports as they stand."""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

PACKAGE = Path(__file__).parent.parent / "gqm_sym"

# From the top down: a unit imports itself and units of the layers under its own.
LAYERS = (
    {"cli"},
    {"report", "sweeps"},
    {"building", "specfile"},
    {"emission"},
    {"derivation"},
    {"declare", "kernels"},
    {"parameters"},
    {"expressions"},
    {"runtime"},
    {"sympy_tree", "sympy_charts"},
    {"grammar", "enclosures", "angles"},
    {"trees"},
    {"rationals"},
    {"budgets", "loading"},
    {"arguments", "dimensions"},
    {"errors"},
)

# Not above the runtime though it lies in a layer above it: they know it by name only.
KNOWS_NO_RUNTIME = {"emission", "derivation", "declare", "kernels", "parameters", "expressions"}

# Packages that only some units import.
ONLY_IN = {
    "distributed": {"runtime"},
    "jinja2": {"emission"},
    "llvmlite": {"runtime"},
    "matplotlib": {"runtime", "report"},
    "mpmath": {"runtime", "enclosures"},
    "numba": {"runtime"},
    "numpy": {"runtime", "sweeps"},
    "pint": {"specfile"},
    "pydantic": {"specfile", "sweeps"},
    "pydantic_core": {"specfile", "sweeps"},
    "ruamel": {"specfile"},
    "scipy": {"runtime"},
    "sympy": {
        "cli",
        "report",
        "specfile",
        "emission",
        "derivation",
        "declare",
        "kernels",
        "parameters",
        "expressions",
        "sympy_charts",
        "dimensions",
    },
    "xarray": {"cli", "runtime", "sweeps"},
}

# Imported when exact digits, splines, pictures, datasets or units are asked for, so never by a module as it loads.
ONLY_INSIDE_FUNCTIONS = {"distributed", "matplotlib", "mpmath", "pint", "scipy", "xarray"}


class Import(NamedTuple):
    """One import: by which file of which unit, of what, and whether it waits for a call.

    What only a type checker reads waits for ever.
    """

    file: str
    unit: str
    target: str
    waits: bool


def _unit(path: Path) -> str:
    """Name the part of the package that a file belongs to."""
    first = path.relative_to(PACKAGE).parts[0]
    return first.removesuffix(".py")


def _targets(node: ast.stmt) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        assert node.level == 0, "imports are absolute"
        assert node.module is not None
        if node.module == "gqm_sym":
            yield from (f"gqm_sym.{alias.name}" for alias in node.names)
        else:
            yield node.module


def _waits(node: ast.AST) -> bool:
    """Whether what stands inside does not run when the file is imported."""
    if isinstance(node, ast.If):
        return isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
    return isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)


def _imports() -> Iterator[Import]:
    for path in sorted(PACKAGE.rglob("*.py")):
        if "_templates" in path.parts:
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        inside = {id(node) for outer in ast.walk(tree) if _waits(outer) for node in ast.walk(outer)}
        for node in ast.walk(tree):
            if isinstance(node, ast.stmt):
                for target in _targets(node):
                    file = path.relative_to(PACKAGE).as_posix()
                    yield Import(file, _unit(path), target, id(node) in inside)


IMPORTS = tuple(_imports())
LEVEL = {unit: level for level, layer in enumerate(LAYERS) for unit in layer}


def test_every_unit_has_its_place() -> None:
    """A new file or folder of the package is put into the table before anything imports it."""
    units = {_unit(path) for path in PACKAGE.rglob("*.py") if path.parent != PACKAGE or path.name != "__init__.py"}
    assert units - {"_templates"} == set(LEVEL)


def test_imports_go_downwards() -> None:
    """No unit imports one beside or above it; the package's front imports all of them, waiting."""
    wrong = [
        f"{row.file} imports {row.target}"
        for row in IMPORTS
        if row.target.startswith("gqm_sym.") and row.unit != "__init__"
        for unit in [row.target.split(".")[1]]
        if unit != row.unit and (LEVEL[unit] <= LEVEL[row.unit] or (unit == "runtime" and row.unit in KNOWS_NO_RUNTIME))
    ]
    assert wrong == []


def test_the_front_loads_nothing_heavy() -> None:
    """What ``import gqm_sym`` runs at once is the errors alone."""
    loaded = {row.target for row in IMPORTS if row.unit == "__init__" and not row.waits}
    outside = {target for target in loaded if target.split(".")[0] not in sys.stdlib_module_names}
    assert outside <= {"gqm_sym.errors"}


@pytest.mark.parametrize("package", ONLY_IN)
def test_a_package_is_imported_where_it_belongs(package: str) -> None:
    """Each dependency has its units; what they need of it, others ask them for."""
    users = {row.unit for row in IMPORTS if row.target.split(".")[0] == package}
    assert users <= ONLY_IN[package]


def test_no_other_package_is_imported() -> None:
    """The dependencies are those of the table above and the standard library."""
    names = {row.target.split(".")[0] for row in IMPORTS}
    assert names - sys.stdlib_module_names - {"gqm_sym"} <= set(ONLY_IN)


def test_some_imports_wait() -> None:
    """Packages that few calls need are imported inside the functions that need them."""
    eager = [row.file for row in IMPORTS if row.target.split(".")[0] in ONLY_INSIDE_FUNCTIONS and not row.waits]
    assert eager == []
