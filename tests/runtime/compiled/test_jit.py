"""The disk cache has the right contents, and functions are compiled at the right times."""

import ast
import math
import os
import shutil
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numba import types

from gqm_sym.runtime import vocabulary
from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.arithmetic.elementary import reduced
from gqm_sym.runtime.compiled import jit, threads, uncompiled
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.numba_internals import KeyedFiles
from gqm_sym.runtime.compiled.stamps import CALLED_BY_MODULES, Stamps
from gqm_sym.runtime.compiled.trial import TooSlowError, Trial
from gqm_sym.runtime.compiled.uncompiled import NotPlainError, PlainEntry
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


@pytest.mark.sample(5)
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
    """Return the files of the runtime that a file imports anywhere, by Python's own parser."""
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
    """The stamp of each module depends on every module that it imports, directly or through others, and changes with
    them.
    """
    reached = {name: _imported(name) | {name} for name in MODULES}
    before: dict[str, set[str]] = {}
    while before != reached:
        before = reached
        reached = {name: set().union(*(before[each] for each in found)) for name, found in before.items()}
    copy = shutil.copytree(RUNTIME, tmp_path / "runtime", ignore=shutil.ignore_patterns("__pycache__"))
    stamps = Stamps(copy)
    assert [name for name in MODULES if not stamps.files((name,)) >= reached[name]] == []
    unedited = {name: stamps.of(f"gqm_sym.runtime.{name}") for name in MODULES}
    for edited in MODULES[::100]:
        file = copy.joinpath(*edited.split(".")).with_suffix(".py")
        text = file.read_bytes()
        file.write_bytes(text + b"#")
        after = Stamps(copy)
        changed = {name for name in MODULES if after.of(f"gqm_sym.runtime.{name}") != unedited[name]}
        file.write_bytes(text)
        assert changed >= {name for name in MODULES if edited in reached[name]}
    assert Stamps(copy).of("gqm_sym.runtime.arithmetic.doubledouble") == unedited["arithmetic.doubledouble"]


def test_code_of_generated_modules_is_made_of_what_they_import() -> None:
    """Every function that a generated module can call stands in a file that the stamp of its code knows."""
    homes = {home for name, home in HOMES.items() if isinstance(getattr(vocabulary, name), jit.Inner)}
    assert homes
    assert all(any(f"{home}.".startswith(f"{begin}.") for begin in CALLED_BY_MODULES) for home in homes)


def test_an_inner_function_works_from_python() -> None:
    """A function meant for compiled callers can be called from Python, and gives what it gives uncompiled."""
    assert two_sum(1.0, 2.0**-60) == two_sum.py_func(1.0, 2.0**-60) == (1.0, 2.0**-60)


def test_an_inner_function_takes_other_types_than_before() -> None:
    """A number with a fraction keeps it after a call with an integer (it was cut off)."""
    twice = jit.Inner(lambda x: x + x)
    assert (twice(1), twice(0.75), twice(1)) == (2, 1.5, 2)


@pytest.mark.parametrize(("seconds", "said"), [(0.02, 1), (1e9, 0)])
def test_long_compilation_is_announced(seconds: float, said: int, capsys: pytest.CaptureFixture[str]) -> None:
    """A long compilation is announced once for an entry point and all that it calls, and only if it takes long."""
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
    """Code is found by its key and stamp; a file with another key, or made from another text, is not read."""
    files = KeyedFiles(str(tmp_path), "name", "stamp")
    assert files.load(("key", 1)) is None
    files.save(("key", 1), "code")
    assert files.load(("key", 1)) == "code"
    assert files.load(("key", 2)) is None
    (kept,) = tmp_path.iterdir()
    kept.rename(tmp_path / files.file_name(("key", 2)))
    assert files.load(("key", 2)) is None
    assert KeyedFiles(str(tmp_path), "name", "another").load(("key", 1)) is None


@jit.Inner
def cubed(x):  # type: ignore[no-untyped-def]
    """Return a function with a power, which Python would round otherwise."""
    return x**3


def _entry(monkeypatch: pytest.MonkeyPatch, function: Callable[..., Any], signature: Any) -> tuple[Any, list[str]]:
    """Return an entry point that is not in the cache, and the list of what is compiled."""
    compiled = []

    def compile_it(function: Any, *_: Any, **__: Any) -> Any:
        compiled.append(function.__name__)
        return lambda *_: "compiled"

    monkeypatch.setattr(jit.COMPILER, "record", lambda *_: Path(os.devnull))
    monkeypatch.setattr(jit.COMPILER, "entry", compile_it)
    return jit.entry(signature)(function), compiled


def test_python_runs_an_entry_point_at_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python takes the arguments as compiled code would, divides by zero, and returns its own numbers."""

    def run(pair, values, n):  # type: ignore[no-untyped-def]
        values[0] = cubed(pair[0]) / pair[1]
        return pair[0] / values[n - 1], np.empty(n).size

    kinds = (types.UniTuple(types.float64, 2), types.float64[::1], types.int64)
    call, compiled = _entry(monkeypatch, run, types.void(*kinds))
    values = np.zeros(2)
    assert call((0.1, 3), values, 2) == (math.inf, 2)
    assert values[0] == 0.1 * (0.1 * 0.1) / 3.0
    assert type(call((0.1, 3), values, 2)[0]) is float
    assert compiled == []


@pytest.mark.parametrize("seconds", [1e9, 0.0])
def test_an_entry_point_is_compiled_where_python_takes_long_or_raises(
    seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Anything that Python has written before compilation starts is undone."""

    def run(values, n):  # type: ignore[no-untyped-def]
        values[0] = fma(2.0, 3.0, 1.0)
        return 1 // n

    monkeypatch.setattr(jit, "MAX_PYTHON_TIME", seconds)
    call, compiled = _entry(monkeypatch, run, types.int64(types.float64[::1], types.int64))
    values = np.zeros(2)
    assert call(values, 0) == "compiled"
    assert (compiled, values[0]) == (["run"], 0.0)


