"""Declarations of curves, by formulas, by points or pieces, or as one of the known families."""

from gqm_sym.declare import families
from gqm_sym.declare.curve import Curve
from gqm_sym.declare.piecewise import arc, clothoid, line, transition

__all__ = ["Curve", "arc", "clothoid", "families", "line", "transition"]
