"""Whether a rolling body fits into its track: 1 - kappa*radius, with which ds shrinks, must stay positive."""

from typing import TYPE_CHECKING

import numpy as np

from gqm_sym.errors import LaunchError, SolutionError
from gqm_sym.runtime.entries import frame_at
from gqm_sym.runtime.functions import Functions

if TYPE_CHECKING:
    from gqm_sym.runtime.formulas import Formulas
    from gqm_sym.runtime.motion import Motion


def check_launch(formulas: "Formulas", f: Functions, lam0: float) -> None:
    """Refuse a launch where the body does not fit."""
    ds = frame_at(f.addresses, f.p, np.array([lam0]), np.zeros(1))[2, 0]
    if not ds > 0.0:
        raise LaunchError(f"lam0: {_what(formulas, lam0)}; launch elsewhere, or {_remedy(formulas)}")


def check_end(formulas: "Formulas", motion: "Motion") -> None:
    """Refuse a motion that comes to where the body no longer fits: the centre's path has a cusp there."""
    last = motion.legs[-1] if motion.legs else None
    if last is not None and last.end == "cusp":
        what = f"{_what(formulas, last.lam_end)}, where it comes after {last.t_end!r} s"
        raise SolutionError(f"{what}; {_remedy(formulas)}")


def _what(formulas: "Formulas", place: float) -> str:
    return f"a body of radius {formulas.body} does not fit into the track at {formulas.parameter} = {place!r}"


def _remedy(formulas: "Formulas") -> str:
    return f"give {formulas.body} so that 1 - kappa*{formulas.body} > 0, kappa being the track's curvature"
