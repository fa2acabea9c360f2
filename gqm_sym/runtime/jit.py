"""The one place for compiler options, and for how generated functions are compiled.

No fast-math: reassociation would break sums and products of two doubles, and NaN and infinity have meaning here. Division by
zero gives infinity, as in IEEE arithmetic, and is not an exception.
"""

import hashlib
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from numba import cfunc

COMPILE: dict[str, Any] = {"cache": True, "error_model": "numpy"}


def compiler(file: str) -> Callable[[Any], Callable[[Any], Any]]:
    """A decorator factory for the functions of one generated module: ``compiled(signature)``.

    numba's disk cache remembers the module's name and imports it on loading, and machine code is told apart by it. A generated module may
    be imported under any name, from any folder; so its functions are given to numba under a name made from the module's own text.
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
