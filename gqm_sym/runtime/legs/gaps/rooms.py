"""The rooms for the data kept of gaps, which serve later calls for the same forces and run-time parameters."""

import threading
from collections.abc import Hashable, Iterator
from contextlib import contextmanager

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.legs.advance import NO_NUMBERS
from gqm_sym.runtime.legs.gaps.data import room_kept

# The rooms by forces, parameters and chart. The chart is stored with them, so that no other chart can have the same
# identity. A thread that uses an entry removes it for that time.
_KEPT: dict[Hashable, tuple[Array, Array]] = {}
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
    found = None
    if key is not None:
        with _LOCK:
            found = _KEPT.pop(key, None)
    room = room_kept(breaks, with_blocks=with_blocks) if found is None else found[0]
    yield room
    if key is not None:
        with _LOCK:
            _KEPT[key] = room, chart
            while len(_KEPT) > MAX_KEPT:
                del _KEPT[next(iter(_KEPT))]
