"""The position of an entry in a file, found from a path of keys or from the words of a message."""

import re
from collections.abc import Iterator, Sequence

from gqm_sym.specfile.nodes import ListNode, MapNode, Mark, Node, Scalar, scalars

# The beginnings of messages that name their origin, such as "graph", "graph curve" or "families.ellipse".
_ORIGIN = re.compile(r"[\w.]+( [\w.]+)?")
_COLUMN = re.compile(r"column (\d+)")
_QUOTED_NAME = re.compile(r"'([A-Za-z]\w*)'")


def descend(tree: Node, path: Sequence[str | int]) -> Iterator[tuple[str, Mark, Node]]:
    """Yield step, place and node along a path, as far as it exists in the tree.

    Steps that do not exist (the tag of a union, a missing key) are skipped.
    """
    node = tree
    for step in path:
        if isinstance(node, MapNode) and step in node.items:
            mark, node = node.keys[str(step)].mark, node.items[str(step)]
        elif isinstance(node, ListNode) and isinstance(step, int) and step < len(node.items):
            node = node.items[step]
            mark = node.mark
        else:
            continue
        yield str(step), mark, node


def place_of(tree: Node, path: Sequence[str | int]) -> Mark:
    """Return the place of the key at the end of a path, or of the last key on it that exists."""
    return [tree.mark, *(mark for _, mark, _ in descend(tree, path))][-1]


def node_at(tree: Node, path: Sequence[str | int]) -> Node:
    """Return the value at the end of a path, or the last value on it that exists."""
    return [tree, *(node for _, _, node in descend(tree, path))][-1]


def mention(tree: Node, name: str) -> Mark | None:
    """Return the place where a name first occurs in an expression."""
    word = re.compile(rf"(?<![A-Za-z0-9_]){re.escape(name)}(?![A-Za-z0-9_])")
    for scalar in scalars(tree):
        if found := word.search(scalar.text):
            return scalar.at(found.start() + 1)
    return None


def locate(tree: Node, message: str, base: tuple[str, ...] = ()) -> tuple[Mark, str]:
    """Return the place to which a message refers, and the message with the path of that place.

    Messages begin with their origin, as in ``graph: domain: must have ...`` or ``graph: z: column 3: ...``, and quote
    the names to which they refer.

    Parameters
    ----------
    tree
        The file.
    message
        The message of an error raised while something in the file was declared.
    base
        The path of the entry that was being declared.
    """
    node, mark = node_at(tree, base), place_of(tree, base)
    path, words, column = list(base), message.split(": "), 0
    while len(words) > 1:
        if isinstance(node, MapNode) and words[0] in node.items:
            mark, node = node.keys[words[0]].mark, node.items[words[0]]
            path.append(words[0])
        elif found := _COLUMN.fullmatch(words[0]):
            column = int(found[1])
        elif not _ORIGIN.fullmatch(words[0]):
            break
        del words[0]
    if isinstance(node, Scalar):
        mark = node.at(column) if column else node.mark
    elif isinstance(node, ListNode):
        mark = node.mark
    else:
        names = _QUOTED_NAME.findall(message)
        places = (_place_of_name(node, name) or _place_of_name(tree, name) for name in names)
        mark = next((place for place in places if place is not None), mark)
    label = ".".join(path)
    return mark, ": ".join([label, *words] if label else words)


def _place_of_name(tree: Node, name: str) -> Mark | None:
    """Return the place at which a name is a key at the top, or is mentioned, or is a key further down."""
    if not isinstance(tree, MapNode):
        return None
    if name in tree.keys:
        return tree.keys[name].mark
    deeper = (_place_of_name(node, name) for node in tree.items.values())
    return mention(tree, name) or next((place for place in deeper if place is not None), None)
