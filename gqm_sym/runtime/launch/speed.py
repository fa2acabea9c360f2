"""Pass 1: position, curvature, V**2 and contact force at given places of a conservative model.

A load map has all of these at many places. It is filled block by block, so that intermediate results stay in the cache.
V**2 is its value at launch less twice the change of the effective potential. If most of that difference cancels, as
near a launch from rest, the first divided difference of the potential from the launch place keeps the digits that a
subtraction of potentials loses.
"""

from itertools import pairwise
from math import fabs, nan, sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.errors import InputError
from gqm_sym.runtime.compiled.calls import (
    call_effective_potential,
    call_load_map,
    call_path_and_contact_force,
    call_path_in_space,
    call_potential_divdiff1,
)
from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.streaming import put, settle
from gqm_sym.runtime.compiled.types import ADDRESSES, INTEGER, MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.interface import LOAD_MAP_ROWS, PATH_ROWS, SPACE_ROWS

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas

# The number of places that are filled at a time. It is small enough that streamed results are written to memory while
# the next ones are computed.
BLOCK = 256

# The rows of a load map, and those of the load map of a space curve.
MAP_ROWS, MAP_ROWS_IN_SPACE = 6, 10

# The largest size of the potential's terms for which V**2 by subtraction keeps its digits, in units of V**2 at launch
# or of its change: the divided difference is then no more accurate.
MAX_TERMS_RATIO = 1.0

# Potentials that two functions evaluate differ by less than this share of their terms.
DIFFERENCE_SHARE = 0.01


class Pass1(NamedTuple):
    """The results of pass 1 at places of a curve (paper, section "Pass 1"; MATHS, section 2).

    Each field is an array of the shape of the places, or of that of ``out``.

    Attributes
    ----------
    x, z : array
        Coordinates in m; z is up.
    ds : array
        Arc length per unit of the curve parameter, ds/dlam, in m.
    kappa : array
        Signed curvature in 1/m, positive where the track bends to the left of increasing parameter.
    v2 : array
        Squared speed V**2 in m**2/s**2; negative at places that a conservative motion cannot reach, NaN beyond the
        first turn of a dissipative one.
    normal_force : array
        Contact force N in N along the normal, which is to the left of increasing parameter.
    """

    x: Array
    z: Array
    ds: Array
    kappa: Array
    v2: Array
    normal_force: Array


class Pass1InSpace(NamedTuple):
    """The results of pass 1 at places of a space curve: those of `Pass1` and four more arrays.

    Attributes
    ----------
    x, z, ds, v2 : array
        As in `Pass1`.
    kappa, normal_force : array
        As in `Pass1` if the curve lies in a vertical plane; else the lengths of the curvature and of the contact force.
    y : array
        The third coordinate in m.
    normal_x, normal_y, normal_z : array
        The contact force along x, y and z, in N.
    """

    x: Array
    z: Array
    ds: Array
    kappa: Array
    v2: Array
    normal_force: Array
    y: Array
    normal_x: Array
    normal_y: Array
    normal_z: Array


class Pass1OfRider(NamedTuple):
    """The results of pass 1 at places of a banked track: those of `Pass1InSpace` and the loads on a rider.

    Attributes
    ----------
    x, z, ds, kappa, v2, normal_force, y, normal_x, normal_y, normal_z : array
        As in `Pass1InSpace`.
    n_vertical, n_lateral, n_longitudinal : array
        Loads on the rider upwards, to the left and forwards, in units of 9.80665 m/s**2.
    onset_vertical, onset_lateral, onset_longitudinal : array
        Their rates of change, in the same unit per second.
    roll : array
        The roll angle in radians, between -pi and pi, positive to the left.
    track_x, track_y, track_z : array
        Coordinates in m of the track, below the riders' line.
    """

    x: Array
    z: Array
    ds: Array
    kappa: Array
    v2: Array
    normal_force: Array
    y: Array
    normal_x: Array
    normal_y: Array
    normal_z: Array
    n_vertical: Array
    n_lateral: Array
    n_longitudinal: Array
    onset_vertical: Array
    onset_lateral: Array
    onset_longitudinal: Array
    roll: Array
    track_x: Array
    track_y: Array
    track_z: Array


class LaunchNumbers(NamedTuple):
    """A launch in doubles, with the numbers that a load map keeps of it.

    Attributes
    ----------
    lam0, w0 : float
        The launch place, and V**2 there.
    v2_correction : float
        The increase of V**2 that results from the difference between the exact launch place and its double.
    size : float
        Size of the terms of the effective potential at launch; NaN if it is not known.
    """

    lam0: float
    w0: float
    v2_correction: float
    size: float


