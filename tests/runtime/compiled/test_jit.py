"""What the disk cache knows of, and what is compiled when."""

import ast
import os
import shutil
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gqm_sym.runtime import vocabulary
from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled import jit
from gqm_sym.runtime.compiled.numba_internals import KeyedFiles
from gqm_sym.runtime.compiled.stamps import CALLED_BY_MODULES, Stamps
from gqm_sym.runtime.vocabulary import HOMES


def _key() -> tuple[Any, ...]:
    codegen = SimpleNamespace(magic_tuple=lambda: ("a processor",))
    return jit.COMPILER.cache_of(two_sum.py_func)._index_key("a signature", codegen)


def test_the_key_of_the_cache_has_the_stamp(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cache's key has the digest of all files that code may come from, though numba looks at one file only."""
    before = _key()
    assert before == _key()
    monkeypatch.setattr(jit, "stamp_for", lambda _: "0" * 64)
    assert _key() != before


RUNTIME = Path(jit.__file__).parents[1]
ONE_OF_EACH_ROOM = sorted(
    {file.parent: file.relative_to(RUNTIME).as_posix() for file in sorted(RUNTIME.rglob("*.py"))}.values()
)


@pytest.mark.parametrize("name", ["compiled/jit.py", *ONE_OF_EACH_ROOM])
def test_the_stamp_has_every_file_of_the_runtime(name: str, tmp_path: Path) -> None:
    """A changed character in a file of any room changes the stamp, though its time and size stay; a copy does not."""
    copy = shutil.copytree(RUNTIME, tmp_path / "runtime", ignore=shutil.ignore_patterns("__pycache__"))
    assert Stamps(copy).of_all == jit.STAMP
    changed = copy / name
    status = changed.stat()
    changed.write_bytes(changed.read_bytes()[:-1] + b" ")
    os.utime(changed, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert changed.stat().st_size == status.st_size
    assert Stamps(copy).of_all != jit.STAMP


def _imported(name: str) -> set[str]:
    """The files of the runtime that a file imports anywhere, by Python's own parser."""
    path = RUNTIME.joinpath(*name.split("."))
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.with_suffix(".py").read_text(encoding="utf-8"))):
        if not isinstance(node, ast.Import | ast.ImportFrom):
            continue
        names = [alias.name for alias in node.names]
        begin = getattr(node, "module", None)
        whole = [begin, *(f"{begin}.{each}" for each in names)] if begin else names
        found |= {each.removeprefix("gqm_sym.runtime.") for each in whole if each.startswith("gqm_sym.runtime.")}
    return {each for each in found if RUNTIME.joinpath(*each.split(".")).with_suffix(".py").is_file()}


MODULES = sorted(
    ".".join(file.relative_to(RUNTIME).with_suffix("").parts) for file in RUNTIME.rglob("*.py") if file.stem[0] != "_"
)


def test_code_is_compiled_anew_after_an_edit_of_what_it_may_come_from(tmp_path: Path) -> None:
    """The stamp of each module changes with an edit of every module that it imports, directly or through others."""
    reached = {name: _imported(name) | {name} for name in MODULES}
    for _ in MODULES:
        reached = {name: set().union(found, *(reached[each] for each in found)) for name, found in reached.items()}
    copy = shutil.copytree(RUNTIME, tmp_path / "runtime", ignore=shutil.ignore_patterns("__pycache__"))
    before = {name: Stamps(copy).of(f"gqm_sym.runtime.{name}") for name in MODULES}
    for edited in MODULES:
        file = copy.joinpath(*edited.split(".")).with_suffix(".py")
        text = file.read_bytes()
        file.write_bytes(text + b"#")
        after = Stamps(copy)
        changed = {name for name in MODULES if after.of(f"gqm_sym.runtime.{name}") != before[name]}
        file.write_bytes(text)
        assert changed >= {name for name in MODULES if edited in reached[name]}
    assert Stamps(copy).of("gqm_sym.runtime.arithmetic.doubledouble") == before["arithmetic.doubledouble"]


def test_code_of_generated_modules_is_made_of_what_they_import() -> None:
    """Every function that a generated module can call stands in a file that the stamp of its code knows."""
    homes = {home for name, home in HOMES.items() if isinstance(getattr(vocabulary, name), jit.Inner)}
    assert homes
    assert all(any(f"{home}.".startswith(f"{begin}.") for begin in CALLED_BY_MODULES) for home in homes)


def test_an_inner_function_works_from_python() -> None:
    """A function meant for compiled callers can be called from Python, and gives what it gives uncompiled."""
    assert two_sum(1.0, 2.0**-60) == two_sum.py_func(1.0, 2.0**-60) == (1.0, 2.0**-60)


@pytest.mark.parametrize(("seconds", "said"), [(0.02, 1), (1e9, 0)])
def test_long_compilation_is_announced(seconds: float, said: int, capsys: pytest.CaptureFixture[str]) -> None:
    """Once for an entry point and all that it calls, while it is compiled, and only where it takes long."""
    announcer = jit.Announcer(seconds)
    announcer.begin(jit.Announcer.begin)
    announcer.begin(jit.Announcer.end)
    started = time.process_time()
    while time.process_time() - started < 0.3:
        pass
    announcer.end()
    announcer.end()
    assert capsys.readouterr().err.count("gqm_sym: compiling for this machine, once: compiled.jit\n") == said


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
