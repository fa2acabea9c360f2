"""At corners of stitched planes contact is lost where the track bends away, and ridges are left in the direction of
launch.
"""

import math
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from types import ModuleType

import pytest

import gqm_sym as gqm
from gqm_sym.errors import SolutionError

G = 9.81
# The track has two valleys with a ridge between them, lower than the sides.
POINTS = [(0, 2), (1, 0), (2, 1), (3, 0), (4, 2)]
LENGTHS = [math.dist(a, b) for a, b in pairwise(POINTS)]
EDGES = [sum(LENGTHS[:k]) for k in range(5)]
RIDGE, END = EDGES[2], EDGES[4]
FRICTION = 0.01

Build = Callable[[str, bool], ModuleType]


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Return the track with a force, from its first point or from its last."""
    forces = {"free": gqm.Gravity(), "rough": gqm.Gravity() + gqm.CoulombFriction(mu="1/100")}

    @cache
    def make(force: str, is_reversed: bool) -> ModuleType:
        track = gqm.Curve.sampled(POINTS[::-1] if is_reversed else POINTS, kind="linear")
        name = f"{force}_{'backwards' if is_reversed else 'forwards'}"
        return gqm.build(gqm.derive(track, forces[force]), name=name, folder=tmp_path_factory.mktemp("planes"))

    return make


def slid(force: str, lam: float, v: float, stops: list[float]) -> float:
    """Return the time in s that a body moving right from ``lam`` with the speed ``v`` takes along planes, stop after
    stop.
    """
    mu, spent = FRICTION if force == "rough" else 0.0, 0.0
    for stop in stops:
        k = max(k for k in range(4) if EDGES[k] <= min(lam, stop) + 1e-9)
        (x0, z0), (x1, z1) = POINTS[k : k + 2]
        sign = 1.0 if stop > lam else -1.0
        pull = -G * (sign * (z1 - z0) + mu * (x1 - x0)) / LENGTHS[k]
        distance = abs(stop - lam)
        after = math.sqrt(v * v + 2.0 * pull * distance)
        spent += 2.0 * distance / (v + after)
        lam, v = stop, after
    return spent


@pytest.mark.sample(3)
@pytest.mark.parametrize("force", ["free", "rough"])
@pytest.mark.parametrize("is_reversed", [False, True])
@pytest.mark.parametrize(
    ("lam0", "v0", "stops"),
    [(0.25, 0.0, [EDGES[1], RIDGE]), (0.5, 2.0, [EDGES[1], RIDGE]), (2.5, 5.0, [RIDGE])],
)
def test_a_body_leaves_the_track_at_a_ridge(
    force: str, is_reversed: bool, lam0: float, v0: float, stops: list[float], build: Build
) -> None:
    """A body passes the valley, where the track bends towards it, and flies off where the track bends away."""
    module = build(force, is_reversed)
    contact, direction = ("below", -1) if is_reversed else ("above", 1)
    launch = {"lam0": END - lam0 if is_reversed else lam0, "v0": v0, "direction": direction, "contact": contact}
    motion = module.solve(**launch)
    assert [event.kind for event in motion.events] == ["corner"] * (len(stops) - 1) + ["liftoff"]
    assert motion.events[-1].lam == pytest.approx(END - RIDGE if is_reversed else RIDGE, rel=4e-16)
    assert motion.t_end == pytest.approx(slid(force, lam0, v0, stops), rel=2e-15)
    assert motion.legs[-1].end == "liftoff"
    assert module.sweep("t_end", **launch).values == pytest.approx(motion.t_end, rel=1e-15)
    for quantity in ("v_max", "v_min", "normal_force_max"):
        swept = module.sweep(quantity, **launch).values
        assert swept == pytest.approx(getattr(motion, quantity).value, rel=1e-14), quantity
    # A track that holds the body from both sides keeps it.
    assert module.solve(**launch | {"contact": "bilateral"}).t_end > motion.t_end


@pytest.mark.parametrize("force", ["free", "rough"])
def test_a_body_launched_on_a_ridge_leaves_it_when_it_comes_back(force: str, build: Build) -> None:
    """The launch is along the plane ahead, without flight; bodies launched at the valleys' bottoms do not fly off."""
    module = build(force, False)
    motion = module.solve(RIDGE, 1.0, -1, contact="above")
    assert [event.kind for event in motion.events] == ["corner", "turn", "corner", "liftoff"]
    assert motion.events[-1].lam == pytest.approx(RIDGE, rel=1e-15)
    assert module.sweep("t_end", lam0=RIDGE, v0=1.0, direction=-1, contact="above").values == motion.t_end
    below = module.solve(EDGES[1], 1.0, 1, contact="above", t_max=1.0)
    assert "liftoff" not in {event.kind for event in below.events}


@pytest.mark.parametrize("force", ["free", "rough"])
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("at", [{"lam0": RIDGE}, {"point": (2, 1)}])
def test_from_rest_on_a_ridge_a_body_slides_in_the_direction_of_launch(
    force: str, direction: int, at: dict[str, object], build: Build
) -> None:
    """A body slides down either side, for many periods; contact is not lost on the ridge, which it leaves slowly."""
    module = build(force, False)
    motion = module.solve(**at, v0=0, direction=direction, contact="above", t_max=60)
    place = RIDGE + 0.5 * direction
    expected = slid(force, RIDGE, 0.0, [place]) if direction > 0 else slid(force, END - RIDGE, 0.0, [END - place])
    assert motion.time_at(place) == pytest.approx(expected, rel=1e-14)
    launch = {"lam0": RIDGE, "v0": 0.0, "direction": direction, "t_max": 60.0}
    assert module.sweep("time_at", lam=place, **launch).values == pytest.approx(expected, rel=1e-14)
    assert motion.t_end == 60.0
    assert math.copysign(1.0, float(motion.lam(59.0)) - RIDGE) == direction


@pytest.mark.parametrize("lam0", [0.25, 1.0])
def test_a_turning_body_has_no_speed(lam0: float, build: Build) -> None:
    """v_min of a libration is 0, solved and swept, and never -0."""
    for force, horizon in (("free", None), ("rough", 5.0)):
        module = build(force, False)
        for v0, direction in ((0.5, 1), (0.5, -1), (0.0, 1)):
            least = module.solve(lam0, v0, direction, t_max=horizon).v_min.value
            swept = float(module.sweep("v_min", lam0=lam0, v0=v0, direction=direction, t_max=horizon).values)
            assert (least, math.copysign(1.0, least)) == (0.0, 1.0)
            assert (swept, math.copysign(1.0, swept)) == (0.0, 1.0)


@pytest.mark.parametrize("launch", ["sqrt(5)/2", math.sqrt(5.0) / 2.0])
def test_a_body_that_comes_to_rest_on_a_ridge_is_refused(launch: str | float, build: Build) -> None:
    """The body could slide off either way (all but its kind raised "not analytic"); a little higher or lower it moves
    on.
    """
    module = build("free", False)
    with pytest.raises(SolutionError, match="comes to rest on the corner"):
        module.solve(launch)
    with pytest.raises(SolutionError, match="comes to rest on the corner"):
        module.solve(EDGES[1], "sqrt(2*9.81)", 1)
    assert math.isnan(module.sweep("period", lam0=LENGTHS[0] / 2.0).values)
    over, before = (module.solve(LENGTHS[0] / 2.0 + shift) for shift in (-1e-9, 1e-9))
    assert over.period > 1.5 * before.period
    assert over.turning_points[1] > RIDGE > before.turning_points[1]
