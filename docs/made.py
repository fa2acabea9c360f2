"""Reference pages that are made from the code, so that they cannot differ from it.

``python docs/made.py`` writes them into ``docs/reference``; a test compares the files with what would be written.
"""

import argparse
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gqm_sym.cli import gen, tool
from gqm_sym.declare.families import FAMILIES
from gqm_sym.kernels import KERNELS
from gqm_sym.specfile import json_schema
from gqm_sym.studies import fit_schema, sweep_schema

DOCS = Path(__file__).parent
ROOT = DOCS.parent


def pages() -> dict[str, str]:
    """Return the text of each page by its name."""
    made = {"command_line": command_line(), "yaml": curve_files(), "forces": forces()}
    return {name: "\n".join(lines) + "\n" for name, lines in made.items()}


def write_pages(folder: Path) -> None:
    """Write every page into a folder."""
    folder.mkdir(exist_ok=True)
    for name, text in pages().items():
        (folder / f"{name}.md").write_text(text, encoding="utf-8")


def copy_notebooks(folder: Path) -> None:
    """Copy the notebooks and their data into a folder, where Sphinx finds them."""
    folder.mkdir(exist_ok=True)
    for pattern in ("*.ipynb", "*.csv"):
        for file in sorted((ROOT / "notebooks").glob(pattern)):
            shutil.copy(file, folder / file.name)


def write_all(folder: Path) -> None:
    """Write every page into a folder, and copy the notebooks there."""
    write_pages(folder)
    copy_notebooks(folder)


def command_line() -> Iterator[str]:
    """Yield the options of every command. argparse's own help differs from one version of Python to the next."""
    yield "# Command line"
    yield ""
    yield "Exit codes: 0 done; 130 interrupted; 1 `--check` found a difference; 2 the input is wrong (the message gives"
    yield "file, line and column); 3 the derivation or the solution failed. `COMMAND --help` prints the same"
    yield "information."
    for parser in (gen._parser(), tool._parser()):
        yield from _options(parser)
        for action in parser._actions:
            if isinstance(action, argparse._SubParsersAction):
                summaries = {choice.dest: choice.help or "" for choice in action._choices_actions}
                for name, command in action.choices.items():
                    yield from _options(command, summaries[name])


def _options(parser: argparse.ArgumentParser, summary: str = "") -> Iterator[str]:
    yield from ("", f"## {parser.prog}", "", _cell(parser.description or f"{summary[:1].upper()}{summary[1:]}."))
    rows = [(_spelled(action), action.help or "") for action in parser._actions if _is_documented(action)]
    if rows:
        yield from ("", "| argument | meaning |", "|---|---|")
        yield from (f"| `{spelled}` | {_cell(text)} |" for spelled, text in rows)
    if parser.epilog and not parser.epilog.startswith("Exit codes"):
        yield from ("", _cell(parser.epilog))


def _is_documented(action: argparse.Action) -> bool:
    return not isinstance(action, argparse._HelpAction | argparse._SubParsersAction)


def _spelled(action: argparse.Action) -> str:
    """Return an argument as it is typed, such as ``-o, --output DIR``."""
    value = action.metavar or ("{" + ",".join(map(str, action.choices)) + "}" if action.choices else "")
    if action.nargs == 0:
        value = ""
    repeated = " ..." if action.nargs == "*" else ""
    return f"{', '.join(action.option_strings)} {value}{repeated}".strip()


def forces() -> Iterator[str]:
    """Yield the tables of forces and of families."""
    yield from ("# Forces and families", "", "## Forces", "", "| in YAML | in Python | description |", "|---|---|---|")
    for row in KERNELS.values():
        arguments = ", ".join(row.arguments)
        yield f"| `{row.name}: {{{arguments}}}` | `{row.make.__qualname__}({arguments})` | {_cell(row.summary)} |"
    yield from ("", "Forces are added with `+`. Each argument is a value or another name for its parameter.", "")
    yield from ("## Families of curves", "", "| name | parameters | description |", "|---|---|---|")
    yield "| `cartesian_graph` | those of `phi` | the graph of a function of x |"
    yield "| `implicit` | those of `F` | a curve F(x, z) = 0 through a start point |"
    for family in FAMILIES.values():
        note = f"; {family.note}" if family.note else ""
        yield f"| `{family.name}` | `{', '.join(family.argument_names)}` | {_cell(family.title + note)} |"
    yield from ("", "Their closed forms are on the pages of the [families](../families/index.md).")


