"""The result of a sweep: the values of one quantity with their launches."""

from collections.abc import Mapping
from math import prod
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.kinds import LOADS
from gqm_sym.runtime.motion.rows import table, text_table
from gqm_sym.runtime.sweep.quantities import ROUTES, STATUS_SENTENCES

# The present names of attributes that earlier versions had.
RENAMED = {"reasons": "status", "why": "status_counts()"}

# The unit of all values of the curve's parameter, which is that of the launch place.
PLACE = "lam0"

# The description of each column, and its unit.
DESCRIBED = {
    "half_period": ("time from one turning point to the other", "s"),
    "period": ("time after which the motion repeats", "s"),
    "action": ("integral of (1 + beta) V ds over one period, per mass", "m2/s"),
    "turning_point_lower": ("lower turning point, as a value of the curve's parameter", PLACE),
    "turning_point_upper": ("upper turning point, as a value of the curve's parameter", PLACE),
    "v_min": ("least speed", "m/s"),
    "v_max": ("largest speed", "m/s"),
    "normal_force_min": ("least contact force along the normal", "N"),
    "normal_force_max": ("largest contact force along the normal", "N"),
    **{
        f"n_{load}_{which}": (f"{word} {load} load on a rider, in units of 9.80665 m/s2", "1")
        for load in LOADS
        for which, word in (("min", "least"), ("max", "largest"))
    },
    "time_at": ("first time at the place lam", "s"),
    "t_end": ("time at which the motion ends", "s"),
    "rest_position": ("where the body rests in the end, as a value of the curve's parameter", PLACE),
    "lam0": ("launch place, as a value of the curve's parameter", PLACE),
    "v0": ("launch speed", "m/s"),
    "direction": ("sign of ds/dt at launch", ""),
    "lam": ("place asked about, as a value of the curve's parameter", PLACE),
}

# The largest number of rows that a printed sweep or its table in a notebook shows.
MAX_ROWS_SHOWN = 10


class SweepArrays(NamedTuple):
    """The arrays of a sweep; those of its parts are concatenated."""

    values: Array
    status: NDArray[np.int8]
    route: NDArray[np.int8]


