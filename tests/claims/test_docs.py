"""The examples of the documentation run, and print what the documentation shows."""

import doctest
import importlib
import re
import runpy
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from paths import ROOT

from gqm_sym.declare import families
from gqm_sym.errors import SpecFileError
from gqm_sym.kernels import KERNELS
from gqm_sym.specfile import read_spec
from gqm_sym.studies import read_sweep

DOCS = ROOT / "docs"
MARK = "-- next block --"
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
WITH_CODE = [
    page for page in (ROOT / "README.md", *sorted(DOCS.rglob("*.md"))) if "```python\nimport" in page.read_text()
]


@pytest.mark.sample(4)
@pytest.mark.parametrize("page", WITH_CODE, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_code_runs(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The blocks of a page form one program, and an output shown below a block is what that block prints."""
    blocks = BLOCK.findall(page.read_text(encoding="utf-8"))
    monkeypatch.chdir(tmp_path)
    program = tmp_path / "program.py"
    code = [text for language, text in blocks if language == "python"]
    program.write_text(f"\nprint({MARK!r})\n".join(code), encoding="utf-8")
    runpy.run_path(str(program))
    outputs = iter(capsys.readouterr().out.split(f"{MARK}\n"))
    for (language, _), (answer, text) in pairwise([*blocks, ("end", "")]):
        output = next(outputs) if language == "python" else ""
        if language == "python" and answer in ("", "text"):
            assert text == output


def test_the_pages_are_some() -> None:
    """The pattern finds the pages that are meant."""
    names = {page.name for page in WITH_CODE}
    assert names >= {"README.md", "index.md", "start.md", "curves.md", "forces.md", "motions.md", "figures.md"}


def test_every_notebook_is_in_the_index() -> None:
    """The site's index and the README list every notebook."""
    index, readme = ((ROOT / name).read_text(encoding="utf-8") for name in ("docs/index.md", "README.md"))
    for notebook in (ROOT / "notebooks").glob("*.ipynb"):
        assert f"made/{notebook.stem}" in index
        assert f"notebooks/{notebook.name}" in readme


def test_the_example_file_is_right(tmp_path: Path) -> None:
    """The curve file of the how-to solves, and the mistake shown gives the message that the page prints."""
    page = (DOCS / "howto" / "files.md").read_text(encoding="utf-8")
    (text,) = [text for language, text in BLOCK.findall(page) if language == "yaml"]
    (mistake,) = [text for language, text in BLOCK.findall(page) if language == "text"]
    path = tmp_path / "chute.yaml"
    path.write_text(text)
    spec = read_spec(path)
    spec.check_solvable(spec.derive())
    path.write_text(text.replace("unit: g}", "unit: cm}"))
    with pytest.raises(SpecFileError) as caught:
        read_spec(path)
    assert str(caught.value).removeprefix(f"{tmp_path}/") == mistake.strip()


def test_the_example_sweep_is_right(tmp_path: Path) -> None:
    """The sweep file of the how-to is read, with a curve file of that name."""
    page = (DOCS / "howto" / "sweeps.md").read_text(encoding="utf-8")
    (text,) = [text for language, text in BLOCK.findall(page) if language == "yaml"]
    (tmp_path / "periods.yaml").write_text(text)
    (tmp_path / "pendulum.yaml").write_bytes((ROOT / "curves" / "pendulum.yaml").read_bytes())
    assert read_sweep(tmp_path / "periods.yaml").shape == (300, 3)


def test_what_is_cited_as_maths_is_a_page() -> None:
    """Docstrings, comments and generated modules cite sections of the page on mathematics that exist."""
    page = (DOCS / "concepts" / "maths.md").read_text(encoding="utf-8")
    headings = set(re.findall(r"^## (\d)\. ", page, re.MULTILINE))
    files = [path for folder in ("gqm_sym", "generated", "tests") for path in (ROOT / folder).rglob("*.py")]
    cited = "\n".join(path.read_text(encoding="utf-8") for path in files if path != Path(__file__))
    named = re.findall(r"MATHS,?\s+(?:sections?|s\.)\s+(\d)(?: (?:to|and) (\d))?", cited)
    assert len(named) == cited.count("MATHS") > 50
    assert {section for both in named for section in both if section} <= headings


EXAMPLES = [path for path in sorted((ROOT / "gqm_sym").rglob("*.py")) if ">>> " in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_examples_in_docstrings(path: Path) -> None:
    """Each example gives the output that stands below it."""
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    ran = doctest.testmod(importlib.import_module(name))
    assert ran.attempted > 0
    assert ran.failed == 0


def test_made_pages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables made from the code name every force, family, command and key."""
    monkeypatch.syspath_prepend(str(DOCS))
    import made

    made.write_all(tmp_path)
    sys.modules.pop("made")
    pages = {path.stem: path.read_text(encoding="utf-8") for path in tmp_path.glob("*.md")}
    assert all(f"`{name}: {{" in pages["forces"] for name in KERNELS)
    assert all(f"| `{name}` |" in pages["forces"] for name in families.names())
    assert all(f"## {command}\n" in pages["command_line"] for command in ("gqm-gen", "gqm solve", "gqm sweep"))
    assert all(
        f"| `{key}`" in pages["yaml"] for key in ("curve", "kernel", "lam0", "value", "unit", "grid", "quantities")
    )
    assert {path.stem for path in tmp_path.glob("*.ipynb")} >= {"quickstart", "example1", "example2", "own_curve"}