def load_map_arrays(
    kind: type[Pass1] | type[Pass1InSpace] | type[Pass1OfRider], shape: tuple[int, ...], lam: Array, out: Any
) -> Pass1 | Pass1InSpace | Pass1OfRider:
    """Return the arrays of a load map: those of ``out``, or new ones if it is None.

    Parameters
    ----------
    kind : type
        The NamedTuple class in which the arrays are returned.
    shape : tuple of int
        The shape of the places.
    lam : array
        The places, with which no array of ``out`` may share memory.
    out : tuple or list of arrays, or None
        Arrays of doubles to be filled, in the order of ``kind``.

    Raises
    ------
    InputError
        If ``out`` does not consist of the right number of writable, contiguous arrays of doubles of that shape, each
        with memory of its own.
    """
    names = kind._fields
    if out is None:
        return kind(*(np.empty(shape) for _ in names))
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
    return kind(*out)


def _check(where: str, array: Any, shape: tuple[int, ...]) -> None:
    """Refuse an array that compiled code cannot fill."""
    if not isinstance(array, np.ndarray):
        raise InputError(f"{where} is {type(array).__name__}; give an array of float64")
    if array.dtype != np.float64:
        raise InputError(f"{where} is an array of {array.dtype}; give one of float64")
    if array.shape != shape:
        raise InputError(f"{where} has the shape {array.shape}; the places have {shape}")
    if not array.flags.c_contiguous:
        raise InputError(f"{where} is not contiguous; give an array whose rows follow each other (np.empty makes one)")
    if not array.flags.aligned:
        raise InputError(f"{where} is not aligned in memory; give an array that is (np.empty makes one)")
    if not array.flags.writeable:
        raise InputError(f"{where} is read-only; give an array that may be written to")


@Inlined
def keeps_digits(w0, v2, sizes):  # type: ignore[no-untyped-def]
    """Return whether V**2 has kept its digits although terms of some size were subtracted; false if one of them is not
    a number.
    """
    return sizes <= MAX_TERMS_RATIO * max(fabs(w0 - v2), w0)


@Inner
def fill_by_difference(fns, path_in_space, p, launch, places, low_parts, field):  # type: ignore[no-untyped-def]
    """Fill V**2 and the contact force by the divided difference of the potential wherever that has more digits.

    ``field`` holds the rows of a block of a load map. If the size of the potential's terms at launch is not known, it
    is empty on entry and all of its rows are filled. ``path_in_space`` is the address of the function that fills the
    last four; 0 if there are none.
    """
    n, lam0, w0, size = places.size, launch.lam0, launch.w0, launch.size
    divdiff, offsets, better = np.empty(2 * n), places - lam0, np.empty(n)
    if low_parts.size:
        offsets += low_parts
    call_potential_divdiff1(fns.potential_divdiff1, n, lam0, places, offsets, p, divdiff)
    for i in range(n):
        better[i] = w0 - (2.0 * offsets[i] * divdiff[i] - launch.v2_correction)
    if size >= 0.0:
        replace_rounded(fns, path_in_space, p, launch, places, better, field)
        return
    call_path_and_contact_force(fns.path_and_contact_force, n, places, better, p, field)
    for i in range(n):
        field[5 * n + i], field[4 * n + i] = field[4 * n + i], better[i]
    if path_in_space:
        call_path_in_space(path_in_space, n, places, better, 1.0, p, field[LOAD_MAP_ROWS * n :])


@Inner
def replace_rounded(fns, path_in_space, p, launch, places, better, field):  # type: ignore[no-untyped-def]
    """Fill a block of a load map, which is filled by subtraction, anew where that loses digits of V**2.

    ``better`` is V**2 by a divided difference, and on return what V**2 is.
    """
    n, w0, size = places.size, launch.w0, launch.size
    keeps, rows = np.empty(n), np.empty((PATH_ROWS + SPACE_ROWS) * n)
    for i in range(n):
        v2 = field[4 * n + i]
        keeps[i] = 1.0 if keeps_digits(w0, v2, size + field[6 * n + i]) else 0.0
        better[i] = v2 if keeps[i] else better[i]
    call_path_and_contact_force(fns.path_and_contact_force, n, places, better, p, rows)
    for i in range(n):
        field[5 * n + i] = field[5 * n + i] if keeps[i] else rows[4 * n + i]
        field[4 * n + i] = better[i]
    if path_in_space:
        call_path_in_space(path_in_space, n, places, better, 1.0, p, rows[PATH_ROWS * n :])
        for k in range(SPACE_ROWS):
            for i in range(n):
                # The first rows come from the same function, whether the load map of the block is known or not.
                field[k * n + i] = field[k * n + i] if keeps[i] else rows[k * n + i]
        for k in range(SPACE_ROWS):
            for i in range(n):
                at, of = (LOAD_MAP_ROWS + k) * n + i, (PATH_ROWS + k) * n + i
                field[at] = field[at] if keeps[i] else rows[of]


