"""Gradients in double precision agree with closed forms and with differences in mpmath, whatever their neighbours."""

import gc
from collections import Counter
from types import ModuleType
from typing import Any
from weakref import ref

import numpy as np
import pytest
from mpmath import mp, mpf
from orbits import FORMULAS, by_differences, half_orbit
from paths import ROOT

from gqm_sym.loading import load
from gqm_sym.runtime.gradients.formula_orbit import source_of
from gqm_sym.runtime.gradients.lanes import periods
from gqm_sym.runtime.gradients.lanes.assembly import LaneProgram
from gqm_sym.runtime.gradients.lanes.evaluation import ANSWERED
from gqm_sym.runtime.gradients.lanes.machine_code import coded
from gqm_sym.runtime.gradients.programs import turning_point_program

ULP = 2.0**-52


def generated(name: str) -> ModuleType:
    """Return a module of the repository."""
    return load(str(ROOT / "generated" / f"{name}.py"), name)


@pytest.fixture
def answered(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Return how many half periods each program has given derivatives for, by the names of these programs."""
    counts: Counter[str] = Counter()
    carried_out = periods.carried_out

    def counted(stage: periods.Stage, *arguments: object) -> Any:
        out, states = carried_out(stage, *arguments)  # type: ignore[arg-type]
        counts[stage.make.__name__] += int((states == ANSWERED).sum())
        return out, states

    monkeypatch.setattr(periods, "carried_out", counted)
    return counts


@pytest.mark.parametrize(("low", "high"), [(1e-3, 0.1), (0.1, 1.0), (1.0, 2.4), (2.4, 3.12)])
def test_pendulums(low: float, high: float, answered: Counter[str]) -> None:
    """For random pendulums, dtau/dA and dtau/dL are within 2 ulp of complete elliptic integrals, also for small
    swings, and for those that nearly reach the top.
    """
    random, count = np.random.default_rng(7), 150
    amplitude, length, g = (
        random.uniform(low, high, count),
        random.uniform(0.1, 10, count),
        random.uniform(1, 25, count),
    )
    found = generated("circle").sweep(
        "half_period", lam0=amplitude, L=length, g=g, gradient=("lam0", "L", "g", "v0", "m")
    )
    assert answered["mean_program"] > 0.95 * count
    with mp.workdps(40):
        for k in range(count):
            a, scale = mpf(amplitude[k]), mp.sqrt(mpf(length[k]) / mpf(g[k]))
            modulus = mp.sin(a / 2)
            first, second = mp.ellipk(modulus**2), mp.ellipe(modulus**2)
            by_amplitude = scale * mp.cos(a / 2) * (second / (modulus * (1 - modulus**2)) - first / modulus)
            wanted = by_amplitude, scale * first / mpf(length[k]), -scale * first / mpf(g[k])
            for value, true in zip(found.gradient[k, :3], wanted, strict=True):
                assert abs(value - true) <= 2 * ULP * abs(true)
    np.testing.assert_array_equal(found.gradient[:, 3:], 0.0)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", ["ellipse", "parabola", "catenary", "double_well", "rolling_circle"])
def test_random_launches(name: str, answered: Counter[str]) -> None:
    """For random launches on wells with and without symmetry, derivatives are within 4 ulp of differences in mpmath.

    These have 2 ulp of the integral of the absolute values, which may be twice the integral.
    """
    formula, random = FORMULAS[name], np.random.default_rng(11)
    given = {key: random.uniform(*ends, 5) for key, ends in formula.ranges.items()}
    ends = generated(name).sweep("turning_points", **given)
    found = generated(name).sweep("half_period", **given, gradient=tuple(given))
    for k in np.flatnonzero(found.status == 0):
        launch = {key: float(values[k]) for key, values in given.items()}
        with mp.workdps(40):
            for column, key in enumerate(launch):
                near = tuple(ends.values[k])
                wanted = by_differences(lambda numbers, near=near: half_orbit(name, numbers, near), launch, key)[0]
                assert abs(found.gradient[k, column] - wanted) <= 4 * ULP * abs(wanted)
    assert sum(answered.values()) == np.count_nonzero(found.status == 0)
    if name in ("ellipse", "parabola", "catenary"):
        assert answered["axis_program"] + answered["exact_axis_program"] == found.status.size


def test_neighbours_do_not_matter() -> None:
    """The same launch has the same derivatives, to the last bit, alone and anywhere among others."""
    module, random = generated("pendulum"), np.random.default_rng(3)
    lam0, v0 = random.uniform(-2.6, -0.6, 200), random.choice([0.0, 1.0, 2.0], 200)
    names = ("lam0", "v0", "L")
    together = module.sweep("half_period", lam0=lam0, v0=v0, gradient=names).gradient
    order = random.permutation(200)
    shuffled = module.sweep("half_period", lam0=lam0[order], v0=v0[order], gradient=names).gradient
    np.testing.assert_array_equal(shuffled, together[order])
    for k in (0, 70, 199):
        alone = module.sweep("half_period", lam0=lam0[k], v0=v0[k], gradient=names).gradient
        np.testing.assert_array_equal(alone, together[k])
    one_by_one = [module.sweep("half_period", lam0=lam0, v0=v0, gradient=name).gradient[:, 0] for name in names]
    for column, wanted in zip(one_by_one, together.T, strict=True):
        np.testing.assert_allclose(column, wanted, rtol=4 * ULP)


@pytest.mark.extended
@pytest.mark.parametrize("name", ["double_well", "circle", "ellipse", "rolling_circle"])
def test_machine_code(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Machine code for a program gives the same bits as the interpreters, for librations from rest and others, and for
    laps.
    """
    module, random = generated(name), np.random.default_rng(5)
    lam0, v0 = random.uniform(-1.4, 1.4, 300), random.choice([0.0, 0.0, 1.0, 12.0], 300)
    names, found = (*module.PARAMETERS, "lam0", "v0"), []
    for least in (1, 10**6):
        monkeypatch.setattr(periods, "MIN_LAUNCHES_FOR_CODE", least)
        found.append(module.sweep("period", lam0=lam0, v0=v0, gradient=names).gradient)
    assert np.isfinite(found[0]).all(axis=1).mean() > 0.9
    np.testing.assert_array_equal(*found)


@pytest.mark.extended
@pytest.mark.parametrize("quantity", ["turning_points", "v_min", "v_max", "normal_force_min", "normal_force_max"])
def test_turning_points_and_extremes_in_any_company(quantity: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Derivatives of turning points and extremes have the same bits alone, anywhere among others, and by machine
    code.
    """
    module, random = generated("ellipse"), np.random.default_rng(5)
    lam0, v0 = random.uniform(-1.4, 1.4, 150), random.choice([0.0, 1.0, 12.0], 150)
    names, order, found = (*module.PARAMETERS, "lam0", "v0"), random.permutation(150), []
    for least in (1, 10**6):
        monkeypatch.setattr(periods, "MIN_LAUNCHES_FOR_CODE", least)
        found.append(module.sweep(quantity, lam0=lam0[order], v0=v0[order], gradient=names).gradient)
        found.append(module.sweep(quantity, lam0=lam0, v0=v0, gradient=names).gradient[order])
    for other in found[1:]:
        np.testing.assert_array_equal(other, found[0])
    for k in (0, 70, 149):
        alone = module.sweep(quantity, lam0=lam0[order[k]], v0=v0[order[k]], gradient=names).gradient
        np.testing.assert_array_equal(alone, found[0][k])


@pytest.mark.parametrize("name", ["parabola", pytest.param("double_well", marks=pytest.mark.extended)])
def test_known_numbers_of_intervals(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where double precision tells how many intervals suffice, double-double arithmetic takes no others, and has the
    same bits as where it finds that by itself, in any company.
    """
    module, random = generated(name), np.random.default_rng(3)
    lam0, names, carried_out = random.uniform(0.1, 2.0, 200), (*module.PARAMETERS, "lam0"), periods.carried_out
    numbers = set[int]()

    def by_itself(stage: periods.Stage, program: Any, count: int, which: Any, most: int) -> Any:
        if not isinstance(program, LaneProgram):
            numbers.add(most)
            most = 0
        return carried_out(stage, program, count, which, most)

    found = module.sweep("half_period", lam0=lam0, gradient=names).gradient
    alone = [module.sweep("half_period", lam0=place, gradient=names).gradient for place in lam0[:20]]
    np.testing.assert_array_equal(alone, found[:20])
    monkeypatch.setattr(periods, "carried_out", by_itself)
    np.testing.assert_array_equal(found, module.sweep("half_period", lam0=lam0, gradient=names).gradient)
    assert max(numbers) > 0


def test_machine_code_for_many_short_sweeps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Programs that have served enough launches in all become machine code, which gives the same bits."""
    monkeypatch.setattr(periods, "MIN_LAUNCHES_IN_ALL", 250)
    made, machine_code = [], periods.machine_code
    monkeypatch.setattr(periods, "machine_code", lambda *maker: made.append(maker[0]) or machine_code(*maker))
    periods.launches_so_far.cache_clear()
    module, lam0, found = generated("circle"), np.linspace(0.3, 1.2, 100), []
    for sweeps in range(1, 5):
        found.append(module.sweep("half_period", lam0=lam0, gradient=("lam0", "L")).gradient)
        assert len(made) == max(0, sweeps - 2)
        np.testing.assert_array_equal(found[0], found[-1])


def test_machine_code_that_is_not_used_any_more() -> None:
    """Machine code is removed from memory with its program, and is made again when it is needed."""
    source = source_of(generated("circle").MODEL)
    gc.freeze()  # objects of other tests, which would take seconds
    program = coded(turning_point_program(source))
    code = ref(program.codes[0])
    del program
    gc.collect()
    gc.unfreeze()
    assert code() is None
    assert coded(turning_point_program(source)).codes[0].address


def test_near_the_separatrix(answered: Counter[str]) -> None:
    """Pendulums that almost reach the top have the derivatives of their elliptic integrals in double-double
    arithmetic.
    """
    gap = np.array([1e-2, 1e-3, 1e-4])
    found = generated("circle").sweep("half_period", lam0=np.pi - gap, L=1, g=1, gradient=("lam0", "L"))
    assert answered["mean_program"] <= 1
    with mp.workdps(40):
        for k, place in enumerate(np.pi - gap):
            modulus = mp.sin(mpf(place) / 2)
            first, second = mp.ellipk(modulus**2), mp.ellipe(modulus**2)
            by_place = mp.cos(mpf(place) / 2) * (second / (modulus * (1 - modulus**2)) - first / modulus)
            for value, true in zip(found.gradient[k], (by_place, first), strict=True):
                assert abs(value - true) <= 2 * ULP * abs(true)


@pytest.mark.parametrize(("v0", "program"), [(6.5, "circulation_program"), (7.5, "lap_program"), (30.0, "lap_program")])
def test_laps_of_pendulums(v0: float, program: str, answered: Counter[str]) -> None:
    """Laps of pendulums have the derivatives of their elliptic integrals: in doubles, which they had in double-double
    arithmetic alone, and in the latter if they almost come to rest at the top.
    """
    lam0, direction = np.array([0.1, -0.4, 0.5]), np.array([1, -1, 1])
    found = generated("circle").sweep("period", lam0=lam0, v0=v0, direction=direction, L=1, g=10, gradient=("g", "v0"))
    assert answered[program] == 3
    with mp.workdps(40):
        for k, place in enumerate(lam0):

            def lap(g: Any, speed: Any, place: float = place) -> Any:
                lowest = speed**2 + 2 * g * (1 - mp.cos(mpf(place)))  # V**2 at the bottom
                return 4 * mp.ellipk(4 * g / lowest) / mp.sqrt(lowest)

            wanted = mp.diff(lambda g: lap(g, mpf(v0)), mpf(10)), mp.diff(lambda v: lap(mpf(10), v), mpf(v0))
            for value, true in zip(found.gradient[k], wanted, strict=True):
                assert abs(value - true) <= 2 * ULP * abs(true)


@pytest.mark.parametrize("program", ["lap_program", "circulation_program"])
def test_laps_whose_rule_seems_to_converge(program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The phase of a launch may make one change of the trapezoidal rule small by accident. The derivatives of such laps
    around Viviani's curve were off by up to 600 ulp, for one motion too; they are sums over 400 nodes.
    """
    if program == "circulation_program":
        stages = periods.lap_stages
        monkeypatch.setattr(periods, "lap_stages", lambda *a: (s for s in stages(*a) if s.make.__name__ == program))
    module = generated("viviani")
    launch = {"lam0": [-0.19633934, 0.98180911], "v0": [8.0628322, 8.6284625], "a": [1.0384631, 0.9565449]}
    found = module.sweep("period", **launch, g=9.75, gradient="v0").gradient[:, 0]
    for k in range(2):
        given = [values[k] for values in launch.values()]
        single = module.solve(*given[:2], a=given[2], g=9.75).gradient("period", "v0")["v0"]
        with mp.workdps(30):
            lam0, v0, a = map(mpf, given)
            wanted = mpf(0)
            for n in range(400):
                lam = lam0 + 4 * mp.pi * n / 400
                ds, fallen = a * mp.sqrt(1 + mp.cos(lam / 2) ** 2), mp.sin(lam0 / 2) - mp.sin(lam / 2)
                wanted -= 4 * mp.pi * v0 * ds / mp.sqrt(v0**2 + 39 * a * fallen) ** 3 / 400
            for value in (found[k], single):
                assert abs(value - wanted) <= 2 * ULP * abs(wanted)
