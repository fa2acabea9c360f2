"""The benchmarks run, and our rows have errors below their limits; how long they take is not tested."""

import math
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from mpmath import mp

FOLDER = Path(__file__).parent.parent / "benchmarks"
TABLES = ("half_periods", "sampling", "legs", "load_maps", "many_launches")


@pytest.fixture(autouse=True)
def _beside_the_benchmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let benchmarks be imported as from their own folder, with references of 40 digits for their tests only."""
    monkeypatch.syspath_prepend(FOLDER)
    monkeypatch.setattr(sys, "argv", ["benchmark"])
    monkeypatch.setattr(mp, "dps", 40)


@pytest.mark.extended
@pytest.mark.parametrize("name", TABLES)
def test_our_rows_are_within_their_limits(name: str) -> None:
    """Each row of ours is run once and compared with its reference of 40 digits."""
    rows = [row for row in getattr(import_module(name), name)() if row.line < math.inf]
    assert rows
    for row in rows:
        assert row.error(row.call()) <= row.line, f"{row.work}, {row.who}"


@pytest.mark.extended
def test_where_the_time_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each step of the table can be run, which calls compiled functions of the runtime by their own arguments."""
    calls = import_module("calls")

    def once(work: Callable[[], Any], *_: int) -> float:
        work()
        return 0.0

    monkeypatch.setattr(calls, "least", once)
    assert all(line.endswith("| 0 ns |") for line in calls.profile()[2:])


@pytest.mark.parametrize("name", sorted(path.stem for path in FOLDER.glob("*.py")))
def test_it_can_be_imported(name: str) -> None:
    """No benchmark needs what is no longer there."""
    pytest.importorskip("distributed") if name == "cluster" else None
    assert import_module(name).__doc__
