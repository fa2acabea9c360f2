"""The operations of exact formulas over floats and over NumPy arrays, named as an mpmath context names them."""

import math
from math import e, pi
from types import SimpleNamespace

import numpy as np

# The same names as an mpmath context has, over floats.
FLOATS = SimpleNamespace(
    **{name: getattr(math, name) for name in ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"]},
    **{name: getattr(math, name) for name in ["asinh", "acosh", "atanh", "exp", "log", "sqrt", "pi", "e"]},
    mpf=float,
)

# The names that a module's domain needs, over arrays.
ARRAYS = SimpleNamespace(
    **{name: getattr(np, name) for name in ["sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "sqrt"]},
    **{name: getattr(np, f"arc{name[1:]}") for name in ["asin", "acos", "atan", "asinh", "acosh", "atanh"]},
    pi=pi,
    e=e,
    mpf=float,
)
