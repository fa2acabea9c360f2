"""Functions of generated modules are run by Python at first, compiled once, and found again by their text."""

import math
from collections.abc import Callable
from ctypes import CFUNCTYPE, c_double, c_ssize_t, c_void_p, cast
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from numba import types
from paths import ROOT

from gqm_sym.loading import load
from gqm_sym.runtime.compiled import emitted, jit, trial
from gqm_sym.runtime.compiled.trial import begin_launch
from gqm_sym.runtime.interface import INTERFACE

# The launches in which Python may run a function; the suite as a whole allows more.
MAX_LAUNCHES = 2

MODULE = f"""from math import pi

from numba import carray

from gqm_sym.runtime import compiler
from gqm_sym.runtime.vocabulary import EFFECTIVE_POTENTIAL, sin

compiled = compiler(__file__, interface={INTERFACE})

FACTOR = 2.0


def plain(x):
    return 3.0*x


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    places, out = carray(places, n), carray(out, (2, n))
    for i in range(n):
        out[0, i] = sin(places[i])

        out[1, i] = TERM


LAST = 1
"""


def _compilations(text: str, file: Path, cache: Path) -> int:
    """Return how often the function of a module is compiled, and written to the cache, when the module is imported."""
    file.parent.mkdir(exist_ok=True)
    file.write_text(text, encoding="utf-8")
    before = len(list(cache.rglob("effective_potential.*.nbc")))
    load(file, file.stem).effective_potential.compile()
    return len(list(cache.rglob("effective_potential.*.nbc"))) - before


