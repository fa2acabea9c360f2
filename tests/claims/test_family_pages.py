"""Every family has a page of documentation, which agrees with its derivation."""

import runpy

import pytest
from paths import ROOT

import gqm_sym as gqm


def test_each_family_has_a_page() -> None:
    """There is one page for each family, and an index."""
    assert {path.stem for path in (ROOT / "docs" / "families").glob("*.md")} == {"index", *gqm.families.names()}


@pytest.mark.extended
def test_pages_are_current() -> None:
    """The committed pages are those that the script writes, one for each family and an index."""
    pages = runpy.run_path(str(ROOT / "scripts" / "make_family_pages.py"))["pages"]()
    assert {path.stem for path in pages} == {"index", *gqm.families.names()}
    for path, text in pages.items():
        assert path.read_text(encoding="utf-8") == text, f"{path.name}: run make generate"
