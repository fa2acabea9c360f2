"""Results of a sweep as a labelled dataset, and as a file of netCDF or Zarr."""

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
_PLACE = "lam0"  # what is a value of the curve's parameter has the launch place's unit

# What the columns hold, and its unit.
DESCRIBED = {
    "half_period": ("time from one turning point to the other", "s"),
    "period": ("time after which the motion repeats", "s"),
    "turning_point_lower": ("lower turning point, as a value of the curve's parameter", _PLACE),
    "turning_point_upper": ("upper turning point, as a value of the curve's parameter", _PLACE),
    "v_min": ("least speed", "m/s"),
    "v_max": ("largest speed", "m/s"),
    "normal_force_min": ("least contact force along the normal", "N"),
    "normal_force_max": ("largest contact force along the normal", "N"),
    "time_at": ("first time at the place lam", "s"),
    "t_end": ("time at which the motion ends", "s"),
    "rest_position": ("where the body rests in the end, as a value of the curve's parameter", _PLACE),
    "lam0": ("launch place, as a value of the curve's parameter", _PLACE),
    "v0": ("launch speed", "m/s"),
    "direction": ("sign of ds/dt at launch", ""),
    "lam": ("place asked about, as a value of the curve's parameter", _PLACE),
}


@require("data")
def check_format(target: Path) -> None:
    """Refuse a file whose ending is no known format, or that could not be written, before anything is computed."""
    if target.suffix.lower() not in _ENGINES:
        raise InputError(f"{target}: cannot tell the format of the results; end its name in {' or '.join(_ENGINES)}")
    for package in ("xarray", _ENGINES[target.suffix.lower()]["engine"]):
        import_module(package)


@require("data")
def dataset(plan: Plan, swept: Mapping[str, Sweep], refusals: Mapping[str, str]) -> "Dataset":
    """All quantities over what varies, with names, units, why there is no value, and what it was made from.

    Parameters
    ----------
    refusals
        Of each quantity, why the first refused launch is refused; empty where none is.
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
            variables[column] = (dims, values, {**_attributes(plan, column), "ancillary_variables": f"{name}_reason"})
        variables[f"{name}_reason"] = (dims, one.reasons, _why(name, refusals[name]))
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
    unit = plan.units.get(_PLACE, "") if unit == _PLACE else unit
    return {"long_name": text, **({"units": unit} if unit else {})}


def _why(name: str, refusal: str) -> dict[str, Any]:
    """Attributes of the reasons, in the convention for flags (CF 3.5)."""
    meanings = ["answered", *(re.sub(r"\W+", "_", text) for text in REASONS[1:])]
    return {
        "long_name": f"why there is no {name}",
        "flag_values": np.arange(len(REASONS), dtype=np.int8),
        "flag_meanings": " ".join(meanings),
        **({"first_refused": refusal} if refusal else {}),
    }


@require("data")
def write(data: "Dataset", target: Path) -> None:
    """Write a dataset, whole or not at all; the same dataset gives the same bytes."""
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
    """The results of a plan from their file; None if that holds anything else."""
    from xarray import open_dataset

    try:
        with open_dataset(target, **_ENGINES[target.suffix.lower()]) as data:
            return data.load() if data.attrs.get(DIGEST) == plan.digest else None
    except (OSError, ValueError, KeyError):
        return None
