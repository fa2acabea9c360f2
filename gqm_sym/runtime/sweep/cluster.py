"""Sweeps on a Dask cluster: they are divided into jobs, which carry the module's text to the workers, and the results
are joined here.

The division does not depend on the workers, and a job is computed as it would be here, so that the results are the
same.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import islice
from math import prod
from typing import Any, TypeVar

import numpy as np

from gqm_sym.arguments import short
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.loading import load_text
from gqm_sym.optional import require
from gqm_sym.runtime.compiled.jit import STAMP
from gqm_sym.runtime.sweep.columns import broadcast_shape
from gqm_sym.runtime.sweep.result import Sweep

T = TypeVar("T")

# The number of launches of one job, and the number of jobs in the queue for each thread of a worker.
LAUNCHES_PER_JOB, JOBS_PER_THREAD = 2**13, 3

# The seconds within which a scheduler must answer.
TIMEOUT = 10


@require("dask")
def connected(address: str) -> Any:
    """Return a client of the cluster whose scheduler is at an address.

    Raises
    ------
    InputError
        If there is none.
    """
    from distributed import Client

    try:
        return Client(address, timeout=TIMEOUT)
    except (OSError, ValueError) as error:
        raise InputError(
            f"{address}: no Dask scheduler answers there ({error}); give an address as tcp://host:8786"
        ) from None


@require("dask")
def finished(client: Any, work: Callable[..., T], jobs: Iterable[tuple[Any, ...]]) -> Iterator[tuple[int, T]]:
    """Call ``work`` with the arguments of each job on a cluster; yield the number and the result of each job when it is
    finished.

    Parameters
    ----------
    client : distributed.Client
    work
        A function that the workers can import.
    jobs
        The arguments of each job; they are taken when the queue has space for them.
    """
    from distributed import as_completed

    numbers: dict[str, int] = {}

    def sent(numbered: Iterable[tuple[int, tuple[Any, ...]]]) -> Iterator[Any]:
        for number, job in numbered:
            future = client.submit(work, *job, pure=False)
            numbers[future.key] = number
            yield future

    queue = enumerate(jobs)
    line = as_completed(list(sent(islice(queue, JOBS_PER_THREAD * max(sum(client.nthreads().values()), 2)))))
    return _outcomes(line, numbers, sent(queue))


def _outcomes(line: Any, numbers: dict[str, int], others: Iterator[Any]) -> Iterator[tuple[int, Any]]:
    """Yield each finished job, and submit another one in its place."""
    for future in line:
        outcome = future.result()
        line.update(islice(others, 1))
        yield numbers.pop(future.key), outcome


def answer(stamp: str, source: str, text: str, name: str, quantity: str, arguments: Mapping[str, Any]) -> Sweep:
    """Answer one job, on a worker.

    Parameters
    ----------
    stamp
        The digest of the calling runtime (`jit.STAMP`).
    source, text, name
        The file of the module, its text, and its name.
    quantity, arguments
        The arguments of the module's ``sweep``.
    """
    if stamp != STAMP:
        raise SolutionError("client: a worker runs another version of gqm_sym; install the same one everywhere")
    swept: Sweep = load_text(source, text, name).sweep(quantity, **arguments)
    return swept


def sweep_on(client: Any, module: tuple[str, str, str], quantity: str, arguments: Mapping[str, Any]) -> Sweep:
    """Call ``module.sweep`` on a cluster; the arguments broadcast against each other.

    Parameters
    ----------
    module
        The file of the generated module, its text and its name.
    """
    if not hasattr(client, "nthreads"):
        raise InputError(f"client: must be a distributed.Client, got {short(client)}")
    given = {key: value for key, value in arguments.items() if value is not None}
    # Arrays of objects keep exact numbers and text as they are.
    arrays = {k: v if isinstance(v, np.ndarray) else np.array(v, dtype=object) for k, v in given.items() if np.ndim(v)}
    shape = broadcast_shape(arrays)
    flat = {key: np.broadcast_to(array, shape).reshape(-1) for key, array in arrays.items()}
    cuts = [slice(begin, begin + LAUNCHES_PER_JOB) for begin in range(0, max(prod(shape), 1), LAUNCHES_PER_JOB)]
    parts = ({**given, **{key: column[cut] for key, column in flat.items()}} for cut in cuts)
    found = dict(finished(client, answer, ((STAMP, *module, quantity, part) for part in parts)))
    if not arrays:
        return found[0]
    fields = (np.concatenate(parts) for parts in zip(*(found[k] for k in range(len(cuts))), strict=True))
    return Sweep(*(field.reshape(shape + field.shape[1:]) for field in fields))
