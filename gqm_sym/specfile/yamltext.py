"""Conversion of YAML text to a tree of nodes with their line and column.

Only a part of YAML 1.2 is read: mappings with text keys, sequences and scalars, with one document in a file. Scalars
stay text, because ``9.81`` means 981/100 and not the double nearest to it. Tags, anchors and aliases are refused:
without them a file states everything in one place and cannot grow when it is read. The tree is built from the stream of
events with a stack of our own, so that no nesting can exhaust Python's.
"""

import re
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from gqm_sym.errors import SpecFileError
from gqm_sym.specfile.nodes import ListNode, MapNode, Mark, Mistakes, Node, Scalar, shown

SIZE_LIMIT = 1 << 16
LINE_LIMIT = 10_000  # the scanner takes quadratic time over a tag of a million characters
DEPTH_LIMIT = 20
NODE_LIMIT = 1000

_NOT_YAML = re.compile(r"[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")

# The messages of the scanner, with remedies.
_REMEDIES = (
    (
        "mapping values are not allowed",
        "put text that contains ': ' in quotes, and indent keys alike",
    ),
    ("found character '\\t'", "indent with spaces"),
    ("that cannot start any token", "put the text in quotes"),
    ("could not find expected ':'", "write 'key: value', with a space after the colon"),
    ("found unexpected end of stream", "close the quotes"),
    ("expected ',' or '}'", "separate entries by commas and close the brace"),
    ("expected ',' or ']'", "separate entries by commas and close the bracket"),
    ("expected <block end>", "indent the keys of one mapping alike"),
    ("alphabetic or numeric character", "put text that begins with *, & or % in quotes"),
)


class _Stop(Exception):
    """An exception that ends reading; the reason is already recorded."""


def read_text(path: Path, mistakes: Mistakes) -> str:
    """Read the text of a file, and refuse a file that is not text.

    Raises
    ------
    SpecFileError
        If there is nothing to read; the message gives the reason.
    """
    try:
        # The read is bounded instead of the size being checked, because devices and pipes have no size.
        with path.open("rb") as file:
            data = file.read(SIZE_LIMIT + 1)
    except IsADirectoryError:
        raise SpecFileError([f"{path}: is a folder; give the YAML files in it"]) from None
    except FileNotFoundError:
        raise SpecFileError([f"{path}: there is no such file; check its path"]) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise SpecFileError([f"{path}: cannot be read ({reason}); give a YAML file"]) from None
    start = Mark(1, 1)
    text = ""
    if len(data) > SIZE_LIMIT:
        mistakes.add(start, "the file is larger than 64 KiB", "such a file has a few hundred bytes")
    elif data.startswith((b"\xff\xfe", b"\xfe\xff")):
        mistakes.add(start, "the file is UTF-16 text", "save it as UTF-8")
    elif b"\0" in data:
        mistakes.add(start, "the file is binary", "give a YAML file")
    else:
        try:
            text = data.decode("utf-8").removeprefix("\ufeff")
        except UnicodeDecodeError as error:
            before = data[: error.start].decode("utf-8").removeprefix("\ufeff")
            mistakes.add(_mark_in(before, len(before)), "this is not UTF-8 text", "save it as UTF-8")
        else:
            _check_text(text, mistakes)
    if mistakes:
        raise mistakes.error()
    return text


def _mark_in(text: str, index: int) -> Mark:
    return Mark(text.count("\n", 0, index) + 1, index - text.rfind("\n", 0, index))


def _check_text(text: str, mistakes: Mistakes) -> None:
    """Refuse characters and lines that the scanner cannot read."""
    if found := _NOT_YAML.search(text):
        mark = _mark_in(text, found.start())
        what = f"the character {found.group()!r} is not allowed in YAML"
        mistakes.add(mark, what, "give a text file, in UTF-8")
    for number, line in enumerate(text.split("\n"), start=1):
        if len(line) > LINE_LIMIT:
            what = f"the line is longer than {LINE_LIMIT} characters"
            mistakes.add(Mark(number, 1), what, "break it")


def read_tree(text: str, mistakes: Mistakes, *, needed: str = "name, curve and kernel") -> Node | None:
    """Read the one document of a text; return None if there is nothing that can be checked further.

    Parameters
    ----------
    text
        The file's text.
    mistakes
        The record of the file's mistakes.
    needed
        The keys that an empty file lacks.
    """
    try:
        return _Builder(text, mistakes).build(needed)
    except _Stop:
        return None
    except YAMLError as error:
        _report(error, mistakes)
        return None
    except (ValueError, OverflowError):
        # An escape such as "\UFFFFFFFF", which ruamel.yaml hands to chr() unchecked.
        mistakes.add(Mark(1, 1), "a quoted text has an escape that is no character", "mend it")
        return None


