"""A right motion passes the checks of ``make soak``, and one that breaks a law does not."""

import random
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mpmath import mp
from paths import ROOT

from gqm_sym.errors import LaunchError

sys.path.append(str(ROOT / "scripts"))

import soak
import soak_bounds
import soak_kinds

SLOW = {"lam0": -1.0, "v0": 2.0116e-06, "direction": 1, "h": 0.18013, "g": 7.62668, "m": 1.0}


@pytest.fixture(scope="module")
def well(generated_folder: Path) -> ModuleType:
    """Return two wells with a hill between them."""
    import gqm_sym as gqm

    curve = gqm.Curve.graph("h*(x**4 - 2*x**2)", parameters={"h": "1/4"})
    return gqm.build(gqm.derive(curve, gqm.Gravity()), name="soaked_well", folder=generated_folder)


def test_a_slow_launch_from_the_bottom_of_a_well(well: ModuleType) -> None:
    """V**2 is right to the last bit of the place, though pass 1 subtracts terms that are a million times as large.

    Seed 3 found this: compared with pass 1, whose rounding this is, the energy seemed off by 5.5e-10 of V**2.
    """
    motion = well.solve(**SLOW)
    state = motion.state(np.linspace(0.0, motion.period, 400))
    told, rounding = soak.exactly(well, state.lam, SLOW)
    assert rounding == 0.0
    bit = np.spacing(np.abs(state.lam))
    above, below = (soak.exactly(well, state.lam + side * bit, SLOW)[0] for side in (1.0, -1.0))
    slope = np.abs(above - below)
    assert np.max(np.abs(state.v2 - told) - slope) <= 1e-14 * SLOW["v0"] ** 2
    assert np.max(np.abs(well.pass1(state.lam, **SLOW).v2 - told)) > 1e-10 * SLOW["v0"] ** 2
    assert soak.faults(well, SLOW, random.Random(0), closely=True) == []
    # Doubles leave too few digits of so small a V**2, so that forty digits are used without being asked for.
    loosely, unsure = soak.speed_squared(well, motion, state.lam, bit, SLOW, False, SLOW["v0"] ** 2)
    assert np.array_equal(loosely, told)
    assert np.max(unsure) <= 2e-9 * SLOW["v0"] ** 2


def _with(motion: Any, **changes: Callable[..., Any]) -> SimpleNamespace:
    names = (
        "kind",
        "legs",
        "turning_points",
        "t_end",
        "state",
        "lam",
        "error_bound",
        "time_at",
        "problem",
        "_trajectory",
    )
    told = {name: getattr(motion, name) for name in names}
    if motion.kind != "rest":
        told["period"] = motion.period
    return SimpleNamespace(**told | changes)


def _scaled(state: Any, name: str, factor: float) -> Any:
    return state._replace(**{name: getattr(state, name) * factor})


WRONG: dict[str, tuple[str, Callable[[Any], dict[str, Any]]]] = {
    "energy": ("energy", lambda motion: {"state": lambda t: _scaled(motion.state(t), "v2", 1.0 + 1e-9)}),
    "not a number": ("not finite", lambda motion: {"state": lambda t: _scaled(motion.state(t), "x", np.nan)}),
    "order": ("legs out of order", lambda motion: {"legs": motion.legs[::-1]}),
    "period": ("not periodic", lambda motion: {"lam": lambda t: motion.lam(t) * (1.0 + 1e-9)}),
    "passage": ("first passage late", lambda motion: {"time_at": lambda lam: motion.time_at(lam) + motion.period}),
    "launch": ("not as launched", lambda motion: {"state": lambda t: motion.state(t + 1e-9)}),
    "sense": ("runs against its leg", lambda motion: {"state": lambda t: _scaled(motion.state(t), "v", -1.0)}),
    "turning points": ("beyond a turning point", lambda motion: {"turning_points": (-1.0, -0.9)}),
}


