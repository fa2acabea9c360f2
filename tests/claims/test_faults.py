"""Full disks, killed runs, damaged caches and old modules lead to correct output or to one clear error, and leave
nothing half done.
"""

import ctypes
import errno
import importlib.util
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
import pytest
from numba import types
from numba.core import event
from numba.core.caching import IndexDataCacheFile
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.building import load, write_module
from gqm_sym.errors import OutdatedModuleError
from gqm_sym.runtime.compiled import jit
from gqm_sym.runtime.compiled.numba_internals import KeyedCache
from gqm_sym.runtime.interface import INTERFACE

FILE = "name: bowl\ntitle: Größe λ\ncurve: {graph: {z: 6*x**2, parameter: x}}\nkernel: {gravity: {}}\n"
GENERATE = "import sys\nfrom gqm_sym.cli.gen import main\n"
PR_CAPBSET_DROP, CAP_DAC_OVERRIDE = 24, 1


def interruptible() -> None:
    """Accept Ctrl-C as from a terminal, also if the tests run as a background job, which begins by ignoring it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def python(
    code: str, *arguments: str | Path, before: Callable[[], None] = interruptible, **environment: str
) -> subprocess.CompletedProcess[bytes]:
    """Run Python code in a fresh process, after a call in that process."""
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        cwd=ROOT,
        env=os.environ | environment,
        capture_output=True,
        check=False,
        preexec_fn=before,
    )


# What the commands import takes a second or two, so the processes that are interrupted or killed begin with it.
FORKING = """
import json, os, sys, tempfile
import matplotlib.backends.backend_svg
import gqm_sym as gqm, gqm_sym.cli.gen, gqm_sym.cli.tool, gqm_sym.figures, gqm_sym.report, gqm_sym.specfile
gqm.emit(gqm.derive(gqm.Curve.graph("sin(x)"), gqm.Gravity()), name="first")
for line in sys.stdin:
    code, arguments, environment, out, err = json.loads(line)
    child = os.fork()
    if child == 0:
        os.environ.update(environment)
        tempfile.tempdir = None  # as it is in a fresh process, so that TMPDIR is read
        for path, number in ((out, 1), (err, 2)):
            os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
        sys.argv[1:] = arguments
        exec(code, {"__name__": "__main__"})
        sys.exit()
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""
Forked = Callable[..., subprocess.CompletedProcess[bytes]]


@pytest.fixture(scope="module")
def forked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Forked]:
    """Return a function that runs Python code in a process of its own, in which the commands are imported."""
    folder = tmp_path_factory.mktemp("printed")
    out, err = folder / "out", folder / "err"
    with subprocess.Popen(
        [sys.executable, "-c", FORKING],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=interruptible,
    ) as parent:
        assert parent.stdin is not None
        assert parent.stdout is not None
        requests, answers = parent.stdin, parent.stdout

        def run(code: str, *arguments: str | Path, **environment: str) -> subprocess.CompletedProcess[bytes]:
            request = [code, [*map(str, arguments)], environment, str(out), str(err)]
            print(json.dumps(request), file=requests, flush=True)
            status = int(answers.readline())
            return subprocess.CompletedProcess(code, status, out.read_bytes(), err.read_bytes())

        yield run


# Jobs in the background ignore Ctrl-C from their beginning.
UNINTERRUPTIBLE = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"


def unprivileged() -> None:
    """Give up root's right to write what is read-only; other users do not have it."""
    ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0)


def names_in(folder: Path) -> list[str]:
    """Return the names in a folder."""
    return sorted(entry.name for entry in folder.iterdir())


@pytest.fixture(scope="module")
def text() -> str:
    """Return the text of a small module."""
    return gqm.emit(gqm.derive(gqm.Curve.graph("6*x**2"), gqm.Gravity()), name="bowl")


@pytest.fixture
def yaml(tmp_path: Path) -> Path:
    """Write a small curve file, in a folder of its own."""
    path = tmp_path / "in" / "bowl.yaml"
    path.parent.mkdir()
    path.write_text(FILE, encoding="utf-8")
    return path


