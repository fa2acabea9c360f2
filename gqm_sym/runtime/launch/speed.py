"""Load maps: Pass 1 at many places of a conservative model, block by block, so that what lies between stays in cache.

V**2 is the launch's less the climb to a place. Where most of that cancels, as near a launch from rest, the climb's
first divided difference from the launch place keeps the digits that subtracting heights loses.
"""

from itertools import pairwise
from math import fabs, nan
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.errors import InputError
from gqm_sym.runtime.compiled.calls import (
    call_effective_potential,
    call_load_map,
    call_path_and_contact_force,
    call_potential_divdiff1,
)
from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.streaming import put, settle
from gqm_sym.runtime.compiled.types import ADDRESSES, INTEGER, MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.interface import FRAME_ROWS, LOAD_ROWS

# Places filled at a time: few enough that what is streamed drains into memory while the next are worked out.
BLOCK = 256

# Rows that are asked for.
SHOWN = 6

# Heights may be of this many times the size of V**2 at launch or of its change: then both ways round alike.
LEVELLED = 2.0


class Pass1(NamedTuple):
    """Position, metric, curvature, V**2 and contact force at places of a curve, each an array of the places' shape."""

    x: Array
    z: Array
    ds: Array
    kappa: Array
    v2: Array
    normal_force: Array


def room(shape: tuple[int, ...], lam: Array, out: Any) -> Pass1:
    """Arrays for a load map: new ones, or those of ``out`` where they will do.

    Raises
    ------
    InputError
        If ``out`` is not six arrays of doubles of that shape, each with memory of its own.
    """
    if out is None:
        return Pass1(*(np.empty(shape) for _ in Pass1._fields))
    names = Pass1._fields
    if not isinstance(out, tuple | list) or len(out) != len(names):
        what = f"{len(out)} of them" if isinstance(out, tuple | list) else type(out).__name__
        raise InputError(f"out: must be {len(names)} arrays ({', '.join(names)}), as pass1 returns them; got {what}")
    for name, array in zip(names, out, strict=True):
        _check(f"out: {name}", array, shape)
    spans = sorted(
        (array.__array_interface__["data"][0], array.nbytes, name) for name, array in zip(names, out, strict=True)
    )
    for (start, size, one), (other_start, _, other) in pairwise(spans):
        if start + size > other_start:
            raise InputError(f"out: {one} and {other} share memory; give each array its own")
    for name, array in zip(names, out, strict=True):
        if np.may_share_memory(array, lam):
            raise InputError(f"out: {name} shares memory with the places; give it its own")
    return Pass1(*out)


def _check(where: str, array: Any, shape: tuple[int, ...]) -> None:
    """Refuse what compiled code cannot fill in place."""
    if not isinstance(array, np.ndarray):
        raise InputError(f"{where} is {type(array).__name__}; give an array of float64")
    if array.dtype != np.float64:
        raise InputError(f"{where} is an array of {array.dtype}; give one of float64")
    if array.shape != shape:
        raise InputError(f"{where} has the shape {array.shape}; the places have {shape}")
    if not array.flags.c_contiguous:
        raise InputError(f"{where} is not contiguous; give an array whose rows follow each other (np.empty makes one)")
    if not array.flags.writeable:
        raise InputError(f"{where} is read-only; give an array that may be written to")


@Inlined
def keeps(w0, v2, sizes):  # type: ignore[no-untyped-def]
    """Whether subtracting heights of some size has left V**2 its digits; never of what is not a number."""
    return sizes <= LEVELLED * max(fabs(w0 - v2), w0)


@Inner
def mend(fns, p, lam0, gained, w0, size, here, rests, field, known):  # type: ignore[no-untyped-def]
    """What `fill_loads` has in ``field``, with V**2 from the climb's divided difference wherever that has more digits.

    Without ``known`` there is nothing in it yet.
    """
    n = here.size
    rise, offsets, exact, frame = np.empty(2 * n), here - lam0, np.empty(n), np.empty(FRAME_ROWS * n)
    v2, force, sizes = field[4 * n : 5 * n], field[5 * n : 6 * n], field[6 * n : 7 * n]
    if rests.size:
        offsets += rests
    call_potential_divdiff1(fns.potential_divdiff1, n, lam0, here, offsets, p, rise)
    for i in range(n):
        slow = w0 - (offsets[i] * rise[i] - gained)
        exact[i] = v2[i] if known and keeps(w0, v2[i], size + sizes[i]) else slow
    call_path_and_contact_force(fns.path_and_contact_force, n, here, exact, p, frame)
    if not known:
        field[: 4 * n] = frame[: 4 * n]
    for i in range(n):
        force[i] = force[i] if known and keeps(w0, v2[i], size + sizes[i]) else frame[4 * n + i]
    v2[:] = exact


