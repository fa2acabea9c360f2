"""The runtime as plain Python, for runs with ``NUMBA_DISABLE_JIT=1``: coverage is measured so, and mutants are run so.

Compiled functions are ordinary Python over doubles, so Python can run them, a thousand times slower and to the same
bits but for the last place of elementary functions. What differs is made alike: a division by zero gives infinity, a
root of a negative number NaN. Generated functions have an address, by which C can call them as well.
"""

import ctypes
import importlib
import math
import pkgutil
from collections.abc import Callable, Iterable
from functools import cache, wraps
from inspect import signature
from types import FunctionType, SimpleNamespace
from typing import Any

import numba
import numpy as np
from numba.core.extending import _Intrinsic
from numba.core.registry import CPUDispatcher

import gqm_sym.runtime
from gqm_sym.runtime import interface
from gqm_sym.runtime.compiled import emitted, jit
from gqm_sym.runtime.legs.polynomials import COUNT

_NAMES = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2", "pow": "power"}
_NAMES |= {"asinh": "arcsinh", "acosh": "arccosh", "atanh": "arctanh"}
_SAME = ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "expm1", "log", "log1p", "log2", "log10", "sqrt")
_NAMES |= {name: name for name in (*_SAME, "hypot", "fabs", "fmod")}

_FUNCTIONS: dict[int, Callable[..., Any]] = {}
_KEPT: list[Any] = []  # what C holds the address of

_fma = ctypes.CDLL(None).fma
_fma.restype, _fma.argtypes = ctypes.c_double, [ctypes.c_double] * 3


def _whole(function: Callable[[float], int]) -> Callable[[float], int]:
    return lambda x: function(x) if math.isfinite(x) else 0


def _carray(array: Any, shape: Any) -> Any:
    """Give the first places of an array, in another shape, or what lies at an address."""
    if isinstance(array, ctypes._Pointer):
        return np.ctypeslib.as_array(array, shape if isinstance(shape, tuple) else (shape,))
    count = int(np.prod(shape))
    assert array.flags.c_contiguous
    return array.reshape(-1)[:count].reshape(shape)


_MATH: dict[Any, Any] = {getattr(math, name): getattr(np, other) for name, other in _NAMES.items()}
_MATH |= {math.floor: _whole(math.floor), math.ceil: _whole(math.ceil), numba.carray: _carray}


def _sums(table: Any) -> Callable[..., None]:
    """Give what adds up rows of a table, as `matrices.times` does."""

    def sums(values: Any, at: int, out: Any, to: int) -> None:
        total = np.zeros(table.shape[1])
        for value, row in zip(values.reshape(-1)[at : at + len(table)], table, strict=True):
            total = total + value * row
        out.reshape(-1)[to : to + total.size] = total

    return sums


def _extent(values: Any, at: int) -> tuple[Any, Any]:
    """Give the span of a panel's values, as `matrices.span` does."""
    part = values.reshape(-1)[at : at + COUNT]
    return np.fmin.reduce(part), np.fmax.reduce(part)


def _size(values: Any, at: int) -> Any:
    """Give the largest of a panel's values, as `matrices.largest` does."""
    return np.fmax.reduce(np.abs(values.reshape(-1)[at : at + COUNT]))


def _row(intrinsic: Any) -> Callable[..., None]:
    """Give a row by a formula of others, as `lanes.over_rows` does."""

    def fill(line: Any, out: int, *given: Any) -> None:
        rows = (value if isinstance(value, float) else line[value : value + intrinsic.width] for value in given)
        line[out : out + intrinsic.width] = intrinsic.formula(*rows)

    return fill


def _copy(width: int) -> Callable[..., None]:
    """Copy a row of one line into another, as `lanes.copied` does."""

    def copy(target: Any, to: int, line: Any, at: int) -> None:
        target[to : to + width] = line[at : at + width]

    return copy


def _speed_equation(address: int, n: int, work: Any, rows: tuple[int, ...], v: float, nu: float, p: Any) -> None:
    """Fill five rows of a line of numbers from others of it, as `calls.call_speed_equation` does."""
    lam, v2, out = rows
    _FUNCTIONS[address](n, work[lam:], work[v2:], v, nu, p, work[out:])


_QUICK = {"uncounted": lambda array: array, "least_and_greatest": _extent, "size": _size}
_QUICK |= {"call_speed_equation": _speed_equation}
_QUICK |= {"fma": lambda x, y, z: np.float64(_fma(x, y, z)), "nearest_whole": np.rint, "whole_below": np.floor}
_QUICK |= {"choose": lambda condition, x, y: np.float64(x if condition else y)}
_QUICK |= {
    "bits": lambda x: int(np.float64(x).view(np.int64)),
    "from_bits": lambda n: np.uint64(n % 2**64).view(np.float64),
}


def _call(address: int, *arguments: Any) -> None:
    _FUNCTIONS[address](*arguments)


