"""Functions of generated modules give the same bits in Python as compiled."""

import dis
import itertools
from collections.abc import Iterator
from importlib import import_module
from inspect import signature
from pathlib import Path
from pkgutil import walk_packages
from types import FunctionType
from typing import Any

import numpy as np
import pytest
from numba import types
from paths import ROOT

from gqm_sym import runtime
from gqm_sym.loading import load
from gqm_sym.runtime import vocabulary
from gqm_sym.runtime.compiled import jit, uncompiled
from gqm_sym.runtime.compiled.emitted import Emitted
from gqm_sym.runtime.compiled.uncompiled import plain_by_address
from gqm_sym.runtime.interface import INTERFACE

# Together these modules have sines, powers, roots, exponentials, arc tangents and the law of friction.
MODULES = ("pendulum", "log_spiral", "cubic_coulomb")

MODULE = f"""from numba import carray, types
from gqm_sym.runtime import compiler
from gqm_sym.runtime.vocabulary import {{names}}

compiled = compiler(__file__, interface={INTERFACE})
MANY = types.CPointer(types.float64)


@compiled(types.void(types.uintp, MANY, MANY, MANY, MANY))
def everything(n, first, second, third, out):
    first, second, third, out = carray(first, n), carray(second, n), carray(third, n), carray(out, ({{rows}}, n))
    for i in range(n):
        a, b, c = first[i], second[i], third[i]
{{lines}}
"""

# Arguments may be these values in addition to ordinary numbers.
EXTREME = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 1e308, -1e-310])


def _functions(module: str) -> dict[str, Emitted]:
    file = ROOT / "generated" / f"{module}.py"
    return {name: each for name, each in vars(load(file, Path(file).stem)).items() if isinstance(each, Emitted)}


def _results(function: Emitted, call: Any, seed: int, count: int) -> np.ndarray:
    """Run a function on random arguments, including extreme ones, and return the bits of its output."""
    rng = np.random.default_rng(seed)
    given: list[Any] = []
    for kind in function.signature.args:
        if kind == types.CPointer(types.float64):
            numbers = rng.normal(size=64 * count) * 2.0 ** rng.integers(-6, 4, size=64 * count)
            if seed % 3 == 0:
                numbers[rng.integers(0, 8 * count, size=4)] = rng.choice(EXTREME, size=4)
            given.append(numbers)
        else:
            given.append(count if kind == types.uintp else float(rng.normal()))
    call(*(value.ctypes.data if isinstance(value, np.ndarray) else value for value in given))
    out: np.ndarray = given[-1]
    out[np.isnan(out)] = np.nan  # either NaN is right
    return out.view(np.int64)


@pytest.mark.extended
@pytest.mark.parametrize("module", MODULES)
def test_bits_are_those_of_compiled_code(module: str) -> None:
    """The bits agree for each function, for arguments over six decades, infinities, NaN and numbers next to
    overflow.
    """
    functions = _functions(module)
    assert len(functions) >= 5
    for function in functions.values():
        in_python = plain_by_address(function.function, function.signature, function.text)
        function.compile()
        for seed in range(6):
            for count in (1, 8):
                expected = _results(function, function.call, seed, count)
                assert np.array_equal(_results(function, in_python, seed, count), expected)


def _calls() -> dict[str, tuple[str, ...]]:
    """Return functions of the arithmetic that a function may call, with their arguments if these are numbers or
    intervals.
    """
    taken = {("x",): "a", ("x", "y", "h"): "a, b, b - a", ("x", "y", "w", "h1", "h2"): "a, b, c, b - a, c - b"}
    taken |= {("x", "y", "h", "n"): "a, b, b - a, 3", ("x", "y", "w", "h1", "h2", "n"): "a, b, c, b - a, c - b, 4"}
    taken |= {("x", "y", "h", "p"): "a, b, b - a, 0.7", ("x", "y", "w", "h1", "h2", "p"): "a, b, c, b - a, c - b, 0.7"}
    intervals = {("a",): "(a, b)", ("a", "b"): "(a, b), (b, c)", ("a", "n"): "(a, b), 3", ("a", "p"): "(a, b), 0.7"}
    found: dict[str, tuple[str, ...]] = {}
    for name, home in vocabulary.HOMES.items():
        function = getattr(getattr(vocabulary, name), "py_func", None)
        arguments = tuple(signature(function).parameters) if function else ()
        if home.endswith("intervals") and arguments in intervals:
            found[name] = (f"{name}({intervals[arguments]})[0]", f"{name}({intervals[arguments]})[1]")
        elif home.startswith("arithmetic") and arguments in taken:
            found[name] = (f"{name}({taken[arguments]})",)
    return found


@pytest.mark.extended
def test_bits_of_the_arithmetic(tmp_path: Path) -> None:
    """The bits agree for each function of one or more numbers or intervals that a generated module can call."""
    calls = _calls()
    assert len(calls) > 60
    rows = [row for each in calls.values() for row in each]
    lines = [f"        out[{k}, i] = {row}" for k, row in enumerate(rows)]
    file = tmp_path / "arithmetic.py"
    file.write_text(MODULE.format(names=", ".join(calls), rows=len(rows), lines="\n".join(lines)), encoding="utf-8")
    function = load(file, file.stem).everything
    in_python = plain_by_address(function.function, function.signature, function.text)
    function.compile()
    rng = np.random.default_rng(3)
    for scale in (1e-9, 0.3, 1.0, 4.0, 1e3):
        places, n = np.sort(scale * rng.normal(size=(3, 40)), axis=0), 40
        places[:, -2:] = np.abs(places[:, -2:])
        found = np.empty((2, len(rows), n))
        for out, call in zip(found, (in_python, function.call), strict=True):
            call(n, *(each.ctypes.data for each in (*places, out)))
        found[np.isnan(found)] = np.nan
        one, other = found.view(np.int64)
        assert [row for row, same in zip(rows, (one == other).all(axis=1), strict=True) if not same] == []


def _compiled_functions() -> Iterator[FunctionType]:
    """Return every function of the runtime that numba compiles."""
    for module in walk_packages(runtime.__path__, f"{runtime.__name__}."):
        for value in vars(import_module(module.name)).values():
            is_entry = getattr(getattr(value, "__code__", None), "co_filename", None) == jit.__file__
            function = getattr(value, "__wrapped__" if is_entry else "py_func", None)
            if getattr(function, "__module__", None) == module.name:
                yield function


def test_python_knows_all_of_numpy_that_compiled_functions_use() -> None:
    """Python knows every NumPy name in them; otherwise the first call would compile them and their callers without a
    message.
    """
    found, unknown = 0, set()
    for function in _compiled_functions():
        steps = list(dis.get_instructions(function))
        found += 1
        for step, following in itertools.pairwise(steps):
            is_numpy = step.opname == "LOAD_GLOBAL" and function.__globals__.get(step.argval) is np
            if is_numpy and not hasattr(uncompiled._NUMPY, following.argval):
                unknown.add(f"{function.__module__}.{function.__name__}: np.{following.argval}")
    assert found > 500
    assert unknown == set()
