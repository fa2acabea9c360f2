"""What the disk cache knows of, and what is compiled when."""

from types import SimpleNamespace
from typing import Any

import pytest

from gqm_sym.runtime import jit
from gqm_sym.runtime.doubledouble import two_sum


def _key() -> tuple[Any, ...]:
    codegen = SimpleNamespace(magic_tuple=lambda: ("a processor",))
    return jit.ReadyCache(two_sum.py_func)._index_key("a signature", codegen)


def test_an_edit_anywhere_in_the_runtime_compiles_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cache's key changes with any file of the runtime, though numba looks at one file only."""
    before = _key()
    assert before == _key()
    name, time, size = jit.STAMP[0]
    monkeypatch.setattr(jit, "STAMP", ((name, time + 1, size), *jit.STAMP[1:]))
    assert _key() != before


def test_the_stamp_has_every_file_of_the_runtime() -> None:
    """No file of the runtime is left out of the stamp."""
    assert {name for name, _, _ in jit.STAMP} >= {"panels.py", "search.py", "first_differences.py", "intervals.py"}


def test_an_inner_function_works_from_python() -> None:
    """A function meant for compiled callers can be called from Python, and gives what it gives uncompiled."""
    assert two_sum(1.0, 2.0**-60) == two_sum.py_func(1.0, 2.0**-60) == (1.0, 2.0**-60)