@pytest.mark.parametrize("keep", [True, False])
def test_equal_functions_of_modules_are_compiled_once(
    keep: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Equal functions are compiled once, whatever else their modules contain, in any folder, and also if none is in
    use; pi and attributes of arrays are nothing of the module.
    """
    cache = tmp_path / "cache"
    monkeypatch.setattr("numba.config.CACHE_DIR", str(cache))
    text = MODULE.replace("TERM", f"{41.0 + keep}*pi*places.size")
    assert _compilations(text, tmp_path / "a" / "one.py", cache) == 1
    others = [f'"""A title."""\n{text}', text.replace("LAST = 1", "LAST = 2"), text.replace("FACTOR = 2.0", "")]
    for k, other in enumerate(others):
        if not keep:
            monkeypatch.setattr(emitted, "_IN_USE", {})
        assert other != text
        assert _compilations(other, tmp_path / "b" / f"module_{k}.py", cache) == 0
    assert _compilations(text.replace("sin(", "2.0*sin("), tmp_path / "b" / "changed.py", cache) == 1


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("term", "before", "after"), [("FACTOR", "FACTOR = 2.0", "FACTOR = 4.0"), ("plain(1.0)", "3.0*x", "5.0*x")]
)
def test_what_a_function_uses_of_its_module_is_noticed(
    term: str, before: str, after: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A module written by hand may have constants of its own, which are compiled into its functions."""
    cache = tmp_path / "cache"
    monkeypatch.setattr("numba.config.CACHE_DIR", str(cache))
    text = MODULE.replace("TERM", term).replace("def plain", "from numba import njit\n\n\n@njit\ndef plain")
    assert _compilations(text, tmp_path / "one.py", cache) == 1
    assert _compilations(text, tmp_path / "one.py", cache) == 0
    assert _compilations(text.replace(before, after), tmp_path / "one.py", cache) == 1


class _Compiler:
    """A substitute for the compiler, which notes what is compiled and has nothing in its cache."""

    def __init__(self, launches: Path) -> None:
        self.compiled: list[str] = []
        self.launches = launches

    def record(self, *_: Any) -> Path:
        return self.launches

    @staticmethod
    def entry(function: Any, *_: Any, **__: Any) -> Any:
        return function

    def callback(self, function: Any, signature: Any) -> Any:
        self.compiled.append(function.__name__)
        numbers = signature.args.count(types.CPointer(types.float64))
        call = CFUNCTYPE(None, c_ssize_t, *(c_void_p,) * numbers)(self.fill)
        return SimpleNamespace(address=cast(call, c_void_p).value, keep=call)

    @staticmethod
    def fill(n: int, *addresses: int) -> None:
        (c_double * (2 * n)).from_address(addresses[-1])[:] = [7.0] * (2 * n)


@pytest.fixture
def compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> _Compiler:
    """Return a compiler whose functions give 7, and which no time in Python calls, however slow the machine is."""
    compiler = _Compiler(tmp_path / "launches")
    monkeypatch.setattr(emitted, "MAX_PYTHON_TIME", math.inf)
    monkeypatch.setattr(trial, "MAX_LAUNCHES", MAX_LAUNCHES)
    monkeypatch.setattr(jit, "COMPILER", compiler)
    monkeypatch.setattr(emitted, "_IN_USE", {})
    return compiler


def _potential(tmp_path: Path, term: str) -> tuple[Any, Callable[[], list[float]]]:
    """Return the function of a module, and a function that calls it as compiled code does, by its address."""
    file = tmp_path / "one.py"
    file.write_text(MODULE.replace("TERM", term), encoding="utf-8")
    function = load(file, file.stem).effective_potential
    address = function.address

    def call() -> list[float]:
        places, out = (c_double * 2)(0.5, 1.5), (c_double * 4)()
        at = c_void_p.from_address(address).value
        assert at
        CFUNCTYPE(None, c_ssize_t, c_void_p, c_void_p, c_void_p)(at)(2, places, places, out)
        return list(out)

    return function, call


def test_python_runs_a_function_until_it_is_worth_compiling(tmp_path: Path, compiler: _Compiler) -> None:
    """After a function is compiled, its address leads to the compiled one."""
    function, call = _potential(tmp_path, "3.0")
    assert call() == pytest.approx([math.sin(0.5), math.sin(1.5), 3.0, 3.0], rel=3e-16, abs=0.0)
    assert compiler.compiled == []
    function.compile()
    function.compile()
    assert compiler.compiled == ["effective_potential"]
    assert call() == [7.0] * 4


def test_a_function_is_compiled_when_python_has_taken_long(
    tmp_path: Path, compiler: _Compiler, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A function is compiled when Python has taken long, here in the second call."""
    monkeypatch.setattr(emitted, "MAX_PYTHON_TIME", 1e-9)
    _, call = _potential(tmp_path, "3.0")
    assert call()[2:] == [3.0, 3.0]
    assert compiler.compiled == []
    assert call() == [7.0] * 4


def test_a_call_that_takes_long_is_given_up(
    tmp_path: Path, compiler: _Compiler, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python gives a call for many places up, and the compiled function fills all of them."""
    monkeypatch.setattr(emitted, "MAX_PYTHON_TIME", 10.0)
    monkeypatch.setattr(emitted, "MAX_EXCESS", -11.0)
    function, call = _potential(tmp_path, "3.0")
    monkeypatch.setattr(function, "_plain", lambda *_: trial.go_on())
    assert call() == [7.0] * 4
    assert compiler.compiled == ["effective_potential"]


def test_a_function_is_compiled_in_the_third_launch_that_uses_it(tmp_path: Path, compiler: _Compiler) -> None:
    """A function is compiled in the third launch that uses it, however short the launches are."""
    _, call = _potential(tmp_path, "3.0")
    for _ in range(MAX_LAUNCHES):
        begin_launch()
        assert call() == call()
        assert compiler.compiled == []
    begin_launch()
    assert call() == [7.0] * 4


def test_launches_of_other_processes_count(
    tmp_path: Path, compiler: _Compiler, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A script that launches one body compiles what it uses when it runs for the third time."""
    for _ in range(MAX_LAUNCHES):
        _, call = _potential(tmp_path, "3.0")
        assert call() == call()
        monkeypatch.setattr(emitted, "_IN_USE", {})
    assert compiler.compiled == []
    assert compiler.launches.read_bytes() == b"." * MAX_LAUNCHES
    _, call = _potential(tmp_path, "3.0")
    assert call() == [7.0] * 4


@pytest.mark.parametrize("term", ["1/(n - 2)", "2.0**places[i]", "places[i]**0.5"])
def test_what_python_cannot_run_is_compiled(term: str, tmp_path: Path, compiler: _Compiler) -> None:
    """Quotients of integers by zero, which raise in Python, are compiled, and so are powers that the compiler may write
    otherwise.
    """
    _, call = _potential(tmp_path, term)
    assert call() == [7.0] * 4
    assert compiler.compiled == ["effective_potential"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError])
def test_what_is_raised_in_python_passes_through_compiled_code(
    error: type[BaseException], tmp_path: Path, compiler: _Compiler, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An exception in Python is raised, once, when the compiled function that was called from Python returns."""
    function, call = _potential(tmp_path, "3.0")

    def interrupted(*_: Any) -> None:
        raise error

    monkeypatch.setattr(function, "_plain", interrupted)
    call()
    from_python = jit.entry(types.float64(types.float64))(lambda x: 2.0 * x)
    monkeypatch.setattr(jit, "MAX_PYTHON_TIME", 0.0)
    with pytest.raises(error):
        from_python(1.0)
    assert from_python(1.0) == 2.0


def test_importing_a_module_compiles_nothing(tmp_path: Path, compiler: _Compiler) -> None:
    """Importing a module compiles nothing, nor does asking for an address if Python can run the function."""
    text = (ROOT / "generated" / "pendulum.py").read_text(encoding="utf-8")
    file = tmp_path / "pendulum_of_this_test.py"
    file.write_text(text.replace('"""Bounds of', '"""Other bounds of'), encoding="utf-8")
    functions = load(file, file.stem).MODEL.functions
    assert functions.bounds.address == functions.bounds.address
    assert compiler.compiled == []
    functions.bounds.compile()
    assert compiler.compiled == ["bounds"]


@pytest.mark.parametrize("kind", [types.intp, types.uintp])
def test_zero_is_a_number(kind: Any) -> None:
    """A Python function that compiled code calls gets the number 0 as such, whatever the sign of its type."""
    given: list[Any] = []
    called = emitted._c_function(types.void(kind, types.float64))(lambda n, x: given.append((n, x)))
    called(0, 0.5)
    called(3, 1.5)
    assert given == [(0, 0.5), (3, 1.5)]
