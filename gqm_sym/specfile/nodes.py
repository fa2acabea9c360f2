"""The tree of a YAML file, whose nodes have their line and column, and the mistakes in it."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from gqm_sym.errors import SpecFileError

MISTAKES_SHOWN = 50

_NULLS = frozenset({"", "~", "null", "Null", "NULL"})


@dataclass(frozen=True, slots=True)
class Mark:
    """A place in the file, with line and column counted from 1 as in editors."""

    line: int
    column: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Scalar:
    """A piece of text: a number, a name, an expression or nothing."""

    mark: Mark
    text: str
    plain: bool = True
    inside: Mark | None = None  # the mark of the first character, if columns in the text are columns in the file
    kind: ClassVar[str] = "a single value"

    @property
    def is_null(self) -> bool:
        """Whether YAML reads it as null."""
        return self.plain and self.text in _NULLS

    def at(self, column: int) -> Mark:
        """Return the place of a column (counted from 1) of the text, as accurately as it is known."""
        if self.inside is None:
            return self.mark
        return Mark(self.inside.line, self.inside.column + column - 1)


@dataclass(slots=True, kw_only=True)
class ListNode:
    """Nodes in order."""

    mark: Mark
    items: "list[Node]" = field(default_factory=list)
    kind: ClassVar[str] = "a list"


@dataclass(slots=True, kw_only=True)
class MapNode:
    """Named nodes in the order of the file; the first of duplicates is kept."""

    mark: Mark
    items: "dict[str, Node]" = field(default_factory=dict)
    keys: dict[str, Scalar] = field(default_factory=dict)
    kind: ClassVar[str] = "a mapping"


Node = Scalar | ListNode | MapNode


def plain(node: Node) -> Any:
    """Return strings, None, lists and dicts, as a validator takes them."""
    if isinstance(node, Scalar):
        return None if node.is_null else node.text
    if isinstance(node, ListNode):
        return [plain(item) for item in node.items]
    return {key: plain(item) for key, item in node.items.items()}


def scalars(node: Node) -> Iterator[Scalar]:
    """Yield every value in the tree, in the order of the file."""
    if isinstance(node, Scalar):
        yield node
    else:
        for item in node.items.values() if isinstance(node, MapNode) else node.items:
            yield from scalars(item)


def shown(text: str) -> str:
    """Return text from a file as it is shown in a message: quoted, on one line, and not too long."""
    return repr(text if len(text) <= 60 else text[:57] + "...")


class Mistakes:
    """The mistakes of one file, collected until all of it has been read."""

    def __init__(self, path: Path | str) -> None:
        self.path = str(path)
        self._found: dict[tuple[Mark, str], None] = {}

    def __bool__(self) -> bool:
        return bool(self._found)

    def add(self, mark: Mark, what: str, remedy: str = "") -> None:
        """Record a mistake."""
        self._found[mark, f"{what}; {remedy}" if remedy else what] = None

    def places(self) -> frozenset[Mark]:
        """Return the places of the mistakes so far."""
        return frozenset(mark for mark, _ in self._found)

    def error(self) -> SpecFileError:
        """Return the error with all mistakes, in the order of the file."""
        found = sorted(self._found, key=lambda item: (item[0].line, item[0].column))
        lines = [
            # Each mistake takes one line, whatever its message quotes.
            " ".join(f"{self.path}:{mark.line}:{mark.column}: {message}".split())
            for mark, message in found[:MISTAKES_SHOWN]
        ]
        if len(found) > MISTAKES_SHOWN:
            more = len(found) - MISTAKES_SHOWN
            lines.append(f"{self.path}: and {more} more mistakes; mend these first")
        return SpecFileError(lines)
