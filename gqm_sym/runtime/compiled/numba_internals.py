"""The only file that uses names which numba does not document. Each of them saves time; none of them is needed.

=================================== ==================================== ===============================================
name                                what it is used for                  what is done where numba lacks it
=================================== ==================================== ===============================================
``caching.FunctionCache``,          a disk cache that notices an edit    ``cache=True``, in a cache folder named by the
``caching.IndexDataCacheFile``,     of any file of the runtime, and is   runtime's digest; only functions called from
``_cache`` of a compiled function   read before numba prepares to        Python or by address are cached, and each
                                    compile (`KeyedCache`)               process takes 0.4 s of CPU time longer to start
``ccallback.CFunc``                 the same cache for functions         ``numba.cfunc(..., cache=True)``: 0.4 s longer
                                    called by address
``codegen.JITCodeLibrary``,         functions that only compiled code    they are: the first compilation takes twice as
``codegen.JITCPUCodegen``,          calls are not optimised or turned    long
``compiler.Compiler``               into machine code by themselves
``get_call_template`` of a          one version of a function for all    one for each: the first compilation takes
dispatcher                          integers that are written in calls   a sixth longer
``get_call_type`` and               what numba's own functions return    it is looked for at each call: the first
``_impl_keys`` of                   for arguments of some types is       compilation takes a seventh longer
``types.Function``                  looked for once
``runtime.rtsys``                   code from the cache runs without     the preparation: 0.4 s longer
                                    numba's preparation
``environment.Environment``,        code from the cache is read          reading imports them: 0.2 s longer
``environment.lookup_environment``  without importing numba's modules
``entry_point`` of an overload      calls without a check of the         each call takes 0.5 microseconds longer
                                    arguments' types
=================================== ==================================== ===============================================

The digits of all results are the same in every case (`tests/runtime/compiled/test_numba_internals.py`).
"""

import hashlib
import os
import pickle
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from inspect import getfile
from pathlib import Path
from threading import RLock
from types import ModuleType
from typing import Any, ClassVar

import llvmlite.binding
import numba
from numba import njit, types

try:
    from numba.core.caching import FunctionCache, IndexDataCacheFile
except ImportError:
    FunctionCache = IndexDataCacheFile = object
try:
    from numba.core import ccallback
except ImportError:
    ccallback = None  # type: ignore[assignment]
try:
    from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
except ImportError:
    JITCodeLibrary = JITCPUCodegen = object
try:
    from numba.core.compiler import Compiler as Pipeline
except ImportError:
    Pipeline = object
try:
    from numba.core.environment import Environment, lookup_environment
except ImportError:
    Environment = lookup_environment = None
try:
    from numba.core.runtime import rtsys
except ImportError:
    rtsys = None


def _has(owner: object, *names: str) -> bool:
    return all(hasattr(owner, name) for name in names)


HAS_CACHE = _has(FunctionCache, "load_overload", "save_overload", "_load_overload", "_index_key") and _has(
    IndexDataCacheFile, "_save_data", "_data_path"
)
HAS_CALLBACKS = _has(ccallback, "CFunc") and _has(ccallback.CFunc, "_targetdescr")
HAS_ENVIRONMENTS = _has(Environment, "_memo")
HAS_RUNTIME = _has(rtsys, "initialize")
HAS_RESOLUTION = _has(types.Function, "get_call_type", "get_impl_key")
HAS_LIBRARIES = (
    HAS_CACHE
    and HAS_RUNTIME
    and _has(JITCodeLibrary, "_optimize_functions", "_optimize_final_module", "_finalize_final_module")
    and _has(JITCodeLibrary, "_finalize_specific", "_finalize_dynamic_globals")
    and _has(JITCPUCodegen, "_library_class", "_function_pass_manager", "_pass_builder")
    and _has(Pipeline, "define_pipelines", "compile_extra")
)

# Numba sees a function of a generated module in a module of this name, followed by a digest of the function's text.
GENERATED = "gqm_sym_generated_"

# numba.config is one for the whole process; it is changed while a function is made whose code numba itself caches.
_CONFIG = RLock()


