"""Results of a sweep as a labelled dataset, and as a netCDF or Zarr file."""

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
from gqm_sym.runtime.sweep.sweep import REASONS, Sweep
from gqm_sym.studies.plan import Plan

if TYPE_CHECKING:
    from xarray import Dataset

_ENGINES: dict[str, dict[str, Any]] = {
    ".nc": {"engine": "h5netcdf"},
    ".zarr": {"engine": "zarr", "consolidated": False},
}
DIGEST = "sweep_digest"
_LAM_UNIT = "lam0"  # stands for the unit of the curve parameter, which is that of the launch place

# Long name and unit of each variable.
VARIABLES = {
    "half_period": ("time from one turning point to the other", "s"),
    "period": ("time after which the motion repeats", "s"),
    "turning_point_lower": ("lower turning point, as a value of the curve parameter", _LAM_UNIT),
    "turning_point_upper": ("upper turning point, as a value of the curve parameter", _LAM_UNIT),
    "v_min": ("least speed", "m/s"),
    "v_max": ("largest speed", "m/s"),
    "normal_force_min": ("least contact force along the normal", "N"),
    "normal_force_max": ("largest contact force along the normal", "N"),
    "time_at": ("first time at the place lam", "s"),
    "t_end": ("time at which the motion ends", "s"),
    "rest_position": ("place where the body comes to rest, as a value of the curve parameter", _LAM_UNIT),
    "lam0": ("launch place, as a value of the curve parameter", _LAM_UNIT),
    "v0": ("launch speed", "m/s"),
    "direction": ("sign of ds/dt at launch", ""),
    "lam": ("place whose first passage time_at gives, as a value of the curve parameter", _LAM_UNIT),
}


@require("data")
def check_format(target: Path) -> None:
    """Check, before anything is computed, that results can be written to a file.

    Raises
    ------
    InputError
        If the extension of the file is not that of a known format, or a package that is needed is not installed.
    """
    if target.suffix.lower() not in _ENGINES:
        raise InputError(
            f"{target}: the format of the results is unknown; use a name that ends in {' or '.join(_ENGINES)}"
        )
    for package in ("xarray", _ENGINES[target.suffix.lower()]["engine"]):
        import_module(package)


@require("data")
def dataset(plan: Plan, swept: Mapping[str, Sweep], refusals: Mapping[str, str]) -> "Dataset":
    """Return all quantities as a dataset with names, units, status codes and the input they were computed from.

    Parameters
    ----------
    plan : Plan
        What was computed.
    swept : mapping
        The result of each quantity, in the shape of the plan.
    refusals : mapping
        For each quantity the reason why the first refused launch is refused; empty if none is.

    Returns
    -------
    xarray.Dataset
        A variable for each quantity (two for the turning points), and one named ``<quantity>_status`` with its codes.
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
        variables[f"{name}_status"] = (dims, one[1], _status_attributes(name, refusals[name]))
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
    text, unit = VARIABLES.get(name, (f"parameter {name}", plan.units.get(name, "")))
    unit = plan.units.get(_LAM_UNIT, "") if unit == _LAM_UNIT else unit
    return {"long_name": text, **({"units": unit} if unit else {})}


def _status_attributes(name: str, refusal: str) -> dict[str, Any]:
    """Return the attributes of status codes, by the CF conventions for flags (section 3.5)."""
    meanings = ["answered", *(re.sub(r"\W+", "_", text) for text in REASONS[1:])]
    return {
        "long_name": f"status of {name}",
        "flag_values": np.arange(len(REASONS), dtype=np.int8),
        "flag_meanings": " ".join(meanings),
        **({"first_refused": refusal} if refusal else {}),
    }


@require("data")
def write(data: "Dataset", target: Path) -> None:
    """Write a dataset to a file, completely or not at all; the same dataset gives the same bytes."""
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
    """Remove a file or a folder, if it exists."""
    if target.is_dir():
        shutil.rmtree(target)
    else:
        target.unlink(missing_ok=True)


@require("data")
def read_results(target: Path, plan: Plan) -> "Dataset | None":
    """Return the results of a plan from a file; None if the file holds anything else."""
    from xarray import open_dataset

    try:
        with open_dataset(target, **_ENGINES[target.suffix.lower()]) as data:
            return data.load() if data.attrs.get(DIGEST) == plan.digest else None
    except (OSError, ValueError, KeyError):
        return None
