"""Derivatives of states at any time agree with closed forms in mpmath, and with laws that every motion obeys."""

from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from orbits import FORMULAS, by_differences
from paths import ROOT

from gqm_sym.errors import SolutionError
from gqm_sym.loading import load

# The times from launch, in periods: within the first one, and much later.
TIMES = np.array([0.0, 0.03, 0.21, 0.25, 0.4, 0.5, 0.71, 0.98, 1.0, 2.3, -0.6, 1234.56, 1e6 + 0.37, 1e9 + 0.11])


def generated(name: str) -> ModuleType:
    """Return a module of the repository."""
    return load(str(ROOT / "generated" / f"{name}.py"), name)


def swing(time: Any, at: dict[str, Any]) -> list[Any]:
    """Return angle and speed of a pendulum released at rest, in Jacobi's functions."""
    k, rate = mp.sin(at["lam0"] / 2), mp.sqrt(at["g"] / at["L"])
    u = rate * time + mp.ellipk(k**2)
    sn, cn = mp.ellipfun("sn", u, k**2), mp.ellipfun("cn", u, k**2)
    return [2 * mp.asin(k * sn), at["L"] * 2 * k * rate * cn]


@pytest.mark.sample(1)
@pytest.mark.parametrize("amplitude", [1.2, 2.9, 0.05, 3.1415, 3.1415926])
def test_a_pendulum_at_any_time(amplitude: float) -> None:
    """Sensitivities are right up to 1e9 periods, within 1e-14 of the largest derivative in the period then."""
    launch = {"lam0": amplitude, "L": 1.25, "g": 9.81}
    motion = generated("circle").solve(**launch)
    times = motion.period * TIMES
    found = motion.sensitivity(times, list(launch))
    late = times[:, None] + motion.period * np.linspace(0.0, 1.0, 33)
    for k, name in enumerate(launch):
        around = motion.sensitivity(late, name)
        for i, time in enumerate(times):
            with mp.workdps(70):
                lam, v = by_differences(lambda at, time=time: swing(mpf(time), at), launch, name, 25)
            assert abs(found.lam[k, i] - lam) <= 1e-14 * np.abs(around.lam[0, i]).max(), (name, time)
            assert abs(found.v[k, i] - v) <= 1e-14 * np.abs(around.v[0, i]).max(), (name, time)


def test_reference_numbers() -> None:
    """Sensitivities of the pendulum of 1.2 rad after 1000 s agree with published numbers."""
    motion = generated("circle").solve(lam0="6/5", L=1, g="9.81")
    assert motion.lam(1000) == pytest.approx(1.02038649414777600971089, rel=4e-16)
    found = motion.sensitivity(1000, ("lam0", "L", "g"))
    wanted = [-288.2637682807651750363456, -887.7666509115583862701233, 90.49609081667261837615936]
    np.testing.assert_allclose(found.lam, wanted, rtol=3e-14)


CASES = [(name, 0.0) for name in FORMULAS] + [("circle", 9.0), ("ellipse", 9.0), ("rolling_circle", 12.0)]