@cache
def _compiled(intrinsic: Any) -> Callable[..., Any]:
    """Give what LLVM does, as a function for Python: nothing else knows what that is."""
    f = intrinsic
    forms: tuple[Callable[..., Any], ...] = (
        lambda a: f(a),
        lambda a, b: f(a, b),
        lambda a, b, c: f(a, b, c),
        lambda a, b, c, d: f(a, b, c, d),
        lambda a, b, c, d, e: f(a, b, c, d, e),
        lambda a, b, c, d, e, g: f(a, b, c, d, e, g),
        lambda a, b, c, d, e, g, h: f(a, b, c, d, e, g, h),
        lambda a, b, c, d, e, g, h, k: f(a, b, c, d, e, g, h, k),
    )
    count = len(signature(intrinsic._defn).parameters) - 1  # but for the typing context
    dispatcher = CPUDispatcher(forms[count - 1], targetoptions={"nopython": True})
    return lambda *arguments: _numpy(dispatcher(*arguments))


def _alike(value: Any) -> Any:
    """Give what compiled code would mean by a global value."""
    if isinstance(value, float):
        return np.float64(value)
    if isinstance(value, jit.Inner):
        return value.py_func
    if isinstance(value, _Intrinsic):
        if value._name == "fill_row":
            return _row(value)
        if value._name == "sums":
            return _sums(value.table)
        if value._name == "copy_row":
            return _copy(value.width)
        if value._name == "stacked":
            return lambda: np.empty(value.count)
        if value._name in _QUICK:
            return _QUICK[value._name]
        return _call if value._name.startswith("call_") else _compiled(value)
    try:
        return _MATH.get(value, value)
    except TypeError:  # not hashable
        return value


def _rebuilt(function: FunctionType, names: dict[str, Any]) -> Any:
    """Give the same code over other names, its numbers NumPy's."""
    code = function.__code__
    numbers = tuple(np.float64(value) if type(value) is float else value for value in code.co_consts)
    return FunctionType(code.replace(co_consts=numbers), names, function.__name__, function.__defaults__)


def _like(value: Any, items: Iterable[Any]) -> Any:
    """Give a tuple of the same class, which may be a named one."""
    return type(value)(*items) if hasattr(value, "_fields") else tuple(items)


def _numpy(value: Any) -> Any:
    """Give numbers that divide by zero as compiled ones do."""
    if isinstance(value, tuple):
        return _like(value, (_numpy(one) for one in value))
    return np.float64(value) if isinstance(value, float) else value


def _python(value: Any) -> Any:
    """Give what numba returns: Python's own numbers."""
    if isinstance(value, tuple):
        return _like(value, (_python(one) for one in value))
    return value.item() if isinstance(value, np.generic) else value


def _entry(function: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(function)
    def call(*arguments: Any) -> Any:
        with np.errstate(all="ignore"):
            return _python(function(*map(_numpy, arguments)))

    return call


def _callback(kind: Any, **_: Any) -> Callable[[Any], Any]:
    """Stand in for `numba.cfunc`: the function with an address, by which C can call it as well."""
    kinds = [_C.get(one, ctypes.POINTER(ctypes.c_double)) for one in kind.args]

    def decorate(function: Any) -> Any:
        names = {name: _alike(value) for name, value in function.__globals__.items()}
        plain = _rebuilt(function, names)
        _KEPT.append(ctypes.CFUNCTYPE(None, *kinds)(_entry(plain)))
        slot = ctypes.cast(_KEPT[-1], ctypes.c_void_p)
        address = ctypes.addressof(slot)
        _FUNCTIONS[address] = plain
        return SimpleNamespace(address=address, call=_KEPT[-1], slot=slot)

    return decorate


def _compiler(file: str, *, interface: int) -> Callable[..., Callable[[Any], Any]]:
    """Stand in for `emitted.compiler`."""
    if interface != INTERFACE:
        return COMPILER(file, interface=interface)

    return _callback


INTERFACE, COMPILER = interface.INTERFACE, emitted.compiler
_C = {numba.types.float64: ctypes.c_double, numba.types.int64: ctypes.c_int64, numba.types.intp: ctypes.c_ssize_t}


def install() -> None:
    """Let Python run what numba would compile, from now on."""
    found = pkgutil.walk_packages(gqm_sym.runtime.__path__, "gqm_sym.runtime.")
    modules = [gqm_sym.runtime, *(importlib.import_module(info.name) for info in found)]
    entries: dict[Any, Any] = {}
    known = []
    for module in modules:
        inner = {name: value for name, value in vars(module).items() if isinstance(value, jit.Inner)}
        names = {name: _alike(value) for name, value in vars(module).items()} | inner
        known.append(names)
        for value in list(vars(module).values()):
            if (
                isinstance(value, FunctionType)
                and value.__code__.co_name == "call"
                and value.__module__ == module.__name__
            ):
                entries[value] = _entry(_rebuilt(value.__wrapped__, names))
            elif isinstance(value, jit.Inner) and value.py_func.__module__ == module.__name__:
                value.py_func = _rebuilt(value.py_func, names)
    for names in known:  # now that all are rebuilt, they call each other directly
        names |= {name: _alike(value) for name, value in names.items() if isinstance(value, jit.Inner)}
    for module in modules:
        for name, value in list(vars(module).items()):
            if isinstance(value, FunctionType) and value in entries:
                setattr(module, name, entries[value])
            elif value is emitted.compiler:
                setattr(module, name, _compiler)
    jit.Inner.__call__ = lambda self, *arguments: _entry(self.py_func)(*arguments)
    jit.COMPILER.callback = lambda function, signature: _callback(signature)(function)  # type: ignore[method-assign]
    numba.carray, numba.cfunc = _carray, _callback