def curve_files() -> Iterator[str]:
    """Yield the tables of the keys of curve files, sweep files and fit files, from their schemas."""
    yield from ("# Curve files, sweep files and fit files (YAML)", "")
    yield "`gqm schema`, `gqm schema --sweep` and `gqm schema --fit` print these keys as JSON Schema (draft 7), and"
    yield "`gqm-gen --init NAME` writes a commented file to start from. Numbers are read as text and are exact. A"
    yield "number may be written with its unit, as in `50 cm`. Each mapping is described where a key first needs it."
    yield ""
    described: set[str] = set()
    for title, schema in (
        ("A curve file", json_schema()),
        ("A sweep file", sweep_schema()),
        ("A fit file", fit_schema()),
    ):
        yield from _file(title, schema, described)


def _file(title: str, schema: dict[str, Any], described: set[str]) -> Iterator[str]:
    """Yield the tables of a file: that of the whole, then each mapping where a table first refers to it."""
    definitions = schema.pop("definitions")
    yield from _keys(f"## {title}", schema)
    names = list(_referred(schema, definitions))
    for name in names:
        kind = name.partition("_")[0].removesuffix("Section")
        if kind in described:
            continue
        described.add(kind)
        members = {other.partition("_")[2]: definitions[other] for other in names if other.startswith(f"{kind}_")}
        if members:
            yield from _variants(kind, definitions.get(f"{kind}Section", {}).get("description", ""), members)
        else:
            yield from _keys(f"### {kind}", _long(definitions[name]))


def _referred(schema: Any, definitions: dict[str, Any]) -> Iterator[str]:
    """Yield the names of the definitions that a schema refers to, each followed by those that it refers to itself."""
    for name in re.findall(r'"#/definitions/(\w+)"', json.dumps(schema)):
        yield name
        yield from _referred(definitions[name], definitions)


def _long(definition: dict[str, Any]) -> dict[str, Any]:
    """Return the long form of a definition: a number may also be written in a short one."""
    return next(form for form in definition.get("anyOf", [definition]) if "properties" in form)


def _keys(heading: str, schema: dict[str, Any]) -> Iterator[str]:
    """Yield the table of the keys of one mapping."""
    yield from (heading, "", _cell(schema.get("description", "")), "", "| key | meaning | example |", "|---|---|---|")
    required = schema.get("required", [])
    for key, entry in schema["properties"].items():
        yield f"| {_key(key, required)} | {_cell(entry.get('description', ''))} | {_example(entry)} |"
    yield ""


def _variants(kind: str, text: str, members: dict[str, dict[str, Any]]) -> Iterator[str]:
    """Yield one table of all families or forces, and below it one of the keys that most of them share."""
    yield from (f"### {kind}", "", *([_cell(text), ""] if text else []))
    yield from ("| name | key | meaning | example |", "|---|---|---|---|")
    shared = {
        key: entry
        for member in members.values()
        for key, entry in member["properties"].items()
        if key != "name" and sum(other["properties"].get(key) == entry for other in members.values()) > len(members) / 2
    }
    for name, member in members.items():
        shown = f"`{name}`: {_cell(member['description'])}"
        for key, entry in member["properties"].items():
            if key != "name" and key not in shared:
                meaning = _cell(entry.get("description", ""))
                yield f"| {shown} | {_key(key, member.get('required', []))} | {meaning} | {_example(entry)} |"
                shown = ""
    if shared:
        yield from ("", "These keys are shared:", "", "| key | meaning | example |", "|---|---|---|")
    for key, entry in shared.items():
        lacking = [f"`{name}`" for name, member in members.items() if key not in member["properties"]]
        exceptions = f"; not of {' and '.join(lacking)}" if lacking else ""
        yield f"| `{key}` | {_cell(entry['description'])}{exceptions} | {_example(entry)} |"
    yield ""


def _key(key: str, required: list[str]) -> str:
    return f"`{key}` (required)" if key in required else f"`{key}`"


def _example(entry: dict[str, Any]) -> str:
    example = entry.get("examples", [entry.get("default", "")])[0]
    return f"`{_flow(example)}`" if example else ""


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return "null" if value is None else str(value)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("*", "\\*")


if __name__ == "__main__":
    write_pages(DOCS / "reference")