# The cache of compiled code


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a cache folder that nothing else uses."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def function(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Callable[[float], float]]:
    """Return an entry point that adds a number, from a source file that numba takes for the same, or with a given
    time.
    """
    monkeypatch.setattr(jit, "MAX_PYTHON_TIME", 0.0)

    def make(number: float, time: int = 1_000_000_000) -> Callable[[float], float]:
        path = tmp_path / "source.py"
        path.write_text(f"def add(x):\n    return x + {number:4.1f}\n", encoding="utf-8")
        os.utime(path, (time, time))
        spec = importlib.util.spec_from_file_location("source", path)
        module = importlib.util.module_from_spec(spec)
        sys.modules["source"] = module
        exec(compile(path.read_text(encoding="utf-8"), str(path), "exec"), module.__dict__)  # noqa: S102
        return jit.entry(types.float64(types.float64))(module.add)

    return make


def _damage(cache: Path, pattern: str, content: Callable[[bytes], bytes]) -> None:
    files = list(cache.rglob(pattern))
    assert files
    for path in files:
        path.write_bytes(content(path.read_bytes()))


@pytest.mark.parametrize(
    "content",
    [lambda _: b"", lambda data: data[: len(data) // 2], lambda data: data[:-1], lambda _: bytes(range(256)) * 9],
    ids=["empty", "half", "a byte short", "noise"],
)
def test_a_damaged_cache_is_made_anew(
    content: Callable[[bytes], bytes], cache: Path, function: Callable[[float], Any]
) -> None:
    """Files that were cut off or overwritten cost a compilation, and are complete afterwards."""
    assert function(2.0)(1.0) == 3.0
    _damage(cache, "*.nbc", content)
    assert function(2.0)(1.0) == 3.0
    with event.install_recorder("numba:compile") as compiled:
        assert function(2.0)(1.0) == 3.0
    assert not compiled.buffer


def test_a_cache_of_other_code_is_not_used(
    cache: Path, function: Callable[[float], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another runtime at the same place, with the same times and sizes, gets machine code of its own."""
    assert function(2.0)(1.0) == 3.0
    monkeypatch.setattr(jit, "stamp_for", lambda _: "another")
    assert function(5.0)(1.0) == 6.0


def test_killed_between_two_files_of_the_cache(
    cache: Path, function: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """An edit whose code was never stored is not answered by the machine code before it."""
    assert function(2.0)(1.0) == 3.0
    with monkeypatch.context() as patch:
        patch.setattr(IndexDataCacheFile, "_save_data", lambda *_: None)
        assert function(5.0, 1_100_000_000)(1.0) == 6.0
    assert function(5.0, 1_100_000_000)(1.0) == 6.0


def test_two_at_once_keep_their_own_code(
    cache: Path, function: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two versions that are stored at the same time are not mistaken for each other."""
    save, waiting = IndexDataCacheFile._save_data, ["once"]

    def save_later(self: Any, name: str, data: Any) -> None:
        if waiting:
            waiting.clear()
            for index in cache.rglob("*.nbi"):
                index.unlink()  # the same happens as if the other process had looked before it was written
            with monkeypatch.context() as patch:
                patch.setattr(jit, "stamp_for", lambda _: "another")
                assert function(5.0)(1.0) == 6.0
        save(self, name, data)

    monkeypatch.setattr(IndexDataCacheFile, "_save_data", save_later)
    assert function(2.0)(1.0) == 3.0
    monkeypatch.undo()
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(cache))
    monkeypatch.setattr(jit, "stamp_for", lambda _: "another")
    assert function(5.0)(1.0) == 6.0


def test_inner_functions_know_the_stamp_too() -> None:
    """Functions that compiled code calls are kept under the same key; otherwise an edit of their callees would not be
    seen.
    """
    from gqm_sym.runtime.arithmetic.doubledouble import two_sum

    assert isinstance(two_sum.dispatcher._cache, KeyedCache)


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EACCES])
def test_a_cache_that_cannot_be_written(
    number: int, cache: Path, function: Callable[[float], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A full disk, or a folder that became read-only, costs a compilation in every process, and nothing else."""

    def fail(*_: Any) -> Any:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(IndexDataCacheFile, "_open_for_write", fail)
    assert function(2.0)(1.0) == 3.0
    assert not list(cache.rglob("*.nb?"))


def test_no_folder_for_a_cache(monkeypatch: pytest.MonkeyPatch, function: Callable[[float], Any]) -> None:
    """If nothing can be written, everything works, but is compiled anew in every process."""
    monkeypatch.setattr(KeyedCache._impl_class, "_locator_classes", [])
    assert jit.COMPILER.cache_of(function(2.0)) is None
    assert function(2.0)(1.0) == 3.0


# Modules


def test_a_module_of_an_older_interface_is_named(text: str, tmp_path: Path) -> None:
    """The version is checked before names that the runtime no longer has; the message says which command to run."""
    path = tmp_path / "old.py"
    old = text.replace(f"interface={INTERFACE})", f"interface={INTERFACE - 1})")
    imports = "from gqm_sym.runtime.vocabulary import ("
    assert imports in old
    for gone in (old.replace(imports, f"{imports}GONE, "), old.replace("CompiledModel, ", "CompiledModel, GONE, ")):
        assert gone != old
        path.write_text(gone, encoding="utf-8")
        with pytest.raises(OutdatedModuleError, match=rf"old\.py: .*interface {INTERFACE - 1} .*run gqm-gen"):
            load(path, "old")
    path.write_text(old.replace("runtime.vocabulary", "runtime.gone"), encoding="utf-8")
    with pytest.raises(OutdatedModuleError, match="run gqm-gen"):
        load(path, "old")


WRITE_AND_COMPILE = """
import os, sys
from pathlib import Path
import numba
from gqm_sym.building import load, write_module
text, path = Path(sys.argv[1]).read_text(encoding="utf-8"), sys.argv[2]
numba.njit("f8(f8)")(lambda x: x)  # what numba does before it first compiles takes longer than the rest
children = []
for _ in range(4):
    children.append(os.fork())
    if children[-1] == 0:
        write_module(text, path)
        load(path, "small").effective_potential.compile()
        print("compiled")
        sys.exit()
sys.exit(sum(os.waitpid(child, 0)[1] for child in children))
"""
# The file is written as by gqm-gen, with one function instead of seven.
SMALL = f"""from numba import carray

from gqm_sym.runtime import compiler
from gqm_sym.runtime.vocabulary import EFFECTIVE_POTENTIAL

compiled = compiler(__file__, interface={INTERFACE})


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    out = carray(out, (2, n))
    for i in range(n):
        out[0, i] = out[1, i] = 1.0
"""


@pytest.mark.extended
def test_four_processes_at_once(tmp_path: Path) -> None:
    """Four processes write and compile the same module with one cache; each gets all of it, and no other files
    remain.
    """
    source, path = tmp_path / "text", tmp_path / "out" / "small.py"
    source.write_text(SMALL, encoding="utf-8")
    done = python(WRITE_AND_COMPILE, source, path, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    # What several processes write to one pipe may be mixed: a line may come before the end of another.
    assert (done.returncode, done.stdout.replace(b"\n", b"")) == (0, b"compiled" * 4), done.stderr
    assert names_in(path.parent) == ["small.py"]
    assert [entry.suffix for entry in (tmp_path / "cache").rglob("*") if entry.is_file()] == [".nbc"]
    assert path.read_text(encoding="utf-8") == SMALL


KILLED = """
import os, signal, sys
from gqm_sym.cli.gen import main
number = getattr(signal, sys.argv.pop(1))
os.fsync = lambda _: os.kill(os.getpid(), number)
sys.exit(main(["-q", *sys.argv[1:]]))
"""


def test_killed_while_writing(yaml: Path, text: str, forked: Forked) -> None:
    """If a run is killed while writing, the old module stays whole, and the next run writes the new one."""
    out = yaml.parent / "out"
    target = out / "bowl.py"
    write_module(text, target)
    assert forked(KILLED, "SIGKILL", "-o", out, yaml).returncode == -signal.SIGKILL
    assert target.read_text(encoding="utf-8") == text
    assert forked(GENERATE + "sys.exit(main(['-q', *sys.argv[1:]]))", "-o", out, yaml).returncode == 0
    assert "Größe λ" in target.read_text(encoding="utf-8")


def test_interrupted_while_writing(yaml: Path, forked: Forked) -> None:
    """After Ctrl-C a command ends with exit code 130 and one line, and leaves no file, whole or partial."""
    out = yaml.parent / "out"
    done = forked(KILLED, "SIGINT", "-o", out, yaml)
    assert (done.returncode, done.stdout, done.stderr) == (130, b"", b"gqm-gen: interrupted\n")
    assert names_in(out) == []


def test_an_interruption_that_is_ignored_stays_so(yaml: Path, forked: Forked) -> None:
    """A job in the background ignores Ctrl-C, which is meant for the one in the foreground, and ends its work."""
    out = yaml.parent / "out"
    done = forked(UNINTERRUPTIBLE + KILLED, "SIGINT", "-o", out, yaml)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")
    assert names_in(out) == ["bowl.py"]


INTERRUPTED = """
import itertools, os, signal, sys
import sympy
from gqm_sym.cli.gen import main
plain, calls = sympy.Expr.diff, itertools.count(1)
def interrupted(*arguments, **options):
    if next(calls) == 10:
        os.kill(os.getpid(), signal.SIGINT)
    return plain(*arguments, **options)
sympy.Expr.diff = interrupted
sys.exit(main(["-q", *sys.argv[1:]]))
"""


def test_interrupted_while_deriving(yaml: Path, forked: Forked) -> None:
    """Ctrl-C in the middle of a derivation also ends with exit code 130 and one line."""
    out = yaml.parent / "out"
    done = forked(INTERRUPTED, "-o", out, yaml)
    assert (done.returncode, done.stdout, done.stderr) == (130, b"", b"gqm-gen: interrupted\n")
    assert not out.exists()


RING = "name: ring\ncurve: {implicit: {F: x**2 + z**2 - 1, start: [0, -1]}}\nkernel: {gravity: {}}\n"
# A row has the function that is interrupted, and the command.
STAGES = {
    "a chart": ("gqm_sym.runtime.launch.formulas.Formulas.charted", ["solve", "ring.yaml"]),
    "a page": ("os.fsync", ["report", "ring.yaml"]),
    "a figure": ("os.fsync", ["plot", "ring.yaml", "ring.svg"]),
}
INTERRUPTED_AT = """
import os, pkgutil, signal, sys
from gqm_sym.cli.tool import main
place, folder = sys.argv.pop(1), sys.argv.pop(1)
home, _, name = place.rpartition(".")
home = pkgutil.resolve_name(home)
plain = getattr(home, name)
def interrupted(*arguments):
    os.kill(os.getpid(), signal.SIGINT)
    return plain(*arguments)
setattr(home, name, interrupted)
os.chdir(folder)
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.sample(2)
@pytest.mark.parametrize("stage", STAGES)
def test_interrupted_at_work(stage: str, tmp_path: Path, forked: Forked) -> None:
    """The same holds while a chart is made, and while a figure or a page is written; temporary files are gone."""
    (tmp_path / "ring.yaml").write_text(RING + "launch: {lam0: 0, v0: 1}\n", encoding="utf-8")
    place, arguments = STAGES[stage]
    done = forked(INTERRUPTED_AT, place, tmp_path, *arguments, TMPDIR=str(tmp_path))
    assert (done.returncode, done.stdout, done.stderr) == (130, b"", b"gqm: interrupted\n")
    assert names_in(tmp_path) == ["ring.yaml"]


@pytest.mark.extended
def test_a_folder_that_cannot_be_written(yaml: Path) -> None:
    """If a folder cannot be written, the error names it, and its contents stay."""
    out = yaml.parent / "out"
    out.mkdir()
    out.chmod(0o555)
    done = python(GENERATE + "sys.exit(main(['-q', *sys.argv[1:]]))", "-o", out, yaml, before=unprivileged)
    assert done.returncode == 2
    assert done.stderr.startswith(b"gqm-gen: ")
    assert str(out).encode() in done.stderr
    assert done.stderr.count(b"\n") == 1
    assert names_in(out) == []


@pytest.fixture(scope="module")
def generated(tmp_path_factory: pytest.TempPathFactory, forked: Forked) -> bytes:
    """Return what a process with the tests' own settings writes."""
    folder = tmp_path_factory.mktemp("plain")
    (folder / "bowl.yaml").write_text(FILE, encoding="utf-8")
    command = GENERATE + "sys.exit(main(sys.argv[1:]))"
    assert forked(command, "-o", folder, folder / "bowl.yaml").returncode == 0
    return (folder / "bowl.py").read_bytes()


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "environment",
    [
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "latin-1"},
        {
            **{"LC_ALL": "tr_TR.UTF-8", "LANG": "tr_TR.UTF-8", "TZ": "Pacific/Kiritimati"},
            **{"PYTHONOPTIMIZE": "2", "PYTHONWARNINGS": "error"},
        },
    ],
    ids=["C", "Latin-1", "Turkish, optimised, with warnings as errors"],
)
def test_no_setting_changes_the_text(environment: dict[str, str], yaml: Path, generated: bytes) -> None:
    """The file's bytes do not depend on locale, encoding, time zone or Python's flags; printing never fails."""
    out = yaml.parent / "out"
    done = python(GENERATE + "sys.exit(main(sys.argv[1:]))", "-o", out, yaml, **environment)
    assert (done.returncode, done.stderr) == (0, b"")
    assert (out / "bowl.py").read_bytes() == generated
