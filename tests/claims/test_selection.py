"""What runs at every change is a part of all tests, to which each file contributes."""

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from paths import ROOT
from selection import EXTENDED_NOTEBOOKS, first_of_each, spread, usual


class _Item:
    """What is looked at of a test that pytest has found."""

    def __init__(self, name: str, *marks: Any, path: str = "test_file.py", **params: Any) -> None:
        self.path, self.originalname, self.marks = Path(path), name, marks
        self.callspec = SimpleNamespace(params=params)

    def get_closest_marker(self, name: str) -> Any:
        """Return the mark of this name, or None."""
        return next((mark for mark in self.marks if mark.name == name), None)


@pytest.mark.parametrize(
    ("length", "count", "kept"), [(48, 3, {0, 24, 47}), (5, 2, {0, 4}), (7, 1, {0}), (2, 3, {0, 1})]
)
def test_cases_are_spread_evenly(length: int, count: int, kept: set[int]) -> None:
    """The first and the last case are kept, and others between them at equal steps; all of them if there are few."""
    assert spread(length, count) == kept


def test_each_value_of_an_argument_is_kept() -> None:
    """Of all pairs of two curves and two forces, those are kept that have a curve or a force not seen before."""
    assert first_of_each([("a", "x"), ("a", "y"), ("b", "x"), ("b", "y")]) == {0, 1, 2}


def test_what_is_left_out() -> None:
    """Tests marked as extended, most cases of a sampled family and the listed notebooks are left out, and no others."""
    sample, each = pytest.mark.sample(2).mark, pytest.mark.sample(each=("curve", "force")).mark
    family = [_Item("family", sample, case=case) for case in range(4)]
    crossed = [_Item("crossed", each, curve=curve, force=force) for curve in "ab" for force in "xy"]
    other = [_Item("plain"), _Item("plain"), _Item("quickstart.ipynb", path="quickstart.ipynb")]
    slow = [_Item("slow", pytest.mark.extended.mark), _Item("", path=f"{EXTENDED_NOTEBOOKS[0]}.ipynb")]
    kept = usual([*family, *slow, *crossed, *other])
    assert kept == [family[0], family[3], *(crossed[case] for case in (0, 1, 2)), *other]


def test_no_file_of_tests_is_left_out() -> None:
    """Each file of tests has tests that run at every change."""
    texts = {file: file.read_text(encoding="utf-8") for file in (ROOT / "tests").rglob("test_*.py")}
    counts = {file: len(re.findall(r"^ *def test_", text, re.MULTILINE)) for file, text in texts.items()}
    marked = {file: len(re.findall(r"^ *@pytest.mark.extended$", text, re.MULTILINE)) for file, text in texts.items()}
    assert [file.name for file in texts if marked[file] >= counts[file]] == []


def test_listed_notebooks_exist() -> None:
    """The list of notebooks for the extended run names notebooks."""
    assert set(EXTENDED_NOTEBOOKS) <= {path.stem for path in (ROOT / "notebooks").glob("*.ipynb")}
