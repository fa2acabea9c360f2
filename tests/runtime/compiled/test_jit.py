"""What the disk cache knows of, and what is compiled when."""

import io
import os
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled import jit
from gqm_sym.runtime.compiled.numba_internals import KeyedFiles


def _key() -> tuple[Any, ...]:
    codegen = SimpleNamespace(magic_tuple=lambda: ("a processor",))
    return jit.COMPILER.cache_of(two_sum.py_func)._index_key("a signature", codegen)


def test_an_edit_anywhere_in_the_runtime_compiles_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cache's key changes with any file of the runtime, though numba looks at one file only."""
    before = _key()
    assert before == _key()
    monkeypatch.setattr(jit, "STAMP", "0" * 64)
    assert _key() != before


RUNTIME = Path(jit.__file__).parents[1]
ONE_OF_EACH_ROOM = sorted(
    {file.parent: file.relative_to(RUNTIME).as_posix() for file in sorted(RUNTIME.rglob("*.py"))}.values()
)


@pytest.mark.parametrize("name", ["compiled/jit.py", *ONE_OF_EACH_ROOM])
def test_the_stamp_has_every_file_of_the_runtime(name: str, tmp_path: Path) -> None:
    """A changed character in a file of any room changes the stamp, though its time and size stay; a copy does not."""
    copy = shutil.copytree(RUNTIME, tmp_path / "runtime", ignore=shutil.ignore_patterns("__pycache__"))
    assert jit.stamp_of(copy) == jit.STAMP
    changed = copy / name
    status = changed.stat()
    changed.write_bytes(changed.read_bytes()[:-1] + b" ")
    os.utime(changed, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert changed.stat().st_size == status.st_size
    assert jit.stamp_of(copy) != jit.STAMP


def test_an_inner_function_works_from_python() -> None:
    """A function meant for compiled callers can be called from Python, and gives what it gives uncompiled."""
    assert two_sum(1.0, 2.0**-60) == two_sum.py_func(1.0, 2.0**-60) == (1.0, 2.0**-60)


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("stream", "said"), [(_Terminal, 1), (io.StringIO, 0)])
def test_compiling_the_runtime_is_announced_once(stream: Any, said: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """One line at a terminal, nothing in a log."""
    stderr = stream()
    monkeypatch.setattr("sys.stderr", stderr)
    jit.announce.cache_clear()
    for _ in range(3):
        jit.announce()
    assert stderr.getvalue().count("gqm_sym: compiling the runtime, once per installation\n") == said


def test_what_is_kept_is_found_again_by_its_key_alone(tmp_path: Path) -> None:
    """Under its key and stamp; a file that holds another key, or was made of another text, is not read."""
    files = KeyedFiles(str(tmp_path), "name", "stamp")
    assert files.load(("key", 1)) is None
    files.save(("key", 1), "code")
    assert files.load(("key", 1)) == "code"
    assert files.load(("key", 2)) is None
    (kept,) = tmp_path.iterdir()
    kept.rename(tmp_path / files.file_name(("key", 2)))
    assert files.load(("key", 2)) is None
    assert KeyedFiles(str(tmp_path), "name", "another").load(("key", 1)) is None
