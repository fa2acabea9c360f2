"""What is kept of gaps serves later calls for the same forces, run-time parameters and chart."""

from contextlib import ExitStack

import numpy as np
import pytest

from gqm_sym.runtime.compiled.threads import cores
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.legs.gaps import rooms

CHART, BREAKS = np.ones(3), 5


@pytest.fixture(autouse=True)
def nothing_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Begin without rooms."""
    monkeypatch.setattr(rooms, "_KEPT", [])


def rooms_at_once(key: str, count: int) -> list[Array]:
    """Return the rooms that as many threads use at the same time."""
    with ExitStack() as stack:
        return [stack.enter_context(rooms.room_for(CHART, BREAKS, key, with_blocks=False)) for _ in range(count)]


def test_each_thread_finds_what_was_kept() -> None:
    """Threads of one sweep have a room each, and the next sweep gets all of them: only the first found what the body
    before had left, so that all others filled their rooms anew.
    """
    first = rooms_at_once("law", 2)
    assert first[0] is not first[1]
    assert {id(room) for room in rooms_at_once("law", 2)} == {id(room) for room in first}
    assert all(room is not one for room in rooms_at_once("another law", 1) for one in first)
    assert {id(room) for room in rooms_at_once("law", 2)} == {id(room) for room in first}


def test_rooms_are_given_up() -> None:
    """The rooms that were used last are kept, and not more than a few."""
    most = max(rooms.MAX_KEPT, cores())
    (first,) = rooms_at_once("law 0", 1)
    for k in range(1, most):
        rooms_at_once(f"law {k}", 1)
    assert rooms_at_once("law 0", 1)[0] is first
    (second,) = rooms_at_once("law 1", 1)
    rooms_at_once("law at last", 1)
    assert rooms_at_once("law 2", 1)[0] is not first
    assert rooms_at_once("law 1", 1)[0] is second
    assert len(rooms._KEPT) == most


def test_bodies_with_other_parameters_keep_nothing() -> None:
    """A room without a key is for one call, and a curve without breaks needs none."""
    with rooms.room_for(CHART, BREAKS, None, with_blocks=False) as room:
        assert room.size > 0
    assert rooms._KEPT == []
    with rooms.room_for(CHART, 0, "law", with_blocks=False) as room:
        assert room.size == 0
