"""Measurements of a motion: the measured quantities, their times, and their standard deviations."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.arguments import short, unknown_argument
from gqm_sym.errors import InputError
from gqm_sym.literals.numbers import read_numbers
from gqm_sym.runtime.compiled.types import Array

# The quantities that are measured at times, and those that each launch has once, with their units; the unit of a place
# is that of the parameter.
AT_TIMES = {"lam": None, "s": "m", "x": "m", "y": "m", "z": "m", "v": "m/s"}
OF_LAUNCHES = {"period": "s", "half_period": "s"}
PASSAGES = "passages"
UNITS = {**AT_TIMES, **OF_LAUNCHES, PASSAGES: "s"}


class Measurements(NamedTuple):
    """Measured quantities.

    Attributes
    ----------
    values : dict
        For each quantity the measured values, (n,) arrays in SI units.
    sigma : dict or None
        For each quantity the standard deviations, (n,) arrays; None if none were given.
    t : array or None
        The times in s of the measurements that were made at given times.
    place : array or None
        For passages, the place of each, as a value of the curve parameter.
    columns : dict
        Launch arguments and run-time parameters that differ from one period to the next, (n,) arrays.
    """

    values: dict[str, Array]
    sigma: dict[str, Array] | None
    t: Array | None
    place: Array | None
    columns: dict[str, Array]


def read_measurements(data: Any, arguments: Mapping[str, str | None], unit: str | None) -> Measurements:
    """Read a mapping or a DataFrame of measurements.

    Parameters
    ----------
    data
        A mapping, or anything else with ``keys()`` and columns by name.
    arguments
        The units of launch arguments and run-time parameters, which may be columns beside periods.
    unit
        The unit of the curve parameter.

    Raises
    ------
    InputError
        If a column is missing, unknown, of another length, or not of finite numbers; or if a standard deviation is not
        positive.
    """
    if not hasattr(data, "keys") or not hasattr(data, "__getitem__"):
        raise InputError(f"data: must be a mapping or a DataFrame of columns, got {short(data)}")
    given = {str(name): data[name] for name in data.keys()}  # noqa: SIM118
    quantities = [name for name in given if name in AT_TIMES or name in OF_LAUNCHES or name == PASSAGES]
    timed = "t" in given
    if not quantities:
        what = ", ".join([*AT_TIMES, *OF_LAUNCHES, PASSAGES])
        raise InputError(f"data: needs at least one of {what}; it has {', '.join(given) or 'nothing'}")
    if any((name in AT_TIMES) != timed for name in quantities) or (PASSAGES in given and len(quantities) > 1):
        raise InputError(
            "data: give t with lam, s, x, y, z or v; or periods, without t; or passages with their place; "
            f"got {', '.join(given)}"
        )
    columns = set() if timed or PASSAGES in given else set(arguments) & set(given)
    known = [*quantities, "sigma", *(["t"] if timed else ["place"] if PASSAGES in given else arguments)]
    for name in given:
        if name not in known:
            raise InputError(unknown_argument("data", name, known, what="column"))
    units = {**arguments, **UNITS, "t": "s", "lam": unit, "place": unit}
    sizes = {name: _column(given[name], name, units.get(name)) for name in (*quantities, *columns)}
    count = max(column.size for column in sizes.values())
    full = {name: _spread(column, name, count) for name, column in sizes.items()}
    for name in (*OF_LAUNCHES, PASSAGES):
        _check_times(full.get(name, np.empty(0)), name)
    t = _spread(_column(given["t"], "t", "s"), "t", count) if timed else None
    if PASSAGES in given and "place" not in given:
        raise InputError("data: passages: the place is missing; give 'place', a value of the curve parameter")
    place = _spread(_column(given["place"], "place", unit), "place", count) if PASSAGES in given else None
    return Measurements(
        values={name: full[name] for name in quantities},
        sigma=_deviations(given.get("sigma"), quantities, units, count),
        t=t,
        place=place,
        columns={name: full[name] for name in columns},
    )


def _column(values: Any, name: str, unit: str | None) -> Array:
    plain = values.to_numpy() if hasattr(values, "to_numpy") else values
    array = np.asarray(plain) if not hasattr(plain, "units") else plain
    if getattr(array, "dtype", None) is not None and array.dtype.kind == "f" and not np.isfinite(array).all():
        where = int(np.flatnonzero(~np.isfinite(np.ravel(array)))[0])
        raise InputError(f"data: {name}: row {where + 1} is not a finite number; leave out what was not measured")
    numbers, _, shape = read_numbers(plain, where=f"data: {name}", unit=unit)
    if len(shape) > 1:
        raise InputError(f"data: {name}: must be one column, got the shape {shape}")
    return numbers


def _check_times(times: Array, name: str) -> None:
    """Refuse periods that are not positive, and passages that are not in the order of time."""
    before = np.concatenate([[0.0], times[:-1]]) if name == PASSAGES else np.zeros_like(times)
    wrong = np.flatnonzero(~(times > before))
    if wrong.size:
        what = "positive times in ascending order" if name == PASSAGES else "positive"
        raise InputError(f"data: {name}: must be {what}; row {wrong[0] + 1} is {times[wrong[0]]:g}")


def _spread(column: Array, name: str, count: int) -> Array:
    if column.size not in (1, count):
        raise InputError(f"data: {name}: has {column.size} rows where others have {count}")
    return np.ascontiguousarray(np.broadcast_to(column, (count,)))


def _deviations(
    sigma: Any, quantities: list[str], units: Mapping[str, str | None], count: int
) -> dict[str, Array] | None:
    """Return the standard deviations, given as one number or column for all quantities, or one for each."""
    if sigma is None:
        return None
    each = sigma if isinstance(sigma, Mapping) else dict.fromkeys(quantities, sigma)
    if set(each) != set(quantities):
        raise InputError(f"data: sigma: must have one entry for each of {', '.join(quantities)}, got {', '.join(each)}")
    found = {}
    for name in quantities:
        where = f"sigma of {name}" if isinstance(sigma, Mapping) else "sigma"
        found[name] = _spread(_column(each[name], where, units.get(name)), where, count)
        if not (found[name] > 0.0).all():
            raise InputError(f"data: {where}: standard deviations must be positive")
    return found
