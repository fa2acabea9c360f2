"""All that emitted modules import: each name is fetched from the room it lives in when a module first asks for it.

A room of the runtime may be moved without touching a module that was generated before.
"""

from importlib import import_module
from typing import Any

_NAMES_BY_HOME = {
    "arithmetic.divided_differences.first": "abs1 acos1 acosh1 asin1 asinh1 atan1 atanh1 cos1 cosh1 exp1 ipow1 log1 rpow1 sin1 sinh1 tan1 tanh1",
    "arithmetic.divided_differences.second": "abs2 acos2 acosh2 asin2 asinh2 atan2 atanh2 ipow2 log2 rpow2",
    "arithmetic.divided_differences.trigonometric": "cos2 cosh2 exp2 near_cos2 near_cosh2 near_even near_odd near_sin2 near_sinc near_sinh2 sin2 sinh2 tan2 tanh2",
    "arithmetic.elementary": "atan cos cosh exp sin sinh",
    "arithmetic.intervals": "iabs iacos iacosh iadd iasin iasinh iatan iatanh iconst icos icosh idiv iexp iinv ilog imul ipi ipoint ipow irpow isin isinh isqrt itan itanh",
    "arithmetic.offsets": "left_of nearest",
    "charts.evaluate": "chart_alpha chart_alpha1 chart_alpha2 chart_kappa chart_of chart_x chart_x1 chart_x2 chart_z chart_z1 chart_z2 ichart_alpha ichart_kappa ichart_x ichart_z",
    "charts.rail": "Rail",
    "charts.sampled": "Sampled",
    "charts.tracing": "Traced",
    "interface": "Addresses BEND BEND_EACH BOUNDS BOUNDS_EACH CLIMB CREST_EACH DRIVE Dissipation Each ExactClimb ExactFormulas FIELD FRAME HOLD LOADS MEAN_EACH ORBIT_EACH RISE RISE_EACH SEGMENT SWING_EACH TOP_EACH",
    "launch.request": "LaunchRequest",
    "launch.speed": "Pass1",
    "model": "CompiledModel",
    "motion.motion": "Motion",
    "sweep.sweep": "Sweep",
}
HOMES = {name: home for home, names in _NAMES_BY_HOME.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name not in HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"gqm_sym.runtime.{HOMES[name]}"), name)
