"""Functions of generated modules: Python runs them at first, and they are compiled when that is worth its time."""

import builtins
import ctypes
import hashlib
import math
import re
import sys
import threading
import time
from collections.abc import Callable
from functools import cache
from itertools import takewhile
from pathlib import Path
from types import ModuleType
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
from numba import types

from gqm_sym.errors import OutdatedModuleError
from gqm_sym.runtime.compiled import jit
from gqm_sym.runtime.compiled.numba_internals import GENERATED
from gqm_sym.runtime.compiled.trial import TooSlowError, Trial, go_on, limited, paused
from gqm_sym.runtime.compiled.uncompiled import plain_by_address
from gqm_sym.runtime.interface import INTERFACE

# The time in seconds that Python may spend on running a function of a generated module before the function is compiled.
# Compiling takes some 0.2 s.
MAX_PYTHON_TIME = 0.02

# The time in seconds by which one call, for an array of many places, may take longer than that.
MAX_EXCESS = 0.2


@cache
def _c_function(signature: Any) -> Any:
    """Return the type of C's functions with numba's signature."""
    kinds: dict[Any, Any] = {
        types.float64: ctypes.c_double,
        types.intp: ctypes.c_ssize_t,
        types.uintp: ctypes.c_size_t,
    }
    return ctypes.CFUNCTYPE(None, *(kinds.get(kind, ctypes.c_void_p) for kind in signature.args))


# The memory cells with the addresses of all functions. None of them is freed, so that an address always means the same
# function and results may be stored under it.
_SLOTS: list[ctypes.c_void_p] = []

# The functions that may be called by address, by the cells of their addresses.
_AT: WeakValueDictionary[int, "Emitted"] = WeakValueDictionary()


def run_at(address: int, *arguments: Any) -> None:
    """Run the function whose address is in a memory cell, for functions that run as plain Python."""
    go_on()
    _AT[address].run(*(value.ctypes.data if isinstance(value, np.ndarray) else value for value in arguments))


class Emitted:
    """A function of a generated module that compiled code calls by the address in the cell ``address``.

    Python runs it at first, unless its compiled code is in the cache; it is compiled when that has taken some time. The
    results are the same to the last bit (`uncompiled`).

    Parameters
    ----------
    function : callable
        The function.
    signature
        numba's signature: it returns nothing, and takes numbers and pointers to numbers.
    text : str, optional
        The source text of the function, needed if it may contain powers.
    alias : str, optional
        The name under which numba sees its module, if it is another one.
    """

    def __init__(self, function: Any, signature: Any, text: str | None = None, alias: str | None = None) -> None:
        self.function, self.signature, self.text, self._alias = function, signature, text, alias
        self._slot = ctypes.c_void_p()
        _SLOTS.append(self._slot)
        _AT[ctypes.addressof(self._slot)] = self
        self._compiled: Any = None
        self._plain: Any = None
        self._called_from_c: Any = None
        self._trial: Any = None

    @property
    def address(self) -> int:
        """Make code for the function if there is none yet, and return the cell with its address."""
        self._begin()
        return ctypes.addressof(self._slot)

    @property
    def call(self) -> Callable[..., None]:
        """The function for callers in Python, which pass pointers of `ctypes`."""
        self._begin()
        function: Callable[..., None] = _c_function(self.signature)(self._slot.value)
        return function

    def compile(self) -> None:
        """Compile the function if it is not compiled yet; from now on callers use the compiled function."""
        with jit.COMPILING:
            if self._compiled is not None:
                return
            try:
                with paused():
                    compiled = jit.COMPILER.callback(self._as_numba_sees_it(), self.signature)
            finally:
                jit.ANNOUNCER.end()
            self._slot.value, self._compiled = compiled.address, compiled

    def _as_numba_sees_it(self) -> Any:
        if self._alias is not None:
            sys.modules.setdefault(self._alias, ModuleType(self._alias))
            self.function.__module__ = self._alias
        return self.function

    def _begin(self) -> None:
        """Provide code for the function if there is none yet: compiled code from the cache, or Python's."""
        if self._slot.value:
            return
        record = jit.COMPILER.record(self._as_numba_sees_it(), self.signature)
        if record is not None:
            self._trial = Trial(MAX_PYTHON_TIME if self._alias else jit.MAX_PYTHON_TIME, record)
            self._plain = plain_by_address(self.function, self.signature, self.text)
        if self._plain is None:
            self.compile()
            return
        self._called_from_c = _c_function(self.signature)(self._run_for_c)
        self._slot.value = ctypes.cast(self._called_from_c, ctypes.c_void_p).value

    def run(self, *arguments: Any) -> None:
        """Run the function in Python, or its compiled code if there is some by now; pointers are given as integers."""
        self._begin()
        if self._compiled is None:
            if not self._trial.is_over():
                started = time.perf_counter()
                try:
                    with limited(max(self._trial.left, 0.0) + MAX_EXCESS):
                        self._plain(*arguments)
                    self._trial.left -= time.perf_counter() - started
                    return
                except (ArithmeticError, TooSlowError, ValueError):  # compiled code has no exceptions and goes on here
                    pass
            self.compile()
        self.call(*arguments)

    def _run_for_c(self, *arguments: Any) -> None:
        try:
            self.run(*arguments)
        except BaseException as error:
            jit.PENDING_EXCEPTIONS[threading.get_ident()] = error