@entry(
    types.void(
        *(ADDRESSES, INTEGER, VECTOR, REAL, REAL, REAL, VECTOR, VECTOR),
        *(types.UniTuple(VECTOR, SHOWN), INTEGER, INTEGER, types.boolean),
    ),
    nogil=True,
)
def fill_loads(fns, loads, p, lam0, lam0_low, w0, places, rests, rows, begin, end, past):  # type: ignore[no-untyped-def]
    """Fill rows x, z, ds, kappa, V**2 and contact force from the index ``begin`` to ``end``; ``past`` as in `put`.

    ``loads`` is the address of the module's function, 0 where it has none. ``rests`` are what the places leave over as
    doubles; empty where they leave nothing.
    """
    launch, field = np.empty((2, 1)), np.empty(LOAD_ROWS * BLOCK)
    start = np.array([lam0])
    call_effective_potential(fns.effective_potential, 1, start, p, launch)
    gained = lam0_low * launch[1, 0]
    level, size = 0.0, nan  # nothing is kept of sizes that are not known
    if loads and not rests.size:
        call_load_map(loads, 1, 0.0, 0.0, start, p, field)
        level, size = gained - field[4], field[6]
    known = size >= 0.0
    x, z, ds, kappa, v2, force = rows
    for first in range(begin, end, BLOCK):
        n = min(BLOCK, end - first)
        lost = n
        if known:
            call_load_map(loads, n, w0, level, places[first : first + n], p, field)
            lost = 0
            for i in range(n):
                lost += 0 if keeps(w0, field[4 * n + i], size + field[6 * n + i]) else 1
        if lost:
            mend(fns, p, lam0, gained, w0, size, places[first : first + n], rests[first : first + n], field, known)
        put(x, first, field, 0, n, past)
        put(z, first, field, n, n, past)
        put(ds, first, field, 2 * n, n, past)
        put(kappa, first, field, 3 * n, n, past)
        put(v2, first, field, 4 * n, n, past)
        put(force, first, field, 5 * n, n, past)
    settle(x)


@entry(MATRIX(ADDRESSES, VECTOR, VECTOR, VECTOR))
def path_and_force_at(fns, p, lam, v2):  # type: ignore[no-untyped-def]
    """x, z, ds, kappa and the contact force at many places, given V**2 there."""
    out = np.empty((5, lam.size))
    call_path_and_contact_force(fns.path_and_contact_force, lam.size, lam, v2, p, out)
    return out


@entry(MATRIX(ADDRESSES, VECTOR, VECTOR))
def potential_at(fns, p, lam):  # type: ignore[no-untyped-def]
    """The climb and its slope at many places."""
    out = np.empty((2, lam.size))
    call_effective_potential(fns.effective_potential, lam.size, lam, p, out)
    return out


@entry(VECTOR(ADDRESSES, VECTOR, REAL, REAL, REAL, VECTOR, VECTOR))
def speed_squared_at(fns, p, lam0, lam0_low, w0, places, offsets):  # type: ignore[no-untyped-def]
    """V**2 at many places and their offsets from lam0, launched from lam0 + lam0_low, without subtracting heights."""
    rows, launch = np.empty((2, offsets.size)), np.empty((2, 1))
    call_potential_divdiff1(fns.potential_divdiff1, offsets.size, lam0, places, offsets, p, rows)
    call_effective_potential(fns.effective_potential, 1, np.array([lam0]), p, launch)
    out = np.empty(offsets.size)
    for i in range(offsets.size):
        out[i] = w0 - (offsets[i] * rows[0, i] - lam0_low * launch[1, 0])
    return out