@pytest.mark.parametrize("law", WRONG)
def test_a_broken_law_is_reported(law: str, well: ModuleType) -> None:
    """A motion that breaks a law is reported, for each of the laws."""
    call = SLOW | {"v0": 0.5}
    motion = well.solve(**call)
    wrong = _with(motion, **WRONG[law][1](motion))
    tampered = SimpleNamespace(MODEL=well.MODEL, PARAMETERS=well.PARAMETERS, pass1=well.pass1, sweep=well.sweep)
    tampered.solve = lambda **_: motion
    assert soak.faults(tampered, call, random.Random(0), closely=True) == []
    tampered.solve = lambda **_: wrong
    assert any(found.startswith(WRONG[law][0]) for found in soak.faults(tampered, call, random.Random(0), closely=True))


@pytest.mark.parametrize("closely", [True, False])
def test_charts_are_held_to_their_heights(closely: bool, generated_folder: Path) -> None:
    """On a circle declared as F = 0, V**2 follows the height everywhere."""
    import gqm_sym as gqm

    ring = gqm.Curve.implicit("x**2 + z**2 - 1", start=(0, -1))
    module = gqm.build(gqm.derive(ring, gqm.Gravity()), name="soaked_ring", folder=generated_folder)
    call = {"lam0": 0.5, "v0": 1.0, "direction": 1, "g": 9.81, "m": 1.0}
    assert soak.faults(module, call, random.Random(0), closely=closely) == []


def test_a_body_at_rest_stays(well: ModuleType) -> None:
    """A body without speed at the bottom stays there, and one that moves is reported."""
    call = SLOW | {"v0": 0.0}
    assert soak.faults(well, call, random.Random(0), closely=True) == []
    motion = well.solve(**call)
    moves = _with(motion, state=lambda t: motion.state(t)._replace(lam=np.full(len(t), -1.1)))
    tampered = SimpleNamespace(MODEL=well.MODEL, PARAMETERS=well.PARAMETERS, solve=lambda **_: moves)
    assert soak.faults(tampered, call, random.Random(0), closely=True) == ["not as launched", "moves at rest"]


def test_a_sweep_that_differs_is_reported(well: ModuleType) -> None:
    """A sweep is reported if it differs by more than four units in the last place."""
    call = SLOW | {"v0": 0.5}
    period = well.solve(**call).period
    assert soak.swept(well, call, period) == []
    assert soak.swept(well, call, period * (1.0 + 2e-15))


@pytest.fixture(scope="module")
def families(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ModuleType]:
    """Return the modules of the random curves."""
    return soak_bounds.build(tmp_path_factory.mktemp("families"))


@pytest.mark.extended
def test_random_librations_keep_to_their_bounds(families: dict[str, ModuleType]) -> None:
    """Hundreds of places of random librations lie within their bounds, and no bound is uselessly large."""
    tally, failed = soak_bounds.soak(50, 19, families)
    assert failed == []
    assert tally["checks"] >= 500


# Each of these launches, with its parameters, was outside its bound by a factor of 10 to 10,000.
SMALL = {
    "balance": {"lam0": 8.8e-06, "v0": 8.8e-06, "direction": 1, "a": 1.42, "k": 0.322, "c": 43.26211180124224},
    "ring": {"lam0": -1.09e-06, "v0": 0.0, "direction": -1, "k": 0.0},
    "rolling": {"lam0": -6.8e-05, "v0": 0.0, "direction": 1, "a": 0.68, "beta": 0.42},
}

# Near a hilltop the rounding of an end is thirty roundings of the time.
NEAR_HILLTOP = {
    "lam0": 0.013704888185852636,
    "v0": 0.0,
    "direction": 1,
    "Omega": 1.290592153588273,
    "q": 0.14192163319253512,
    "g": 1.62,
}


@pytest.mark.extended
@pytest.mark.parametrize("name", SMALL)
def test_small_swings_where_large_forces_cancel(name: str, families: dict[str, ModuleType]) -> None:
    """The turning points in doubles have an error of one rounding of the forces over their small sum."""
    call = SMALL[name] | {"g": 9.81}
    assert soak_bounds.faults(families[name], soak_bounds.FAMILIES[name], call) == ([], len(soak_bounds.SHARES))