def test_python_stops_when_its_time_has_run_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python stops in the middle of a loop when its time has run out."""
    monkeypatch.setattr(uncompiled, "MAX_CALL", 0.05)

    def run(x):  # type: ignore[no-untyped-def]
        while True:
            x = reduced(x)[1]

    with pytest.raises(NotPlainError):
        PlainEntry(run, (types.float64,), Trial(1.0))((1.0,))


def norm(x):  # type: ignore[no-untyped-def]
    """Return a norm, which NumPy rounds in another way than compiled code."""
    return np.linalg.norm(x)


def root(x):  # type: ignore[no-untyped-def]
    """Return a power for which the compiler may take a square root."""
    return x**0.5


def exponential(x):  # type: ignore[no-untyped-def]
    """Return an exponential for whose power the compiler may take another function."""
    return 2.0**x


def hashed(x):  # type: ignore[no-untyped-def]
    """Return a hash, for which compiled code has its own function."""
    return hash(x)


@pytest.mark.parametrize("run", [norm, root, exponential, hashed])
def test_what_cannot_be_run_to_the_same_bits_is_compiled(run: Callable[..., Any]) -> None:
    """It is compiled whether the difference is found when the function is read or when it is run."""
    with pytest.raises(NotPlainError):
        PlainEntry(run, (types.float64,), Trial(1e9))((1.0,))


def test_threads_keep_what_they_write_into_one_array(monkeypatch: pytest.MonkeyPatch) -> None:
    """If a thread gives Python up and restores the array, what another thread has written meanwhile stays."""
    begun, written = threading.Event(), threading.Event()

    def fill(out, begin, end):  # type: ignore[no-untyped-def]
        out[begin:end] = begin + 1.0
        for _ in range(300 * begin):
            fma(1.0, 1.0, 1.0)

    def give_up() -> None:
        begun.set()
        written.wait()
        raise TooSlowError

    def compiled(function: Any, *_: Any, **__: Any) -> Any:
        return lambda out, begin, end: out.__setitem__(slice(begin, end), begin + 1.0)

    def work(part: slice) -> None:
        if not part.start:
            begun.wait()
        call(out, part.start, part.stop)
        (begun if part.start else written).set()

    monkeypatch.setattr(threads, "cores", lambda: 2)
    monkeypatch.setattr(uncompiled, "go_on", give_up)
    call, _ = _entry(monkeypatch, fill, types.void(types.float64[::1], types.int64, types.int64))
    monkeypatch.setattr(jit.COMPILER, "entry", compiled)
    out = np.zeros(4)
    threads.run_in_threads(work, out.size, 1)
    assert out.tolist() == [1.0, 1.0, 3.0, 3.0]


def test_threads_compile_an_entry_point_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """One thread compiles an entry point, and those that need it meanwhile wait for it."""
    compiled = []

    def compile_slowly(function: Any, *_: Any, **__: Any) -> Any:
        compiled.append(function.__name__)
        all_ask.wait()
        return lambda *_: None

    def work(part: slice) -> None:
        if len(asked) == 2:
            all_ask.set()
        asked.append(part)
        call(1.0)

    asked: list[slice] = []
    all_ask = threading.Event()
    monkeypatch.setattr(threads, "cores", lambda: 3)
    call, _ = _entry(monkeypatch, cubed.py_func, types.float64(types.float64))
    monkeypatch.setattr(jit.COMPILER, "entry", compile_slowly)
    threads.run_in_threads(work, 3, 1)
    assert compiled == ["cubed"]


def test_threads_that_ask_for_threads_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """The caller takes over the parts that no thread has begun, so that parts which have parts of their own end."""
    monkeypatch.setattr(threads, "cores", lambda: 2)
    out = np.zeros((8, 8))

    def work(rows: slice) -> None:
        def row(columns: slice) -> None:
            out[rows, columns] += 1.0

        threads.run_in_threads(row, 8, 1)

    threads.run_in_threads(work, 8, 1)
    assert (out == 1.0).all()


@pytest.mark.parametrize("bad", [0, 1])
def test_what_a_thread_raises_is_raised_when_all_have_ended(bad: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is raised whether it was the caller's part or another one that failed, and no part runs on."""
    monkeypatch.setattr(threads, "cores", lambda: 2)
    begun, ended = threading.Event(), []

    def work(part: slice) -> None:
        if part.start == bad:
            begun.wait()
            raise ZeroDivisionError
        begun.set()
        ended.append(part)

    with pytest.raises(ZeroDivisionError):
        threads.run_in_threads(work, 2, 1)
    assert len(ended) == 1


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forked processes exist on POSIX systems only")
def test_a_forked_process_starts_threads_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """The threads of the parent do not exist in a forked process."""
    monkeypatch.setattr(threads, "cores", lambda: 2)
    threads.run_in_threads(lambda part: None, 2, 1)
    met = threading.Barrier(2)
    if not (child := os.fork()):
        try:
            threads.run_in_threads(lambda part: met.wait(20.0), 2, 1)  # both parts must run at once
        except BaseException:
            os._exit(1)
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
