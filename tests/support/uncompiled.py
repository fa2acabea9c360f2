"""The runtime can run as plain Python throughout, which is how coverage is measured and mutants are run.

Python runs what is not compiled yet, to the same bits. Here nothing ever is.
"""

import math
import os
from pathlib import Path

import numba
import pytest

from gqm_sym.runtime.compiled import emitted, jit, trial, uncompiled


def install() -> None:
    """Let Python run what numba would compile, from now on."""
    jit.MAX_PYTHON_TIME = emitted.MAX_PYTHON_TIME = uncompiled.MAX_CALL = trial.MAX_LAUNCHES = math.inf
    jit.COMPILER.record = lambda *_: Path(os.devnull)  # type: ignore[method-assign]
    jit.COMPILER.callback = jit.COMPILER.entry = _refused  # type: ignore[method-assign, assignment]
    numba.cfunc = _refused


def _refused(*_: object, **__: object) -> None:
    pytest.fail("this would be compiled")