@Inner
def may_keep_digits(fns, p, launch, potential, places):  # type: ignore[no-untyped-def]
    """Return whether V**2 may keep its digits at some of the places, given the potential at launch; the size of its
    terms there is part of those that V**2 is the difference of.
    """
    rows, size = np.empty(2 * places.size), (1.0 - DIFFERENCE_SHARE) * launch.size
    call_effective_potential(fns.effective_potential, places.size, places, p, rows)
    for i in range(places.size):
        if not size > MAX_TERMS_RATIO * max(fabs(2.0 * (rows[i] - potential)), launch.w0):
            return True
    return False


@Inner
def fill_directed(path_in_space, p, launch, direction, places, field):  # type: ignore[no-untyped-def]
    """Fill the contact force of a block of a load map, and the last four rows, in a rotating frame.

    ``direction`` is the sign of ds/dt at launch. From rest the body may move to either side of the launch.
    """
    n, first = places.size, LOAD_MAP_ROWS * places.size
    v2, force, rows = field[4 * n : 5 * n], field[5 * n : 6 * n], field[first : first + SPACE_ROWS * n]
    call_path_in_space(path_in_space, n, places, v2, direction, p, rows)
    if launch.w0 == 0.0:
        backwards = np.empty(SPACE_ROWS * n)
        call_path_in_space(path_in_space, n, places, v2, -direction, p, backwards)
        for i in range(n):
            for k in range(SPACE_ROWS if (places[i] - launch.lam0) * direction < 0.0 else 0):
                rows[k * n + i] = backwards[k * n + i]
    for i in range(n):
        along_x, along_y, along_z = rows[n + i], rows[2 * n + i], rows[3 * n + i]
        force[i] = sqrt(along_x * along_x + along_y * along_y + along_z * along_z)


@entry(
    types.void(
        *(ADDRESSES, types.UniTuple(INTEGER, 3), VECTOR, types.UniTuple(REAL, 3), types.UniTuple(VECTOR, 2)),
        *(types.UniTuple(VECTOR, MAP_ROWS_IN_SPACE), types.UniTuple(INTEGER, 2), types.boolean),
    ),
    nogil=True,
    checked=False,
)
def fill_load_map(fns, of_map, p, launch, places, rows, part, past_cache):  # type: ignore[no-untyped-def]
    """Fill a part of the rows x, z, ds, kappa, V**2 and contact force of a load map, and of y and the contact force
    along x, y and z in space.

    The arguments are not checked, because examining the tuples would take two microseconds a call.
    `CompiledModel.pass1`, the only caller, ensures that arrays are aligned, contiguous and of doubles.

    Parameters
    ----------
    of_map : (load_map, path_in_space, direction)
        The addresses of the module's functions for load maps and for the last four rows; 0 if there are none. In a
        rotating frame in space, the sign of ds/dt at launch, on which the contact force depends; otherwise 0.
    launch : (lam0, lam0_low, w0)
        The launch place as two doubles, and V**2 there.
    places : (lam, low_parts)
        The places as two doubles each; ``low_parts`` is empty if all of them are zero.
    rows : tuple of ten arrays
        The rows to be filled. If ``path_in_space`` is 0, the last four are not read.
    part : (begin, end)
        The range of places to fill.
    past_cache : bool
        Whether the rows are written past the caches (`streaming.put`).
    """
    (lam0, lam0_low, w0), (lam, low_parts), (begin, end) = launch, places, part
    load_map, path_in_space, direction = of_map
    slopes, field = np.empty((2, 1)), np.empty((LOAD_MAP_ROWS + SPACE_ROWS) * BLOCK)
    start = np.array([lam0])
    call_effective_potential(fns.effective_potential, 1, start, p, slopes)
    correction = 2.0 * lam0_low * slopes[1, 0]
    level, size = 0.0, nan
    if load_map and not low_parts.size:
        call_load_map(load_map, 1, 0.0, 0.0, start, p, field)
        level, size = 0.5 * (correction - field[4]), field[6]
    numbers = LaunchNumbers(lam0, w0, correction, size)
    unknown = LaunchNumbers(lam0, w0, correction, nan)
    by_subtraction, is_known, in_space = size >= 0.0, True, 0 if direction else path_in_space
    x, z, ds, kappa, v2, force, y, along_x, along_y, along_z = rows
    for first in range(begin, end, BLOCK):
        n = min(BLOCK, end - first)
        inaccurate, block = n, lam[first : first + n]
        # After a block without digits to keep, a look at the next one costs less than its load map.
        is_known = by_subtraction and (
            is_known or not in_space or may_keep_digits(fns, p, numbers, slopes[0, 0], block)
        )
        if is_known:
            call_load_map(load_map, n, w0, level, lam[first : first + n], p, field)
            inaccurate = 0
            for i in range(n):
                inaccurate += 0 if keeps_digits(w0, field[4 * n + i], size + field[6 * n + i]) else 1
        if inaccurate:
            told = numbers if is_known else unknown
            fill_by_difference(fns, in_space, p, told, block, low_parts[first : first + n], field)
            is_known = is_known and inaccurate < n
        if direction:
            fill_directed(path_in_space, p, numbers, float(direction), lam[first : first + n], field)
        put(x, first, field, 0, n, past_cache)
        put(z, first, field, n, n, past_cache)
        put(ds, first, field, 2 * n, n, past_cache)
        put(kappa, first, field, 3 * n, n, past_cache)
        put(v2, first, field, 4 * n, n, past_cache)
        put(force, first, field, 5 * n, n, past_cache)
        if path_in_space:
            put(y, first, field, 7 * n, n, past_cache)
            put(along_x, first, field, 8 * n, n, past_cache)
            put(along_y, first, field, 9 * n, n, past_cache)
            put(along_z, first, field, 10 * n, n, past_cache)
    settle(x)


