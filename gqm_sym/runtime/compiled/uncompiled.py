"""Functions that would otherwise be compiled, run as plain Python, which gives the same bits.

Compiling a function of a generated module takes some 0.2 s, and Python runs it in some 20 microseconds a place.
Compiling an entry point takes seconds, and Python runs it in milliseconds. So first answers come sooner if Python runs
the functions that are not in the cache of compiled code (`emitted.Emitted`, `jit.entry`).

Python's numbers are NumPy's here, which divide by zero as compiled code does, and elementary functions are those of the
C library that compiled code calls. Functions that cannot be run in this way are left to the compiler.
"""

import ast
import builtins
import ctypes
import dis
import inspect
import math
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from itertools import count
from types import CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numba
import numpy as np

from gqm_sym.runtime.compiled import intrinsics
from gqm_sym.runtime.compiled.trial import TooSlowError, Trial, go_on, limited

# Functions of the C library, by their number of arguments. Compiled code calls the same ones.
_ELEMENTARY = {
    1: "acos acosh asin asinh atan atanh cos cosh exp expm1 log log1p sin sinh sqrt tan tanh",
    2: "atan2 hypot pow",
}

# Other names that a function may use because they mean the same in Python.
_SAME = (abs, bool, enumerate, int, len, max, min, range, round, slice, math.copysign)
_OF_NUMPY = "abs array bool_ empty floor full int64 int8 maximum ones rint searchsorted zeros"
_NUMPY = SimpleNamespace(
    **{name: getattr(np, name) for name in _OF_NUMPY.split()},
    **{name: np.float64(getattr(np, name)) for name in ("inf", "nan", "pi")},
)

# The time in seconds that one call of an entry point may take in Python. The compiler takes some seconds.
MAX_CALL = 1.5


class NotPlainError(Exception):
    """A function uses something that Python cannot run to the same bits."""


class _Sharing(threading.local):
    """Whether other threads write into the same arrays as this one."""

    on = False


_SHARING = _Sharing()
_STEPS = count()

# The parser of Python 3.11 may raise a SystemError if two threads use it at once.
_PARSING = threading.Lock()


@contextmanager
def sharing_arrays() -> Iterator[None]:
    """Keep entry points from running as plain Python in this thread, because other threads write into parts of the same
    arrays.

    If plain Python gives up, its writes are undone; those of other threads would be undone as well.
    """
    before, _SHARING.on = _SHARING.on, True
    try:
        yield
    finally:
        _SHARING.on = before


@cache
def _of_library(name: str, arguments: int) -> Callable[..., float]:
    """Return a function of the C library that returns and takes doubles."""
    function: Any = getattr(ctypes.CDLL(None), name)
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double] * arguments
    return function  # type: ignore[no-any-return]


def _over_numpy(function: Callable[..., float]) -> Callable[..., Any]:
    return lambda *arguments: np.float64(function(*arguments))


def _integer_power(x: Any, n: int) -> Any:
    """``x**n`` by repeated squaring, in the order of compiled code."""
    result, factor, count = np.float64(1.0), x, abs(n)
    while count:
        result = result * factor if count & 1 else result
        factor, count = factor * factor, count >> 1
    return 1.0 / result if n < 0 else result


# Python functions that run in place of operations of compiled code; other rooms add their own.
_IN_PYTHON: dict[Any, Callable[..., Any]] = {}