def _report(error: YAMLError, mistakes: Mistakes) -> None:
    problem = str(getattr(error, "problem", None) or "the YAML cannot be read")
    place = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    mark = Mark(place.line + 1, place.column + 1) if place else Mark(1, 1)
    fitting = (remedy for words, remedy in _REMEDIES if words in problem)
    remedy = next(fitting, "write YAML: 'key: value' lines, indented by spaces")
    mistakes.add(mark, f"this is not YAML: {problem}", remedy)


class _Builder:
    """A builder that converts the events of one stream to a tree of bounded depth and size."""

    def __init__(self, text: str, mistakes: Mistakes) -> None:
        self.text = text
        self.mistakes = mistakes
        self.root: Node | None = None
        self.open: list[ListNode | MapNode] = []
        self.key: list[Scalar | None] = []  # for each open mapping, the key that waits for its value
        self.count = 0
        self.documents = 0

    def build(self, needed: str) -> Node | None:
        # The "safe" pure loader collects no comments for round trips and needs no C extension.
        for event in YAML(typ="safe", pure=True).parse(self.text):
            self._take(event)
        if self.root is None:
            self.mistakes.add(Mark(1, 1), "the file is empty", f"give at least {needed}")
        return self.root

    def _take(self, event: Any) -> None:
        name = type(event).__name__
        mark = Mark(event.start_mark.line + 1, event.start_mark.column + 1)
        if name == "DocumentStartEvent":
            self.documents += 1
            if self.documents > 1:
                self.mistakes.add(mark, "a second document begins", "give one document a file")
                raise _Stop
        elif name in ("SequenceEndEvent", "MappingEndEvent"):
            self.open.pop()
            self.key.pop()
        elif name == "AliasEvent":
            what = f"the alias *{event.anchor} is not allowed"
            self.mistakes.add(mark, what, "write the value out, or put the text in quotes")
            self._place(Scalar(mark=mark, text=""))
        elif name in ("ScalarEvent", "SequenceStartEvent", "MappingStartEvent"):
            self._check_properties(event, mark)
            self._place(self._node(name, event, mark))

    def _check_properties(self, event: Any, mark: Mark) -> None:
        self.count += 1
        if self.count > NODE_LIMIT:
            self.mistakes.add(mark, f"more than {NODE_LIMIT} values", "give a file for one curve or one sweep")
            raise _Stop
        if event.anchor is not None:
            what = f"the anchor &{event.anchor} is not allowed"
            self.mistakes.add(mark, what, "write the value out where it is needed")
        if event.tag is not None:
            what = f"the tag {shown(str(event.tag))} is not allowed"
            self.mistakes.add(mark, what, "write the plain value, without a tag")

    def _node(self, name: str, event: Any, mark: Mark) -> Node:
        if name == "ScalarEvent":
            quoted = event.style in ("'", '"')
            begin = event.start_mark.index + quoted
            literal = self.text[begin : begin + len(event.value)] == event.value
            inside = Mark(mark.line, mark.column + quoted) if literal else None
            return Scalar(mark=mark, text=event.value, plain=not event.style, inside=inside)
        return ListNode(mark=mark) if name == "SequenceStartEvent" else MapNode(mark=mark)

    def _place(self, node: Node) -> None:
        if not self.open:
            self.root = node
        elif isinstance(parent := self.open[-1], ListNode):
            parent.items.append(node)
        elif (key := self.key[-1]) is None:
            self.key[-1] = self._as_key(node)
        else:
            self.key[-1] = None
            if key.text in parent.items:
                first = parent.keys[key.text].mark.line
                what = f"the key {shown(key.text)} is given twice (first in line {first})"
                self.mistakes.add(key.mark, what, "keep one of them")
            else:
                parent.items[key.text] = node
                parent.keys[key.text] = key
        if not isinstance(node, Scalar):
            self.open.append(node)
            self.key.append(None)
            if len(self.open) > DEPTH_LIMIT:
                what = f"values are nested deeper than {DEPTH_LIMIT} levels"
                self.mistakes.add(node.mark, what, "such a file needs five")
                raise _Stop

    def _as_key(self, node: Node) -> Scalar:
        if isinstance(node, Scalar):
            return node
        self.mistakes.add(node.mark, f"a key is {node.kind}", "keys are single words")
        return Scalar(mark=node.mark, text=f"<{node.kind} in line {node.mark.line}>")