@pytest.mark.extended
def test_the_rounding_of_an_end_near_a_hilltop_is_charged(families: dict[str, ModuleType]) -> None:
    """Bounds include the rounding of an end near a hilltop (the half period was off by 60 roundings, places by 4.2
    bounds).
    """
    family, module = soak_bounds.FAMILIES["rotating"], families["rotating"]
    assert soak_bounds.faults(module, family, NEAR_HILLTOP) == ([], len(soak_bounds.SHARES))


@pytest.mark.extended
def test_forces_that_cancel_along_a_track_but_not_across_it(families: dict[str, ModuleType]) -> None:
    """A rounding of the points across the track moves a turning point by eleven times as much (seed 144)."""
    call = {"lam0": 2.467701708628926, "v0": 0.0, "direction": -1, "k": 4.345879535611289, "g": 9.81}
    assert soak_bounds.faults(families["track"], soak_bounds.FAMILIES["track"], call) == ([], len(soak_bounds.SHARES))


@pytest.mark.sample(1)
@pytest.mark.parametrize("c2", [-25.952397021578278, -60.0, -8.0])
def test_a_sharp_bottom_of_the_valley_is_resolved(c2: float, families: dict[str, ModuleType]) -> None:
    """Within a thousandth of the swing ds/dx changes; on a coarse scale this was taken for noise of 1e-10."""
    call = {"lam0": 0.9038783239624086, "c1": 0.0, "c2": c2, "c3": -0.03722067968333353, "c4": 0.014594479042941668}
    motion = families["polynomial"].solve(**call, k=0.0)
    assert motion.quadrature_error <= 1e-14
    times = np.linspace(0.0, motion.half_period, 9)
    assert np.all(motion.error_bound(times) <= 1e-15 * motion.condition_number * np.ptp(motion.turning_points))
    call |= {"v0": 0.0, "direction": -1, "k": 0.0, "g": 9.81}
    assert soak_bounds.faults(families["polynomial"], soak_bounds.FAMILIES["polynomial"], call)[0] == []


