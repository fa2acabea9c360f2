"""Sweeps of bodies that leave a track which can only push agree with closed forms, up to the place where they leave."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from railed import built

import gqm_sym as gqm
from gqm_sym.building import transient

G = 9.81

# The relative tolerance of elementary closed forms.
FEW = 4e-15

# The contact force in N where it vanishes, for a rounding of that place.
AT_LOSS = 4e-14

EXTREMES = ("v_max", "v_min", "normal_force_max", "normal_force_min")


@pytest.fixture(scope="module")
def hump(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return two inclines of length 2, and between them an arc of radius 1 in three parts, over which the heading falls
    from 1 to -1.
    """
    arcs = [gqm.arc(radius=1, angle=angle) for angle in ("-4/5", "-2/5", "-4/5")]
    pieces = [gqm.line(length=2), *arcs, gqm.line(length=2)]
    return built(tmp_path_factory.mktemp("hump"), "hump", pieces, start=(0, 0), heading="1")


def _found(module: ModuleType, *launch: float) -> dict[str, float]:
    """Return the extremes of a swept launch, which the compiled loop answers."""
    swept = {quantity: module.sweep(quantity, *launch, contact="above") for quantity in EXTREMES}
    assert all(one.route_counts() == {"single": 1} for one in swept.values())
    return {quantity: float(one.values) for quantity, one in swept.items()}


@pytest.mark.parametrize(("place", "sense"), [(0.5, 1), (5.5, -1)])
def test_a_body_that_leaves_where_an_arc_begins(place: float, sense: int, hump: ModuleType) -> None:
    """N is m g cos(1) on the whole incline; the load that would act on the arc is not one of the body's loads.

    `solve` included that load for a body that passes the rail backwards.
    """
    v2_at_joint = 49.0 - 2.0 * G * 1.5 * np.sin(1.0)
    load = G * np.cos(1.0)
    expected = {"v_max": 7.0, "v_min": np.sqrt(v2_at_joint), "normal_force_max": load, "normal_force_min": load}
    assert _found(hump, place, 7.0, sense) == pytest.approx(expected, rel=FEW)
    motion = hump.solve(place, 7.0, sense, contact="above")
    assert motion.normal_force_min.value == pytest.approx(load, rel=FEW)


def test_a_body_that_turns_before_it_leaves(hump: ModuleType) -> None:
    """With u the angle from the top, N is m g (3 cos(u) - 2 cos(turn)), which vanishes where cos(u) = 2/3 cos(turn)."""
    top = np.cos(0.3) + 0.6**2 / (2.0 * G)
    expected = {
        "v_max": np.sqrt(2.0 * G * top / 3.0),
        "v_min": 0.0,
        "normal_force_max": G * top,
        "normal_force_min": 0.0,
    }
    assert _found(hump, 2.7, 0.6, 1) == pytest.approx(expected, rel=FEW, abs=AT_LOSS)
    assert _found(hump, 3.3, 0.6, -1) == pytest.approx(expected, rel=FEW, abs=AT_LOSS)
    downwards = expected | {"v_min": 0.6, "normal_force_max": G * np.cos(0.3) - 0.36}
    assert _found(hump, 2.7, 0.6, -1) == pytest.approx(downwards, rel=FEW, abs=AT_LOSS)


def test_a_launch_backwards_from_a_joint(hump: ModuleType) -> None:
    """A body that leaves an arc at once keeps contact on the incline; sweeps found that it left the track at once."""
    slope, length = G * np.sin(1.0), 2.0
    end = (np.sqrt(25.0 + 2.0 * slope * length) - 5.0) / slope
    assert float(hump.sweep("t_end", 2.0, 5.0, -1, contact="above").values) == pytest.approx(end, rel=FEW)
    fastest = float(hump.sweep("v_max", 2.0, 5.0, -1, contact="above").values)
    assert fastest == pytest.approx(np.sqrt(25.0 + 2.0 * slope * length), rel=FEW)
    assert float(hump.sweep("t_end", 2.0, 5.0, 1, contact="above").values) == 0.0


