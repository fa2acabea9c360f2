"""The glossary has every public name, each word once, and the reference page lists everything that is exported."""

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

import gqm_sym as gqm
from gqm_sym import design, errors, figures, jax, runtime, torch
from gqm_sym.declare import families
from gqm_sym.runtime import Event, Leg, Motion, Sweep

DOCS = Path(__file__).parent.parent / "docs"
REFERENCE = DOCS / "reference"

CLASSES = (gqm.Curve, gqm.Kernel, gqm.Model, Motion, Event, Leg, Sweep)


def rows() -> Iterator[str]:
    """Yield the first cell of each row of the tables below the symbols."""
    text = (REFERENCE / "glossary.md").read_text(encoding="utf-8").partition("## Declaring")[2]
    for line in text.splitlines():
        first = line.split("|")[1].strip() if line.startswith("| ") else ""
        if first and first not in ("name", "word"):
            yield first


def defined() -> list[str]:
    """List the names in backticks that the first cells define."""
    return [name for row in rows() for name in re.findall(r"`([\w.]+)`", row)]


def members(owner: type) -> Iterator[str]:
    """Yield the public names of a class with its name before them."""
    inherited = set(dir(tuple))
    fields = {name for part in owner.__mro__ for name in vars(part).get("__annotations__", {})}
    for name in {*dir(owner), *fields}:
        if not name.startswith("_") and (name not in inherited or name in fields):
            yield f"{owner.__name__}.{name}"


def public() -> set[str]:
    """Return every public name."""
    names = {*gqm.__all__, *runtime.__all__} - {"compiler"}
    names |= {f"families.{name}" for name in families.names()} | {f"figures.{name}" for name in figures.__all__}
    names |= {f"design.{name}" for name in design.__all__} | {f"jax.{name}" for name in jax.__all__}
    names |= {f"torch.{name}" for name in torch.__all__}
    for owner in CLASSES:
        names |= set(members(owner))
    return names - {f"{owner.__name__}.{name}" for owner in (Event,) for name in ("t", "lam", "x", "z")}


def test_every_public_name_is_explained() -> None:
    """Every exported name and every public member has a row; fields of states and events share one."""
    shared = {"Curve.x", "Curve.z", "Leg.lam_start", "Leg.lam_end"}
    assert sorted(public() - set(defined()) - shared) == []


def test_every_explained_name_exists() -> None:
    """A name with a dot in it is a member of its class or package."""
    dotted = {name for name in defined() if "." in name and not name.startswith("State.")}
    assert sorted(dotted - public()) == []


def test_each_is_explained_once() -> None:
    """No row begins as another does."""
    assert [row for row, count in Counter(rows()).items() if count > 1] == []


SHOWN = [*gqm.__all__, *(f"{room.__name__[8:]}.{name}" for room in (figures, design) for name in room.__all__)]


@pytest.mark.parametrize("name", SHOWN)
def test_the_reference_page_lists(name: str) -> None:
    """Every name that is exported stands on the page by its full name."""
    page = (REFERENCE / "api.md").read_text(encoding="utf-8")
    assert re.search(rf"gqm_sym\.{re.escape(name)}\b", page)


def test_the_reference_page_lists_the_runtime_and_the_errors() -> None:
    """The page lists the types that `solve` and `sweep` return; the errors are listed all together."""
    page = (REFERENCE / "api.md").read_text(encoding="utf-8")
    missing = [name for name in ("Motion", "State", "Pass1", "Event", "Leg", "Sweep") if f"runtime.{name}" not in page]
    assert missing == []
    assert errors.__name__ in page


def test_the_made_pages_are_current(monkeypatch: pytest.MonkeyPatch) -> None:
    """The committed tables are what `python docs/made.py` writes."""
    monkeypatch.syspath_prepend(str(DOCS))
    monkeypatch.delitem(__import__("sys").modules, "made", raising=False)
    import made

    for name, text in made.pages().items():
        assert (REFERENCE / f"{name}.md").read_text(encoding="utf-8") == text, name


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as hosting sites and the built site make them."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_links_are_words_and_lead_to_files() -> None:
    """Pages are read as files too: each link has a text, and leads to a file of the repository and a heading in it."""
    wrong = []
    for page in (DOCS.parent / "README.md", *DOCS.rglob("*.md")):
        if {"made", "_build"} & set(page.relative_to(DOCS.parent).parts):
            continue
        text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        for words, target in re.findall(r"(?<!\\)\[([^\]\n]*)\]\(([^)\s]+)\)", text):
            if "://" in target:
                continue
            path, _, anchor = target.partition("#")
            file = page.parent / path if path else page
            if not words or not file.exists() or (anchor and anchor not in anchors(file)):
                wrong.append(f"{page.name}: [{words}]({target})")
    assert wrong == []


def words() -> list[str]:
    """List the words that the glossary defines, without their plurals and abbreviations."""
    text = (REFERENCE / "glossary.md").read_text(encoding="utf-8").partition("## Words")[2]
    return [line.split("|")[1].strip() for line in text.splitlines()[4:]]


def test_words_are_in_order() -> None:
    """A reader finds a word in alphabetical order."""
    assert words() == sorted(words(), key=str.lower)


# ARCHITECTURE.md presupposes these words. A word that is no longer used there is removed from this list.
TERMS = """arithmetic-geometric mean, axis of symmetry, batch, body, chart, divided difference, double-double,
effective potential, emission, facade, Fourier series, Gauss-Legendre rule, gradient, hilltop, integrating factor,
interface, interval bounds, lane, launch, leg, lowering, multiprecision, Newton's method, node, normal, orbit, panel,
phase angle, piece, quadrature, record, room, run-time parameter, segment, separatrix, shared subexpression, stage,
substitution, table, tape, tier, trapezoidal rule, turning point, variational equation, vector register,
vocabulary"""


@pytest.mark.parametrize("term", [term.strip() for term in " ".join(TERMS.split()).split(",")])
def test_the_words_of_the_architecture(term: str) -> None:
    """Each word is used in ARCHITECTURE.md and defined in the glossary."""
    architecture = " ".join((DOCS.parent / "ARCHITECTURE.md").read_text(encoding="utf-8").split())
    used = re.compile(re.sub(r"rule$", "rules?", re.escape(term)).replace("mean", "means?"), re.IGNORECASE)
    assert used.search(architecture)
    assert term in words()
