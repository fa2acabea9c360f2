"""All names that emitted modules import; each is fetched from its room when a module first needs it.

A room of the runtime may be moved without touching a module that was generated before.
"""

from importlib import import_module
from typing import Any

_NAMES_BY_HOME = {
    "arithmetic.divided_differences.cotangents": "difference_of_sinc divdiff1_difference_of_sinc",
    "arithmetic.divided_differences.first": (
        "divdiff1_abs divdiff1_acos divdiff1_acosh divdiff1_asin divdiff1_asinh divdiff1_atan divdiff1_atanh "
        "divdiff1_cos divdiff1_cos_of_sum divdiff1_cosh divdiff1_exp divdiff1_ipow divdiff1_log divdiff1_rpow "
        "divdiff1_sin divdiff1_sin_of_sum divdiff1_sinh divdiff1_tan divdiff1_tanh"
    ),
    "arithmetic.divided_differences.second": (
        "divdiff2_abs divdiff2_acos divdiff2_acosh divdiff2_asin divdiff2_asinh divdiff2_atan divdiff2_atanh "
        "divdiff2_ipow divdiff2_log divdiff2_rpow"
    ),
    "arithmetic.divided_differences.trigonometric": (
        "difference_of_sech difference_of_sinhc divdiff1_cos_in_square divdiff1_cosh_in_square "
        "divdiff1_sinc_in_square divdiff1_sinhc_in_square divdiff2_cos divdiff2_cos_near divdiff2_cosh "
        "divdiff2_cosh_near divdiff2_exp divdiff2_sin divdiff2_sin_near divdiff2_sinh divdiff2_sinh_near "
        "divdiff2_tan divdiff2_tanh mean_sech sinc_near sinhc_near sum_of_sinhc"
    ),
    "arithmetic.elementary": "atan cos cos_of_sum cosh exp sin sin_of_sum sinh sinh_of_ratio tanh",
    "arithmetic.intervals": (
        "iabs iacos iacosh iadd iasin iasinh iatan iatanh iconst icos icosh idiv iexp iinv ilog imul ipi "
        "ipoint ipow irpow isin isinh isqrt itan itanh"
    ),
    "arithmetic.offsets": "place_from_ends speed_squared_from_potential",
    "charts.differences": (
        "chart_differences divdiff1_chart_alpha divdiff1_chart_x divdiff1_chart_z divdiff2_chart_alpha "
        "divdiff2_chart_x divdiff2_chart_z"
    ),
    "charts.evaluate": (
        "chart_alpha chart_kappa chart_of chart_rows chart_x chart_z ichart_alpha ichart_kappa ichart_slope ichart_x "
        "ichart_z spare_rows"
    ),
    "charts.polynomials": "Polynomials",
    "charts.rail": "Rail",
    "charts.sampled": "Sampled",
    "charts.space.rail": "SpaceRail",
    "charts.tracing": "Traced",
    "charts.train": "TrackOfTrain",
    "charts.train_load": "speeds_at_rest train_load_rates train_loads train_loads_in_plane",
    "interface": (
        "AGM_ARGUMENTS_BATCH BOUNDS BOUNDS_BATCH BatchFunctions CompiledFunctions DissipativeFunctions "
        "EFFECTIVE_POTENTIAL ExactChartLaw ExactFormulas ExactLaw ExactPotential FIELD INTEGRAND_INVARIANTS_BATCH "
        "LOAD_MAP ORBIT_INVARIANTS_BATCH "
        "PATH_AND_CONTACT_FORCE PATH_IN_SPACE POTENTIAL_DIVDIFF1 POTENTIAL_DIVDIFF1_BATCH POTENTIAL_DIVDIFF2 "
        "POTENTIAL_DIVDIFF2_BATCH RIDER_LOADS SEGMENT SEPARATED_TERMS SPEED_EQUATION SQUARED_CONTACT STATIC_BALANCE "
        "SeparatedTerms "
        "TIME_INTEGRAND_BATCH TURNING_POINT_BATCH"
    ),
    "launch.request": "LaunchRequest",  # only older modules import it; newer ones give its fields
    "launch.speed": "Pass1 Pass1InSpace Pass1OfRider",
    "model": "CompiledModel",
    "motion.motion": "Motion",
    "sweep.result": "Sweep",
}
HOMES = {name: home for home, names in _NAMES_BY_HOME.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name not in HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"gqm_sym.runtime.{HOMES[name]}"), name)
