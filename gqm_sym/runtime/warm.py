"""Compilation of everything in advance, for `gqm warm` and for the tests before they begin.

Several processes may need the same compiled functions at once, and each would compile them for itself. Here every entry
point is compiled by one process, those that take longest first; functions that several of them call may still be
compiled twice.
"""

import gc
import inspect
import os
import re
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from types import FunctionType

from gqm_sym.loading import load
from gqm_sym.runtime.compiled import jit
from gqm_sym.runtime.compiled.emitted import Emitted
from gqm_sym.runtime.compiled.stamps import FOLDER, RUNTIME

# numba makes millions of objects, of which little is garbage. The usual frequent search for it takes a tenth of the
# time.
COLLECTION_THRESHOLDS = (100_000, 20, 50)

# Texts that occur in a file with an entry point, or with a function that is called by its address.
ENTRY = re.compile(r"^(@entry\(|@compiled\(|\w.*= Emitted\()", re.MULTILINE)

# The files with the entry points that take longest; if these come first, all processes are busy to the end.
LONGEST = (
    *(
        "legs.answers",
        "sweep.scalar",
        "sweep.batch.batches",
        "charts.double_double.passage",
        "double_double.orbit_time",
    ),
    *(
        "gradients.sensitivity",
        "legs.variations.formula_changes",
        "legs.variations.chain",
        "inversion.records",
        "sweep.tables.tabulate",
        "gradients.lanes.arrivals.times",
        "gradients.lanes.arrivals.beside_hilltops",
    ),
)


def rooms() -> list[str]:
    """Return the dotted names of the files of the runtime that have entry points, the slow ones first."""
    files = (path for path in sorted(FOLDER.rglob("*.py")) if ENTRY.search(path.read_text(encoding="utf-8")))
    names = [".".join(path.relative_to(FOLDER).with_suffix("").parts) for path in files]
    return sorted(names, key=lambda name: LONGEST.index(name) if name in LONGEST else len(LONGEST))


def compile_room(name: str) -> str:
    """Compile the entry points of a file of the runtime into the cache; return its name."""
    module = import_module(f"{RUNTIME}.{name}")
    for call in vars(module).values():
        if isinstance(call, Emitted):
            call.compile()
        is_entry = isinstance(call, FunctionType) and call.__code__.co_name == "call"
        if is_entry and call.__module__ == module.__name__:
            given = inspect.getclosurevars(call).nonlocals
            options = {name: given[name] for name in ("nogil", "checked")}
            jit.COMPILER.entry(given["function"], given["signature"], **options)
    return name


def compile_module(file: str) -> str:
    """Compile all functions of a generated module into the cache; return its path."""
    module = load(file, Path(file).stem)
    for value in vars(module).values():
        if isinstance(value, Emitted):
            value.compile()
    return file


def warm(files: tuple[str, ...] = (), processes: int = 0, progress: Callable[[int, int], None] | None = None) -> int:
    """Compile the runtime, and generated modules, into the cache.

    Parameters
    ----------
    files : tuple of str
        Paths of generated modules.
    processes : int
        The number of processes at a time; 0 for one process for each core.
    progress : callable, optional
        Called with the number of files that are done, and the number of all files.

    Returns
    -------
    int
        The number of files.

    Raises
    ------
    InputError
        If a file is not a generated module, before anything is compiled.
    """
    for file in files:
        load(file, Path(file).stem)
    jobs = [*((compile_room, name) for name in rooms()), *((compile_module, file) for file in files)]
    with ProcessPoolExecutor(
        processes or os.cpu_count() or 1,
        mp_context=get_context("spawn"),
        initializer=gc.set_threshold,
        initargs=COLLECTION_THRESHOLDS,
    ) as pool:
        for done, _ in enumerate(_finished(pool, jobs), start=1):
            if progress is not None:
                progress(done, len(jobs))
    return len(jobs)


def _finished(pool: ProcessPoolExecutor, jobs: list[tuple[Callable[[str], str], str]]) -> Iterator[str]:
    for future in as_completed([pool.submit(work, name) for work, name in jobs]):
        yield future.result()
