"""A motion sampled in time as a labelled dataset, with names, units and the input it was computed from."""

from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.optional import require
from gqm_sym.runtime.motion.motion import horizon

if TYPE_CHECKING:
    from xarray import Dataset

    from gqm_sym.runtime.motion.motion import Motion

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


@require("data")
def dataset(motion: "Motion", t: Any = None) -> "Dataset":
    """Sample a motion into an xarray Dataset; `Motion.to_xarray` is the public way to do so.

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
        attributes hold the module, the launch and the parameters as they were given.
    """
    from xarray import Dataset

    times = np.linspace(0.0, horizon(motion), SAMPLES) if t is None else t
    state = motion.state(times)
    formulas, launch = motion.problem.formulas, motion.problem.launch
    columns = {name: (("t",), np.atleast_1d(getattr(state, name)), _attributes(*VARIABLES[name])) for name in VARIABLES}
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
