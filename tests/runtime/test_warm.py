"""Everything can be compiled beforehand, and is then found in the cache."""

import ast
from pathlib import Path

import pytest

from gqm_sym.errors import InputError
from gqm_sym.runtime import warm
from gqm_sym.runtime.compiled.stamps import FOLDER


def test_every_entry_point_is_found() -> None:
    """The files with an entry point or a function called by address are those that Python's own parser finds."""

    def has_entry(path: Path) -> bool:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
        calls = [d for node in functions for d in node.decorator_list if isinstance(d, ast.Call)]
        calls += [node.value for node in tree.body if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call)]
        return any(
            isinstance(call.func, ast.Name) and call.func.id in ("entry", "compiled", "Emitted") for call in calls
        )

    names = {".".join(p.relative_to(FOLDER).with_suffix("").parts) for p in FOLDER.rglob("*.py") if has_entry(p)}
    found = warm.rooms()
    assert set(found) == names
    assert tuple(found[: len(warm.LONGEST)]) == warm.LONGEST


def test_a_room_is_compiled() -> None:
    """The entry points of a small file are compiled, and a second time they come from the cache."""
    assert warm.compile_room("arithmetic.doubledouble") == "arithmetic.doubledouble"


def test_a_wrong_file_is_refused_at_once(tmp_path: Path) -> None:
    """A wrong file is refused before minutes are spent on the others."""
    with pytest.raises(InputError, match="is not a generated module"):
        warm.warm((str(tmp_path / "none.py"),))
