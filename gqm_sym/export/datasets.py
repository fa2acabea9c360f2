"""Motions, states and sweeps as pandas tables and xarray datasets, with names, units and provenance."""

from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.errors import InputError
from gqm_sym.optional import require
from gqm_sym.runtime.launch.kinds import LOADS
from gqm_sym.runtime.motion.motion import horizon
from gqm_sym.runtime.sweep.result import DESCRIBED, PLACE, Sweep, columns_of

if TYPE_CHECKING:
    from xarray import Dataset

    from gqm_sym.runtime.motion.motion import Motion
    from gqm_sym.runtime.motion.state import State

SAMPLES = 201

# Long name and unit of each variable. The unit of the curve parameter depends on the declaration and is not known here.
VARIABLES = {
    "lam": ("curve parameter", None),
    "s": ("arc length from the launch", "m"),
    "x": ("horizontal coordinate", "m"),
    "z": ("height", "m"),
    "v": ("velocity ds/dt", "m/s"),
    "v2": ("squared speed", "m2/s2"),
    "kappa": ("signed curvature", "1/m"),
    "normal_force": ("contact force along the normal, which points to the left of increasing parameter", "N"),
}
# The same for the fields that only states in space have.
VARIABLES_IN_SPACE = {
    "y": ("the other horizontal coordinate", "m"),
    **{f"normal_{axis}": (f"contact force along {axis}", "N") for axis in "xyz"},
    **{f"n_{load}": (f"{load} load on a rider, in units of 9.80665 m/s2", "1") for load in LOADS},
    **{f"onset_{load}": (f"rate of change of the {load} load, in units of 9.80665 m/s2", "1/s") for load in LOADS},
    "roll": ("roll angle, positive to the left", "rad"),
    **{f"track_{axis}": (f"{axis} of the track below the rider's line", "m") for axis in "xyz"},
}


@require("data")
def dataset(motion: "Motion", t: Any = None) -> "Dataset":
    """Sample a motion into an xarray Dataset; the public method is `Motion.to_xarray`.

    Parameters
    ----------
    motion : Motion
        The motion.
    t : array_like, optional
        Times in seconds from the launch. Without it 201 times are spaced evenly over one period, or over the whole
        motion if it does not repeat.

    Returns
    -------
    xarray.Dataset
        The variables of a `State` over the dimension ``t``, and ``lam_error``, the bound of the error of ``lam``. The
        attributes contain the module, the launch and the parameters as they were given.
    """
    from xarray import Dataset

    times = _times(motion, t)
    state = motion.state(times)
    if np.ndim(state.t) > 1:
        raise InputError(f"t: must be one time or a row of times, got an array of shape {np.shape(state.t)}")
    formulas, launch = motion.problem.formulas, motion.problem.launch
    known = VARIABLES | {name: text for name, text in VARIABLES_IN_SPACE.items() if name in state._fields}
    columns = {name: (("t",), np.atleast_1d(getattr(state, name)), _attributes(*text)) for name, text in known.items()}
    columns["lam"][2]["parameter"] = formulas.parameter
    error = np.atleast_1d(motion.error_bound(times))
    columns["lam_error"] = (("t",), error, _attributes("bound of the error of lam", None))
    time = ("t", np.atleast_1d(state.t), _attributes("time from the launch", "s"))
    provenance = {
        "module": formulas.name,
        "kind": motion.kind,
        "lam0": launch.lam0.text,
        "v0": launch.v0.text,
        "direction": motion.direction,
        "contact": launch.contact,
        **{f"parameter_{name}": p.text for name, p in zip(formulas.parameters, motion.problem.p, strict=True)},
    }
    return Dataset(columns, coords={"t": time}, attrs=provenance)


def _attributes(long_name: str, units: str | None) -> dict[str, str]:
    return {"long_name": long_name, **({"units": units} if units else {})}


def _times(motion: "Motion", t: Any) -> Any:
    """Return the given times, or else those by which a motion is sampled."""
    return np.linspace(0.0, horizon(motion), SAMPLES) if t is None else t


def motion_frame(motion: "Motion", t: Any = None) -> Any:
    """Sample a motion into a pandas table; `Motion.to_pandas` is the public way to it, with times as in `dataset`."""
    return state_frame(motion.state(_times(motion, t)))


@require("data")
def state_frame(state: "State") -> Any:
    """Return the states at times as a pandas table; the public method is `State.to_pandas`."""
    from pandas import DataFrame

    return DataFrame({name: np.atleast_1d(np.asarray(field)).reshape(-1) for name, field in state._asdict().items()})


@require("data")
def sweep_frame(sweep: Sweep) -> Any:
    """Return the launches of a sweep as a pandas table; the public method is `Sweep.to_pandas`."""
    from pandas import DataFrame

    table = DataFrame(columns_of(sweep))
    table.attrs |= {name: value for name, value in sweep.arguments.items() if not np.ndim(value)}
    return table


@require("data")
def sweep_dataset(sweep: Sweep) -> "Dataset":
    """Return a sweep as an xarray dataset; the public method is `Sweep.to_xarray`."""
    from xarray import Dataset

    shape = sweep.status.shape
    varied = {name: np.asarray(value) for name, value in sweep.arguments.items() if np.ndim(value)}
    aligned = {name: value.reshape((1,) * (len(shape) - value.ndim) + value.shape) for name, value in varied.items()}
    dims = [_axis_name(axis, aligned) for axis in range(len(shape))]
    fixed = {name: value for name, value in sweep.arguments.items() if name not in varied}

    def described(name: str) -> dict[str, str]:
        long_name, unit = DESCRIBED.get(name, (name, ""))
        return _attributes(long_name, None if unit in ("", PLACE) else unit)

    coordinates: dict[str, Any] = {}
    for name, value in aligned.items():
        if name in dims:
            coordinates[name] = ((name,), value.reshape(-1), described(name))
        else:
            coordinates[name] = (tuple(dims), np.broadcast_to(value, shape), described(name))
    names = [sweep.quantity] if sweep.values.ndim == len(shape) else ["turning_point_lower", "turning_point_upper"]
    values = sweep.values.reshape(*shape, len(names))
    columns: dict[str, Any] = {name: (tuple(dims), values[..., k], described(name)) for k, name in enumerate(names)}
    columns["status"] = (tuple(dims), sweep.status, _attributes("0 where there is a value", None))
    columns["route"] = (tuple(dims), sweep.route, _attributes("how the launch was answered", None))
    return Dataset(columns, coords=coordinates, attrs=fixed)


def _axis_name(axis: int, arguments: dict[str, Any]) -> str:
    """Return the name of the argument that varies along this axis only; a numbered name if there is none."""
    along = [name for name, value in arguments.items() if value.shape[axis] != 1]
    alone = len(along) == 1 and arguments[along[0]].size == arguments[along[0]].shape[axis]
    return along[0] if alone else f"axis_{axis}"