@entry(MATRIX(ADDRESSES, VECTOR, VECTOR, VECTOR))
def path_and_force_at(fns, p, lam, v2):  # type: ignore[no-untyped-def]
    """Return rows x, z, ds, kappa and contact force at places ``lam``, given V**2 there."""
    out = np.empty((5, lam.size))
    call_path_and_contact_force(fns.path_and_contact_force, lam.size, lam, v2, p, out)
    return out


@entry(MATRIX(ADDRESSES, VECTOR, VECTOR))
def potential_at(fns, p, lam):  # type: ignore[no-untyped-def]
    """Return rows of the effective potential and of its slope at places ``lam``."""
    out = np.empty((2, lam.size))
    call_effective_potential(fns.effective_potential, lam.size, lam, p, out)
    return out


@entry(VECTOR(ADDRESSES, VECTOR, REAL, REAL, REAL, VECTOR, VECTOR))
def speed_squared_at(fns, p, lam0, lam0_low, w0, places, offsets):  # type: ignore[no-untyped-def]
    """Return V**2 at places with their offsets from lam0, for a launch at lam0 + lam0_low, without subtracting
    potentials.
    """
    rows, launch = np.empty((2, offsets.size)), np.empty((2, 1))
    call_potential_divdiff1(fns.potential_divdiff1, offsets.size, lam0, places, offsets, p, rows)
    call_effective_potential(fns.effective_potential, 1, np.array([lam0]), p, launch)
    out = np.empty(offsets.size)
    for i in range(offsets.size):
        out[i] = w0 - 2.0 * (offsets[i] * rows[0, i] - lam0_low * launch[1, 0])
    return out


@entry(MATRIX(INTEGER, VECTOR, VECTOR, VECTOR, REAL), nogil=True)
def path_in_space_at(address, p, lam, v2, v):  # type: ignore[no-untyped-def]
    """Return rows y and contact force along x, y and z at places ``lam`` of a space curve, given V**2 and sgn(ds/dt)
    there.
    """
    out = np.empty((SPACE_ROWS, lam.size))
    call_path_in_space(address, lam.size, lam, v2, v, p, out)
    return out


@entry(types.UniTuple(REAL, SPACE_ROWS + 1)(INTEGER, VECTOR, REAL, REAL, REAL))
def path_in_space_once(address, p, lam, v2, v):  # type: ignore[no-untyped-def]
    """Return y, the contact force along x, y and z, and its length at one place of a space curve, given V**2 and V."""
    numbers = np.empty(2 + SPACE_ROWS)
    numbers[0], numbers[1] = lam, v2
    call_path_in_space(address, 1, numbers, numbers[1:], -1.0 if v < 0.0 else 1.0, p, numbers[2:])
    y, along_x, along_y, along_z = numbers[2], numbers[3], numbers[4], numbers[5]
    return y, along_x, along_y, along_z, sqrt(along_x * along_x + along_y * along_y + along_z * along_z)


def path_in_space(formulas: "Formulas", p: Array, lam: Array, v2: Array, direction: Array) -> Array:
    """Return rows y and contact force along x, y and z at places ``lam`` of a space curve.

    ``direction`` contains signs of ds/dt, or V itself; they matter only in a rotating frame.
    """
    assert formulas.path_in_space is not None
    address = formulas.path_in_space.address
    rows: Array = path_in_space_at(address, p, lam, v2, 1.0)
    if formulas.directed and (back := direction < 0.0).any():
        rows[:, back] = path_in_space_at(address, p, lam[back], v2[back], -1.0)
    return rows


def length(vector: Array) -> Array:
    """Return the lengths of vectors, whose components are the rows."""
    found: Array = np.sqrt((vector * vector).sum(axis=0))
    return found
