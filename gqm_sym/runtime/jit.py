"""The one place for compiler options, and for how generated functions are compiled.

No fast-math: reassociation would break sums and products of two doubles, and NaN and infinity have meaning here.
Division by zero gives infinity, as in IEEE arithmetic, and is not an exception.
"""

import hashlib
import sys
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from types import ModuleType
from typing import Any

from numba import njit, types
from numba.core import sigutils
from numba.core.caching import FunctionCache
from numba.core.ccallback import CFunc
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys
from numba.extending import typeof_impl

from gqm_sym.errors import OutdatedModuleError
from gqm_sym.runtime.interface import INTERFACE

COMPILE: dict[str, Any] = {"cache": True, "error_model": "numpy"}


def _stamp() -> tuple[tuple[str, int, int], ...]:
    """Names, times and sizes of the runtime's files."""
    files = sorted(Path(__file__).parent.glob("*.py"))
    return tuple((file.name, (status := file.stat()).st_mtime_ns, status.st_size) for file in files)


STAMP = _stamp()


class ReadyCache(FunctionCache):  # type: ignore[misc]
    """numba's disk cache, looked into before numba prepares to compile, and aware of changes in the runtime.

    The preparation imports and registers all that compiling may need (SciPy's linear algebra as well) and takes a tenth
    of a second; code that is in the cache needs none of it. numba itself notices changes in a function's own file only,
    by time and size; compiled code here holds functions of several files, and the name of a generated module's
    functions tells its text (`compiler`).
    """

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return (*super()._index_key(sig, codegen), self._py_func.__module__, STAMP)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function from the cache, or numba's own way."""
        with self._guard_against_spurious_io_errors():
            found = self._load_overload(sig, target_context)
            if found is not None:
                return found
        return super().load_overload(sig, target_context)


class Inner:
    """A function for other compiled functions to call.

    numba's dispatcher is made when one of them is compiled, or Python calls it: code from the cache never needs it.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function
        self.__name__, self.__doc__ = function.__name__, function.__doc__
        self._dispatcher: Any = None

    @property
    def dispatcher(self) -> Any:
        """The function as numba knows it."""
        if self._dispatcher is None:
            self._dispatcher = njit(**COMPILE)(self.py_func)
        return self._dispatcher

    def __call__(self, *arguments: Any) -> Any:
        """Call it from Python."""
        return self.dispatcher(*arguments)


@typeof_impl.register(Inner)
def _type_of_inner(value: Inner, _: Any) -> Any:
    return types.Dispatcher(value.dispatcher)


def entry(signature: Any) -> Callable[[Any], Callable[..., Any]]:
    """An entry point from Python: compiled, or loaded from the cache, when it is first called."""

    def decorate(function: Any) -> Callable[..., Any]:
        compiled: Any = None

        @wraps(function)
        def call(*arguments: Any) -> Any:
            nonlocal compiled
            if compiled is None:
                dispatcher = njit(**COMPILE)(function)
                dispatcher._cache = ReadyCache(function)
                rtsys.initialize(dispatcher.targetctx)  # cached code counts its arrays too
                dispatcher.compile(signature)
                dispatcher.disable_compile()
                compiled = dispatcher
            return compiled(*arguments)

        return call

    return decorate


def compiler(file: str, *, interface: int) -> Callable[[Any], Callable[[Any], Any]]:
    """A decorator factory for the functions of one generated module: ``compiled(signature)``.

    Refuses a module that was generated for another version of the interface, before anything is compiled.

    numba's disk cache remembers the module's name and imports it on loading, and machine code is told apart by it.
    A generated module may be imported under any name, from any folder; so its functions are given to numba under a
    name made from the module's own text.
    """
    if interface != INTERFACE:
        raise OutdatedModuleError(
            f"{file}: made for interface {interface} of the runtime, which is now at {INTERFACE}; "
            "run gqm-gen on its declaration again"
        )
    digest = hashlib.sha256(Path(file).read_bytes()).hexdigest()[:16]
    alias = f"gqm_sym_generated_{digest}"
    sys.modules.setdefault(alias, ModuleType(alias))

    def compiled(signature: Any) -> Callable[[Any], Any]:
        def decorate(function: Any) -> Any:
            function.__module__ = alias
            rtsys.initialize(cpu_target.target_context)
            options = {"error_model": COMPILE["error_model"]}
            callback: Any = CFunc(function, sigutils.normalize_signature(signature), {}, options)
            callback._cache = ReadyCache(function)
            callback.compile()
            return callback

        return decorate

    return compiled
