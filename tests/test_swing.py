"""Orbits about an axis as integrals without sines: their times are those of the motion, wherever there is such a form."""

from math import inf
from types import ModuleType
from collections.abc import Callable

import mpmath
import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.derivation.swing import APART, GAP, HALF, LACK, SCALE, SQUARE, TOP, TOP_APART, TOP_LACK

ModuleOf = Callable[[str], ModuleType]

X = sp.Symbol("x", real=True)


def derived(z: str, **given: float) -> gqm.Model:
    """A graph under gravity."""
    return gqm.derive(gqm.Curve.graph(z, parameter="x", parameters=given), gqm.Gravity())


def by_swing(model: gqm.Model, half: float) -> mpf:
    """The half period by the integral over u."""
    swing = model.swing
    assert swing is not None
    numbers = {sp.Symbol(name, real=True): sp.nsimplify(value) for name, value in model.defaults}
    numbers |= {s: sp.nsimplify(v) for name, v in model.defaults for s in swing.pace.free_symbols if s.name == name}
    ends = {symbol: end.xreplace({HALF: sp.Float(half, 40)}).xreplace(numbers).evalf(40) for symbol, end in swing.ends}

    def rate(u: mpf) -> mpf:
        fall, rise = sp.Float(mp.sin(u) ** 2, 40), sp.Float(mp.cos(u) ** 2, 40)
        here = {
            SQUARE: ends[TOP] * fall,
            GAP: ends[TOP] * rise,
            LACK: rise + ends.get(TOP_LACK, 0) * fall,
            APART: rise + ends.get(TOP_APART, 0) * fall,
        }
        if swing.scale is not None:
            here[SCALE] = swing.scale.xreplace(here)
        return mp.sqrt(mpf(str(swing.pace.xreplace(here | ends | numbers).evalf(35))))

    return 2 * mpmath.quad(rate, [0, mp.pi / 4, mp.pi / 2])
