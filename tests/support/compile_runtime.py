"""Fill numba's cache before the tests begin: ``compile_runtime.py [PROCESSES]``.

The tests run in several processes, and all of them need the same compiled functions at once: each would compile them
for itself. Here every entry point is compiled by one process only, the ones that take longest first; functions that
several of them call may still be compiled twice.
"""

import inspect
import os
import re
import sys
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from multiprocessing import get_context
from types import FunctionType

from paths import ROOT

sys.path.insert(0, str(ROOT))

RUNTIME = ROOT / "gqm_sym" / "runtime"
# Where the entry points that take longest are: all processes are busy to the end when these come first.
LONGEST = ("sweep.scalar", "sweep.batch.batches", "legs.answers", "launch.speed")


def modules() -> list[str]:
    """The modules of the runtime that have entry points, the slow ones first."""
    files = (path for path in sorted(RUNTIME.rglob("*.py")) if re.search(r"entry\(|Later\(", path.read_text("utf-8")))
    names = [".".join(path.relative_to(RUNTIME).with_suffix("").parts) for path in files]
    return sorted(names, key=lambda name: LONGEST.index(name) if name in LONGEST else len(LONGEST))


def compile_entries(name: str) -> str:
    """Compile the entry points of a module into the cache."""
    from gqm_sym.runtime.compiled import jit

    module = import_module(f"gqm_sym.runtime.{name}")
    for call in vars(module).values():
        if isinstance(call, jit.Later):
            assert call.address
        is_entry = isinstance(call, FunctionType) and call.__code__.co_name == "call"
        if is_entry and call.__module__ == module.__name__:
            given = inspect.getclosurevars(call).nonlocals
            options = {name: given[name] for name in ("nogil", "checked")}
            jit.COMPILER.entry(given["function"], given["signature"], **options)
    return name


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else os.cpu_count() or 1
    with ProcessPoolExecutor(count, mp_context=get_context("fork")) as pool:
        list(pool.map(compile_entries, modules()))