def test_a_bound_that_does_not_hold_is_reported(
    families: dict[str, ModuleType], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bounds a million times smaller are reported as broken, and larger ones as useless."""
    family = soak_bounds.FAMILIES["ellipse"]
    module = families["ellipse"]
    call = {"lam0": 1.0, "v0": 0.0, "direction": 1, "a": 1.0, "b": 1.0, "k": 0.5, "g": 9.81}
    assert soak_bounds.faults(module, family, call) == ([], len(soak_bounds.SHARES))
    motion = type(module.solve(**call))
    stated = motion.error_bound
    for factor, word in ((1e-6, "outside"), (1e9, "useless")):
        monkeypatch.setattr(motion, "error_bound", lambda self, t, factor=factor: factor * stated(self, t))
        assert any(found.startswith(word) for found in soak_bounds.faults(module, family, call)[0])


@pytest.fixture(scope="module")
def kinds(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ModuleType]:
    """Return the modules of the motions of many kinds."""
    return soak_kinds.build(tmp_path_factory.mktemp("kinds"))


@pytest.mark.extended
@pytest.mark.parametrize("near", [1e-1, 2.5e-3, 1e-6, 1e-10, -1e-10, -2.5e-3])
@pytest.mark.parametrize("v0", [0.68, 1e-5, 60.0])
def test_friction_that_all_but_holds_the_body(near: float, v0: float, kinds: dict[str, ModuleType]) -> None:
    """The acceleration is a small difference of large terms, whose rounding the bound includes (errors were 3.6
    bounds).
    """
    for direction in (1, -1):
        launch = {"lam0": 2.339, "v0": v0, "direction": direction, "a": -0.078156, "mu": 0.078156 * (1.0 - near)}
        assert soak_kinds.slide(kinds, launch, random.Random(1)) == []


FALLING = {
    "at rest at the end, downhill outwards": ("-1", 0.0, -1, 1.0),
    "from the end, back to it": ("-1", 1e-30, 1, 1.0),
    "from the end, outwards": ("1/3", 1e-30, 1, 1.0),
    "from a place that is no double": ("1/7", 1e-21, -1, 1.0),
    "uphill from the next double": ("1/10", 1e-12, -1, 1.0),
    "next to the end": ("-999999999999999/1000000000000000", 0.0, -1, 1.0),
    "as slow as can be": (0.125, 1e-30, -1, 1.0),
}


@pytest.mark.parametrize("case", FALLING)
def test_slow_launches_and_ends_of_the_curve(case: str, kinds: dict[str, ModuleType]) -> None:
    """These launches raised ZeroDivisionError, turned beyond the end of the curve, or were up to 1e7 bounds off."""
    launch = dict(zip(("lam0", "v0", "direction", "a"), FALLING[case], strict=True))
    with mp.workdps(40):
        assert soak_kinds.fall(kinds, launch, random.Random(1))[0] == []


def test_no_chart_is_left_through_its_end_and_come_back_to(kinds: dict[str, ModuleType]) -> None:
    """The turn was 1e-24 m beyond the end of the curve, and the next leg began at the end; now it does not."""
    with pytest.raises(LaunchError, match="would leave through it at once"):
        kinds["planes"].solve(0.0, 4.8e-12, -1)


DAMPED = {
    "thrown slowly": (-0.065, 2.9e-7, 1, 0.2307, 0.0875),
    "slowly against the spring": (-1.3769421491184743e-06, 2.819412749244849e-12, 1, 0.4326, 0.0383),
    "from rest": (3.495744063186849e-07, 0.0, -1, 2.3434225222512235, 2.079290874827242),
    "hardly at all": (0.05687488163703877, 2.2816675196297342e-10, -1, 0.1104213369442389, 0.16174555918681344),
    "a leg of a few roundings": (-0.0012592848079292901, 1.115e-10, -1, 0.33347700500008876, 0.02659599827117379),
    "overdamped, from rest": (-0.08136451436625418, 0.0, 1, 0.17565924665035534, 1.820356562297667),
    "overdamped, thrown": (-0.10434589824515211, 0.6865260361125656, -1, 0.4119897324977207, 2.9555735374799723),
    "seventy legs": (-0.008755379335412601, 0.0, -1, 68.37785985120317, 0.012754252274079185),
}


@pytest.mark.parametrize("case", DAMPED)
def test_springs_with_viscous_damping(case: str, kinds: dict[str, ModuleType]) -> None:
    """The motions lie within their bounds (they did not, or were refused because the end of a leg had no room for a
    panel).
    """
    launch = dict(zip(("lam0", "v0", "direction", "k", "c"), DAMPED[case], strict=True))
    assert soak_kinds.damp(kinds, launch, random.Random(1)) == []


def test_no_speed_is_negative(kinds: dict[str, ModuleType]) -> None:
    """The speed at a turn is not negative, although V**2 was rounded to -1.8e-16 there."""
    launch = {"lam0": -1.1087799233866897, "v0": 0.05760950449765136, "direction": 1, "t": -0.25721177667548717}
    assert kinds["wells"].solve(**launch).v_min.value == 0.0


@pytest.mark.parametrize("seed", [160000162282092, 82690791284912, 35866620081299])
def test_small_swings_across_the_seam_of_a_ring(seed: int, kinds: dict[str, ModuleType]) -> None:
    """A chart is read at places less whole laps, and bounds include the rounding of that (turns were up to 15 bounds
    off).
    """
    with mp.workdps(40):
        assert soak_kinds.rims(random.Random(seed), kinds)[0] == []


@pytest.mark.extended
def test_random_motions_of_many_kinds(kinds: dict[str, ModuleType], monkeypatch: pytest.MonkeyPatch) -> None:
    """On slopes, springs, circles, rims and coils, closed forms, sweeps and threads agree; differences are reported."""
    modules = kinds
    tally, failed, _ = soak_kinds.soak(70, 20, modules)
    assert failed == []
    assert tally["checks"] >= 350
    assert {kind.__name__ for kind in soak_kinds.KINDS} <= tally.keys()
    # With slightly stronger gravity the closed forms are those of another law.
    monkeypatch.setattr(soak_kinds, "G", "9.8100000001")
    for kind in (soak_kinds.slides, soak_kinds.swings, soak_kinds.bounces):
        assert any(kind(random.Random(seed), modules)[0] for seed in range(20))
