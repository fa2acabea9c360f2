"""The checks of single values in a curve file, with their messages.

Every scalar arrives as text and stays text, so that ``9.81`` keeps meaning 981/100.
"""

import re
import sys
from ast import Constant, walk
from collections.abc import Callable
from typing import Annotated, Any, TypeAlias

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema
from pydantic_core import PydanticCustomError

from gqm_sym.errors import InputError, NumberError
from gqm_sym.expressions import RESERVED_NAMES, check_module_name, check_name
from gqm_sym.literals.grammar import parse
from gqm_sym.literals.units import check_unit, read_unit, split_unit
from gqm_sym.parameters import check_parameter, exact_value, in_si, read_value
from gqm_sym.specfile.nodes import shown

LINE_LIMIT = 200
# A count with more digits is refused before it is converted.
MAX_DIGITS = 9

# The default of optional entries. It is not "model | None = None", because null in the file is a mistake.
ABSENT: Any = None

# The spellings of YAML and Python for values that are not finite numbers.
_NOT_FINITE = frozenset({".nan", ".inf", "nan", "inf", "infinity"})
_COLUMN = re.compile(r"(?:.*?: )?column (\d+): ")


class Section(BaseModel):
    """A mapping of the file."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def wrapped(key: str, kind: type) -> BeforeValidator:
    """Accept a value of a kind in place of the mapping that has it under a key."""
    return BeforeValidator(lambda value: {key: value} if isinstance(value, kind) else value)


def _mistake(what: str, column: int = 0) -> PydanticCustomError:
    return PydanticCustomError("gqm", "{what}", {"what": what, "column": column})


def column_of(message: str) -> tuple[str, int]:
    """Separate the column from a message about a text, such as ``column 4: unexpected '^'``; it is 0 if there is
    none.
    """
    found = _COLUMN.match(message)
    return (message[found.end() :], int(found[1])) if found else (message, 0)


def _checked(check: Callable[[str], object]) -> AfterValidator:
    """Return a validator made of a check that raises one of our errors; the text itself is kept."""

    def validate(text: str) -> str:
        try:
            check(text)
        except InputError as error:
            # "where" is empty, because the caller has the exact place from the tree of the file.
            raise _mistake(*column_of(str(error).removeprefix(": "))) from None
        return text

    return AfterValidator(validate)


def _check_line(text: str) -> str:
    # A title becomes part of the header of emitted code: it must not contain invisible characters or line breaks.
    if not text.isprintable() or len(text) > LINE_LIMIT:
        raise _mistake(f"must be one line of at most {LINE_LIMIT} printable characters")
    return text


def _check_curve_parameter(text: str) -> object:
    # A curve's own parameter, and nothing else, may be called "lam".
    return check_name(text, where="", reserved=RESERVED_NAMES - {"lam"})


def split_value(value: object) -> object:
    """Convert a bare value to the long form, which is ``{value, unit}`` if it is a text such as "50 cm"."""
    measured = split_unit(value) if isinstance(value, str) else None
    if measured is not None:
        return {"value": measured[0], "unit": measured[2]}
    return value if isinstance(value, dict) else {"value": value}


def _check_expression(text: str) -> object:
    measured = split_unit(text)
    tree = parse(text, where="") if measured is None else measured[1]
    for node in walk(tree):
        if isinstance(node, Constant) and not _is_double(node.value):
            raise NumberError(f"column {node.col_offset + 1}: the number must be within the range of doubles")
    return text


def _is_double(number: Any) -> bool:
    """Return whether a number is neither too large nor too small for a double."""
    try:
        return not number or float(number) != 0.0
    except OverflowError:
        return False


def _in_metres(text: str) -> str:
    measured = split_unit(text)
    if measured is None:
        return text
    try:
        check_unit(measured[2], "m")
    except InputError as error:
        raise _mistake(str(error)) from None
    return in_si(measured[0], measured[2])


def _check_number(text: str) -> object:
    measured = split_unit(text)
    if measured is not None:
        raise NumberError(f"must be a number, got {text}; write unit: {measured[2]} beside it")
    if text.lower().lstrip("+-") in _NOT_FINITE:
        raise NumberError(f"must be a finite number, got {text}")
    if abs(exact_value(read_value(text, where=""))) > sys.float_info.max:
        raise NumberError(f"must be within the range of doubles, got {text}")
    return text


def _check_scatter(text: str) -> object:
    if text == "auto":
        return text
    try:
        _check_number(text)
        right = bool(exact_value(text) > 0)
    except InputError:
        right = False
    if not right:
        raise NumberError(f"must be a standard deviation, a positive number, or auto, got {shown(text)}")
    return text


def _read_flag(value: object) -> object:
    if value not in ("true", "false"):
        raise _mistake(f"must be true or false, got {shown(str(value))}")
    return value == "true"


def _read_count(value: object) -> object:
    text = str(value)
    if not (text.isascii() and text.isdigit() and len(text) <= MAX_DIGITS):
        raise _mistake(f"must be a whole number, got {shown(text)}")
    return int(text)


def _read_sign(of: str) -> BeforeValidator:
    def read(value: object) -> object:
        if value not in ("1", "+1", "-1"):
            raise _mistake(f"must be 1 or -1 (the sign of {of}), got {shown(str(value))}")
        return int(str(value))

    return BeforeValidator(read)


_TEXT_OR_NUMBER = {"type": ["string", "number"]}

Line: TypeAlias = Annotated[str, AfterValidator(_check_line)]
Name: TypeAlias = Annotated[str, _checked(lambda text: check_module_name(text, where=""))]
CurveParameter: TypeAlias = Annotated[str, _checked(_check_curve_parameter)]
ParameterName: TypeAlias = Annotated[str, _checked(lambda text: check_parameter(text, where=""))]
UnitText: TypeAlias = Annotated[str, _checked(lambda text: text and read_unit(text, where=""))]
Expression: TypeAlias = Annotated[str, _checked(_check_expression), WithJsonSchema(_TEXT_OR_NUMBER)]
Number: TypeAlias = Annotated[str, _checked(_check_number), WithJsonSchema(_TEXT_OR_NUMBER)]
ScatterText: TypeAlias = Annotated[str, _checked(_check_scatter), WithJsonSchema(_TEXT_OR_NUMBER)]
Flag: TypeAlias = Annotated[bool, BeforeValidator(_read_flag), WithJsonSchema({"type": "boolean"})]
Count: TypeAlias = Annotated[
    int, BeforeValidator(_read_count), WithJsonSchema({"type": "integer", "minimum": 1, "default": 1})
]
Direction: TypeAlias = Annotated[int, _read_sign("ds/dt at launch"), WithJsonSchema({"enum": [1, -1]})]
Tangent: TypeAlias = Annotated[int, _read_sign("the tangent (-F_z, F_x)"), WithJsonSchema({"enum": [1, -1]})]
Ends: TypeAlias = Annotated[list[Expression | None], Field(min_length=2, max_length=2)]
Length: TypeAlias = Annotated[str, AfterValidator(_in_metres), _checked(_check_number), WithJsonSchema(_TEXT_OR_NUMBER)]
Place: TypeAlias = Annotated[list[Length], Field(min_length=2, max_length=2)]
Centre: TypeAlias = Annotated[list[Expression], Field(min_length=2, max_length=2)]
SpaceCentre: TypeAlias = Annotated[list[Expression], Field(min_length=2, max_length=3)]
Headings: TypeAlias = Annotated[list[Expression], Field(min_length=1, max_length=3)]