@pytest.mark.extended
def test_a_body_in_a_ring_up_to_where_it_leaves(generated_folder: Path) -> None:
    """Thrown up from the lowest place with V0**2 = share * g, a body leaves where 3 cos(s) = 2 - share.

    A slower body swings, also in a swing so small that V**2 is only a rounding of the potential.
    """
    curve = gqm.Curve.parametric(x="sin(th)", z="-cos(th)", parameter="th", period="2*pi")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="liftoff_ring", folder=generated_folder)
    share = np.array([2.2, 3.0, 4.9])
    speed = np.sqrt(share * G)
    found = {what: module.sweep(what, 0.0, speed, [1, -1, 1], contact="above").values for what in EXTREMES}
    assert found["v_max"] == pytest.approx(speed, rel=FEW)
    assert found["v_min"] == pytest.approx(np.sqrt(G * (share - 2.0) / 3.0), rel=1e-13)
    assert found["normal_force_max"] == pytest.approx(G * (1.0 + share), rel=FEW)
    assert found["normal_force_min"] == pytest.approx(np.zeros(3), abs=AT_LOSS)
    fastest = module.sweep("v_max", [1e-3, 0.2], 0.0, contact="above").values
    assert fastest == pytest.approx(2.0 * np.sqrt(G) * np.sin([5e-4, 0.1]), rel=FEW)


def test_a_body_that_leaves_shortly_before_a_joint(tmp_path: Path) -> None:
    """From rest beside the top of an arc of radius 1, a body leaves where cos(u) = 2/3 cos(0.1), 0.005 before the arc
    bends up.

    Single motions went on to the end of the rail: the contact force was not looked at between there and the joint.
    """
    pieces = [gqm.arc(radius=1, angle="-17/20"), gqm.arc(radius=1, angle="17/20"), gqm.line(length=1)]
    module = built(tmp_path, "leaves_before_joint", pieces, start=(0, 0), heading="0")
    place, speed = np.arccos(2.0 / 3.0 * np.cos(0.1)), np.sqrt(2.0 / 3.0 * G * np.cos(0.1))
    assert 0.844 < place < 0.85
    motion = module.solve(0.1, contact="above")
    assert [event.kind for event in motion.events] == ["liftoff"]
    assert motion.events[0].lam == pytest.approx(place, rel=FEW)
    assert motion.v_max.value == pytest.approx(speed, rel=FEW)
    found = _found(module, 0.1)
    assert found["v_max"] == pytest.approx(speed, rel=FEW)
    assert found["normal_force_min"] == pytest.approx(0.0, abs=AT_LOSS)


TURNS = np.linspace(-3.0, 3.0, 41)
BANKED = {
    "points": lambda: gqm.Curve.sampled(
        np.column_stack([TURNS, np.sin(2.0 * TURNS) / 4.0, np.sin(TURNS) + TURNS**2 / 8.0]),
        roll=np.full(TURNS.size, 0.1),
    ),
    "formulas": lambda: gqm.Curve.space(x="t", y="sin(2*t)/4", z="sin(t) + t**2/8", parameter="t", roll="1/10"),
}


@pytest.mark.parametrize(
    ("curve", "spin"),
    [
        ("points", 0.0),
        pytest.param("points", 0.7, marks=pytest.mark.extended),
        pytest.param("formulas", 0.7, marks=pytest.mark.extended),
    ],
)
def test_on_a_banked_track_in_space(curve: str, spin: float) -> None:
    """Compiled loops answer as each motion does, also in a rotating frame, where a body loses contact moving one way.

    Each launch was solved by itself.
    """
    law = gqm.Gravity() + gqm.RotatingFrame(Omega=spin) if spin else gqm.Gravity()
    module = transient(gqm.derive(BANKED[curve](), law))
    first, last = (0.5, 7.5) if curve == "points" else (-2.5, 2.5)
    lam0, v0, sense = np.linspace(first, last, 12), np.tile([0.5, 3.0, 5.0, 6.0], 3), np.tile([1, -1, -1, 1], 3)
    for asked in [{"contact": "above", "t_max": 1.0}] + [{"contact": "below"}, {"contact": "above"}] * (spin != 0.0):
        motions = [module.solve(*launch, **asked) for launch in zip(lam0, v0, sense, strict=True)]
        ends, *extremes = (module.sweep(name, lam0, v0, sense, **asked) for name in ("t_end", *EXTREMES[:1:-1]))
        assert all("solve" not in swept.route_counts() for swept in (ends, *extremes))
        wanted = np.array([motion.t_end for motion in motions])
        np.testing.assert_allclose(ends.values, np.where(np.isfinite(wanted), wanted, np.nan), rtol=1e-13, atol=1e-14)
        for name, swept in zip(EXTREMES[:1:-1], extremes, strict=True):
            loads = np.array([getattr(motion, name).value for motion in motions])
            np.testing.assert_allclose(swept.values, loads, rtol=2e-14, atol=1e-12)
