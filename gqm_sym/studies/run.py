"""Run a sweep part by part, in this process or on a cluster; each part is stored as soon as it is computed."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.building import write_text
from gqm_sym.errors import GQMError, InputError
from gqm_sym.loading import load
from gqm_sym.runtime.compiled.jit import STAMP
from gqm_sym.runtime.sweep.cluster import answer, finished
from gqm_sym.runtime.sweep.sweep import QUANTITIES, REFUSED, Sweep
from gqm_sym.studies.plan import Plan
from gqm_sym.studies.results import check_format, dataset, read_results, remove, write
from gqm_sym.studies.store import Store

if TYPE_CHECKING:
    from xarray import Dataset


# Called with the number of points that are done and the number of all points.
Progress = Callable[[int, int], None]


def run(
    plan: Plan, target: Path | str, *, client: Any = None, force: bool = False, progress: Progress | None = None
) -> "Dataset":
    """Compute a sweep and write its results to a file; an interrupted run is continued.

    Parameters
    ----------
    plan : Plan
        What to compute, as `read_sweep` returns it.
    target : path
        The file, ``.nc`` (netCDF) or ``.zarr``. Until it is complete, finished parts are stored beside it in the folder
        ``FILE.parts``.
    client : distributed.Client, optional
        A Dask cluster that does the work. The numbers are the same.
    force : bool
        Whether to start again and overwrite what is stored.
    progress : callable, optional
        Called with the number of points that are done and the number of all points.

    Returns
    -------
    xarray.Dataset
        The results, as they are in the file.

    Raises
    ------
    InputError
        If the file or the folder of parts holds the results of another sweep, or the format is unknown.
    """
    target = Path(target)
    check_format(target)
    if force:
        remove(target)
        remove(Store.folder_of(target))
    elif target.exists():
        data = read_results(target, plan)
        if data is None:
            what = "already exists and does not hold the results of this sweep"
            raise InputError(f"{target}: {what}; choose another name, or overwrite it with force=True (--force)")
        remove(Store.folder_of(target))
        return data
    store = Store(target, plan)
    source = store.folder / f"{plan.name}.py"
    write_text(plan.module, source)
    lengths = {number: store.length(number) for number in store.missing()}
    done, missing = plan.size - sum(lengths.values()), list(lengths)
    report = progress or (lambda done, size: None)
    report(done, plan.size)
    jobs = ((STAMP, str(source), plan.module, plan.name, plan.quantities, plan.arguments(k)) for k in missing)
    for number, swept in _computed_here(jobs) if client is None else finished(client, answer_all, jobs):
        store.put(missing[number], swept)
        done += lengths[missing[number]]
        report(done, plan.size)
    results = store.results()
    data = dataset(plan, results, {name: _refusal(plan, source, one) for name, one in results.items()})
    write(data, target)
    store.remove()
    return data


def _computed_here(jobs: Iterable[tuple[Any, ...]]) -> Iterator[tuple[int, dict[str, Sweep]]]:
    for number, job in enumerate(jobs):
        yield number, answer_all(*job)


def answer_all(
    stamp: str, source: str, text: str, name: str, quantities: tuple[str, ...], arguments: Mapping[str, Any]
) -> dict[str, Sweep]:
    """Compute every quantity at each point of one part, here or on a worker; arguments as for `cluster.answer`."""
    out = {}
    for quantity in quantities:
        given = {key: value for key, value in arguments.items() if key != "lam" or quantity == "time_at"}
        out[quantity] = _answered(partial(answer, stamp, source, text, name, quantity), quantity, given)
    return out


def _answered(compute: Callable[[Mapping[str, Any]], Sweep], quantity: str, arguments: Mapping[str, Any]) -> Sweep:
    """Return values and status. Bisection isolates points with invalid arguments, so that the others are computed."""
    try:
        return compute(arguments)
    except InputError:
        arrays = {key: value for key, value in arguments.items() if isinstance(value, np.ndarray)}
        size = next(iter(arrays.values())).size
        if size == 1:
            shape = (1, 2) if isinstance(QUANTITIES[quantity].columns, slice) else (1,)
            return Sweep(np.full(shape, nan), np.full(1, REFUSED, dtype=np.int8))
        cuts = slice(0, size // 2), slice(size // 2, size)
        halves = [_answered(compute, quantity, {**arguments, **{k: a[cut] for k, a in arrays.items()}}) for cut in cuts]
        return Sweep(*(np.concatenate(both) for both in zip(*halves, strict=True)))


def _refusal(plan: Plan, source: Path, swept: Sweep) -> str:
    """Return why the first refused launch is refused; empty if none is."""
    refused = np.flatnonzero(swept[1] == REFUSED)
    if not refused.size:
        return ""
    given = plan.point(int(refused[0]))
    launch = {key: value for key, value in given.items() if key != "lam"}
    at = ", ".join(f"{axis.name} = {given[axis.name]!r}" for axis in plan.axes)
    try:
        load(source, plan.name).solve(**launch)
    except GQMError as error:
        return f"at {at}: {error}"
    return f"at {at}"
