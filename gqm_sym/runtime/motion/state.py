"""The state of a body at given times, and its energy."""

from typing import Any, NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.rider import FIELDS
from gqm_sym.runtime.motion.rows import HEADINGS, table, text_table

# The largest number of times that a printed state or its table in a notebook shows.
MAX_ROWS_SHOWN = 10


class State(dict[str, Any]):
    """The state of the body at given times.

    Each field is a float if one time was given, else an array of the shape of the times. A state is used as a named
    tuple: fields are read by name, by position and by unpacking (``t, lam, *rest = state``), states are compared with
    each other and with tuples, and none can be changed. Its base class is a dictionary because pandas makes columns of
    dictionaries only: ``pandas.DataFrame(state)`` has a column for each field.

    Attributes
    ----------
    t : float or array
        Times from launch in s, as given.
    lam : float or array
        The curve parameter, in its unit; in circulation laps are counted.
    s : float or array
        Arc length in m, 0 at launch and increasing with the parameter. On a curve without formulas it is 0 at the start
        point.
    x, z : float or array
        Coordinates in m; z is up.
    v : float or array
        Velocity ds/dt in m/s, with its sign.
    v2 : float or array
        Squared speed V**2 in m**2/s**2.
    kappa : float or array
        Signed curvature in 1/m, positive where the track bends to the left of increasing parameter.
    normal_force : float or array
        Contact force N in N along the normal, which is to the left of increasing parameter.
    error : float or array
        A bound of the error of ``lam``, in the unit of the parameter (`Motion.error_bound`).
    """

    __slots__ = ()

    _fields: tuple[str, ...] = ("t", "lam", "s", "x", "z", "v", "v2", "kappa", "normal_force", "error")

    def __init__(self, *values: Any) -> None:
        super().__init__(zip(self._fields, values, strict=True))

    def __getattr__(self, name: str) -> Any:
        if name in self._fields:
            return self[name]
        raise AttributeError(f"a state has no {name!r}; it has {', '.join(self._fields)}")

    def __getitem__(self, key: Any) -> Any:
        return super().__getitem__(key) if isinstance(key, str) else tuple(self.values())[key]

    def __iter__(self) -> Any:
        return iter(self.values())

    def __eq__(self, other: object) -> bool:
        values = tuple(other.values()) if isinstance(other, State) else other
        return tuple(self.values()) == values

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(tuple(self.values()))

    def _refuse_change(self, *args: Any, **kwargs: Any) -> Any:
        raise TypeError("a state cannot be changed; state._replace(lam=...) makes another one")

    __setitem__ = __delitem__ = __ior__ = _refuse_change
    clear = pop = popitem = setdefault = update = _refuse_change

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.array(tuple(self.values()), dtype=dtype)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in self.items())})"

    def __reduce__(self) -> tuple[type["State"], tuple[Any, ...]]:
        return type(self), tuple(self.values())

    def _replace(self, **changes: Any) -> "State":
        return type(self)(*{**self._asdict(), **changes}.values())

    def _asdict(self) -> dict[str, Any]:
        return dict(self.items())

    def to_pandas(self) -> Any:
        """Return the states as a table with a row for each time.

        Returns
        -------
        pandas.DataFrame
            A column for each field; times in more than one dimension are listed in C order.
        """
        from gqm_sym.export.datasets import state_frame

        return state_frame(self)

    def _rows(self) -> tuple[list[str], list[tuple[float, ...]]]:
        """Return the titles with units, and a row for each of the first times, as they are shown."""
        columns = [np.atleast_1d(np.asarray(field)).reshape(-1)[:MAX_ROWS_SHOWN].tolist() for field in self]
        return [HEADINGS.get(name, name) for name in self._fields], list(zip(*columns, strict=True))

    def __str__(self) -> str:
        """Return a table with units, for the first times."""
        titles, rows = self._rows()
        if len(rows) == 1:  # several tables, one below the other
            width = max(map(len, titles))
            return "\n".join(f"  {title:<{width}}  {value!r}" for title, value in zip(titles, rows[0], strict=True))
        hidden = np.size(self.t) - len(rows)
        return "\n".join([*text_table(titles, rows), *([f"  ... and {hidden} more"] if hidden else [])])

    def _repr_html_(self) -> str:
        titles, rows = self._rows()
        hidden = np.size(self.t) - len(rows)
        return f"{table(titles, rows)}{f'<p>... and {hidden} more</p>' if hidden else ''}"


class StateInSpace(State):
    """The state of a body on a space curve: the fields of `State` and four more.

    On a curve that lies in no vertical plane ``kappa`` and ``normal_force`` are the lengths of the curvature and of the
    contact force.

    Attributes
    ----------
    y : float or array
        The third coordinate in m.
    normal_x, normal_y, normal_z : float or array
        The contact force along x, y and z, in N.
    """

    __slots__ = ()

    _fields = (*State._fields, "y", "normal_x", "normal_y", "normal_z")


class StateOfRider(StateInSpace):
    """The state of a body on a banked track: the fields of `StateInSpace` and the loads on a rider.

    At a turning point, where forces against the motion change their direction, ``n_longitudinal`` does not include
    them.

    Attributes
    ----------
    n_vertical, n_lateral, n_longitudinal : float or array
        Loads on the rider upwards, to the left and forwards (towards increasing parameter), in units of 9.80665 m/s**2.
    onset_vertical, onset_lateral, onset_longitudinal : float or array
        Their rates of change, in the same unit per second.
    roll : float or array
        The roll angle in radians, between -pi and pi, positive to the left.
    track_x, track_y, track_z : float or array
        Coordinates in m of the track, below the riders' line.
    """

    __slots__ = ()

    _fields = (*StateInSpace._fields, *FIELDS)


class Energy(NamedTuple):
    """The energy of the body at given times.

    Each field is a float if one time was given, else an array of the shape of the times.

    Attributes
    ----------
    kinetic : float or array
        m*(1 + beta)*V**2/2 in J, which includes the rotation of a rolling body.
    potential : float or array
        m times the potential per unit mass in J: m*g*z for gravity alone. In a rotating frame it contains the
        centrifugal potential.
    lost : float or array
        The energy lost to friction, drag or resistance since launch in J; 0 for a conservative model. It is a
        difference of energies, with an error of some roundings of these.
    """

    kinetic: Any
    potential: Any
    lost: Any
