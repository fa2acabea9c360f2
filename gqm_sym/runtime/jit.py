"""The one place for compiler options, and for how generated functions are compiled.

No fast-math: reassociation would break sums and products of two doubles, and NaN and infinity have meaning here.
Division by
zero gives infinity, as in IEEE arithmetic, and is not an exception.
"""

import hashlib
import sys
from collections.abc import Callable
from functools import wraps
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

from numba import cfunc, njit

COMPILE: dict[str, Any] = {"cache": True, "error_model": "numpy"}


def _spare_scipy() -> None:
    """Keep numba from importing scipy.linalg, a third of its start-up, to learn whether ``np.dot`` can be compiled.

    numba asks once, through `ensure_blas`; whether SciPy is installed answers it. Wherever BLAS is really used,
    numba asks again.
    """
    if "numba.np.arraymath" in sys.modules:
        return
    from numba.np import linalg

    def installed() -> None:
        if find_spec("scipy") is None:
            raise ImportError("scipy")

    asks = linalg.ensure_blas
    linalg.ensure_blas = installed
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        linalg.ensure_blas = asks


_spare_scipy()


def entry(signature: Any) -> Callable[[Any], Callable[..., Any]]:
    """An entry point from Python: compiled, or loaded from the cache, when it is first called."""

    def decorate(function: Any) -> Callable[..., Any]:
        compiled: Any = None

        @wraps(function)
        def call(*arguments: Any) -> Any:
            nonlocal compiled
            if compiled is None:
                compiled = njit(signature, **COMPILE)(function)
            return compiled(*arguments)

        return call

    return decorate


def compiler(file: str) -> Callable[[Any], Callable[[Any], Any]]:
    """A decorator factory for the functions of one generated module: ``compiled(signature)``.

    numba's disk cache remembers the module's name and imports it on loading, and machine code is told apart by it.
    A generated module may
    be imported under any name, from any folder; so its functions are given to numba under a name made from the
    module's own text.
    """
    digest = hashlib.sha256(Path(file).read_bytes()).hexdigest()[:16]
    alias = f"gqm_sym_generated_{digest}"
    sys.modules.setdefault(alias, ModuleType(alias))

    def compiled(signature: Any) -> Callable[[Any], Any]:
        def decorate(function: Any) -> Any:
            function.__module__ = alias
            return cfunc(signature, **COMPILE)(function)

        return decorate

    return compiled
