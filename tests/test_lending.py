"""Memory of large results: taken again when nobody has it any more, and never before."""

import copy
import gc
import pickle
import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from gqm_sym.runtime import lending
from gqm_sym.runtime.lending import MOST, rows
from gqm_sym.runtime.stores import LARGE, LINE

SIZE = LARGE // 8
BYTES = 2 * SIZE * 8


@pytest.fixture(autouse=True)
def nothing_kept() -> Iterator[None]:
    """Begin and end without a block."""
    lending._spare.clear()
    yield
    lending._spare.clear()


def place(array: Any) -> int:
    """Give where an array lies."""
    return int(array.__array_interface__["data"][0])


def test_memory_is_taken_again() -> None:
    """By the next result of that size."""
    first = rows(2, SIZE)
    there = place(first)
    first[:] = 1.0
    del first
    again = rows(2, SIZE)
    assert place(again) == there


@pytest.mark.parametrize(
    "held",
    [
        lambda array: array[1],
        lambda array: array[0, ::7],
        lambda array: array[1].reshape(2, -1).T,
        lambda array: array[0].base,
        lambda array: memoryview(array[0]),
        lambda array: array[1].view(np.int64)[5:],
        lambda array: array[1].ctypes,
        lambda array: np.asarray(memoryview(array[1])[3:9]),
        lambda array: array.flat,
    ],
)
def test_whatever_holds_a_part_holds_it_all(held: Callable[[Any], Any]) -> None:
    """Rows, views of views, buffers: none is written over while it lives, and then it may be."""
    array = rows(2, SIZE)
    array[:] = 3.0
    there, part = place(array), held(array)
    del array
    gc.collect()
    others = [rows(2, SIZE) for _ in range(3)]
    for other in others:
        other[:] = 4.0
        assert place(other) != there
    del others, other, part
    lending._spare.clear()
    gc.collect()


def test_results_that_live_have_memory_of_their_own() -> None:
    """However they come and go."""
    random, alive = np.random.default_rng(1), []
    for k in range(200):
        made = rows(2, SIZE if random.random() < 0.7 else SIZE + 8)
        made[:, :: SIZE // 4] = k
        alive.append((k, made))
        if len(alive) > 3:
            del alive[int(random.integers(len(alive)))]
        for number, array in alive:
            assert (array[:, :: SIZE // 4] == number).all()


def test_in_threads_too() -> None:
    """Blocks go to one of those that ask at once."""

    def work(k: int) -> bool:
        for _ in range(50):
            array = rows(2, SIZE)
            array[:, :: LINE * 64] = k
            kept = array[1]
            del array
            if not (kept[:: LINE * 64] == k).all():
                return False
        return True

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(work, range(8)))


def test_one_block_is_kept() -> None:
    """Of many results one; of one that is too large, or of a size that is no longer asked for, nothing."""
    tracemalloc.start()
    try:
        begin, _ = tracemalloc.get_traced_memory()
        many = [rows(2, SIZE) for _ in range(3)]
        assert tracemalloc.get_traced_memory()[0] - begin >= 3 * BYTES
        del many
        assert BYTES <= tracemalloc.get_traced_memory()[0] - begin < 1.1 * BYTES
        small = rows(2, SIZE // 2)
        assert BYTES / 2 <= tracemalloc.get_traced_memory()[0] - begin < 0.6 * BYTES
        del small
        huge = rows(1, MOST // 8)
        del huge
        assert tracemalloc.get_traced_memory()[0] - begin < 0.6 * BYTES
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("size", [0, 1, LINE + 1, SIZE, SIZE + 3])
def test_they_are_arrays_like_any_other(size: int) -> None:
    """Plain, writeable, contiguous row by row; those of large ones begin a line of the cache."""
    array = rows(2, size)
    array[:] = [[1.0], [2.0]]
    assert type(array) is np.ndarray
    assert array.shape == (2, size)
    for row in array:
        assert row.flags.c_contiguous
        assert row.flags.writeable
        assert row.flags.aligned
        assert size < SIZE or place(row) % (8 * LINE) == 0
        assert (pickle.loads(pickle.dumps(row)) == row).all()
        twin = copy.deepcopy(row)
        assert twin.flags.owndata
        assert (twin == row).all()


ENDING = """
import numpy as np
from gqm_sym.runtime.lending import rows
kept = rows(2, 2**19), rows(2, 2**19)[1]
loop = [rows(2, 2**19)]
loop.append(loop)
"""


def test_a_process_ends_in_peace() -> None:
    """Whatever is still alive then."""
    done = subprocess.run([sys.executable, "-c", ENDING], capture_output=True, check=True, text=True)
    assert done.stderr == ""