class Sweep(SweepArrays):
    """The values of one quantity over many launches.

    ``np.asarray(sweep)`` is the array of the values, and ``values, status, route = sweep`` are the three arrays.

    Attributes
    ----------
    values : float array
        The quantity of each launch, in the shape that the arguments broadcast to; NaN where there is none. Times
        (``half_period``, ``period``, ``time_at``, ``t_end``) are in seconds, speeds (``v_min``, ``v_max``) in m/s,
        forces (``normal_force_min``, ``normal_force_max``) in newtons, the ``action`` in m2/s; places
        (``turning_points``, ``rest_position``) are values of the curve's parameter, in its unit. ``turning_points``
        has one more axis of length 2, for the lower and the upper one.
    status : int8 array
        0 for each launch that has a value; otherwise a code that says why there is none. `status_counts` gives the
        sentences, which are those of `quantities.STATUS_SENTENCES`.
    route : int8 array
        How each launch was answered, as an index into `quantities.ROUTES`: 0 "batch", in a batch of orbits; 1 "single",
        alone in a compiled loop; 2 "solve", solved as by ``solve``. The route affects the time that a launch takes, and
        its value only by rounding.
    quantity : str
        The name of the quantity.
    arguments : mapping of str to number or array
        The launches and parameters, by name, as they were given and before they were broadcast.
    gradient : float array or None
        The derivatives of the values, with one more axis for the names with respect to which they were taken; NaN where
        there are none. None without the argument ``gradient``.
    """

    quantity: str = ""
    gradient: Array | None = None
    arguments: Mapping[str, Any] = MappingProxyType({})

    def status_counts(self) -> dict[str, int]:
        """Count the launches that have no value.

        Returns
        -------
        dict
            The number of launches for each sentence that says why there is no value; empty if all have one.
        """
        return _counts(self.status, STATUS_SENTENCES, 1)

    def route_counts(self) -> dict[str, int]:
        """Count the launches by the route on which they were answered.

        Returns
        -------
        dict
            The number of launches for each of "batch", "single" and "solve" that occurs.
        """
        return _counts(self.route, ROUTES, 0)

    def to_pandas(self) -> Any:
        """Return the launches as a table with a row for each.

        Returns
        -------
        pandas.DataFrame
            A column for each argument that is an array, the values (two columns for ``turning_points``), and
            ``status``. Arguments that are the same for all launches are in the attribute ``attrs``.
        """
        from gqm_sym.export.datasets import sweep_frame

        return sweep_frame(self)

    def to_xarray(self) -> Any:
        """Return the values as an xarray Dataset with units.

        Returns
        -------
        xarray.Dataset
            The variables are the quantity, ``status`` and ``route``. An axis along which one argument alone varies has
            its name and values; others are called ``axis_0``, ``axis_1``, and so on.
        """
        from gqm_sym.export.datasets import sweep_dataset

        return sweep_dataset(self)

    def _rows(self) -> tuple[list[str], list[tuple[Any, ...]]]:
        """Return the titles and the first rows of the table that is shown."""
        columns = columns_of(self)
        units = {name: unit for name, (_, unit) in DESCRIBED.items() if unit not in ("", PLACE)}
        titles = [f"{name} ({units[name]})" if name in units else name for name in columns]
        return titles, list(zip(*(column[:MAX_ROWS_SHOWN].tolist() for column in columns.values()), strict=True))

    def _summary(self) -> str:
        """Return one line about the sweep as a whole."""
        size = prod(self.status.shape)
        missing = "; ".join(f"{count} without a value: {why}" for why, count in self.status_counts().items())
        fixed = ", ".join(f"{name} = {value}" for name, value in self.arguments.items() if not np.ndim(value))
        launches = f"{size} launch{'es' if size != 1 else ''}{f' ({fixed})' if fixed else ''}"
        return "; ".join([f"{self.quantity or 'values'} of {launches}", *([missing] if missing else [])])

    def __str__(self) -> str:
        """Return one line about the sweep, and its first rows."""
        titles, rows = self._rows()
        hidden = self.status.size - len(rows)
        end = [f"  ... and {hidden} more"] if hidden else []
        return "\n".join([self._summary(), *text_table(titles, rows), *end])

    def _repr_html_(self) -> str:
        titles, rows = self._rows()
        hidden = self.status.size - len(rows)
        return f"<p>{self._summary()}</p>{table(titles, rows)}{f'<p>... and {hidden} more</p>' if hidden else ''}"

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        """Return the values for `numpy.asarray`."""
        return self.values.astype(dtype or self.values.dtype, copy=bool(copy))

    def __getattr__(self, name: str) -> Any:
        """Raise an error that gives the present name of an attribute of an earlier version.

        Raises
        ------
        AttributeError
            Always, as there is no attribute of this name.
        """
        hint = f"; it is now called {RENAMED[name]}" if name in RENAMED else ""
        raise AttributeError(f"Sweep has no attribute {name!r}{hint}", name=name, obj=self)


def with_arguments(sweep: Sweep, quantity: str, arguments: Mapping[str, Any]) -> Sweep:
    """Return the same values with the quantity and the launches to which they belong."""
    out = Sweep(*sweep)
    out.quantity, out.gradient = quantity, sweep.gradient
    out.arguments = {name: value for name, value in arguments.items() if value is not None}
    return out


def columns_of(sweep: Sweep) -> dict[str, Any]:
    """Return each argument that is an array, the values and the status, as one-dimensional arrays of equal length by
    name.
    """
    shape = sweep.status.shape
    varied = {name: value for name, value in sweep.arguments.items() if np.ndim(value)}
    columns = {name: np.broadcast_to(np.asarray(value), shape).reshape(-1) for name, value in varied.items()}
    values = sweep.values.reshape(sweep.status.size, -1).T
    names = [sweep.quantity or "values"] if len(values) == 1 else ["turning_point_lower", "turning_point_upper"]
    return {**columns, **dict(zip(names, values, strict=True)), "status": sweep.status.reshape(-1)}


def _counts(codes: NDArray[np.int8], names: tuple[str, ...], first: int) -> dict[str, int]:
    """Return the number of occurrences of each code from ``first`` on, by the codes' names."""
    found, counts = np.unique(codes[codes >= first], return_counts=True)
    return {names[code]: int(count) for code, count in zip(found, counts, strict=True)}
