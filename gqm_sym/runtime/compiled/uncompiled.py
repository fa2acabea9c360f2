"""Functions of generated modules as plain Python, which gives the same bits as their compiled code.

Compiling a function takes some 0.2 s, and Python runs it in some 20 microseconds a place. So a new module answers its
first questions sooner if Python runs its functions (`emitted.Emitted`).

Python's numbers are NumPy's here, which divide by zero as compiled code does, and elementary functions are those of the
C library that compiled code calls. What cannot be run so is left to the compiler.
"""

import ast
import builtins
import ctypes
import dis
import math
from collections.abc import Callable
from functools import cache
from types import CodeType, FunctionType
from typing import Any

import numba
import numpy as np

from gqm_sym.runtime.compiled import intrinsics

# Functions of the C library, by their number of arguments. Compiled code calls the same ones.
_ELEMENTARY = {
    1: "acos acosh asin asinh atan atanh cos cosh exp expm1 log log1p sin sinh sqrt tan tanh",
    2: "atan2 hypot pow",
    3: "fma",
}

# What else a function may use, which means the same in Python.
_SAME = (abs, int, len, max, min, range)


class NotPlainError(Exception):
    """A function uses what Python cannot run to the same bits."""


def _of_library(library: Any, name: str, count: int) -> Callable[..., Any]:
    function = getattr(library, name)
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double] * count
    return lambda *arguments: np.float64(function(*arguments))


def _integer_power(x: Any, n: int) -> Any:
    """``x**n`` by repeated squaring, in the order of compiled code."""
    result, factor, count = np.float64(1.0), x, abs(n)
    while count:
        result = result * factor if count & 1 else result
        factor, count = factor * factor, count >> 1
    return 1.0 / result if n < 0 else result


# What runs in Python in place of an operation of compiled code; a room adds those that are its own.
_IN_PYTHON: dict[Any, Callable[..., Any]] = {}


def in_python(operation: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Declare, as a decorator, what runs in Python in place of an operation of compiled code, to the same bits."""

    def declare(function: Callable[..., Any]) -> Callable[..., Any]:
        _IN_PYTHON[operation] = function
        return function

    return declare


def fma(x: Any, y: Any, z: Any) -> Any:
    """Return x * y + z, rounded once."""
    return _operations()[intrinsics.fma](x, y, z)


@in_python(intrinsics.polynomial_pair)
def _polynomial_pair(coefficients: Any, s: Any, t: Any) -> tuple[Any, Any]:
    value, slope = np.float64(0.0), np.float64(0.0)
    for coefficient in coefficients:
        slope = fma(slope, s, value)
        value = fma(value, t, coefficient)
    return value, slope


def _array(address: int, shape: Any) -> Any:
    """The array at an address, as `numba.carray` gives it."""
    count = math.prod(shape) if isinstance(shape, tuple) else shape
    line: Any = (ctypes.c_double * count).from_address(address) if count else b""
    numbers = np.frombuffer(line)
    return numbers.reshape(shape)


@cache
def _operations() -> dict[Any, Callable[..., Any]]:
    """For each operation of compiled code what gives the same in Python."""
    library = ctypes.CDLL(None)
    elementary = {
        name: _of_library(library, name, count) for count, names in _ELEMENTARY.items() for name in names.split()
    }
    multiply_add = elementary.pop("fma")
    operations: dict[Any, Callable[..., Any]] = {getattr(math, name): call for name, call in elementary.items()}
    return (
        operations
        | _IN_PYTHON
        | {
            float: np.float64,
            math.fabs: abs,
            math.floor: lambda x: int(np.floor(x)),
            numba.carray: _array,
            intrinsics.fma: multiply_add,
            intrinsics.nearest_whole: np.rint,
            intrinsics.whole_below: np.floor,
            intrinsics.bits: lambda x: int(np.float64(x).view(np.int64)),
            intrinsics.from_bits: lambda n: np.uint64(n % 2**64).view(np.float64),
            intrinsics.choose: lambda condition, x, y: np.float64(x if condition else y),
            intrinsics.polynomial: lambda coefficients, t: _polynomial_pair(coefficients, t, t)[0],
        }
    )


def _is_integer(node: ast.expr) -> bool:
    try:
        return type(ast.literal_eval(node)) is int
    except ValueError:
        return False


def _powers_as_calls(node: Any) -> Any:
    """Write powers as calls, for Python's own are rounded otherwise."""
    for name, value in ast.iter_fields(node):
        if isinstance(value, list):
            setattr(node, name, [_powers_as_calls(one) if isinstance(one, ast.AST) else one for one in value])
        elif isinstance(value, ast.AST):
            setattr(node, name, _powers_as_calls(value))
    if not (isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow)):
        return node
    is_integer = _is_integer(node.right)
    if isinstance(node.left, ast.Constant) or (isinstance(node.right, ast.Constant) and not is_integer):
        raise NotPlainError  # the compiler may write such a power in other terms
    return ast.Call(ast.Name(_POWERS[is_integer].__name__, ast.Load()), [node.left, node.right], [])


def _power(x: Any, y: Any) -> Any:
    return _operations()[math.pow](x, y)


_POWERS = {True: _integer_power, False: _power}


@cache
def _plain_inner(inner: Any) -> Callable[..., Any]:
    function = inner.py_func
    return _over_plain_names(function.__code__, function.__globals__)


def _plain_value(value: Any) -> Any:
    """What compiled code means by a global value."""
    if isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return np.float64(value)
    if isinstance(value, tuple):
        items = [_plain_value(item) for item in value]
        return type(value)(*items) if hasattr(value, "_fields") else tuple(items)
    if hasattr(value, "forceinline"):  # a function that compiled functions call
        return _plain_inner(value)
    if value in _SAME or value in _POWERS.values():
        return value
    if value not in _operations():
        raise NotPlainError
    return _operations()[value]


def _over_plain_names(code: CodeType, given: dict[str, Any]) -> Callable[..., Any]:
    """The same code over plain names, its numbers NumPy's."""
    if any(step.opname == "BINARY_OP" and step.argrepr.startswith("**") for step in dis.get_instructions(code)):
        raise NotPlainError
    given = vars(builtins) | given
    names = {name: _plain_value(given[name]) for name in code.co_names if name in given}
    numbers = tuple(_plain_value(number) if type(number) in (float, tuple) else number for number in code.co_consts)
    return FunctionType(code.replace(co_consts=numbers), names)


def plain(function: Callable[..., Any], text: str) -> Callable[..., Any] | None:
    """Return a function of a generated module as plain Python; None where the compiler must run it.

    Parameters
    ----------
    function : callable
        The function.
    text : str
        Its text with its decorators, as it was when the module was imported.

    Returns
    -------
    callable or None
        It takes addresses in place of pointers.
    """
    definition = ast.parse(text).body[0]
    if not isinstance(definition, ast.FunctionDef) or definition.name != function.__name__:
        return None
    definition.decorator_list = []
    names = {call.__name__: call for call in _POWERS.values()}
    try:
        module = ast.fix_missing_locations(ast.Module([_powers_as_calls(definition)], []))
        constants = compile(module, function.__code__.co_filename, "exec").co_consts
        (code,) = (constant for constant in constants if isinstance(constant, CodeType))
        run = _over_plain_names(code, function.__globals__ | names)
    except (AttributeError, NotPlainError, OSError, TypeError):  # TypeError: a name for what cannot be hashed
        return None

    def call(*arguments: Any) -> None:
        with np.errstate(all="ignore"):
            run(*(np.float64(value) if type(value) is float else value for value in arguments))

    return call
