"""The numerical library that generated modules run on: it computes motions and sweeps.

A generated module imports `compiler` from here, which refuses a module made for another version of the runtime, and
everything else from `vocabulary`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from gqm_sym.runtime.compiled.emitted import compiler

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.equilibria import Equilibrium
    from gqm_sym.runtime.launch.speed import Pass1, Pass1InSpace, Pass1OfRider
    from gqm_sym.runtime.model import CompiledModel
    from gqm_sym.runtime.motion.events import Event, Leg
    from gqm_sym.runtime.motion.extremes import Extreme
    from gqm_sym.runtime.motion.motion import Motion
    from gqm_sym.runtime.motion.riding.cars import Cars, CarsOfRiders
    from gqm_sym.runtime.motion.riding.exceedance import Exceedance
    from gqm_sym.runtime.motion.state import Energy, State, StateInSpace, StateOfRider
    from gqm_sym.runtime.sweep.result import Sweep

__all__ = [
    "Cars",
    "CarsOfRiders",
    "CompiledModel",
    "Energy",
    "Equilibrium",
    "Event",
    "Exceedance",
    "Extreme",
    "Leg",
    "Motion",
    "Pass1",
    "Pass1InSpace",
    "Pass1OfRider",
    "State",
    "StateInSpace",
    "StateOfRider",
    "Sweep",
    "compiler",
]

_HOMES = {
    "CompiledModel": "model",
    "Energy": "motion.state",
    "Equilibrium": "launch.equilibria",
    "Event": "motion.events",
    "Cars": "motion.riding.cars",
    "CarsOfRiders": "motion.riding.cars",
    "Exceedance": "motion.riding.exceedance",
    "Extreme": "motion.extremes",
    "Leg": "motion.events",
    "Motion": "motion.motion",
    "Pass1": "launch.speed",
    "Pass1InSpace": "launch.speed",
    "Pass1OfRider": "launch.speed",
    "State": "motion.state",
    "StateInSpace": "motion.state",
    "StateOfRider": "motion.state",
    "Sweep": "sweep.result",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
