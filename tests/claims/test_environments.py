"""The oldest versions that are tested are those that the requirements promise."""

import ast
import re
import tomllib

from paths import ROOT

TRIED = ("dask", "data", "notebook", "plot", "test")


def release(version: str) -> tuple[int, ...]:
    """Return the numbers of a version, without trailing zeros, which mean nothing."""
    numbers = [int(n) for n in version.split(".")]
    while numbers and numbers[-1] == 0:
        numbers.pop()
    return tuple(numbers)


def test_the_oldest_are_the_lower_bounds() -> None:
    """Every requirement of the package, and of the extras that tests need, is tested at its lower bound, exactly and
    once.
    """
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    promised = [*project["dependencies"], *(line for name in TRIED for line in project["optional-dependencies"][name])]
    bounds = dict(re.fullmatch(r"([\w.-]+)>=([\d.]+)(?:,<[\d.]+)?", line).groups() for line in promised)  # type: ignore[union-attr]
    tree = ast.parse((ROOT / "noxfile.py").read_text())
    (given,) = (s for s in tree.body if isinstance(s, ast.Assign) and ast.unparse(s.targets[0]) == "OLDEST")
    texts = [node.value for node in ast.walk(given) if isinstance(node, ast.Constant)]
    tried = dict(text.split("==") for text in texts if "==" in text)
    assert {name: release(v) for name, v in tried.items()} == {name: release(v) for name, v in bounds.items()}