def _environment(module: str, constants: Any, name: str) -> Any:
    """Rebuild the environment of a compiled function without importing the module that the function is from.

    An environment holds Python objects that compiled code uses, and the code here uses none. numba's own functions,
    such as ``np.empty``, have environments too, and importing their modules takes longer than everything else.
    """
    found = lookup_environment(name)
    if found is None:
        found = Environment(vars(sys.modules.get(module, ModuleType(module))))
        found.consts[:], found.env_name = constants, name
        Environment._memo[name] = found
    return found


class _Reader(pickle.Unpickler):
    """A reader of compiled code that imports no modules for its environments."""

    def find_class(self, module: str, name: str) -> Any:
        if HAS_ENVIRONMENTS and (module, name) == (Environment.__module__, "_rebuild_env"):
            return _environment
        return super().find_class(module, name)


class EntryLibrary(JITCodeLibrary):  # type: ignore[misc]
    """The machine code of a function that Python calls, or that is called by its address, with all that it calls."""

    # How far a function is optimised before it is linked with what it calls.
    options: ClassVar[dict[str, Any]] = {}

    def _optimize_functions(self, ll_module: Any) -> None:
        """Optimise each function by itself; numba does the same, and takes as long for each that is only declared."""
        ll_module.data_layout = self._codegen._data_layout
        manager, builder = self._codegen._function_pass_manager(**self.options)
        for function in ll_module.functions:
            if not function.is_declaration:
                manager.run(function, builder)

    def _optimize_final_module(self) -> None:
        """Optimise all functions together, as thoroughly as LLVM does if no other code can call the linked ones.

        LLVM may change the arguments of these functions. So they must not keep a symbol either: code that is compiled
        later, such as a user's own function that calls the same ones, would find them by it.
        """
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == llvmlite.binding.Linkage.linkonce_odr:
                function.linkage = llvmlite.binding.Linkage.private
        super()._optimize_final_module()

    def _finalize_specific(self) -> None:
        """Make the machine code, and set the addresses of the environments of the code that it is linked with."""
        super()._finalize_specific()
        for variable in self._final_module.global_variables if HAS_ENVIRONMENTS else ():
            found = None if variable.is_declaration else lookup_environment(variable.name)
            if found is not None:
                self._codegen.set_env(variable.name, found)


class _NoEnvironments:
    """A stand-in for a code generator, used if no code could read an environment."""

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing."""


class LinkedLibrary(EntryLibrary):
    """Code that is linked with that of its callers, and not optimised or turned into machine code by itself.

    numba makes machine code of each function together with all that it calls, and does so again for each function that
    calls it, up to the entry point. Nearly all of that is thrown away.
    """

    options: ClassVar[dict[str, Any]] = {"opt": 1, "loop_vectorize": False, "slp_vectorize": False}
    codegen = _NoEnvironments()

    def _optimize_final_module(self) -> None:
        """Leave out what is not used."""
        manager = llvmlite.binding.create_new_module_pass_manager()
        manager.add_global_dead_code_eliminate_pass()
        manager.run(self._final_module, self._codegen._pass_builder(**self.options))

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0: there is no machine code."""
        return 0

    def serialize_using_object_code(self) -> Any:
        """Return what is kept on disk."""
        return self.serialize_using_bitcode()


@contextmanager
def _libraries(codegen: Any, kind: Any) -> Iterator[None]:
    """Have numba make libraries of a kind; it lets one thread at a time compile."""
    before, codegen._library_class = codegen._library_class, kind
    try:
        yield
    finally:
        codegen._library_class = before


# What numba's own functions, such as the sum of two numbers, were found to return for arguments of some types: the
# function itself, so that no other has its identity, the signature, and the key of the version that is called.
_RESOLVED: dict[tuple[Any, ...], tuple[Any, Any, Any]] = {}
_SEARCH = getattr(types.Function, "get_call_type", None)


