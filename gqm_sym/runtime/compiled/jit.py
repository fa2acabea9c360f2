"""The one place for compiler options, and for how generated functions are compiled.

No fast-math: reassociation would break sums and products of two doubles, and NaN and infinity have meaning here.
Division by zero gives infinity, as in IEEE arithmetic, and is not an exception.
"""

import hashlib
import pickle
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache, wraps
from pathlib import Path
from types import ModuleType
from typing import Any

from numba import njit, types
from numba.core import sigutils
from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache
from numba.core.ccallback import CFunc
from numba.core.environment import Environment, lookup_environment
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys
from numba.extending import typeof_impl

from gqm_sym.errors import OutdatedModuleError
from gqm_sym.runtime.interface import INTERFACE

COMPILE: dict[str, Any] = {"error_model": "numpy"}


# The package of which every function that other functions call in compiled code is part.
RUNTIME = "gqm_sym.runtime"


def stamp_of(folder: Path) -> str:
    """Digest of all Python files in a folder and its sub-folders, by their paths and contents.

    Their times say little, as those of a wheel are all the same.
    """
    digest = hashlib.sha256()
    for path, file in sorted((file.relative_to(folder).as_posix(), file) for file in folder.rglob("*.py")):
        text = file.read_bytes()
        digest.update(f"{path} {len(text)}\n".encode() + text)
    return digest.hexdigest()


STAMP = stamp_of(Path(__file__).parent.parent)


@lru_cache(maxsize=1)
def announce() -> None:
    """Say once, to whoever sits before a terminal, what takes so long: the runtime is not in the cache yet."""
    if sys.stderr is not None and sys.stderr.isatty():
        print("gqm_sym: compiling the runtime, once per installation", file=sys.stderr, flush=True)


def _environment(module: str, constants: Any, name: str) -> Environment:
    """What numba keeps for a compiled function, without importing the module that it is from.

    Its names are for Python objects in compiled code, which there are none of; of the modules of numba's own that are
    linked in, such as that of ``np.empty``, importing takes longer than all else there is to load.
    """
    found = lookup_environment(name)
    if found is None:
        found = Environment(vars(sys.modules.get(module, ModuleType(module))))
        found.consts[:], found.env_name = constants, name
        Environment._memo[name] = found
    return found


