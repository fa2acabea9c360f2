"""The rooms for the data kept of gaps, which serve later calls for the same forces and run-time parameters."""

import threading
from collections.abc import Hashable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

from gqm_sym.runtime.compiled.threads import cores
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.legs.advance import NO_NUMBERS
from gqm_sym.runtime.legs.gaps.data import room_kept


class Kept(NamedTuple):
    """A room that no call uses.

    Attributes
    ----------
    key : hashable
        The forces, the run-time parameters and the identity of the chart.
    room : array
    chart : array
        The chart. It is stored so that no other chart can have the same identity.
    """

    key: Hashable
    room: Array
    chart: Array


# The rooms, of which the last was used last. There may be several with the same key, because threads that follow bodies
# at the same time need one each; a thread removes its room for that time.
_KEPT: list[Kept] = []
MAX_KEPT = 8
_LOCK = threading.Lock()


@contextmanager
def room_for(chart: Array, breaks: int, key: Hashable | None, *, with_blocks: bool) -> Iterator[Array]:
    """Provide the room for a curve with so many breaks (`data.room_kept`); an empty one if there are none.

    Parameters
    ----------
    chart : array
        The chart of the curve.
    key : hashable or None
        The forces, the run-time parameters and the identity of the chart. The room is kept for the next call with the
        same key; None stands for bodies with different parameters, which need a room for this call only.
    """
    if not breaks:
        yield NO_NUMBERS
        return
    room = None if key is None else _taken(key)
    if room is None:
        room = room_kept(breaks, with_blocks=with_blocks)
    yield room
    if key is not None:
        with _LOCK:
            _KEPT.append(Kept(key, room, chart))
            del _KEPT[: -max(MAX_KEPT, cores())]


def _taken(key: Hashable) -> Array | None:
    """Remove the room with the key that was used last, and return it; None if there is none."""
    with _LOCK:
        for k in range(len(_KEPT) - 1, -1, -1):
            if _KEPT[k].key == key:
                return _KEPT.pop(k).room
    return None
