"""The least and the greatest speed or contact force on one of many orbits: the best of many places, refined."""

from math import pi, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.elementary import sin
from gqm_sym.runtime.compiled.calls import call_path_and_contact_force, call_potential_divdiff1
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.interface import FRAME_ROWS

# Intervals looked at, in steps of the anomaly; by how much those of each round that refines the best are narrower.
LOOKED_AT, ROUNDS, NARROWER = 64, 2, 16.0
STEPS = np.arange(LOOKED_AT + 1) / LOOKED_AT
PARTS = np.sin(0.5 * pi * STEPS) ** 2
MOST = LOOKED_AT + 1
line_room, pair_room, frame_room, trio_room = (on_stack(n) for n in (MOST, 2 * MOST, FRAME_ROWS * MOST, 3))


@Inner
def loads(fns, p, lam0, w0, least, width, force, parts, n, out):  # type: ignore[no-untyped-def]
    """V, or the contact force, at parts of an orbit's or a lap's width from where it begins.

    By what V**2 loses from the launch: next to a turning point that has the digits of the greatest V**2, not its own.
    """
    offsets, lam, rows, frame = line_room(), line_room(), pair_room(), frame_room()
    for i in range(n):
        offsets[i] = least + width * parts[i]
        lam[i] = lam0 + offsets[i]
    call_potential_divdiff1(fns.potential_divdiff1, n, lam0, lam, offsets, p, rows)
    for i in range(n):
        out[i] = max(w0 - offsets[i] * rows[i], 0.0)
    if force:
        call_path_and_contact_force(fns.path_and_contact_force, n, lam, out, p, frame)
        for i in range(n):
            out[i] = frame[4 * n + i]
    else:
        for i in range(n):
            out[i] = sqrt(out[i])


@Inner
def extreme(fns, p, going_round, even, lam0, w0, least, most, force, sign):  # type: ignore[no-untyped-def]
    """The largest (sign 1) or least (sign -1) V or contact force on an orbit.

    Parabolas through three places, closer and closer: a load is flat at an extreme, so its value has every digit as
    soon as the place has half of them. In a well that is ``even`` and monotone on either side, V is largest in the
    middle.
    """
    if not (going_round or force or sign > 0.0):
        return 0.0  # at a turning point
    width, out, trio, found = most - least, line_room(), trio_room(), trio_room()
    if even and not (going_round or force):
        trio[0] = 0.5
        loads(fns, p, lam0, w0, least, width, force, trio, 1, found)
        return found[0]
    loads(fns, p, lam0, w0, least, width, force, STEPS if going_round else PARTS, MOST, out)
    best = 0
    for i in range(MOST):
        if sign * out[i] > sign * out[best]:
            best = i
    around = LOOKED_AT if going_round else 2 * LOOKED_AT  # between turning points there and back again
    before, after = (best - 1) % around, (best + 1) % around
    f0, f1, f2 = out[min(before, around - before)], out[best], out[min(after, around - after)]
    if going_round:
        f0, f2 = out[before], out[after]
    at, step, top = best / LOOKED_AT, 1.0 / LOOKED_AT, out[best]
    for k in range(ROUNDS + 1):
        bend = sign * (f0 - 2.0 * f1 + f2)
        move = 0.5 * sign * (f0 - f2) / bend if bend < 0.0 else 0.0
        at += step * min(max(move, -1.0), 1.0)
        step /= NARROWER
        trio[0], trio[1], trio[2] = at, at - step, at + step
        if not going_round:
            for i in range(3):
                trio[i] = sin(0.5 * pi * trio[i]) ** 2
        loads(fns, p, lam0, w0, least, width, force, trio, 3 if k < ROUNDS else 1, found)
        f1, f0, f2 = found[0], found[1], found[2]
        top = max(top, f1) if sign > 0.0 else min(top, f1)
    return top
