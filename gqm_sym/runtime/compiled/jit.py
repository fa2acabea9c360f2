"""Decorators that compile functions, and the compiler options of all of them.

Fast-math is off: reassociation would break sums and products of two doubles, and NaN and infinity have meaning here.
Division by zero gives infinity, as in IEEE arithmetic, and is not an exception.
"""

import sys
import threading
import time
from collections.abc import Callable
from functools import wraps
from typing import Any

from numba import typeof, types
from numba.extending import typeof_impl

from gqm_sym.runtime.compiled.numba_internals import Compiler
from gqm_sym.runtime.compiled.stamps import RUNTIME, Stamps
from gqm_sym.runtime.compiled.trial import Trial
from gqm_sym.runtime.compiled.uncompiled import NotPlainError, PlainEntry

COMPILE: dict[str, Any] = {"error_model": "numpy"}


STAMPS = Stamps()

# The digest of the whole runtime, by which processes and stored parts of studies recognise that they belong together.
STAMP = STAMPS.of_all


def stamp_for(function: Any) -> str:
    """Return the digest of all files of the runtime that a function's compiled code may come from."""
    return STAMPS.of(function.__module__)


class Announcer:
    """An object that says on standard error that something is being compiled for this machine, if that takes long.

    Parameters
    ----------
    seconds : float
        The processor time after which it says so.
    """

    def __init__(self, seconds: float = 2.0) -> None:
        self.seconds = seconds
        self._own = threading.local()

    def begin(self, function: Any) -> None:
        """Note that the compilation of a function begins; functions that are compiled on its behalf count as part of
        it.
        """
        if getattr(self._own, "done", None) is None:
            self._own.done = threading.Event()
            room = function.__module__.removeprefix(f"{RUNTIME}.")
            what = room if room != function.__module__ else f"{function.__name__} of a generated module"
            threading.Thread(target=self._watch, args=(what, self._own.done), daemon=True).start()

    def end(self) -> None:
        """Note that the compilation in this thread has ended."""
        done = getattr(self._own, "done", None)
        if done is not None:
            done.set()
            self._own.done = None

    def _watch(self, what: str, done: threading.Event) -> None:
        started = time.process_time()
        while not done.wait(0.25 * self.seconds):
            if time.process_time() - started >= self.seconds:
                if sys.stderr is not None:
                    print(f"gqm_sym: compiling for this machine, once: {what}", file=sys.stderr, flush=True)
                return


ANNOUNCER = Announcer()
COMPILER = Compiler(COMPILE, lambda function: stamp_for(function), ANNOUNCER.begin)


# This lock is held while a function is compiled, and threads that need the same function wait for it. A compiled
# function must not be replaced, because other threads may be running it.
COMPILING = threading.RLock()

# Exceptions raised in Python code that compiled code had called, by thread. Python cannot pass them through compiled
# code.
PENDING_EXCEPTIONS: dict[int, BaseException] = {}


def raise_pending() -> None:
    """Raise the exception that was raised while compiled code ran in this thread, if there is one."""
    raised = PENDING_EXCEPTIONS.pop(threading.get_ident(), None)
    if raised is not None:
        raise raised


class Inner:
    """A function that other compiled functions call.

    Its numba dispatcher is made only when one of its callers is compiled or when Python calls it; code from the cache
    never needs it.
    """

    forceinline = False

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function
        self.__name__, self.__doc__ = function.__name__, function.__doc__
        self._dispatcher: Any = None
        self._called: Any = None
        self._plain: dict[Any, PlainEntry] = {}

    @property
    def dispatcher(self) -> Any:
        """The function as a dispatcher of numba, for compiled callers."""
        if self._dispatcher is None:
            self._dispatcher = COMPILER.inner(self.py_func, forceinline=self.forceinline)
        return self._dispatcher

    def __call__(self, *arguments: Any) -> Any:
        """Call the function from Python, which runs it at first; numbers keep their types, as in compiled code."""
        if self._called is None:
            kinds = tuple(map(typeof, arguments))
            try:
                if kinds not in self._plain:
                    self._plain[kinds] = _plain_entry(self.py_func, kinds)
                return self._plain[kinds](arguments)
            except NotPlainError:
                self._called = COMPILER.called(self.py_func)
        try:
            return self._called(*arguments)
        finally:
            ANNOUNCER.end()
            raise_pending()


class Inlined(Inner):
    """An `Inner` function that is inlined where it is called, for short functions without branches.

    LLVM does not vectorise a loop that contains a call.
    """

    forceinline = True


@typeof_impl.register(Inner)
def _type_of_inner(value: Inner, _: Any) -> Any:
    return types.Dispatcher(value.dispatcher)


# The time in seconds that Python may spend on running an entry point before it is compiled. Compiling takes some
# seconds.
MAX_PYTHON_TIME = 2.0


def _plain_entry(function: Any, signature: Any) -> PlainEntry:
    """Return an entry point as plain Python; None if its compiled code is in the cache or it must be compiled."""
    record = COMPILER.record(function, signature)
    if record is None:
        raise NotPlainError
    return PlainEntry(function, getattr(signature, "args", signature), Trial(MAX_PYTHON_TIME, record))


def entry(signature: Any, *, nogil: bool = False, checked: bool = True) -> Callable[[Any], Callable[..., Any]]:
    """Make a function an entry point from Python.

    Unless its code is in the cache, the function runs as plain Python at first, and is compiled when that has taken
    some time. The results are the same to the last bit (`uncompiled`).

    Parameters
    ----------
    signature
        numba's signature.
    nogil : bool
        Whether other threads of Python may run while the function does.
    checked : bool
        Whether numba checks that arrays are contiguous and of doubles, which takes half a microsecond, or two where
        named tuples are given. The check is switched off for the functions that every launch or its first question
        calls, each of which is called in a single place.
    """

    def decorate(function: Any) -> Callable[..., Any]:
        compiled: Any = None
        plain: Any = None

        @wraps(function)
        def call(*arguments: Any) -> Any:
            nonlocal compiled, plain
            if compiled is None:
                try:
                    plain = plain or _plain_entry(function, signature)
                    return plain(arguments)
                except NotPlainError:
                    pass
                with COMPILING:
                    if compiled is None:
                        try:
                            compiled = COMPILER.entry(function, signature, nogil=nogil, checked=checked)
                        finally:
                            ANNOUNCER.end()
            result = compiled(*arguments)
            if PENDING_EXCEPTIONS:
                raise_pending()
            return result

        return call

    return decorate
