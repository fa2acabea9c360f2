"""Messages about mistakes in the structure of a file, in terms that its author understands."""

from collections.abc import Callable, Collection
from typing import Any, TypeAlias

from pydantic.fields import FieldInfo

from gqm_sym.arguments import nearest
from gqm_sym.specfile.locations import descend, place_of
from gqm_sym.specfile.nodes import MapNode, Mark, Mistakes, Node, Scalar, shown
from gqm_sym.specfile.schema import FAMILY_MODELS

# pydantic's name of a type -> the text for messages.
_WANTED = {
    "string_type": "must be a single value",
    "list_type": "must be a list, as in [a, b]",
    "too_short": "must have two entries, as in [a, b]",
    "too_long": "must have two entries, as in [a, b]",
}
_SAMPLES = {"family": "{name: circle}", "launch": "{lam0: pi/3}", "parameters": "{a: 2}"}
_MAPPINGS = ("model_type", "model_attributes_type", "dict_type")


ModelAt: TypeAlias = Callable[[tuple[str, ...]], Any]


def explain(
    detail: Any, tree: MapNode, mistakes: Mistakes, model_at: ModelAt, *, refused_places: Collection[Mark] = ()
) -> None:
    """Record a mistake that pydantic found, with our message.

    Parameters
    ----------
    detail
        One of the errors of a ``ValidationError``.
    tree
        The file.
    mistakes
        The record of the file's mistakes.
    model_at
        A function that returns the model of the mapping at a place of the file.
    refused_places
        Places at which something could not be read; consequences of that are not reported.
    """
    loc = tuple(detail["loc"])
    kind = detail["type"]
    steps = list(descend(tree, loc))
    path = ".".join(step for step, _, _ in steps)
    mark = steps[-1][1] if steps else tree.mark
    node = steps[-1][2] if steps else tree
    label = f"{path}: " if path else ""
    # The place of an empty value is on some later line, so its key is reported.
    value_mark = mark if isinstance(node, Scalar) and not node.text else node.mark
    if {mark, node.mark} & set(refused_places):
        return
    if kind == "gqm":
        column = detail["ctx"]["column"]
        if isinstance(node, Scalar) and loc[-1] != "[key]":
            mark = node.at(column) if column else value_mark
        mistakes.add(mark, f"{label}{detail['ctx']['what']}")
    elif kind == "extra_forbidden":
        _explain_unknown(loc, steps, mistakes, model_at)
    elif kind == "missing":
        field = model_at(_path(loc[:-1])).model_fields[loc[-1]]
        what = f"{label}{loc[-1]} is missing"
        mistakes.add(mark, what, f"add {loc[-1]}: {_example(field)}")
    elif kind in ("union_tag_not_found", "union_tag_invalid"):
        place = place_of(tree, (*loc, "name"))
        what, near = "name is missing", None
        if kind == "union_tag_invalid":
            name = str(detail["ctx"]["tag"])
            what, near = f"unknown family {shown(name)}", nearest(name, list(FAMILY_MODELS))
        mistakes.add(
            place, f"{label}{what}", f"did you mean {near}?" if near else f"known are {', '.join(FAMILY_MODELS)}"
        )
    elif kind == "literal_error":
        what = f"{label}must be {detail['ctx']['expected']}"
        mistakes.add(value_mark, f"{what}, got {_given(node)}")
    else:
        what = _WANTED.get(kind, detail["msg"])
        if kind in _MAPPINGS:
            what = f"must be a mapping, as in {_sample(loc, model_at)}"
        given = detail.get("ctx", {}).get("actual_length", _given(node))
        mistakes.add(value_mark, f"{label}{what}, got {given}")


def _explain_unknown(
    loc: tuple[Any, ...], steps: list[tuple[str, Mark, Node]], mistakes: Mistakes, model_at: ModelAt
) -> None:
    key = str(loc[-1])
    path = ".".join(step for step, _, _ in steps[:-1])
    label = f"{path}: " if path else ""
    allowed = sorted(model_at(_path(loc[:-1])).model_fields)
    mark = steps[-1][1]
    near = nearest(key, allowed)
    remedy = f"did you mean {near}?" if near else f"allowed are {', '.join(allowed)}"
    if key.isdigit():
        remedy = "a comma separates entries; write a decimal point, as in 0.7"
    mistakes.add(mark, f"{label}unknown key {shown(key)}", remedy)


def _sample(loc: tuple[Any, ...], model_at: ModelAt) -> str:
    """Return a mapping that is allowed at a place of the file."""
    if loc[-1] in _SAMPLES:
        return _SAMPLES[loc[-1]]
    field = getattr(model_at(_path(loc[:-1])), "model_fields", {}).get(loc[-1])
    if field is not None and field.examples:
        return _example(field)
    fields = getattr(model_at(_path(loc)), "model_fields", {}).items()
    return "{" + ", ".join(f"{name}: {_example(one)}" for name, one in fields if one.is_required()) + "}"


def _path(loc: tuple[Any, ...]) -> tuple[str, ...]:
    return tuple(str(step) for step in loc)


def _example(field: FieldInfo) -> str:
    return _flow((field.examples or ["..."])[0])


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
    return str(value)


def _given(node: Node) -> str:
    if isinstance(node, Scalar):
        return "nothing" if node.is_null else shown(node.text)
    return node.kind
