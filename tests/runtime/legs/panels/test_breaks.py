"""Motions with losses on curves with joints agree with closed forms on stitched planes, and are followed on rails."""

import math
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import gqm_sym as gqm

G = 9.81
TRACKS: dict[str, list[Any]] = {
    "vee": [(0, 1), (1, 0), (2, 1)],
    "askew": [(0, 2), (1, 0), (4, 1)],
    "zigzag": [(0, 3), (1, 0), (2, 1), (3, 0.5), (5, -0.25), (6, 4)],
    "level": [(0, 2), (2, 0), (3, 0), (4, 3)],
}
LAUNCHES = 16
# The tolerances of times, relative to the whole, and of places.
TIMES, PLACES = 1e-13, 2e-13
CORNER = math.sqrt(2.0)
Long = np.longdouble


@pytest.fixture(scope="module", params=TRACKS)
def track(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[ModuleType, Any]:
    """Return a module for planes with friction and drag, and their points."""
    points = TRACKS[request.param]
    force = gqm.Gravity() + gqm.CoulombFriction() + gqm.QuadraticDrag()
    model = gqm.derive(gqm.Curve.sampled(points, kind="linear"), force)
    return gqm.build(model, name=request.param, folder=tmp_path_factory.mktemp("planes")), points


def slide(points: Any, lam0: float, v0: float, way: int, mu: float) -> tuple[Any, str]:
    """Return rows of time, place, speed, acceleration and direction of a motion with friction alone, and what ends it.

    On each plane the acceleration is constant, and at corners the speed is kept. Offsets from both ends of the plane
    are kept, because a body may come to rest on a corner.
    """
    steps = [(Long(b[0] - a[0]), Long(b[1] - a[1])) for a, b in pairwise(points)]
    lengths = [np.sqrt(x * x + z * z) for x, z in steps]
    edges = np.append(Long(0), np.cumsum(lengths))
    climbs = [(z / length, x / length) for (x, z), length in zip(steps, lengths, strict=True)]
    k = int(np.searchsorted(edges, lam0, side="right")) - 1
    behind, ahead, v, t = lam0 - edges[k], edges[k + 1] - lam0, Long(v0), Long(0)
    stays = [abs(sine) <= mu * cosine for sine, cosine in climbs]
    rows: list[tuple[Any, ...]] = []
    place = Long(lam0)
    if v0 == 0.0:
        way = -1 if climbs[k][0] > 0 else 1
    end = "rest" if v0 == 0.0 and stays[k] else ""
    while not end:
        sine, cosine = climbs[k]
        rate, room = -G * (sine * way + mu * cosine), ahead if way > 0 else behind
        place = edges[k] + behind if behind < ahead else edges[k + 1] - ahead
        rows.append((t, place, v, rate, way))
        left = v * v + 2 * rate * room
        if left > 0:
            before, v, k = v, np.sqrt(left), k + way
            t += 2 * room / (before + v)
            if not 0 <= k < len(lengths):
                end, place = "domain-end", edges[k + (way < 0)]
            else:
                behind, ahead = (Long(0), lengths[k]) if way > 0 else (lengths[k], Long(0))
        else:
            run, spent = v * v / (-2 * rate) * way, v / -rate
            behind, ahead, t, v = behind + run, ahead - run, t + spent, Long(0)
            place = edges[k] + behind if behind < ahead else edges[k + 1] - ahead
            end = "rest" if stays[k] or spent < 1e-20 else ""
            way = -way
    return np.array([*rows, (t, place, Long(0), Long(0), way)]), end


@pytest.mark.extended
def test_friction_on_planes(track: tuple[ModuleType, Any]) -> None:
    """Random launches come to rest, on planes and on corners, at the times and places of closed forms."""
    module, points = track
    rng = np.random.default_rng(7)
    high = sum(math.dist(a, b) for a, b in pairwise(points))
    for _ in range(LAUNCHES):
        lam0, mu = float(rng.uniform(0.0, high)), float(rng.choice([0.05, 0.1, 0.2, 0.4, 0.7]))
        v0, way = float(rng.choice([0.0, rng.uniform(0.0, 3.0)])), int(rng.choice([-1, 1]))
        motion = module.solve(lam0, v0, way, mu=mu, b=0)
        rows, end = slide(points, lam0, v0, way, mu)
        if motion.kind == "rest":
            assert len(rows) == 1
            continue
        assert motion.legs[-1].end == end
        assert abs(motion.t_end - rows[-1, 0]) <= TIMES * rows[-1, 0]
        t = np.linspace(0.0, motion.t_end, 100)
        _, place, v, rate, ways = (row := rows[np.searchsorted(rows[:, 0], t, side="right") - 1]).T
        spent = t - row[:, 0]
        assert np.abs(motion.state(t).lam - (place + ways * spent * (v + rate * spent / 2))).max() <= PLACES * high


@pytest.mark.sample(4)
@pytest.mark.parametrize("mu", [0.05, 0.2])
def test_sweeps_on_planes(mu: float, track: tuple[ModuleType, Any]) -> None:
    """Sweeps find turns by data kept of the planes, also where the turn is close to a corner (bodies passed through
    whole planes, or turned for ever).
    """
    module, points = track
    high = sum(math.dist(a, b) for a, b in pairwise(points))
    # The number of legs of a launch is inverse to mu; each value of mu has as many legs.
    lam0 = np.random.default_rng(3).uniform(0.0, high, round(20 * mu * LAUNCHES))
    times = module.sweep("t_end", lam0, 0.0, mu=mu, b=0).values
    places = dict(zip(lam0[::5], module.sweep("rest_position", lam0[::5], 0.0, mu=mu, b=0).values, strict=True))
    for start, time in zip(lam0.tolist(), times, strict=True):
        rows, end = slide(points, start, 0.0, 1, mu)
        if len(rows) > 1:
            assert abs(time - rows[-1, 0]) <= TIMES * rows[-1, 0]
        if end == "rest" and start in places:
            assert abs(places[start] - rows[-1, 1]) <= PLACES * high


@pytest.mark.extended
@pytest.mark.parametrize("mu", [0.0, 0.1])
def test_drag_on_planes(mu: float, track: tuple[ModuleType, Any]) -> None:
    """Random launches with drag are followed and only lose energy; with friction as well they are followed to their
    end.
    """
    module, points = track
    rng = np.random.default_rng(11)
    high = sum(math.dist(a, b) for a, b in pairwise(points))
    for _ in range(LAUNCHES // 2):
        lam0, b = float(rng.uniform(0.0, high)), float(rng.choice([0.01, 0.1, 1.0]))
        v0, way = float(rng.choice([0.0, rng.uniform(0.0, 3.0)])), int(rng.choice([-1, 1]))
        motion = module.solve(lam0, v0, way, mu=mu, b=b, t_max=None if mu else 20)
        if motion.kind == "rest":
            continue
        state = motion.state(np.linspace(0.0, motion.t_end, 100))
        energy = state.v2 / 2.0 + G * state.z
        assert np.diff(energy).max() <= 1e-12 * np.abs(energy).max()
        if mu:
            assert motion.legs[-1].end in ("rest", "domain-end")


def test_rest_on_a_corner(tmp_path: Path) -> None:
    """Between planes that rise on both sides a body stays, whatever the friction; it leaves a ridge in the requested
    direction.
    """
    curve = gqm.Curve.sampled([(0, 1), (1, 0), (2, 1), (3, 0)], kind="linear")
    rough = gqm.build(gqm.derive(curve, gqm.Gravity() + gqm.CoulombFriction()), name="rough", folder=tmp_path)
    smooth = gqm.build(gqm.derive(curve, gqm.Gravity()), name="smooth", folder=tmp_path)
    for way in (-1, 1):
        for mu in (0.0, 0.1, 2.0):
            assert rough.solve(CORNER, direction=way, mu=mu).kind == "rest"
        assert smooth.solve(CORNER, direction=way).kind == "rest"
        assert rough.solve(2.0 * CORNER, direction=way, mu=2).kind == "rest"
        motion = rough.solve(2.0 * CORNER, direction=way, mu="1/10", t_max="1/10")
        down = G * math.sqrt(0.5) * 0.9
        assert abs(motion.state(0.1).lam - (2.0 * CORNER + way * down * 0.005)) <= 1e-15


@pytest.mark.sample(1)
@pytest.mark.parametrize("force", ["friction", "droplet"])
def test_rails_whose_curvature_jumps(force: str, tmp_path: Path) -> None:
    """Motions on arcs and lines are followed through many turns, and lose energy on all of them."""
    pieces = [gqm.arc(radius=2, angle="pi/3"), gqm.line(length="1/2"), gqm.arc(radius=1, angle="pi/3")]
    curve = gqm.Curve.piecewise(pieces, start=(0, 0), heading="-pi/3")
    given = {"gamma": 0.005, "ell_c": 0.0027} if force == "droplet" else {"mu": 0.1}
    loss = gqm.SurfaceTension() if force == "droplet" else gqm.CoulombFriction()
    module = gqm.build(gqm.derive(curve, gqm.Gravity() + loss), name=force, folder=tmp_path)
    rng = np.random.default_rng(5)
    high = 2.0 * math.pi / 3.0 + 0.5 + math.pi / 3.0
    for _ in range(60):
        v0 = float(rng.choice([0.0, rng.uniform(0.0, 3.0)]))
        motion = module.solve(float(rng.uniform(0.0, high)), v0, int(rng.choice([-1, 1])), t_max=20, **given)
        if motion.kind == "rest":
            continue
        state = motion.state(np.linspace(0.0, motion.t_end, 100))
        energy = state.v2 / 2.0 + G * state.z
        assert np.diff(energy).max() <= 1e-12 * np.abs(energy).max()