@pytest.mark.sample(4)
@pytest.mark.parametrize(("name", "faster"), CASES)
def test_laws_of_motion(name: str, faster: float) -> None:
    """For random launches in both directions, area in phase space, energy and the scale of time are conserved.

    The map from (s, V) at launch to (s, V) at any time keeps areas. The energy V**2/2 + U depends on the variables as
    at launch. If all forces are proportional to g, a motion depends on t sqrt(g) and v0/sqrt(g).
    """
    module, random = generated(name), np.random.default_rng(11)
    ranges = FORMULAS.get(name, FORMULAS["rolling_circle"]).ranges
    for _ in range(3):
        launch = {
            key: float(random.uniform(*ends))
            for key, ends in ranges.items()
            if key in (*module.PARAMETERS, "lam0", "v0")
        }
        launch["v0"] += faster + 0.1
        direction = int(random.choice([1, -1]))
        motion = module.solve(**launch, direction=direction)
        assert motion.kind == ("circulation" if faster else "libration")
        times = motion.period * TIMES[:-3]
        state, found = motion.state(times), motion.sensitivity(times)
        rows = {key: found.wrt.index(key) for key in found.wrt}
        lam0, v0 = rows["lam0"], rows["v0"]
        f, p = motion.problem.formulas.exact, [mpf(number.value) for number in motion.problem.p]
        ds = np.array([float(f.ds(mp, mpf(lam), p)) for lam in (launch["lam0"], *state.lam)])
        area = ds[1:] * direction * (found.lam[lam0] * found.v[v0] - found.lam[v0] * found.v[lam0])
        size = ds[1:] * (np.abs(found.lam[lam0] * found.v[v0]) + np.abs(found.lam[v0] * found.v[lam0])) + ds[0]
        assert np.all(np.abs(area - ds[0]) <= 1e-13 * size)
        for key, row in rows.items():
            at = dict(zip(motion.problem.formulas.parameters, p, strict=True))

            def level(lam: mpf, key: str = key, at: dict[str, mpf] = at, f: Any = f) -> float:
                """Return the derivative of U with respect to a parameter at a fixed place."""
                if key not in at:
                    return 0.0
                return float(mp.diff(lambda q: f.effective_potential(mp, lam, list({**at, key: q}.values())), at[key]))

            force = [float(f.effective_potential_slope(mp, mpf(lam), p)) for lam in state.lam]
            own = {"v0": launch["v0"], "lam0": float(f.effective_potential_slope(mp, mpf(launch["lam0"]), p))}
            wanted = level(mpf(launch["lam0"])) + own.get(key, 0.0)
            terms = np.array([state.v * found.v[row], force * found.lam[row], [level(mpf(lam)) for lam in state.lam]])
            assert np.all(np.abs(terms.sum(axis=0) - wanted) <= 2e-13 * (np.abs(terms).max() + abs(wanted))), key
        if "w" not in launch:
            g, rate = motion.problem.p[list(motion.problem.formulas.parameters).index("g")].value, state.v / ds[1:]
            scaled = g * found.lam[rows["g"]] + launch["v0"] / 2 * found.lam[v0]
            size = np.abs(g * found.lam[rows["g"]]) + launch["v0"] * np.abs(found.lam[v0]) + np.abs(times * rate).max()
            assert np.all(np.abs(scaled - times * rate / 2) <= 1e-13 * size)


@pytest.mark.parametrize(
    "launch", [{"lam0": 0.9}, {"lam0": -0.7, "v0": 1.5, "direction": -1}, {"lam0": 0.2, "v0": 9.0}]
)
def test_what_states_consist_of(launch: dict[str, Any]) -> None:
    """Derivatives of x, z, s, v and N agree with differences of solved motions."""
    module, step = generated("ellipse"), 1e-5
    launch = {"a": 1.5, "b": 0.8, "g": 9.5, "m": 1.25, "v0": 0.0, **launch}
    launch["lam0"] -= 1.5
    motion = module.solve(**launch)
    times = motion.period * TIMES[:9]
    found = motion.sensitivity(times)
    for k, name in enumerate(found.wrt):
        if launch[name] == 0.0:
            continue
        ahead, behind = (module.solve(**{**launch, name: launch[name] + h}).state(times) for h in (step, -step))
        for field in ("lam", "s", "x", "z", "v", "normal_force"):
            wanted = (getattr(ahead, field) - getattr(behind, field)) / (2 * step)
            np.testing.assert_allclose(
                getattr(found, field)[k], wanted, atol=2e-6 * max(np.abs(wanted).max(), 1e-2), rtol=0
            )


@pytest.mark.parametrize("lam0", [1.1, -1.1])
@pytest.mark.parametrize("direction", [1, -1])
def test_from_rest(lam0: float, direction: int) -> None:
    """The derivative with respect to v0 is that of a launch with small speed in the requested direction."""
    module, speed = generated("circle"), 1e-7
    times = np.linspace(0.0, 3.0, 7)
    rest = module.solve(lam0=lam0, direction=direction)
    moving = module.solve(lam0=lam0, v0=speed, direction=direction)
    wanted = (moving.state(times).lam - rest.state(times).lam) / speed
    np.testing.assert_allclose(rest.sensitivity(times, "v0").lam[0], wanted, atol=1e-6)
    np.testing.assert_allclose(rest.sensitivity(0.0).v[:2], [0.0, direction], atol=1e-15)


