"""Launches and tracks that are determined from requirements on a motion; the tracks are curves like any other."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gqm_sym.design.descent import brachistochrone
    from gqm_sym.design.load import constant_load, from_load
    from gqm_sym.design.optimum import minimise
    from gqm_sym.design.period_law import from_period, height_limit

_HOMES = {
    "brachistochrone": "descent",
    "constant_load": "load",
    "from_load": "load",
    "from_period": "period_law",
    "height_limit": "period_law",
    "minimise": "optimum",
}

__all__ = ["brachistochrone", "constant_load", "from_load", "from_period", "height_limit", "minimise"]


def __getattr__(name: str) -> Any:
    """Fetch a function when it is first used: the least launch speed needs no SymPy, the tracks do."""
    if name not in _HOMES:
        raise AttributeError(f"module 'gqm_sym.design' has no attribute {name!r}")
    return getattr(import_module(f"gqm_sym.design.{_HOMES[name]}"), name)