def in_python(operation: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator for the Python function that runs in place of an operation of compiled code and gives the same
    bits.
    """

    def declare(function: Callable[..., Any]) -> Callable[..., Any]:
        _IN_PYTHON[operation] = function
        return function

    return declare


def fma(x: Any, y: Any, z: Any) -> Any:
    """Return x * y + z, rounded once."""
    if not next(_STEPS) & 255:
        go_on()
    return np.float64(_of_library("fma", 3)(x, y, z))


@cache
def fma_of_arrays() -> Callable[..., Any]:
    """Return a function that computes x * y + z for arrays, with one rounding for each element."""
    made: Callable[..., Any] = np.frompyfunc(_of_library("fma", 3), 3, 1)
    return made


@in_python(intrinsics.polynomial_pair)
def _polynomial_pair(coefficients: Any, s: Any, t: Any) -> tuple[Any, Any]:
    go_on()
    fma, value, slope = _of_library("fma", 3), 0.0, 0.0
    for coefficient in coefficients:
        slope = fma(slope, s, value)
        value = fma(value, t, coefficient)
    return np.float64(value), np.float64(slope)


@in_python(intrinsics.polynomial)
def _polynomial(coefficients: Any, t: Any) -> Any:
    go_on()
    fma, value = _of_library("fma", 3), 0.0
    for coefficient in coefficients:
        value = fma(value, t, coefficient)
    return np.float64(value)


class _AddressOfIntegers(int):
    """An address of integers; all other addresses are those of floats."""


def _array(address: Any, shape: Any) -> Any:
    """Return the array at an address, as `numba.carray` does; or, given an array, its first numbers."""
    count = math.prod(shape) if isinstance(shape, tuple) else shape
    if isinstance(address, np.ndarray):
        return address.reshape(-1)[:count].reshape(shape)
    kind = ctypes.c_int64 if isinstance(address, _AddressOfIntegers) else ctypes.c_double
    line: Any = (kind * count).from_address(address) if count else b""
    return np.frombuffer(line, dtype=np.dtype(kind)).reshape(shape)


@cache
def _operations() -> dict[Any, Callable[..., Any]]:
    """Return, for each operation of compiled code, the Python function that gives the same result."""
    names = [(name, count) for count, names in _ELEMENTARY.items() for name in names.split()]
    operations = {getattr(math, name): _over_numpy(_of_library(name, count)) for name, count in names}
    return operations | {
        float: np.float64,
        math.fabs: abs,
        math.frexp: _mantissa_and_exponent,
        math.floor: lambda x: int(np.floor(x)),
        math.ceil: lambda x: int(np.ceil(x)),
        math.isfinite: np.isfinite,
        numba.carray: _array,
        intrinsics.fma: fma,
        intrinsics.item_at: lambda array, index: array.reshape(-1)[index],
        intrinsics.nearest_whole: np.rint,
        intrinsics.floor_of: np.floor,
        intrinsics.bits: lambda x: int(np.float64(x).view(np.int64)),
        intrinsics.from_bits: lambda n: np.uint64(n % 2**64).view(np.float64),
        intrinsics.choose: lambda condition, x, y: np.float64(x if condition else y),
    }


def _mantissa_and_exponent(x: Any) -> tuple[Any, int]:
    mantissa, exponent = math.frexp(x)
    return np.float64(mantissa), exponent


def _is_integer(node: ast.expr) -> bool:
    try:
        return type(ast.literal_eval(node)) is int
    except ValueError:
        return False


def _powers_as_calls(node: Any) -> Any:
    """Rewrite powers as calls, because Python rounds its own powers otherwise."""
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
    return ast.Call(ast.Name("x**n" if is_integer else "x**y", ast.Load()), [node.left, node.right], [])


def _power(x: Any, y: Any) -> Any:
    return _operations()[math.pow](x, y)


# The functions that are called in place of powers; no other function can have such a name.
_POWERS = {"x**n": _integer_power, "x**y": _power}


@cache
def _plain_inner(inner: Any) -> Callable[..., Any]:
    return plain_function(inner.py_func)


def _plain_value(value: Any) -> Any:
    """Return the meaning of a global value in compiled code."""
    if value is None or isinstance(value, bool | int | str | np.ndarray):
        return value
    if isinstance(value, float):
        return np.float64(value)
    if isinstance(value, tuple):
        return _like(value, (_plain_value(item) for item in value))
    if isinstance(value, ModuleType):
        names = {name: each for name, each in vars(value).items() if isinstance(each, int | float)}
        return _NUMPY if value is np else SimpleNamespace(**{name: _plain_value(each) for name, each in names.items()})
    if hasattr(value, "forceinline"):  # a function that compiled functions call
        return _plain_inner(value)
    if value in _SAME or value in _POWERS.values() or (isinstance(value, type) and hasattr(value, "_fields")):
        return value
    found = _IN_PYTHON.get(value) or _operations().get(value)
    if found is None:
        raise NotPlainError
    return found


def _like(value: Any, items: Iterable[Any]) -> Any:
    """Return a tuple of the same class, which may be a named one."""
    return type(value)(*items) if hasattr(value, "_fields") else tuple(items)


def _over_plain_names(code: CodeType, given: dict[str, Any]) -> Callable[..., Any]:
    """Return a function with the same code in which names have their plain meanings and numbers are NumPy's."""
    given = vars(builtins) | given
    names = {name: _plain_value(given[name]) for name in code.co_names if name in given}
    numbers = tuple(_plain_value(number) if type(number) in (float, tuple) else number for number in code.co_consts)
    names["__builtins__"] = builtins  # attributes of NumPy may cause imports
    return FunctionType(code.replace(co_consts=numbers), names)


def _binary_operations(code: CodeType) -> set[int]:
    """Return Python's numbers of the binary operations in a function's code."""
    pairs = zip(code.co_code[::2], code.co_code[1::2], strict=True)
    return {which for operation, which in pairs if operation == dis.opmap["BINARY_OP"]}


def _raised(x: Any, y: Any) -> Any:
    x **= y
    return x**y


_POWER = _binary_operations(_raised.__code__)


def plain_function(function: Any, text: str | None = None) -> Callable[..., Any]:
    """Return the function as plain Python over NumPy's numbers.

    Parameters
    ----------
    function : callable
        The function.
    text : str, optional
        Its text with its decorators; that of its file if it is not given.

    Raises
    ------
    NotPlainError
        If it must be compiled.
    """
    code = function.__code__
    try:
        if _binary_operations(code) & _POWER:
            code = _of_text(text or inspect.getsource(function), code)
        return _over_plain_names(code, function.__globals__ | _POWERS)
    except (AttributeError, OSError, SyntaxError, TypeError):  # TypeError: an object cannot be hashed
        raise NotPlainError from None


def _of_text(text: str, original: CodeType) -> CodeType:
    """Return the code of a function made from its text, with powers as calls."""
    with _PARSING:
        definition = ast.parse(text).body[0]
    if not isinstance(definition, ast.FunctionDef):
        raise NotPlainError
    definition.decorator_list = []
    module = ast.fix_missing_locations(ast.Module([_powers_as_calls(definition)], []))
    ast.increment_lineno(module, original.co_firstlineno - 1)
    constants = compile(module, original.co_filename, "exec").co_consts
    return next(constant for constant in constants if isinstance(constant, CodeType))


def plain_by_address(function: Any, signature: Any, text: str | None) -> Callable[..., None] | None:
    """Return a function that is called by its address as plain Python; None if it must be compiled.

    Parameters
    ----------
    function : callable
        The function.
    signature
        numba's signature.
    text : str, optional
        Its text with its decorators, as it was when the module was imported.

    Returns
    -------
    callable or None
        It takes addresses in place of pointers.
    """
    try:
        run = plain_function(function, text)
    except NotPlainError:
        return None
    kinds = {numba.types.float64: np.float64, numba.types.CPointer(numba.types.int64): _AddressOfIntegers}
    given = [kinds.get(kind, int) for kind in signature.args]

    def call(*arguments: Any) -> None:
        with np.errstate(all="ignore"):
            run(*(kind(value) for kind, value in zip(given, arguments, strict=True)))

    return call


def _given(kind: Any, value: Any) -> Any:
    """Return an argument of one of numba's types as plain Python takes it."""
    if isinstance(kind, numba.types.Float):
        return np.float64(value)
    if isinstance(kind, numba.types.BaseTuple):
        items = (_given(one, item) for one, item in zip(kind, value, strict=True))
        return kind.instance_class(*items) if isinstance(kind, numba.types.BaseNamedTuple) else tuple(items)
    if isinstance(kind, numba.types.Boolean | numba.types.Integer):
        return bool(value) if isinstance(kind, numba.types.Boolean) else int(value)
    return value


def _result(value: Any) -> Any:
    """Return a result with Python's own numbers, as compiled functions return them."""
    if isinstance(value, tuple):
        return _like(value, map(_result, value))
    return value.item() if isinstance(value, np.generic) else value


def _arrays(value: Any) -> Iterator[Any]:
    """Return the arrays that a function may write into."""
    if isinstance(value, tuple):
        for item in value:
            yield from _arrays(item)
    elif isinstance(value, np.ndarray) and value.flags.writeable:
        yield value


class PlainEntry:
    """An entry point as plain Python, as long as that takes less time than compiling it.

    Parameters
    ----------
    function : callable
        The entry point.
    kinds : sequence
        numba's types of its arguments.
    trial : Trial
        The object that decides when Python stops running it.
    """

    def __init__(self, function: Any, kinds: Sequence[Any], trial: Trial) -> None:
        self._kinds, self._trial = kinds, trial
        self._run = plain_function(function)

    def __call__(self, arguments: tuple[Any, ...]) -> Any:
        """Run the function.

        Raises
        ------
        NotPlainError
            If the function must be compiled, is worth compiling, or shares arrays with other threads that write into
            them. All arrays are then as they were before the call.
        """
        if _SHARING.on or self._trial.is_over():
            raise NotPlainError
        arrays = list(_arrays(arguments))
        before = [array.copy() for array in arrays]
        started = time.perf_counter()
        try:
            with limited(MAX_CALL), np.errstate(all="ignore"):
                return _result(self._run(*map(_given, self._kinds, arguments)))
        except (ArithmeticError, AttributeError, LookupError, TooSlowError, TypeError, ValueError):
            self._trial.left = 0.0
            for array, old in zip(arrays, before, strict=True):
                array[...] = old
            raise NotPlainError from None
        finally:
            self._trial.left -= time.perf_counter() - started