@pytest.mark.parametrize("lam0", [1.3, 1e-6])
def test_a_spring_on_a_line(lam0: float) -> None:
    """The motion is isochronous, so that derivatives of G vanish; with ds/dx = 5/4, x = x0 cos(w t) + 4 v0 sin(w t)/(5
    w).
    """
    module = generated("line_spring")
    motion = module.solve(lam0=lam0)
    rate, times = np.pi / motion.half_period, np.linspace(0.0, 9.0, 12)
    found = motion.sensitivity(times, ("lam0", "v0"))
    np.testing.assert_allclose(found.lam[0], np.cos(rate * times), atol=2e-14)
    np.testing.assert_allclose(found.lam[1], np.sin(rate * times) / (1.25 * rate), atol=2e-14)


def test_shapes_and_names() -> None:
    """There is one row for each name, of the shape of the times."""
    motion = generated("circle").solve(lam0=1.0)
    assert motion.sensitivity(0.5).lam.shape == (5,)
    assert motion.sensitivity(np.zeros((2, 3)), ("g", "L")).x.shape == (2, 2, 3)
    assert motion.sensitivity(np.empty(0), "L").normal_force.shape == (1, 0)
    assert motion.sensitivity("1/2", "L").wrt == ("L",)
    np.testing.assert_allclose(motion.place_changes(0.5), motion.sensitivity(0.5).lam, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(motion.sensitivity(0.0).lam, [1.0, 0.0, 0.0, 0.0, 0.0], atol=1e-15)
    with pytest.raises(SolutionError, match="too near to an equilibrium"):
        generated("circle").solve(lam0="pi - 1/10**30").sensitivity(0.5)


@pytest.mark.parametrize(
    ("name", "launch"),
    [
        ("circle", {"lam0": 1.1, "v0": 0.5, "direction": -1}),
        ("circle", {"lam0": 1.1, "v0": 9.0, "direction": -1}),
        ("ellipse", {"lam0": -1.25, "v0": 9.0}),
        ("circle_drag", {"lam0": 1.1, "v0": 0.5}),
        ("circle_coulomb", {"lam0": 1.5}),
        ("superellipse", {"lam0": 0.5}),
    ],
)
def test_places_alone(name: str, launch: dict[str, float]) -> None:
    """The derivatives of places alone, which fits use, are those of sensitivities."""
    motion, times = generated(name).solve(**launch), np.linspace(0.0, 2.0, 90)
    wanted = motion.sensitivity(times, ("g", "lam0")).lam
    np.testing.assert_allclose(motion.place_changes(times, ("g", "lam0")), wanted, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(motion.place_changes(1.5, "g"), motion.sensitivity(1.5, "g").lam, rtol=1e-14, atol=0.0)


@pytest.mark.parametrize(("name", "v0"), [("ellipse", 0.0), ("circle", 9.0)])
def test_one_time_and_many(name: str, v0: float) -> None:
    """At many times, in one thread or several and in any shape, states change by the same bits as at each time alone;
    with respect to some names as with respect to all.
    """
    motion, times = generated(name).solve(0.7, v0), np.linspace(0.0, 40.0, 5000)
    everything = motion.sensitivity(times)
    some = motion.sensitivity(times.reshape(50, 100), ("lam0", "g"))
    rows = [everything.wrt.index(key) for key in some.wrt]
    for field in everything._fields[1:]:
        whole = getattr(everything, field)
        np.testing.assert_array_equal(getattr(some, field).reshape(2, -1), whole[rows])
        for k in (0, 1, 1777, 4999):
            np.testing.assert_array_equal(getattr(motion.sensitivity(times[k]), field), whole[:, k])
