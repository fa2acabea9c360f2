"""Tapes of the exact formulas of a module, recorded when they are first needed.

A module contains its formulas as plain Python over a namespace of operations, which `recording` provides. To record one
takes less than a millisecond, and the module needs to contain nothing but the formula.
"""

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.double_double.recording import NOWHERE, BoundTape, Recorded, Recorder
from gqm_sym.runtime.interface import ExactFormulas


@lru_cache(maxsize=64)
def record(formulas: ExactFormulas, domain: Callable[..., Any], parameters: int) -> Recorded | None:
    """Return the tape of a module's formulas and registers with its constants; None if they are too long.

    Parameters
    ----------
    formulas : ExactFormulas
        The formulas.
    domain : callable
        ``f(op, p)`` gives the ends of the parameter's range and its period.
    parameters : int
        The number of run-time parameters.
    """
    op = Recorder(parameters)
    potential = op.register(formulas.effective_potential(op, op.place, op.values))
    ds = op.register(formulas.ds(op, op.place, op.values))
    period = domain(op, op.values)[2]
    period_register = NOWHERE if period is None else op.register(period)
    slope = op.register(formulas.effective_potential_slope(op, op.place, op.values))
    return op.finished((potential, ds), (slope,), period_register)


@lru_cache(maxsize=64)
def record_by_coordinates(
    function: Callable[..., Any], parameters: int, dimension: int = 2, known: tuple[tuple[int, Fraction], ...] = ()
) -> Recorded | None:
    """Return the tape of a function ``f(op, x, z, p)``, or ``f(op, x, y, z, p)`` in space, that gives a value and its
    derivatives with respect to the coordinates.

    It is None if it is too long. ``known`` are run-time parameters whose values belong to it.
    """
    op = Recorder(parameters, dimension, known)
    value, *slopes = map(op.register, function(op, *_in_order(op.places), op.values))
    by_x, by_z, *by_y = _in_order(slopes)
    return op.finished((value,), (by_x, by_z), *by_y)


@lru_cache(maxsize=64)
def exponents_of(function: Callable[..., Any], parameters: int, dimension: int = 2) -> frozenset[int]:
    """Return the run-time parameters on which exponents depend in a function of coordinates."""
    op = Recorder(parameters, dimension)
    function(op, *_in_order(op.places), op.values)
    return frozenset(op.exponents)


def bound_by_coordinates(
    function: Callable[..., Any], parameters: Sequence[Number], dimension: int = 2
) -> BoundTape | None:
    """Return the tape of `record_by_coordinates` with values of its parameters; None if it is too long.

    Exponents belong to the tape if they are rational: powers with integer exponents are products, which are real for
    negative numbers too.
    """
    found = ((k, parameters[k].fraction) for k in sorted(exponents_of(function, len(parameters), dimension)))
    known = tuple((k, value) for k, value in found if value is not None)
    return bind(record_by_coordinates(function, len(parameters), dimension, known), parameters)


def _in_order(coordinates: Sequence[Any]) -> Sequence[Any]:
    """Return x, z and y as x, y and z, and conversely; x and z stay as they are."""
    return coordinates if len(coordinates) == 2 else [coordinates[k] for k in (0, 2, 1)]


@lru_cache(maxsize=64)
def record_values(function: Callable[..., Any], parameters: int, count: int, dimension: int) -> Recorded | None:
    """Return the tape of the first values that a function of coordinates gives; None if it is too long.

    Its registers are those of the first run-time parameter, of x and of these values; the rest are empty.
    """
    op = Recorder(parameters, dimension)
    found = function(op, *_in_order(op.places), op.values)
    values = found if isinstance(found, tuple) else (found,)
    return op.finished([op.register(value) for value in values[:count]], ())


def bind(found: Recorded | None, parameters: Sequence[Number]) -> BoundTape | None:
    """Return a recorded tape with values of its parameters; None if there is no tape."""
    if found is None:
        return None
    return BoundTape(*found, np.array([[p.value for p in parameters], [p.low for p in parameters]]).reshape(2, -1))
