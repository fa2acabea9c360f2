"""From a declared curve and a force law to closed forms: pure functions between frozen values."""

from gqm_sym.derivation.model import Model
from gqm_sym.derivation.pipeline import derive

__all__ = ["Model", "derive"]
