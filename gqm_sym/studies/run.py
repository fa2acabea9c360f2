"""Run a sweep part by part, here or on a cluster, and store each part as soon as it is finished."""

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
from gqm_sym.runtime.sweep.quantities import QUANTITIES, REFUSED, SOLVE
from gqm_sym.runtime.sweep.result import Sweep
from gqm_sym.studies.plan import Plan
from gqm_sym.studies.results import check_format, dataset, remove, stored, write
from gqm_sym.studies.store import Store

if TYPE_CHECKING:
    from xarray import Dataset


# The type of a function that is called with the number of finished points and the number of all points.
Progress = Callable[[int, int], None]


def run(
    plan: Plan, target: Path | str, *, client: Any = None, force: bool = False, progress: Progress | None = None
) -> "Dataset":
    """Compute a plan and store the results in a file; parts that an interrupted run has stored are not computed again.

    Parameters
    ----------
    plan : Plan
        The plan to compute.
    target : path
        The file, ``.nc`` (netCDF) or ``.zarr``. Until it is complete, its parts are stored beside it in ``FILE.parts``.
    client : distributed.Client, optional
        A Dask cluster to do the work, which gives the same numbers.
    force : bool
        Whether to begin again and overwrite existing results.
    progress : callable, optional
        Called with the number of finished points and the number of all points.

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    InputError
        If the file contains other results.
    """
    target = Path(target)
    check_format(target)
    if force:
        remove(target)
        remove(Store.folder_of(target))
    elif target.exists():
        data = stored(target, plan)
        if data is None:
            what = "is there already, and is not of this sweep"
            raise InputError(f"{target}: {what}; choose another name, or begin anew with force (--force)")
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
    for which, part in _here(jobs) if client is None else finished(client, answer_all, jobs):
        store.put(missing[which], part)
        done += lengths[missing[which]]
        report(done, plan.size)
    swept = store.joined()
    data = dataset(plan, swept, {name: _refusal(plan, source, one) for name, one in swept.items()})
    write(data, target)
    store.remove()
    return data


def _here(jobs: Iterable[tuple[Any, ...]]) -> Iterator[tuple[int, dict[str, Sweep]]]:
    for number, job in enumerate(jobs):
        yield number, answer_all(*job)


def answer_all(
    stamp: str, source: str, text: str, name: str, quantities: tuple[str, ...], arguments: Mapping[str, Any]
) -> dict[str, Sweep]:
    """Compute one part, here or on a worker: every quantity at each of its points.

    The parameters are those of `cluster.answer`.
    """
    out = {}
    for quantity in quantities:
        given = {key: value for key, value in arguments.items() if key != "lam" or quantity == "time_at"}
        out[quantity] = _answered(partial(answer, stamp, source, text, name, quantity), quantity, given)
    return out


def _answered(ask: Callable[[Mapping[str, Any]], Sweep], quantity: str, arguments: Mapping[str, Any]) -> Sweep:
    """Return the results at all points; points that are refused are found by bisection, and do not stop the others."""
    try:
        return ask(arguments)
    except InputError:
        arrays = {key: value for key, value in arguments.items() if isinstance(value, np.ndarray)}
        size = next(iter(arrays.values())).size
        if size == 1:
            shape = (1, 2) if isinstance(QUANTITIES[quantity].columns, slice) else (1,)
            return Sweep(np.full(shape, nan), *(np.full(1, code, dtype=np.int8) for code in (REFUSED, SOLVE)))
        cuts = slice(0, size // 2), slice(size // 2, size)
        halves = [_answered(ask, quantity, {**arguments, **{k: a[cut] for k, a in arrays.items()}}) for cut in cuts]
        return Sweep(*(np.concatenate(both) for both in zip(*halves, strict=True)))


def _refusal(plan: Plan, source: Path, swept: Sweep) -> str:
    """Return the reason why the first refused launch is refused; an empty text if none is."""
    refused = np.flatnonzero(swept.status == REFUSED)
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