class _Reader(pickle.Unpickler):
    """Reads compiled code from the cache; numba's own way to rebuild a function's environment imports modules."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) == (Environment.__module__, "_rebuild_env"):
            return _environment
        return super().find_class(module, name)


class KeyedFiles(IndexDataCacheFile):  # type: ignore[misc]
    """Compiled code of a function, in a file for each key that is named by the key and holds it.

    numba's own has an index, written before the code, that numbers the files. Processes that compile versions of a
    function at once give both the same number, and one that is killed between leaves a number that an older file has:
    the next one would then run other code than it asked for.
    """

    def _file_of(self, key: Any) -> str:
        digest = hashlib.sha256(repr((self._version, self._source_stamp, key)).encode()).hexdigest()[:16]
        return self._data_name_pattern.replace("{number:d}", digest)  # type: ignore[no-any-return]

    def save(self, key: Any, data: Any) -> None:
        """Keep what was compiled."""
        self._save_data(self._file_of(key), (self._source_stamp, key, data))

    def _load_data(self, name: str) -> Any:
        with Path(self._data_path(name)).open("rb") as file:
            return _Reader(file).load()

    def load(self, key: Any) -> Any:
        """What was kept, or None."""
        try:
            stamp, kept, data = self._load_data(self._file_of(key))
        except FileNotFoundError:
            return None
        return data if (stamp, kept) == (self._source_stamp, key) else None


class ReadyCache(FunctionCache):  # type: ignore[misc]
    """numba's disk cache, looked into before numba prepares to compile, and aware of changes in the runtime.

    The preparation imports and registers all that compiling may need (SciPy's linear algebra as well) and takes a tenth
    of a second; code that is in the cache needs none of it. numba itself notices changes in a function's own file only,
    by time and size; compiled code here holds functions of several files, and the name of a generated module's
    functions tells its text (`compiler`). What cannot be read is compiled anew, and what cannot be written is not kept.
    """

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file: Any = KeyedFiles(self._cache_path, self._impl.filename_base, stamp)

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return (*super()._index_key(sig, codegen), self._py_func.__module__, STAMP)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function from the cache, or numba's own way."""
        found = self._sound(self._load_overload, sig, target_context)
        if found is None and self._py_func.__module__.startswith(f"{RUNTIME}."):
            announce()
        return found or self._sound(super().load_overload, sig, target_context)

    def _sound(self, load: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return load(*arguments)
        except Exception:  # whatever unpickling does with a file that was cut off or overwritten
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled function, unless the disk is full or the folder has become read-only."""
        with suppress(OSError):
            super().save_overload(sig, data)


def _cache_of(function: Any) -> Any:
    """The disk cache of a function; none where no folder can be written, so that each process compiles anew."""
    try:
        return ReadyCache(function)
    except RuntimeError:
        return NullCache()


def _dispatcher_of(function: Any, *, nogil: bool = False, forceinline: bool = False) -> Any:
    dispatcher = njit(nogil=nogil, forceinline=forceinline, **COMPILE)(function)
    dispatcher._cache = _cache_of(function)
    return dispatcher


class Inner:
    """A function for other compiled functions to call.

    numba's dispatcher is made when one of them is compiled, or Python calls it: code from the cache never needs it.
    """

    forceinline = False

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function
        self.__name__, self.__doc__ = function.__name__, function.__doc__
        self._dispatcher: Any = None

    @property
    def dispatcher(self) -> Any:
        """The function as numba knows it."""
        if self._dispatcher is None:
            self._dispatcher = _dispatcher_of(self.py_func, forceinline=self.forceinline)
            rtsys.initialize(self._dispatcher.targetctx)
        return self._dispatcher

    def __call__(self, *arguments: Any) -> Any:
        """Call it from Python."""
        return self.dispatcher(*arguments)


class Inlined(Inner):
    """An `Inner` function whose code is put where it is called: a loop around a call stays scalar.

    For short functions without branches.
    """

    forceinline = True


@typeof_impl.register(Inner)
def _type_of_inner(value: Inner, _: Any) -> Any:
    return types.Dispatcher(value.dispatcher)


def entry(signature: Any, *, nogil: bool = False, checked: bool = True) -> Callable[[Any], Callable[..., Any]]:
    """An entry point from Python: compiled, or loaded from the cache, when it is first called.

    With ``nogil`` other threads of Python run meanwhile. Unless ``checked``, numba does not look whether arrays are of
    doubles and in one piece: that takes half a microsecond. It is for what every launch calls, from a single place.
    """

    def decorate(function: Any) -> Callable[..., Any]:
        compiled: Any = None

        @wraps(function)
        def call(*arguments: Any) -> Any:
            nonlocal compiled
            if compiled is None:
                dispatcher = _dispatcher_of(function, nogil=nogil)
                rtsys.initialize(dispatcher.targetctx)  # cached code counts its arrays too
                dispatcher.compile(signature)
                dispatcher.disable_compile()
                compiled = dispatcher if checked else dispatcher.overloads[dispatcher.signatures[0]].entry_point
            return compiled(*arguments)

        return call

    return decorate


class Later:
    """A function of a generated module that is compiled when its address is first asked for."""

    def __init__(self, compile_it: Callable[[], Any]) -> None:
        self._compile = compile_it
        self._callback: Any = None

    @property
    def address(self) -> int:
        """Where the compiled function lies in memory."""
        if self._callback is None:
            self._callback = self._compile()
        address: int = self._callback.address
        return address


def compiler(file: str, *, interface: int) -> Callable[..., Callable[[Any], Any]]:
    """A decorator factory for the functions of one generated module: ``compiled(signature, later=False)``.

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

    def compiled(signature: Any, *, later: bool = False) -> Callable[[Any], Any]:
        def compile_it(function: Any) -> Any:
            function.__module__ = alias
            rtsys.initialize(cpu_target.target_context)
            callback: Any = CFunc(function, sigutils.normalize_signature(signature), {}, COMPILE)
            callback._cache = _cache_of(function)
            callback.compile()
            return callback

        return (lambda function: Later(lambda: compile_it(function))) if later else compile_it

    return compiled
