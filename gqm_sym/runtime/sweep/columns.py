"""Launches and parameters of a sweep as columns of doubles, checked."""

from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from math import inf, nan
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gqm_sym.arguments import not_given
from gqm_sym.errors import InputError, ParameterError
from gqm_sym.literals.namespaces import ARRAYS
from gqm_sym.literals.numbers import Number, doubles_at_once, read_number
from gqm_sym.runtime.compiled.types import Array

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas


# The types of a single number, and the largest integer up to which all integers are doubles.
ONE_NUMBER, MAX_EXACT_INTEGER = (float, int, str, Number), 2**53


def broadcast_shape(columns: Mapping[str, Array]) -> tuple[int, ...]:
    """Return the shape to which named arrays broadcast."""
    different = {column.shape for column in columns.values()} - {()}
    if len(different) <= 1:
        return next(iter(different), ())
    try:
        return np.broadcast_shapes(*different)
    except ValueError:
        shapes = ", ".join(f"{name} {column.shape}" for name, column in columns.items() if column.shape)
        raise InputError(f"sweep: these shapes do not broadcast against each other: {shapes}") from None


def as_doubles(value: Any, name: str) -> Array:
    """Return numbers as doubles; text and exact numbers become the nearest doubles."""
    if type(value) is float or (type(value) is int and abs(value) <= MAX_EXACT_INTEGER):
        return np.array(float(value))
    if type(value) is str:
        return np.array(_of_text(value, name))
    if value is None:
        raise ParameterError(not_given(name))
    if isinstance(value, np.ndarray) and value.dtype.kind in "fiu":
        return value.astype(np.float64, copy=False)
    doubles = doubles_at_once(value)
    if doubles is not None:
        return doubles
    array = np.asarray(value, dtype=object)
    numbers = [v if isinstance(v, float) else read_number(v, where=name).value for v in array.reshape(-1)]
    return np.array(numbers, dtype=np.float64).reshape(array.shape)


@lru_cache(maxsize=256)
def _of_text(value: str, name: str) -> float:
    return read_number(value, where=name).value


def check_launches(v0: Array, direction: Array) -> None:
    """Refuse speeds and directions that no launch of a sweep may have."""
    if v0.item() < 0.0 if v0.ndim == 0 else (v0 < 0.0).any():
        raise InputError("v0: is a speed and cannot be negative; use direction=-1 to launch the other way")
    if abs(direction.item()) != 1.0 if direction.ndim == 0 else (np.abs(direction) != 1.0).any():
        raise InputError("direction: must be 1 or -1 (the sign of ds/dt at launch)")


def refused(formulas: "Formulas", columns: dict[str, Array]) -> Iterator[tuple[NDArray[np.bool_], str]]:
    """Yield which parameters are refused, because the closed forms do not hold for them or because they are below a
    lower limit of the model, and why.
    """
    for name in (*formulas.positive, "m"):
        yield columns[name] <= 0.0, f"{name}: must be positive; the closed forms hold for {name} > 0"
    for name, lower in formulas.at_least:
        bound = columns[lower] if lower in columns else read_number(lower, where=lower).value
        yield columns[name] < bound, f"{name}: must be at least {lower}"


def columns_of(
    formulas: "Formulas", given: tuple[Any, ...], launches: dict[str, Array]
) -> tuple[list[Array], list[Array]]:
    """Return the columns of the parameters, followed by the chart, and those of the curve's domain.

    If all launches have the same parameters, the columns are found once; otherwise the parameters must broadcast with
    the launches.
    """
    if all(isinstance(value, ONE_NUMBER) or not (isinstance(value, np.ndarray) or np.ndim(value)) for value in given):
        numbers = formulas.numbers(given)
        if numbers.columns is None:
            p = list(map(np.array, numbers.values))
            numbers.columns = p, list(_domain_columns(formulas, p))
        columns: tuple[list[Array], list[Array]] = numbers.columns
        return columns
    named = {name: as_doubles(value, name) for value, name in zip(given, formulas.parameters, strict=True)}
    for wrong, message in refused(formulas, named):
        if wrong.any():
            raise ParameterError(message)
    broadcast_shape({**launches, **named})
    p = list(named.values())
    if formulas.trigonometric is not None:
        p += map(np.asarray, formulas.trigonometric_over(ARRAYS, tuple(p)))
    return p, list(_domain_columns(formulas, p))


def _domain_columns(formulas: "Formulas", p: list[Array]) -> Iterator[Array]:
    """Return the domain and the axes of symmetry of each launch's curve, in the order of `strided`; a chart has no
    axes.
    """
    if formulas.chart is not None:
        return
    place, step = formulas.axes(ARRAYS, tuple(p))
    place_low, step_low = _roundings_of_axes(formulas, place, step, p)
    found = (*formulas.ends(ARRAYS, tuple(p)), place, place_low, step, step_low)
    for value, default in zip(found, (-inf, inf, 0.0, nan, nan, 0.0, 0.0), strict=True):
        yield np.asarray(default if value is None else value, dtype=np.float64)


def _roundings_of_axes(
    formulas: "Formulas", place: Any, step: Any, p: list[Array]
) -> tuple[float | None, float | None]:
    """Return what rounding took from the axis of symmetry and from the distance to the next one, if both are the same
    for all launches; of the latter None also if there is no next one.
    """
    if place is None or np.ndim(place) or np.ndim(step) or not all(column.size for column in p):
        return None, None
    values = tuple(float(column.flat[0]) for column in p)
    return _roundings_of(formulas.axes, float(place), None if step is None else float(step), values)


@lru_cache(maxsize=256)
def _roundings_of(
    axes: Callable[..., Any], place: float, step: float | None, values: tuple[float, ...]
) -> tuple[float, float | None]:
    from mpmath import mp

    with mp.workdps(40):
        exact_place, exact_step = axes(mp, tuple(map(mp.mpf, values)))
        place_low = float(mp.mpf(exact_place) - mp.mpf(place))
        return place_low, None if step is None else float(mp.mpf(exact_step) - mp.mpf(step))