def _resolve(function: Any, context: Any, arguments: Any, keywords: Any) -> Any:
    """Return the signature of the version of a function that fits arguments of some types, and note its key."""
    if keywords:
        return _SEARCH(function, context, arguments, keywords)  # type: ignore[misc]
    given = (id(function), context, *arguments)
    if given not in _RESOLVED:
        signature = _SEARCH(function, context, arguments, keywords)  # type: ignore[misc]
        _RESOLVED[given] = (function, signature, function._impl_keys[signature.args])
    _, signature, function._impl_keys[signature.args] = _RESOLVED[given]
    return signature


@contextmanager
def _resolved_once() -> Iterator[None]:
    """Have numba look once for the version of each of its own functions that fits arguments of some types.

    It looks at each call, twice for each function that it compiles, and for a sum of numbers among versions for arrays
    too.
    """
    before = _SEARCH
    if HAS_RESOLUTION:
        before, types.Function.get_call_type = types.Function.get_call_type, _resolve
    try:
        yield
    finally:
        if HAS_RESOLUTION:
            types.Function.get_call_type = before


class CallbackPipeline(Pipeline):  # type: ignore[misc]
    """numba's steps of compilation, for a function that is called by its address."""

    library: type[Any] = EntryLibrary
    unneeded: tuple[str, ...] = ()

    def compile_extra(self, function: Any) -> Any:
        """Compile a function; those of numba's own that it calls are only linked."""
        with _libraries(self.state.targetctx.codegen(), LinkedLibrary), _resolved_once():
            return super().compile_extra(function)

    def define_pipelines(self) -> Any:
        """Choose the library and what is made beside the function, and return the steps."""
        self.state.library = self.library(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        for wrapper in self.unneeded:
            setattr(self.state.flags, wrapper, True)
        return super().define_pipelines()


class EntryPipeline(CallbackPipeline):
    """For a function that Python calls."""

    unneeded = ("no_cfunc_wrapper",)


class LinkedPipeline(CallbackPipeline):
    """For a function that only compiled functions call."""

    library, unneeded = LinkedLibrary, ("no_cfunc_wrapper", "no_cpython_wrapper")


class KeyedFiles(IndexDataCacheFile):  # type: ignore[misc]
    """The files of one function's compiled code: one for each key, which is named by the key and contains it.

    numba's own scheme numbers the files in an index that is written before the code. Processes that compile versions of
    a function at the same time may give both the same number, and a process that is killed in between leaves the number
    of an older file behind: the next process would then run the wrong code.
    """

    def __init__(self, folder: str, base: str, source_stamp: Any) -> None:
        super().__init__(folder, base, source_stamp)
        self._base, self._stamp = base, source_stamp

    def file_name(self, key: Any) -> str:
        """Return the name of the file that belongs to a key."""
        digest = hashlib.sha256(repr((numba.__version__, self._stamp, key)).encode()).hexdigest()[:16]
        return f"{self._base}.{digest}.nbc"

    def save(self, key: Any, data: Any) -> None:
        """Store compiled code under its key."""
        Path(self._cache_path).mkdir(parents=True, exist_ok=True)
        record = self.record(key)
        self._save_data(self.file_name(key), (self._stamp, key, data))
        if record is not None:
            record.unlink(missing_ok=True)

    def record(self, key: Any) -> Path | None:
        """Return the file with one byte for each launch in which Python ran the function; None if its code is
        stored.
        """
        code = Path(self._data_path(self.file_name(key)))
        return None if code.exists() else code.with_suffix(".launches")

    def load(self, key: Any) -> Any:
        """Read the compiled code that was stored under a key; return None if there is none."""
        try:
            with Path(self._data_path(self.file_name(key))).open("rb") as file:
                stamp, stored_key, data = _Reader(file).load()
        except FileNotFoundError:
            return None
        return data if (stamp, stored_key) == (self._stamp, key) else None


class KeyedCache(FunctionCache):  # type: ignore[misc]
    """numba's disk cache, read before numba prepares to compile, and aware of changes anywhere in the runtime.

    The preparation imports and registers everything that compiling may need (SciPy's linear algebra as well) and takes
    0.4 s; code from the cache needs none of it. numba itself notices changes of a function's own file only, but
    compiled code contains functions of several files: the key holds ``stamp``, the digest of the files that it may come
    from (`stamps`), and the name of the function's module. For a function of a generated module that name is made from
    its text (`jit.compiler`), which alone identifies it: where all machine code is in one folder (``NUMBA_CACHE_DIR``),
    modules with the same function share it. A function whose file cannot be read is compiled again, and a file that
    cannot be written is not stored.

    Parameters
    ----------
    function
        The Python function.
    stamp : str
        Digest of the files that the function's code may come from.
    on_miss
        Called before a function is compiled that is not in the cache.
    linked : bool
        Whether the code is only linked with that of its callers.
    """

    def __init__(self, function: Any, stamp: str, on_miss: Callable[[Any], None], *, linked: bool) -> None:
        super().__init__(function)
        folder, base = self.cache_path, self._impl.filename_base
        source_stamp = self._impl.locator.get_source_stamp()
        if function.__module__.startswith(GENERATED):
            folder = str(Path(numba.config.CACHE_DIR, "gqm_sym_generated")) if numba.config.CACHE_DIR else folder
            base, source_stamp = function.__name__, ""
        self._cache_file: Any = KeyedFiles(folder, base, source_stamp)
        self._function, self._stamp, self._on_miss, self._linked = function, stamp, on_miss, linked

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return (*super()._index_key(sig, codegen), self._function.__module__, self._stamp, self._linked)

    def record(self, sig: Any) -> Path | None:
        """Return the file with one byte for each launch in which Python ran the function; None if its code is
        stored.
        """
        target: Any = ccallback.CFunc._targetdescr  # type: ignore[attr-defined]
        found: Path | None = self._cache_file.record(self._index_key(sig, target.target_context.codegen()))
        return found

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Read the compiled function; None where it must be compiled."""
        found = None
        if HAS_RUNTIME:
            rtsys.initialize(target_context)  # code from the cache counts references to its arrays
            found = self._read(self._load_overload, sig, target_context)
        if found is None:  # there may be code that cannot be read without the preparation
            found = self._read(super().load_overload, sig, target_context)
        if found is None:
            self._on_miss(self._function)
        return found

    def _read(self, load: Callable[..., Any], sig: Any, target_context: Any) -> Any:
        try:
            if not HAS_LIBRARIES:
                return load(sig, target_context)
            with _libraries(target_context.codegen(), LinkedLibrary if self._linked else JITCodeLibrary):
                return load(sig, target_context)
        except Exception:  # unpickling a truncated or overwritten file may raise anything
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store a compiled function, unless the disk is full or the folder has become read-only."""
        with suppress(OSError):
            super().save_overload(sig, data)


def _steps(pipeline: type[Any]) -> dict[str, Any]:
    """Return the option that makes numba compile by these steps, if numba has the names that they need."""
    return {"pipeline_class": pipeline} if HAS_LIBRARIES else {}


class Compiler:
    """The way in which functions are compiled and cached; `jit` has the only instance.

    Parameters
    ----------
    options : dict
        numba's options for every function.
    stamp
        ``f(function)``: the digest of the text of all files that the function's code may come from.
    on_miss
        Called before a function is compiled that is not in the cache.
    """

    def __init__(self, options: dict[str, Any], stamp: Callable[[Any], str], on_miss: Callable[[Any], None]) -> None:
        self._options, self._stamp, self._on_miss = options, stamp, on_miss

    def cache_of(self, function: Any, *, linked: bool = False) -> Any:
        """Return the disk cache of a function; None if no folder can be written or numba lacks the names that it
        needs.
        """
        if not HAS_CACHE:
            return None
        with suppress(RuntimeError, AttributeError):
            return KeyedCache(function, self._stamp(function), self._on_miss, linked=linked)
        return None

    def inner(self, function: Any, *, forceinline: bool = False) -> Any:
        """Return numba's dispatcher of a function that other compiled functions call, and Python does not."""
        dispatcher = njit(forceinline=forceinline, **self._options, **_steps(LinkedPipeline))(function)
        self._attach(dispatcher, function, linked=HAS_LIBRARIES)
        if _has(dispatcher, "get_call_template"):
            template = dispatcher.get_call_template
            dispatcher.get_call_template = lambda arguments, keywords: template(
                [types.unliteral(kind) for kind in arguments],
                {name: types.unliteral(kind) for name, kind in keywords.items()},
            )
        return dispatcher

    def called(self, function: Any) -> Any:
        """Return numba's dispatcher of a function that Python calls with arguments of any type."""
        dispatcher = njit(**self._options, **_steps(EntryPipeline))(function)
        self._attach(dispatcher, function)
        return dispatcher

    def entry(self, function: Any, signature: Any, *, nogil: bool, checked: bool) -> Callable[..., Any]:
        """Compile a function that Python calls, for one signature.

        Unless ``checked``, numba does not check that arrays are contiguous and of doubles.
        """
        dispatcher = njit(nogil=nogil, **self._options, **_steps(EntryPipeline))(function)
        if self._attach(dispatcher, function):
            dispatcher.compile(signature)
        else:
            dispatcher = self._by_public_cache(
                function, lambda cache: njit(signature, nogil=nogil, cache=cache, **self._options)(function)
            )
        dispatcher.disable_compile()
        (overload,) = dispatcher.overloads.values()
        direct = not checked and _has(overload, "entry_point")
        return overload.entry_point if direct else dispatcher  # type: ignore[no-any-return]

    def record(self, function: Any, signature: Any) -> Path | None:
        """Return the file with one byte for each launch in which Python has run a function, in all processes.

        The function is called from Python or by address. The result is None if the cache is known to have its code.
        """
        cache = self.cache_of(function) if HAS_CALLBACKS else None
        return None if cache is None else cache.record(signature)

    def callback(self, function: Any, signature: Any) -> Any:
        """Compile a function that is called by its ``address``."""
        if HAS_CALLBACKS:
            pair = (signature.args, signature.return_type)
            callback: Any = ccallback.CFunc(function, pair, {}, self._options, **_steps(CallbackPipeline))
            if self._attach(callback, function):
                callback.compile()
                return callback
        return self._by_public_cache(
            function, lambda cache: numba.cfunc(signature, cache=cache, **self._options)(function)
        )

    def _attach(self, target: Any, function: Any, *, linked: bool = False) -> bool:
        """Give numba's object our disk cache; return whether that was possible."""
        cache = self.cache_of(function, linked=linked)
        possible = cache is not None and _has(target, "_cache")
        if possible:
            target._cache = cache
        return possible

    def _by_public_cache(self, function: Any, make: Callable[[bool], Any]) -> Any:
        """Compile a function by numba's documented ways alone.

        numba numbers the files of a function, and only notices changes of the function's own file. So the name of the
        folder contains a digest of everything else that the code depends on, including the processor; each folder then
        has one version only.
        """
        parts = (numba.__version__, self._stamp(function), function.__module__, llvmlite.binding.get_host_cpu_name())
        name = hashlib.sha256("\n".join((*parts, str(llvmlite.binding.get_host_cpu_features()))).encode()).hexdigest()
        with self._folder(Path(getfile(function)).parent, name[:16]) as usable:
            if usable:
                with suppress(Exception):  # a damaged file; other errors are raised again below
                    return make(True)
            return make(False)

    @contextmanager
    def _folder(self, beside: Path, name: str) -> Iterator[bool]:
        """Make numba cache in a folder of this name during the ``with`` block, which gets whether the folder can be
        written.
        """
        with _CONFIG:
            before = numba.config.CACHE_DIR
            folder = Path(before or beside / "__pycache__") / f"gqm_sym_{name}"
            try:
                folder.mkdir(parents=True, exist_ok=True)
                usable = os.access(folder, os.W_OK)
            except OSError:
                usable = False
            numba.config.CACHE_DIR = str(folder)
            try:
                yield usable
            finally:
                numba.config.CACHE_DIR = before
