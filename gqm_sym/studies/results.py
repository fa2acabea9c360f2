"""The results of a sweep as a labelled dataset, and as a file in the netCDF or Zarr format."""

import re
import shutil
import tempfile
from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.errors import InputError
from gqm_sym.optional import require
from gqm_sym.runtime.sweep.quantities import STATUS_SENTENCES
from gqm_sym.runtime.sweep.result import DESCRIBED, PLACE, Sweep
from gqm_sym.studies.plan import Plan

if TYPE_CHECKING:
    from xarray import Dataset

_ENGINES: dict[str, dict[str, Any]] = {
    ".nc": {"engine": "h5netcdf"},
    ".zarr": {"engine": "zarr", "consolidated": False},
}
DIGEST = "sweep_digest"


@require("data")
def check_format(target: Path) -> None:
    """Refuse a file in an unknown format, or one that cannot be written, before anything is computed."""
    if target.suffix.lower() not in _ENGINES:
        raise InputError(f"{target}: cannot tell the format of the results; end its name in {' or '.join(_ENGINES)}")
    for package in ("xarray", _ENGINES[target.suffix.lower()]["engine"]):
        import_module(package)


@require("data")
def dataset(plan: Plan, swept: Mapping[str, Sweep], refusals: Mapping[str, str]) -> "Dataset":
    """Return all quantities of a sweep over its axes, with names, units, statuses and provenance.

    Parameters
    ----------
    plan : Plan
        The plan that was computed.
    swept : mapping
        The result for each quantity.
    refusals : mapping
        For each quantity, the reason why the first refused launch is refused; an empty text if none is.

    Returns
    -------
    xarray.Dataset
        A variable for each column, and a variable ``<quantity>_status``, which is 0 where there is a value.
    """
    from xarray import Dataset

    dims = tuple(axis.name for axis in plan.axes) if plan.grid else ("row",)
    coordinates = {
        axis.name: ((axis.name,) if plan.grid else dims, axis.values, _attributes(plan, axis.name))
        for axis in plan.axes
    }
    variables: dict[str, Any] = {}
    for name, one in swept.items():
        columns = {name: one.values}
        if name == "turning_points":
            columns = {f"turning_point_{side}": one.values[..., k] for k, side in enumerate(("lower", "upper"))}
        for column, values in columns.items():
            variables[column] = (dims, values, {**_attributes(plan, column), "ancillary_variables": f"{name}_status"})
        variables[f"{name}_status"] = (dims, one.status, _status_attributes(name, refusals[name]))
    attributes = {
        "title": plan.title or f"sweep over {plan.name}",
        "source": f"gqm_sym {version('gqm_sym')}",
        "curve": plan.name,
        DIGEST: plan.digest,
        **{f"fixed_{name}": text for name, text in plan.fixed.items()},
        **plan.origin,
    }
    return Dataset(variables, coords=coordinates, attrs=attributes)


def _attributes(plan: Plan, name: str) -> dict[str, str]:
    text, unit = DESCRIBED.get(name, (f"parameter {name}", plan.units.get(name, "")))
    unit = plan.units.get(PLACE, "") if unit == PLACE else unit
    return {"long_name": text, **({"units": unit} if unit else {})}


def _status_attributes(name: str, refusal: str) -> dict[str, Any]:
    """Return the attributes of a variable of status codes, in the convention for flags (CF 3.5)."""
    meanings = ["answered", *(re.sub(r"\W+", "_", text) for text in STATUS_SENTENCES[1:])]
    return {
        "long_name": f"status of {name}: why there is no value",
        "flag_values": np.arange(len(STATUS_SENTENCES), dtype=np.int8),
        "flag_meanings": " ".join(meanings),
        **({"first_refused": refusal} if refusal else {}),
    }


@require("data")
def write(data: "Dataset", target: Path) -> None:
    """Write a dataset completely or not at all; the same dataset gives the same bytes."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{target.name}.", dir=target.parent) as folder:
        written = Path(folder) / target.name
        if target.suffix.lower() == ".nc":
            data.to_netcdf(written, engine="h5netcdf")
        else:
            data.to_zarr(written, mode="w", consolidated=False)
        remove(target)
        written.replace(target)


def remove(target: Path) -> None:
    """Remove a file or a folder, if it is there."""
    if target.is_dir():
        shutil.rmtree(target)
    else:
        target.unlink(missing_ok=True)


@require("data")
def stored(target: Path, plan: Plan) -> "Dataset | None":
    """Return the results of a plan from their file; None if the file contains anything else."""
    from xarray import open_dataset

    try:
        with open_dataset(target, **_ENGINES[target.suffix.lower()]) as data:
            return data.load() if data.attrs.get(DIGEST) == plan.digest else None
    except (OSError, ValueError, KeyError):
        return None
