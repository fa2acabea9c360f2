"""Pages of the documentation that are made from the code when it is built, so that they cannot fall behind it."""

import argparse
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gqm_sym.cli import gen, tool
from gqm_sym.declare.families import FAMILIES
from gqm_sym.kernels import KERNELS
from gqm_sym.specfile import json_schema
from gqm_sym.studies import sweep_schema

ROOT = Path(__file__).parent.parent


def write_all(folder: Path) -> None:
    """Write every page into a folder, and copy the notebooks beside them."""
    folder.mkdir(exist_ok=True)
    for name, lines in (("command_line", command_line()), ("yaml", curve_files()), ("forces", forces())):
        (folder / f"{name}.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    for pattern in ("*.ipynb", "*.csv"):
        for file in sorted((ROOT / "notebooks").glob(pattern)):
            shutil.copy(file, folder / file.name)


def command_line() -> Iterator[str]:
    """Yield what every command says of itself."""
    yield "# Command line"
    yield ""
    yield "Exit codes: 0 done; 130 interrupted; 1 `--check` found a difference; 2 the input is wrong, with file,"
    yield "line and column; 3 the derivation or the solution failed."
    for parser in (gen._parser(), tool._parser()):
        yield from _help(parser)
        for action in parser._actions:
            if isinstance(action, argparse._SubParsersAction):
                for command in action.choices.values():
                    yield from _help(command)


def _help(parser: argparse.ArgumentParser) -> Iterator[str]:
    yield from ("", f"## {parser.prog}", "", "```text", parser.format_help().rstrip(), "```")


def forces() -> Iterator[str]:
    """Yield the tables of forces and of families."""
    yield from ("# Forces and families", "", "## Forces", "", "| in YAML | in Python | what it is |", "|---|---|---|")
    for row in KERNELS.values():
        arguments = ", ".join(row.arguments)
        yield f"| `{row.name}: {{{arguments}}}` | `{row.make.__name__}({arguments})` | {_cell(row.summary)} |"
    yield from ("", "Forces add with `+`. Each argument takes another name for its parameter, or a value.", "")
    yield from ("## Families of curves", "", "| name | parameters | what it is |", "|---|---|---|")
    yield "| `cartesian_graph` | those of `phi` | the graph of any function of x |"
    yield "| `implicit` | those of `F` | any curve F(x, z) = 0, from a start point |"
    for family in FAMILIES.values():
        note = f"; {family.note}" if family.note else ""
        yield f"| `{family.name}` | `{', '.join(family.arguments)}` | {_cell(family.title + note)} |"
    yield from ("", "Their closed forms: [](../families/index.md).")


def curve_files() -> Iterator[str]:
    """Yield the tables of the keys of curve files and sweep files, from their schemas."""
    yield from ("# Curve files and sweep files (YAML)", "")
    yield "`gqm schema` and `gqm schema --sweep` print this as JSON Schema (draft 7) for editors, and"
    yield "`gqm-gen --init NAME` writes a commented file to start from. Numbers are kept as text and are exact."
    yield ""
    yield from _file("A curve file", json_schema())
    yield from _file("A sweep file", sweep_schema())


def _file(title: str, schema: dict[str, Any]) -> Iterator[str]:
    yield from _keys(title, schema)
    for name, definition in schema["definitions"].items():
        # A parameter may be written in short as well: what is described is its long form.
        forms = [form for form in definition.get("anyOf", [definition]) if "properties" in form]
        for form in forms:
            yield from _keys(name.replace("_", ": ", 1).replace("_", " "), form)


def _keys(title: str, schema: dict[str, Any]) -> Iterator[str]:
    yield from (
        f"## {title}",
        "",
        _cell(schema.get("description", "")),
        "",
        "| key | what it is | as in |",
        "|---|---|---|",
    )
    required = schema.get("required", [])
    for key, entry in schema["properties"].items():
        example = entry.get("examples", [entry.get("default", "")])[0]
        must = " (needed)" if key in required else ""
        yield f"| `{key}`{must} | {_cell(entry.get('description', ''))} | {f'`{_flow(example)}`' if example else ''} |"
    yield ""


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return "null" if value is None else str(value)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("*", "\\*")
