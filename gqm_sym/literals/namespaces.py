"""The operations of exact formulas, for floats and for NumPy arrays, under the names that an mpmath context has."""

import math
from math import e, pi
from types import SimpleNamespace

import numpy as np

# The operations for floats.
FLOATS = SimpleNamespace(
    **{name: getattr(math, name) for name in ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"]},
    **{name: getattr(math, name) for name in ["asinh", "acosh", "atanh", "exp", "log", "sqrt", "pi", "e"]},
    mpf=float,
)

# The operations for arrays: the functions that the domain of a module may need.
ARRAYS = SimpleNamespace(
    **{name: getattr(np, name) for name in ["sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "sqrt"]},
    **{name: getattr(np, f"arc{name[1:]}") for name in ["asin", "acos", "atan", "asinh", "acosh", "atanh"]},
    pi=pi,
    e=e,
    mpf=float,
)
