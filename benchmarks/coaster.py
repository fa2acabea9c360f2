"""A 1.5 km coaster of 60 pieces with roll, heartline and a train of 20 cars: the profile of what riders feel.

Beside it stands what is done without such a tool: finite differences of the coordinates and of the heights with NumPy,
on the same places. The truth is the track's frame integrated by DOP853, with the mean height of the train.
"""

import importlib
import sys
import tempfile
from math import cos, sin
from time import process_time
from typing import Any

import numpy as np
from measure import Row
from scipy.integrate import solve_ivp

import gqm_sym as gqm

GRAVITY, STANDARD = 9.81, 9.80665
PIECES, LENGTH, TRAIN, CARS = 60, 25.0, 14.0, 20
START, LAUNCH, SPEED = 40.0, 20.0, 9.0
PLACES = 100_000
COMPARED = 400


def rates() -> list[tuple[float, float, float]]:
    """Return how far each piece turns to the left and upwards, and rolls: hills and level bends by turns."""
    found = []
    for group in range(PIECES // 4):
        if group % 2:
            angle, turn = 0.5 * (-1.0) ** (group // 2), 0.7 * (-1.0) ** (group // 2)
            # In the frame of a rider who leans, a level bend goes to the left and upwards.
            bend = (turn * cos(angle), turn * sin(angle), 0.0)
            found += [(0.0, 0.0, angle), bend, bend, (0.0, 0.0, -angle)]
        else:
            steep = 0.45 + 0.08 * sin(group)
            found += [(0.0, side * steep, 0.0) for side in (-1.0, 1.0, 1.0, -1.0)]
    return found


def bump(angle: float) -> str:
    """Return a rate that is zero at both ends of a piece, with its slope, and turns by an angle."""
    return f"{angle!r}*30*(s/{LENGTH!r})**2*(1 - s/{LENGTH!r})**2/{LENGTH!r}"


def track() -> gqm.Curve:
    """Return the track of 60 transitions, banked by their roll."""
    pieces = [gqm.transition(length=LENGTH, yaw=bump(y), pitch=bump(p), roll=bump(r)) for y, p, r in rates()]
    return gqm.Curve.piecewise(pieces, start=(0, 0, START), roll="pieces", heartline="1.1")


def truth(places: Any) -> Any:
    """Return rows of the vertical and lateral load on riders at the middle of the train."""
    told = np.array(rates())

    def slopes(s: float, state: Any) -> Any:
        piece = min(int(s / LENGTH), PIECES - 1)
        share = s / LENGTH - piece
        yaw, pitch, roll = told[piece] * 30.0 * share**2 * (1.0 - share) ** 2 / LENGTH
        ahead, left, up = state[3:12].reshape(3, 3)
        turned = (yaw * left + pitch * up, -yaw * ahead - roll * up, roll * left - pitch * ahead)
        return np.concatenate([ahead, *turned, [state[2]]])

    frame = np.eye(3).ravel()
    state = np.concatenate([[0.0, 0.0, START], frame, [0.0]])
    wanted = np.unique(
        np.concatenate([places + side * TRAIN / 2 for side in (-1, 0, 1)] + [[LAUNCH - TRAIN / 2, LAUNCH + TRAIN / 2]])
    )
    found = np.empty((state.size, wanted.size))
    for piece in range(PIECES):
        low, high = piece * LENGTH, (piece + 1) * LENGTH
        here = (wanted >= low) & ((wanted < high) | (piece == PIECES - 1))
        at = np.append(wanted[here], high)
        solved = solve_ivp(slopes, (low, high), state, "DOP853", at, rtol=1e-13, atol=1e-13)
        found[:, here], state = solved.y[:, : at.size - 1], solved.y[:, -1]
    at = {float(s): column for s, column in zip(wanted, found.T, strict=True)}

    def mean(s: float) -> float:
        return float(at[s + TRAIN / 2][12] - at[s - TRAIN / 2][12]) / TRAIN

    rows = []
    for s in places.tolist():
        column, piece = at[s], min(int(s / LENGTH), PIECES - 1)
        share = s / LENGTH - piece
        yaw, pitch, _ = told[piece] * 30.0 * share**2 * (1.0 - share) ** 2 / LENGTH
        w = SPEED**2 - 2.0 * GRAVITY * (mean(s) - mean(LAUNCH))
        rows.append([(w * pitch + GRAVITY * column[11]) / STANDARD, (w * yaw + GRAVITY * column[8]) / STANDARD])
    return np.array(rows).T


class Pipeline:
    """Loads from coordinates at places that are evenly spaced, as one writes it with NumPy."""

    def __init__(self, path: Any, places: Any) -> None:
        self.points = np.stack([path.x, path.y, path.z], axis=1)
        self.roll, self.step = path.roll, float(places[1] - places[0])
        self.launch = int(np.argmin(np.abs(places - LAUNCH)))

    def __call__(self) -> Any:
        """Return the vertical and the lateral load."""
        first = np.gradient(self.points, self.step, axis=0)
        tangent = first / np.linalg.norm(first, axis=1)[:, None]
        bend = np.gradient(tangent, self.step, axis=0)
        height = self.points[:, 2]
        half = round(TRAIN / 2 / self.step)
        total = np.concatenate([[0.0], np.cumsum(height)])
        low, high = np.arange(height.size) - half, np.arange(height.size) + half + 1
        low, high = np.clip(low, 0, height.size), np.clip(high, 0, height.size)
        mean = (total[high] - total[low]) / (high - low)
        w = SPEED**2 - 2.0 * GRAVITY * (mean - mean[self.launch])
        force = w[:, None] * bend + GRAVITY * (np.array([0.0, 0.0, 1.0]) - tangent * tangent[:, 2:])
        level = np.stack([-tangent[:, 1], tangent[:, 0], 0.0 * w], axis=1)
        left = level / np.linalg.norm(level, axis=1)[:, None]
        above = np.cross(tangent, left)
        cosine, sine = np.cos(self.roll)[:, None], np.sin(self.roll)[:, None]
        up, side = above * cosine + left * sine, left * cosine - above * sine
        return np.stack([(force * up).sum(axis=1), (force * side).sum(axis=1)]) / STANDARD


def coaster() -> list[Row]:
    """Measure the profile by this package and by finite differences, at the same places."""
    folder = tempfile.mkdtemp()
    sys.path.insert(0, folder)
    gqm.build(
        gqm.derive(track(), gqm.Gravity() + gqm.Train(length=TRAIN, cars=CARS)), name="coaster_of_60", folder=folder
    )
    module = importlib.import_module("coaster_of_60")
    whole = PIECES * LENGTH
    places = np.linspace(TRAIN / 2, whole - TRAIN / 2, PLACES)
    out = module.pass1(places, lam0=LAUNCH, v0=SPEED)
    chosen = np.linspace(1000, PLACES - 1001, COMPARED).astype(int)
    true = truth(places[chosen])

    def ours(found: Any) -> float:
        return float(np.abs(np.stack([found.n_vertical, found.n_lateral])[:, chosen] - true).max())

    def theirs(found: Any) -> float:
        return float(np.abs(found[:, chosen] - true).max())

    work = f"profile of a coaster, {PLACES} places"
    pipeline = Pipeline(out, places)
    return [
        Row(work, "gqm_sym", lambda: module.pass1(places, lam0=LAUNCH, v0=SPEED, out=out), ours, line=1e-11, unit="g"),
        Row(work, "NumPy, finite differences", pipeline, theirs, unit="g"),
    ]


if __name__ == "__main__":
    for row in coaster():
        found = row.call()
        times = []
        for _ in range(row.repeats):
            start = process_time()
            row.call()
            times.append(process_time() - start)
        print(f"{row.who:28} {1e3 * min(times):8.2f} ms of processor time, error {row.error(found):.1e} g")
