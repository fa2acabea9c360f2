"""Points of a track, which are read row by row from any of the accepted forms; each point keeps its exact text."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from math import isfinite
from typing import Any, TypeAlias

from gqm_sym.arguments import several, short
from gqm_sym.errors import DeclarationError
from gqm_sym.literals.numbers import read_numbers, without_unit
from gqm_sym.literals.units import is_quantity

Place: TypeAlias = tuple[float, ...]
# The coordinates of points in space.
IN_SPACE = 3

_DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def in_metres(given: Any) -> Any:
    """Convert lengths that were given as quantities, alone or in sequences, to numbers of metres; return anything else
    unchanged.
    """
    if is_quantity(given):
        high, _, shape = read_numbers(given, where="sampled", unit="m")
        return high.reshape(shape).tolist()
    if isinstance(given, Mapping):
        return {key: in_metres(value) for key, value in given.items()}
    if isinstance(given, list | tuple) and any(map(_holds_quantity, given)):
        return [in_metres(value) for value in given]
    return given


def _holds_quantity(given: Any) -> bool:
    return is_quantity(given) or (isinstance(given, list | tuple) and any(map(is_quantity, given)))


def as_rows(points: Any, z: Any) -> tuple[Any, Any]:
    """Return points in any accepted form as rows, and their roll angles if they are a table with these."""
    if z is not None:
        return _paired("sampled: x and z", points, z), None
    # Any kind of table is accepted.
    names = points if isinstance(points, Mapping) else getattr(points, "columns", None)
    if names is None:
        return points, None
    columns = {name.strip().lower(): name for name in names if isinstance(name, str)}
    if columns.keys() >= {"x", "y", "z"}:
        rows = _paired("sampled: columns x, y and z", *(points[columns[name]] for name in "xyz"))
        return rows, points[columns["roll"]] if "roll" in columns else None
    if not columns.keys() >= {"x", "z"}:
        raise DeclarationError(
            f"sampled: points: a table must have columns x and z, got {short(list(names))}; rename them, or give "
            "both columns, as in Curve.sampled(table['distance'], table['height'])"
        )
    return _paired("sampled: columns x and z", points[columns["x"]], points[columns["z"]]), None


def _paired(where: str, *columns: Any) -> list[tuple[Any, ...]]:
    """Return rows of two or three columns."""
    read = [_column(column, where) for column in columns]
    if len({len(column) for column in read}) > 1:
        lengths = " and ".join(str(len(column)) for column in read)
        raise DeclarationError(f"{where}: must be of one length, got {lengths} values")
    return list(zip(*read, strict=True))


def _column(values: Any, where: str) -> tuple[Any, ...]:
    listed = values.tolist() if hasattr(values, "tolist") else values
    return several(listed, where=where, what="two columns of numbers")


def read_rows(points: Iterable[Any]) -> Iterator[tuple[str, Place]]:
    """Read rows of two or three coordinates; return the text and the values of each."""
    if isinstance(points, str):
        raise DeclarationError(
            f"sampled: points: must be rows of x and z, got {short(points)}; read a file first, by gqm_sym.read_track"
        )
    # An array of numbers is converted to Python's floats at once, which is many times faster than row by row.
    rows = points.tolist() if hasattr(points, "tolist") else points
    try:
        numbered = enumerate(rows, start=1)
    except TypeError:
        raise DeclarationError(f"sampled: points: must be rows of x and z, got {short(points)}") from None
    wanted = 2
    for count, row in numbered:
        is_row = isinstance(row, Sequence) and not isinstance(row, str)
        if count == 1 and is_row and len(row) == IN_SPACE:
            wanted = IN_SPACE
        if not is_row or len(row) != wanted:
            expected = "two numbers, x and z" if wanted == 2 else "three numbers, x, y and z, as in row 1"
            expected += ", or in space three, x, y and z" if count == 1 else ""
            raise DeclarationError(
                f"sampled: row {count}: must be {expected}, got {short(row)}; for one array of each write "
                "Curve.sampled(x, z)"
            )
        coordinates, place = zip(*[_read(value, count) for value in row], strict=True)
        yield " ".join(coordinates), place


def _read(value: Any, count: int) -> tuple[str, float]:
    """Return a coordinate's text and value."""
    if isinstance(value, str | Decimal):
        text = str(value).strip()
        if not _DECIMAL.fullmatch(text):
            raise DeclarationError(f"sampled: row {count}: {text[:40]!r} is not a decimal number")
    elif isinstance(value, bool):
        raise DeclarationError(f"sampled: row {count}: {value} is not a number")
    else:
        try:
            # All digits of a float are kept, because it means its binary value and not the shortest decimal that is
            # read as it.
            text = str(value) if isinstance(value, int) else str(Decimal(float(value)))
        except (TypeError, ValueError, OverflowError):
            raise DeclarationError(f"sampled: row {count}: {value!r:.40} is not a number") from None
    number = float(text)
    if not isfinite(number):
        shown = repr(value) if isinstance(value, str) else str(value)  # NumPy names its types in its representations
        raise DeclarationError(f"sampled: row {count}: {shown[:40]} is not finite; leave the row out or mend it")
    return text, number


def read_angles(given: Any, places: list[Place]) -> list[str]:
    """Read the roll angle at each point, and return its text; return no texts if there are no angles."""
    if given is None:
        return []
    if places and len(places[0]) != IN_SPACE:
        raise DeclarationError("sampled: roll: is for tracks in space; give rows of x, y and z")
    given = without_unit(given, where="sampled: roll", unit="rad")
    angles = several(given, where="sampled: roll", what="an angle for each point, a formula in s or 'coordinated'")
    if len(angles) != len(places):
        raise DeclarationError(f"sampled: roll: must be an angle for each point, got {len(angles)} for {len(places)}")
    return [_read(angle, count)[0] for count, angle in enumerate(angles, start=1)]