class RunByPython(Emitted):
    """A function that Python always runs, also for compiled callers.

    Parameters
    ----------
    function : callable
        The function, which takes pointers as integers.
    signature
        As for `Emitted`.
    """

    def __init__(self, function: Callable[..., None], signature: Any) -> None:
        super().__init__(function, signature)
        self._called_from_c = _c_function(signature)(self._run_for_c)
        self._slot.value = ctypes.cast(self._called_from_c, ctypes.c_void_p).value

    def run(self, *arguments: Any) -> None:
        """Run the function."""
        self.function(*arguments)


class MachineCode(Emitted):
    """A function that is machine code from the beginning.

    Parameters
    ----------
    address : int
        The address of the code.
    signature
        As for `Emitted`.
    owner
        What keeps the code in memory.
    """

    def __init__(self, address: int, signature: Any, owner: Any) -> None:
        super().__init__(None, signature)
        self._slot.value, self._compiled = address, owner


# The functions of generated modules that are in use, by their text, so that modules with the same function share it.
_IN_USE: WeakValueDictionary[str, Emitted] = WeakValueDictionary()

# Modules whose contents are covered by the stamp of compiled code, or never change.
_KNOWN = ("gqm_sym.runtime.", "numba.", "math.", "builtins.")


def _is_known(function: Any, name: str) -> bool:
    """Return whether a name in a function refers to something that is covered by the stamp of its code, or that never
    changes.
    """
    found = vars(builtins).get(name, function.__globals__.get(name))
    home = getattr(getattr(found, "py_func", found), "__module__", None)
    return found is math.pi or (isinstance(home, str) and f"{home}.".startswith(_KNOWN))


def _uses_its_module(function: Any, lines: list[str]) -> bool:
    """Return whether a function refers to something of its module that may change.

    Its code names the attributes that it reads too, and their names follow a point in the text.
    """
    code = function.__code__
    unknown = [name for name in code.co_names if not _is_known(function, name)]
    if not unknown:
        return False
    last = max(line for *_, line in code.co_lines() if line)
    text = "\n".join(lines[code.co_firstlineno - 1 : last])
    return re.search(rf"(?<![.\w])({'|'.join(unknown)})\b", text) is not None


def _text(function: Any, lines: list[str]) -> list[str]:
    """Return the lines of a function with its decorators; all lines of the module if the function uses anything else of
    it.
    """
    if _uses_its_module(function, lines):
        return lines
    begin = function.__code__.co_firstlineno - 1
    head = list(takewhile(lambda line: line.startswith(("@", "def ")), lines[begin:]))
    body = takewhile(lambda line: not line or line[0] in " )", lines[begin + len(head) :])
    return [*head, *body]


def compiler(file: str, *, interface: int) -> Callable[[Any], Callable[[Any], Emitted]]:
    """Return a decorator factory for the functions of one generated module: ``compiled(signature)``.

    Each function becomes an `Emitted`, which Python runs until it is worth compiling.

    numba's disk cache stores the name of a function's module, imports it on loading, and distinguishes machine code by
    it. A generated module may be imported under any name and from any folder. So numba sees each function under a name
    that is made from the function's own text, and other changes of the module cause no compilation.

    Parameters
    ----------
    file : str
        Path of the generated module.
    interface : int
        Version of the runtime's interface that it was generated for.

    Raises
    ------
    OutdatedModuleError
        If that is not the version of this runtime.
    """
    if interface != INTERFACE:
        raise OutdatedModuleError(
            f"{file}: made for interface {interface} of the runtime, which is now at {INTERFACE}; "
            "run gqm-gen on its declaration again"
        )
    lines = Path(file).read_text(encoding="utf-8").splitlines()

    def compiled(signature: Any) -> Callable[[Any], Emitted]:
        def decorate(function: Any) -> Emitted:
            text = "\n".join(_text(function, lines))
            alias = GENERATED + hashlib.sha256(f"{function.__name__}\n{text}".encode()).hexdigest()[:16]
            return _IN_USE.setdefault(alias, Emitted(function, signature, text, alias))

        return decorate

    return compiled
