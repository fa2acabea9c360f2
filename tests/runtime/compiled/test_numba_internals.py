"""If names that numba does not document disappear, the results have the same digits by its documented ways."""

import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from paths import ROOT

# These are all private names that `numba_internals` uses: those that it imports, and attributes of these.
IMPORTED = ("FunctionCache", "IndexDataCacheFile", "ccallback", "Environment", "lookup_environment", "rtsys")
ATTRIBUTES = (
    *("_load_overload", "_index_key", "_save_data", "CFunc", "_memo", "initialize", "entry_point", "_cache"),
    *("get_call_type", "get_impl_key"),
)
LIBRARIES = (
    *("JITCodeLibrary", "JITCPUCodegen", "Compiler", "get_call_template", "_optimize_functions"),
    *("_optimize_final_module", "_finalize_final_module", "_finalize_specific", "_finalize_dynamic_globals"),
    *("_library_class", "_function_pass_manager", "_pass_builder", "define_pipelines", "compile_extra"),
)
ALL = (*IMPORTED, *ATTRIBUTES, *LIBRARIES)

# One name of each feature is missing alone; other names, which the same features need, in pairs of two features.
ALONE = ("FunctionCache", "ccallback", "Environment", "rtsys", "entry_point", "_cache", "get_call_type")
PAIRS = (
    *(("IndexDataCacheFile", "CFunc"), ("_load_overload", "lookup_environment")),
    *(("_index_key", "_memo"), ("_save_data", "initialize")),
)

# numba takes longer to get ready than to compile the functions. It gets ready once, in a process that forks for each
# line it reads: the file that the answers are written to, the cache folder, and the arguments of the program.
READY = """
import os, sys, traceback
import numba

numba.njit(lambda x: x + 1.0)(1.0)
program = compile(sys.argv[1], "program", "exec")
for line in sys.stdin:
    answers, numba.config.CACHE_DIR, *sys.argv[1:] = line.rstrip().split("\\t")
    if not (child := os.fork()):
        sys.stdout = sys.stderr = open(answers, "w")
        try:
            exec(program, {})
        except BaseException:
            traceback.print_exc()
        sys.stdout.flush()
        os._exit(0)
    os.waitpid(child, 0)
    print("done", flush=True)
"""

# While `numba_internals` is imported, the modules from which it imports lack the names, and there are no such
# attributes.
PROGRAM = """
import builtins, sys
from numba.core import caching, ccallback, codegen, compiler, environment, runtime

folder, *hidden = sys.argv[1:]
real, gone = hasattr, []
for module in (caching, codegen, compiler, environment, runtime, sys.modules["numba.core"]):
    gone += [(module, name, vars(module).pop(name)) for name in hidden if name in vars(module)]
if "ccallback" in hidden:
    sys.modules["numba.core.ccallback"] = None
builtins.hasattr = lambda owner, name: name not in hidden and real(owner, name)
from gqm_sym.runtime.compiled import numba_internals
numba_internals.hasattr, builtins.hasattr = builtins.hasattr, real
sys.modules["numba.core.ccallback"] = ccallback
for module, name, value in gone:
    setattr(module, name, value)

sys.path.insert(0, folder)
from gqm_sym.runtime.compiled import jit
jit.MAX_PYTHON_TIME = 0.0
import functions
print(functions.total(2.0, functions.np.arange(5.0)).hex(), functions.unchecked(3.0).hex())
functions.square.compile()
print(functions.run(functions.square.address, 1.7).hex())
"""

FUNCTIONS = """
import numpy as np
from numba import carray, types
from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled import emitted, jit
from gqm_sym.runtime.compiled.calls import call_static_balance
from gqm_sym.runtime.interface import INTERFACE

compiled = emitted.compiler(__file__, interface=INTERFACE)
POINTER = types.CPointer(types.float64)


@jit.entry(types.float64(types.float64, types.float64[::1]))
def total(x, values):
    high, low = two_sum(x, 2.0**-60)
    copy = np.empty(values.size)
    for k in range(values.size):
        copy[k] = np.sin(values[k]) * high + low
    return copy[0] + copy[copy.size - 1]


@jit.entry(types.float64(types.float64), checked=False)
def unchecked(x):
    return x / 0.7


@compiled(types.void(types.uintp, POINTER, POINTER, POINTER))
def square(n, lam, p, out):
    lam, out = carray(lam, n), carray(out, (2, n))
    for i in range(n):
        out[0, i], out[1, i] = lam[i] ** 2 / 3.0, p[0]


@jit.entry(types.float64(types.int64, types.float64))
def run(address, x):
    lam, p, out = np.empty(1), np.empty(1), np.empty((2, 1))
    lam[0], p[0] = x, 0.25
    call_static_balance(address, 1, lam, p, out)
    return out[0, 0] + out[1, 0]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the functions that every process compiles."""
    path = tmp_path_factory.mktemp("functions")
    (path / "functions.py").write_text(FUNCTIONS, encoding="utf-8")
    return path


