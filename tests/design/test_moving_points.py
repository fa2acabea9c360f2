"""Motions and limits along a spline have the derivatives of 40-digit differences with the heights of its points."""

import math
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from quadrature import integral

import gqm_sym as gqm
from gqm_sym.design.limits import LIMITS, PLACES
from gqm_sym.design.optimum import _Points
from gqm_sym.runtime.charts import interpolation

# The points, of which the third is moved by differences; the digits of their spline, and the step of a difference.
POINTS = [(-1.0, 0.75), (-0.5, 0.25), (0.0, 0.0), (0.5, 0.125), (1.0, 0.5), (1.5, 1.25)]
MOVED, DIGITS, STEP = 2, 32, mpf(10) ** -10
GRAVITY, MASS, MU, SPEED = mpf("9.81"), mpf(2), mpf("0.05"), mpf(5)
GIVEN = {"g": "9.81", "m": 2}


def solved(rows: list[list[Any]]) -> list[list[Any]]:
    """Return the solutions of linear equations by Gaussian elimination; each row ends with its two right sides.

    Almost all coefficients are zero, and are passed over.
    """
    count = len(rows)
    for k in range(count):
        pivot = max(range(k, count), key=lambda i: abs(rows[i][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(k + 1, count):
            if rows[i][k]:
                share = rows[i][k] / rows[k][k]
                rows[i] = [a - share * b if b else a for a, b in zip(rows[i], rows[k], strict=True)]
    found: list[list[Any]] = []
    for k in reversed(range(count)):
        known = [mp.fdot(rows[k][k + 1 : count], [row[axis] for row in found]) for axis in range(2)]
        found.insert(0, [(rows[k][count + axis] - known[axis]) / rows[k][k] for axis in range(2)])
    return found


class Spline:
    """The natural quintic spline whose knots are its own arc lengths at the points, by Simpson's rule with 9 places and
    one step of Richardson's extrapolation.
    """

    def __init__(self, points: list[tuple[Any, Any]], knots: list[Any]) -> None:
        self.points, self.knots = [[mpf(x) for x in point] for point in points], knots
        change = mpf(1)
        while change > mpf(10) ** (4 - DIGITS):
            self._solve()
            lengths = [self._measured(i, b - a) for i, (a, b) in enumerate(pairwise(self.knots))]
            found = [mp.fsum(lengths[:i]) for i in range(len(self.knots))]
            change = max(abs(a - b) for a, b in zip(found, self.knots, strict=True))
            self.knots = found
        lengths = [self.length(i, b - a) for i, (a, b) in enumerate(pairwise(self.knots))]
        self.lengths = [mp.fsum(lengths[:i]) for i in range(len(self.knots))]

    def _measured(self, i: int, width: Any) -> Any:
        """Return the length between two knots by Simpson's rule."""
        speeds = [mp.hypot(*self._on(i, k * width / 8, 1)) for k in range(9)]
        fine = mp.fdot(speeds, [1, 4, 2, 4, 2, 4, 2, 4, 1]) * width / 24
        coarse = mp.fdot(speeds[::2], [1, 4, 2, 4, 1]) * width / 12
        return fine + (fine - coarse) / 15

    def _solve(self) -> None:
        """Fill in the coefficients of x and z between two knots, in powers of the distance from the first."""
        widths = [b - a for a, b in pairwise(self.knots)]
        count, rows, sides = len(widths), [], []

        def row(i: int, order: int, at: Any) -> list[Any]:
            powers = [math.perm(k, order) * at ** (k - order) if k >= order else mpf(0) for k in range(6)]
            return [mpf(0)] * (6 * i) + powers + [mpf(0)] * (6 * (count - i - 1))

        for i, width in enumerate(widths):
            rows += [row(i, 0, mpf(0)), row(i, 0, width)]
            sides += [self.points[i], self.points[i + 1]]
            for order in range(1, 5) if i + 1 < count else ():
                rows.append([a - b for a, b in zip(row(i, order, width), row(i + 1, order, mpf(0)), strict=True)])
                sides.append([mpf(0), mpf(0)])
        for order in (3, 4):
            rows += [row(0, order, mpf(0)), row(count - 1, order, widths[-1])]
            sides += [[mpf(0), mpf(0)]] * 2
        x, z = zip(*solved([a + b for a, b in zip(rows, sides, strict=True)]), strict=True)
        self.terms = [[column[6 * i : 6 * i + 6] for column in (x, z)] for i in range(count)]

    def at(self, place: Any, order: int = 0) -> tuple[Any, Any]:
        """Return x and z, or derivatives of them, at a value of the parameter."""
        i = max(k for k in range(len(self.terms)) if k == 0 or self.knots[k] <= place)
        return self._on(i, place - self.knots[i], order)

    def _on(self, i: int, at: Any, order: int) -> tuple[Any, Any]:
        powers = [math.perm(k, order) * at ** (k - order) for k in range(order, 6)]
        x, z = (mp.fdot(terms[order:], powers) for terms in self.terms[i])
        return x, z

    def length(self, i: int, width: Any) -> Any:
        """Return the length from a knot on."""
        return integral(lambda t: mp.hypot(*self._on(i, t, 1)), [0, width], 5)

    def place(self, length: Any) -> Any:
        """Return the parameter at an arc length."""
        i = max(k for k in range(len(self.terms)) if k == 0 or self.lengths[k] <= length)
        place = length - self.lengths[i]
        for _ in range(8):
            place -= (self.lengths[i] + self.length(i, place) - length) / mp.hypot(*self._on(i, place, 1))
        return self.knots[i] + place

    def bent(self, place: Any) -> tuple[Any, Any, Any]:
        """Return the rate of arc length, the angle of the tangent, and the curvature."""
        (dx, dz), (bend_x, bend_z) = self.at(place, 1), self.at(place, 2)
        speed = mp.hypot(dx, dz)
        return speed, mp.atan2(dz, dx), (dx * bend_z - dz * bend_x) / speed**3

    def integral(self, function: Callable[[Any], Any], begin: Any, end: Any) -> Any:
        """Return an integral over the parameter."""
        edges = [begin, *(knot for knot in self.knots if begin < knot < end), end]
        return integral(function, edges, 5)


@cache
def splines() -> list[Spline]:
    """Return the spline for heights one step below and above."""
    with mp.workdps(DIGITS + 8):
        knots = [mpf(0)]
        for (x, z), (to_x, to_z) in pairwise(POINTS):
            knots.append(knots[-1] + mp.hypot(mpf(to_x) - x, mpf(to_z) - z))
        knots, found = Spline(POINTS, knots).knots, []
        for side in (-1, 1):
            points: list[tuple[Any, Any]] = [*POINTS]
            points[MOVED] = POINTS[MOVED][0], POINTS[MOVED][1] + side * STEP
            found.append(Spline(points, knots))
        return found


def slope_of(function: Callable[[Spline], Any]) -> Any:
    """Return the derivative of a quantity of a spline by the height of the point that moves."""
    with mp.workdps(DIGITS + 8):
        low, high = (function(spline) for spline in splines())
        return (high - low) / (2 * STEP)


@pytest.fixture
def exact_lengths(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the knots of splines converge to rounding."""
    monkeypatch.setattr(interpolation, "MAX_LAST_CHANGE", 1e-15)
    monkeypatch.setattr(interpolation, "MAX_ITERATIONS", 100)


def half_period(spline: Spline) -> Any:
    """Return the half period from rest at the arc length 1/2."""
    begin = spline.place(mpf(1) / 2)
    height = spline.at(begin)[1]
    end = mp.findroot(lambda t: spline.at(t)[1] - height, spline.place(mpf("1.8")))
    edges = [2 * mp.asin(mp.sqrt((k - begin) / (end - begin))) for k in spline.knots if begin < k < end]

    def rate(phase: Any) -> Any:
        place = begin + (end - begin) * mp.sin(phase / 2) ** 2
        v = mp.sqrt(2 * GRAVITY * (height - spline.at(place)[1]))
        return mp.hypot(*spline.at(place, 1)) * (end - begin) / 2 * mp.sin(phase) / v

    return integral(rate, [0, *edges, mp.pi], 5)


def time(spline: Spline, begin: Any = 0, end: Any = None) -> Any:
    """Return the time from an arc length to a later one, or to the last point, of a body thrown from the former."""
    begin, end = spline.place(mpf(begin)), spline.knots[-1] if end is None else spline.place(end)
    height = spline.at(begin)[1]

    def rate(t: Any) -> Any:
        return mp.hypot(*spline.at(t, 1)) / mp.sqrt(SPEED**2 + 2 * GRAVITY * (height - spline.at(t)[1]))

    return spline.integral(rate, begin, end)


def load(spline: Spline, place: Any, w: Any) -> Any:
    """Return the contact force."""
    _, angle, curvature = spline.bent(place)
    return MASS * (curvature * w + GRAVITY * mp.cos(angle))


def largest_load(spline: Spline) -> Any:
    """Return the largest contact force after a launch from the first point."""

    def force(place: Any) -> Any:
        return load(spline, place, SPEED**2 + 2 * GRAVITY * (spline.at(mpf(0))[1] - spline.at(place)[1]))

    return force(mp.findroot(lambda t: mp.diff(force, t), mpf("1.3"), tol=mpf(10) ** -16))


def with_friction(spline: Spline, length: Any) -> tuple[Any, Any]:
    """Return V**2 and the contact force at an arc length, for a track that always pushes upwards."""
    place, (_, start, _) = spline.place(length), spline.bent(mpf(0))

    def loss(t: Any) -> Any:
        speed, angle, _ = spline.bent(t)
        return 2 * GRAVITY * (mp.sin(angle) + MU * mp.cos(angle)) * mp.exp(2 * MU * angle) * speed

    _, angle, _ = spline.bent(place)
    lost = spline.integral(loss, mpf(0), place) if place > 0 else mpf(0)
    w = SPEED**2 * mp.exp(2 * MU * (start - angle)) - mp.exp(-2 * MU * angle) * lost
    return w, load(spline, place, w)


def tracks(force: gqm.Kernel, given: dict[str, Any], folder: Path) -> _Points:
    """Return the track with the point that moves."""
    return _Points(POINTS, force, [MOVED], GIVEN | given, str(folder))


FRICTION = gqm.Gravity() + gqm.CoulombFriction(mu="1/20")


@pytest.mark.usefixtures("exact_lengths")
def test_half_periods(tmp_path: Path) -> None:
    """The derivative of a half period is that of the integral."""
    found = tracks(gqm.Gravity(), {"lam0": "1/2"}, tmp_path)
    slopes = found.gradient("half_period", found.start)
    assert slopes is not None
    assert abs(slopes[0] - slope_of(half_period)) <= 1e-12 * abs(slopes[0])


@pytest.mark.usefixtures("exact_lengths")
def test_times(tmp_path: Path) -> None:
    """The derivative of the time from the first point to the last is that of the integral."""
    found = tracks(gqm.Gravity(), {"v0": 5}, tmp_path)
    slopes = found.gradient("time_at", found.start)
    assert slopes is not None
    assert abs(slopes[0] - slope_of(time)) <= 1e-11 * abs(slopes[0])


@pytest.mark.usefixtures("exact_lengths")
@pytest.mark.parametrize(
    ("given", "ends"),
    [
        ({"lam": "5/4"}, (mpf(0), mpf("1.25"))),
        ({"lam0": "1/2", "lam": "5/4"}, (mpf("0.5"), mpf("1.25"))),
        ({"lam0": "1/2"}, (mpf("0.5"), None)),
    ],
)
def test_times_between_places(given: dict[str, Any], ends: tuple[Any, Any], tmp_path: Path) -> None:
    """The derivative of the time from any launch to any place is that of the integral between fixed arc lengths."""
    found = tracks(gqm.Gravity(), {"v0": 5} | given, tmp_path)
    slopes = found.gradient("time_at", found.start)
    assert slopes is not None
    assert abs(slopes[0] - slope_of(lambda spline: time(spline, *ends))) <= 1e-11 * abs(slopes[0])


@pytest.mark.usefixtures("exact_lengths")
def test_extremes(tmp_path: Path) -> None:
    """The derivative of the largest contact force is right for a body that runs along the whole track."""
    found = tracks(gqm.Gravity(), {"v0": 5}, tmp_path)
    slopes = found.gradient("normal_force_max", found.start)
    assert slopes is not None
    assert abs(slopes[0] - slope_of(largest_load)) <= 1e-9 * abs(slopes[0])


@pytest.mark.usefixtures("exact_lengths")
@pytest.mark.parametrize("between", [None, (0.5, 2.0)])
def test_limits_with_friction(between: Any, tmp_path: Path) -> None:
    """The derivative of the contact force with friction is right at places along the track."""
    track = tracks(FRICTION, {"v0": 5}, tmp_path)
    found = track.limited(track.start, between)
    assert found is not None
    assert set(found.slopes) == set(LIMITS)
    for k in range(0, PLACES, 50):
        share = mpf(k) / (PLACES - 1)

        def force(spline: Spline, share: Any = share) -> Any:
            low, high = (mpf(0), spline.lengths[-1]) if between is None else (mpf(between[0]), mpf(between[1]))
            return with_friction(spline, low + share * (high - low))[1]

        scale = np.abs(found.slopes["normal_force"]).max()
        assert abs(found.slopes["normal_force"][k, 0] - slope_of(force)) <= 1e-9 * scale, k


def test_many_points(tmp_path: Path) -> None:
    """Of many points on a line a spline needs few, but each height counts: along a plane with friction the time is
    sqrt(2 length/(g (sin - mu cos))), and the contact force m g cos.

    Together, the heights change as the slope of the plane does.
    """
    places = np.linspace(0.0, 2.0, 65)
    track = _Points(np.column_stack([places, -0.5 * places]), FRICTION, range(65), GIVEN, str(tmp_path))
    slopes, found = track.gradient("time_at", track.start), track.limited(track.start, None)
    assert slopes is not None
    assert found is not None

    def time_and_force(k: Any) -> list[Any]:
        stretch = mp.sqrt(1 + k * k)
        time = mp.sqrt(4 * stretch**2 / (GRAVITY * (k - MU)))
        return [time, MASS * GRAVITY / stretch]

    with mp.workdps(40):
        by_time, by_force = (mp.diff(lambda k, i=i: time_and_force(k)[i], mpf("0.5")) for i in range(2))
        time, force = time_and_force(mpf("0.5"))
    assert track.answer("time_at", track.start) == pytest.approx(float(time), rel=1e-12)
    assert slopes @ -places == pytest.approx(float(by_time), rel=1e-9)
    assert abs(slopes.sum()) <= 1e-9 * np.abs(slopes).max()
    assert found.values["normal_force"] == pytest.approx(np.full(PLACES, float(force)), rel=1e-12)
    assert found.slopes["normal_force"] @ -places == pytest.approx(np.full(PLACES, float(by_force)), rel=1e-7)