@contextmanager
def _ready(folder: Path) -> Iterator[Callable[..., str]]:
    """Yield a function that gives the answers of a process with a cache folder and without some names."""
    with subprocess.Popen(
        [sys.executable, "-c", READY, PROGRAM],
        cwd=ROOT,
        env={"PYTHONPATH": str(ROOT)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as ready:

        def answers(cache: Path, *hidden: str) -> str:
            file = cache / "answers"
            ready.stdin.write("\t".join(map(str, (file, cache, folder, *hidden))) + "\n")
            ready.stdin.flush()
            assert ready.stdout.readline() == "done\n"
            return file.read_text(encoding="utf-8")

        yield answers


@pytest.fixture(scope="module")
def compiled_answers(folder: Path) -> Iterator[Callable[..., str]]:
    """Return the answers of processes that compile."""
    with _ready(folder) as answers:
        yield answers


@pytest.fixture(scope="module")
def stored_answers(folder: Path) -> Iterator[Callable[..., str]]:
    """Return the answers of processes whose libraries lie at other addresses in memory than where code was compiled."""
    with _ready(folder) as answers:
        yield answers


@pytest.fixture(scope="module")
def truth(compiled_answers: Callable[..., str], tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the answers with all of numba's names."""
    found = compiled_answers(tmp_path_factory.mktemp("cache"))
    assert re.fullmatch(r"-?0x\S+ 0x\S+\n0x\S+\n", found), found
    return found


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "hidden", [ALL, *((name,) for name in ALONE), *PAIRS, LIBRARIES[:3], LIBRARIES[3:]], ids=" ".join
)
def test_without_a_private_name_the_digits_are_the_same(
    hidden: tuple[str, ...],
    truth: str,
    compiled_answers: Callable[..., str],
    stored_answers: Callable[..., str],
    tmp_path: Path,
) -> None:
    """A process that lacks a name gives the same digits, when it compiles and from the cache."""
    assert compiled_answers(tmp_path, *hidden) == truth
    stored = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")}
    assert len(stored) >= 4
    assert stored_answers(tmp_path, *hidden) == truth
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")} == stored


def test_no_other_file_uses_private_names() -> None:
    """Modules of numba that its manual does not name are imported in one file only; `extending` and `cgutils` are in
    the manual.
    """
    private = re.compile(r"\s*(from|import) numba\.(?!extending|core import cgutils|core\.cgutils)")
    files = (ROOT / "gqm_sym").rglob("*.py")
    assert {
        path.name for path in files for line in path.read_text(encoding="utf-8").splitlines() if private.match(line)
    } == {"numba_internals.py"}


COUNTED = """
import sys
sys.path.insert(0, sys.argv[1])
import functions
print(functions.repeated(2.0).hex(), functions.helper(1.0, 3).hex())
print(sorted(str(signature) for signature in functions.helper.dispatcher.overloads))
print({type(each.library).__name__ for each in functions.helper.dispatcher.overloads.values()})
"""

REPEATED = """
from numba import types
from gqm_sym.runtime.compiled import jit

jit.MAX_PYTHON_TIME = 0.0


@jit.Inner
def helper(x, power, plain=True):
    return x**power if plain else -x


@jit.entry(types.float64(types.float64))
def repeated(x):
    return helper(x, 1) + helper(x, 2) * helper(x, 3, True) - helper(x, 4, False)
"""


@pytest.mark.extended
def test_a_function_for_compiled_callers_is_compiled_once_and_only_linked(tmp_path: Path) -> None:
    """A function is compiled once, whatever integers its callers pass; Python can call it, and callers are read from
    the cache without it.
    """
    (tmp_path / "functions.py").write_text(REPEATED, encoding="utf-8")
    numbers = f"{(36.0).hex()} {(1.0).hex()}"
    versions = "['(float64, int64, bool)', '(float64, int64, omitted(default=True))']"
    for expected in ([numbers, versions, "{'LinkedLibrary'}"], [numbers, "[]", "set()"]):
        answer = subprocess.run(
            [sys.executable, "-c", COUNTED, str(tmp_path)],
            cwd=ROOT,
            env={"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=True,
        )
        assert answer.stdout.splitlines() == expected


CALLED_BY_USERS = """
import numba
import numpy as np
from numba import types
from gqm_sym.runtime.compiled import jit

jit.MAX_PYTHON_TIME = 0.0


@jit.Inner
def powers(x, spare, values):
    for k in range(values.size):
LINES
    return values.sum()


@jit.entry(types.float64(types.float64[::1], types.float64[::1]))
def ours(spare, values):
    return powers(2.0, spare, values) + powers(1.0, spare, values[:3])


@numba.njit
def theirs(spare, values):
    return powers(2.0, spare, values) + powers(1.0, spare, values[:3])


spare, values = np.zeros(3), np.ones(5)
print(ours(spare, values.copy()) == theirs(spare, values.copy()) == 5 * 2.0**60 + 3 * 2.0**60)
"""


@pytest.mark.extended
def test_a_function_of_a_user_may_call_what_only_compiled_callers_call(tmp_path: Path) -> None:
    """A user's function may call one that is not inlined and takes other arguments in the machine code of an entry
    point.
    """
    lines = "\n".join("        values[k] *= x if spare.size == 3 else np.sin(values[k])" for _ in range(60))
    program = CALLED_BY_USERS.replace("LINES", lines)
    (tmp_path / "functions.py").write_text(program, encoding="utf-8")
    answer = subprocess.run(
        [sys.executable, "functions.py"],
        cwd=tmp_path,
        env={"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (answer.returncode, answer.stdout) == (0, "True\n")
