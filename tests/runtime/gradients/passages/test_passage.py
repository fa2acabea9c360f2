"""Motions without losses that do not repeat change as closed forms and differences of 30 digits in mpmath say."""

from collections.abc import Callable
from math import cosh, sinh
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.errors import SolutionError

STEP = mpf(10) ** -15
FIELDS = ("lam", "s", "x", "z", "v", "normal_force")
RUBBING = gqm.Gravity() + gqm.CoulombFriction(mu=0)


@pytest.fixture(scope="module")
def slope(generated_folder: Path) -> ModuleType:
    """Return a plane z = -k x that ends at x = 3 + k."""
    curve = gqm.Curve.graph("-k*x", domain=(-50, "3 + k"), parameters={"k": "3/4"})
    return gqm.build(gqm.derive(curve, gqm.Gravity()), name="passage_slope", folder=generated_folder)


@pytest.fixture(scope="module")
def hill(generated_folder: Path) -> ModuleType:
    """Return a smooth hill, z = h/(1 + x**2) + x/10."""
    curve = gqm.Curve.graph("h/(1 + x**2) + x/10", domain=(-8, 8), parameters={"h": 1})
    return gqm.build(gqm.derive(curve, gqm.Gravity()), name="passage_hill", folder=generated_folder)


@pytest.fixture(scope="module")
def saddle(generated_folder: Path) -> ModuleType:
    """Return a level line with a force k x away from x = 0, on which x is a sum of hyperbolic functions."""
    force = gqm.Potential("-k*x**2/2", parameters={"k": 2})
    return gqm.build(gqm.derive(gqm.Curve.graph("0*x"), force), name="passage_saddle", folder=generated_folder)


def differences(answer: Callable[..., list[Any]], given: dict[str, Any]) -> dict[str, list[Any]]:
    """Return the derivatives of numbers by each argument, at v0 = 0 for greater speeds."""
    found = {}
    for name, value in given.items():
        if name == "v0" and value == 0:
            sides = [answer(**given | {name: n * STEP}) for n in range(3)]
            found[name] = [(4 * b - c - 3 * a) / (2 * STEP) for a, b, c in zip(*sides, strict=True)]
        else:
            up, down = (answer(**given | {name: value + sign * STEP}) for sign in (1, -1))
            found[name] = [(a - b) / (2 * STEP) for a, b in zip(up, down, strict=True)]
    return found


def down_the_slope(lam0: Any, v0: Any, k: Any, g: Any, m: Any, t: Any, heading: int) -> list[Any]:
    """Return lam, s, x, z, v and N of a body on the plane at a time."""
    length = mp.sqrt(1 + k * k)
    a = g * k / length
    s = heading * v0 * t + a * t * t / 2
    x = lam0 + s / length
    return [x, s, x, -k * x, heading * v0 + a * t, m * g / length]


@pytest.mark.parametrize(("v0", "heading"), [(0, 1), (0, -1), (2, 1), (3, -1)])
def test_states_on_a_plane(v0: int, heading: int, slope: ModuleType) -> None:
    """Uniformly accelerated bodies, also before and after their turn and at the turn itself."""
    given = {"lam0": mpf("-0.5"), "v0": mpf(v0), "k": mpf("0.75"), "g": mpf("9.81"), "m": mpf(2)}
    motion = slope.solve(**{name: mp.nstr(value, 17) for name, value in given.items()}, direction=heading)
    times = [0.0, 0.2, 0.51, 1.0]
    found = motion.sensitivity(times, tuple(given))
    with mp.workdps(50):
        for k, t in enumerate(times):
            wanted = differences(lambda t=t, **other: down_the_slope(**other, t=mpf(t), heading=heading), given)
            for i, name in enumerate(given):
                for row, field in enumerate(FIELDS):
                    error = abs(getattr(found, field)[i, k] - wanted[name][row])
                    assert error <= 1e-14 * max(1, abs(wanted[name][row])), (t, name, field)


def test_ends_of_a_plane(slope: ModuleType) -> None:
    """The time to a place, to the end of the plane, and the largest speed, which is that at the end."""
    given = {"lam0": mpf("-0.5"), "v0": mpf(2), "k": mpf("0.75"), "g": mpf("9.81")}

    def ends(lam0: Any, v0: Any, k: Any, g: Any) -> list[Any]:
        length, e = mp.sqrt(1 + k * k), 3 + k
        a = g * k / length
        fastest = mp.sqrt(v0**2 + 2 * a * (e - lam0) * length)
        slower = mp.sqrt(v0**2 + 2 * a * (1 - lam0) * length)
        return [(fastest + v0) / a, (slower + v0) / a, fastest, lam0 - v0**2 / (2 * a * length)]

    motion = slope.solve(**{name: mp.nstr(value, 17) for name, value in given.items()}, direction=-1)
    with mp.workdps(50):
        for name, wanted in differences(ends, given).items():
            found = [motion.gradient("t_end", name)[name], motion.gradient("time_at", name, lam=1)[name]]
            found += [motion.gradient("v_max", name)[name], motion.gradient("turning_points", name)[name][0]]
            for value, right in zip(found, wanted, strict=True):
                assert abs(value - right) <= 1e-14 * max(1, abs(right)), name


@pytest.mark.parametrize(("lam0", "v0", "direction"), [(0.3, 0.0, 1), (-0.2, 1.5, 1), (1.0, 0.5, -1)])
def test_away_from_an_equilibrium(lam0: float, v0: float, direction: int, saddle: ModuleType) -> None:
    """X = x0 cosh(w t) + v0 sinh(w t)/w: from rest, past the equilibrium, and after a turn before it."""
    motion, w = saddle.solve(lam0, v0, direction, k=2, m=1), 2**0.5
    for t in (0.3, 1.7):
        found = motion.sensitivity(t, ("lam0", "v0"))
        speed = sinh(w * t) / w * (direction if v0 or direction * lam0 > 0 else -1)
        np.testing.assert_allclose(found.lam, [cosh(w * t), speed], rtol=1e-13)
        np.testing.assert_allclose(found.v, [w * sinh(w * t), speed * w / sinh(w * t) * cosh(w * t)], rtol=1e-13)


def over_the_hill(lam0: Any, v0: Any, h: Any, g: Any, to: Any) -> list[Any]:
    """Return the time to a place beyond the hill, by an integral."""

    def w(x: Any) -> Any:
        return v0**2 + 2 * g * (h / (1 + lam0**2) - h / (1 + x**2) + (lam0 - x) / 10)

    def rate(x: Any) -> Any:
        return mp.sqrt(1 + (-2 * h * x / (1 + x**2) ** 2 + mpf(1) / 10) ** 2) / mp.sqrt(w(x))

    return [mp.quad(rate, mp.linspace(lam0, to, 9))]


@pytest.mark.extended
def test_over_a_hill(hill: ModuleType) -> None:
    """The time to a place, and the contact force at its least, which is inside the motion."""
    given = {"lam0": mpf(-2), "v0": mpf(5), "h": mpf(1), "g": mpf("9.81")}
    motion = hill.solve(lam0=-2, v0=5, h=1, g="9.81")
    with mp.workdps(40):
        for name, (wanted,) in differences(lambda **other: over_the_hill(**other, to=mpf(3)), given).items():
            assert abs(motion.gradient("time_at", name, lam=3)[name] - wanted) <= 4e-15 * abs(wanted), name
    step, found = 1e-5, motion.gradient("normal_force_min", ("v0", "h"))
    for name, value in (("v0", 5), ("h", 1)):
        up, down = (
            hill.solve(**{"lam0": -2, "v0": 5, "h": 1, "g": "9.81"} | {name: value + sign * step}).normal_force_min
            for sign in (1, -1)
        )
        assert found[name] == pytest.approx((up.value - down.value) / (2 * step), rel=1e-7)


def test_one_time_and_many(hill: ModuleType) -> None:
    """Derivatives at a time have the same bits whatever other times are asked for together."""
    motion, t = hill.solve(-2, 5), np.linspace(0.0, 2.0, 40)
    together = motion.sensitivity(t)
    for k in range(0, 40, 7):
        alone = hill.solve(-2, 5).sensitivity(float(t[k]))
        for field in FIELDS:
            np.testing.assert_array_equal(getattr(alone, field), getattr(together, field)[:, k])


def test_towards_an_equilibrium(generated_folder: Path) -> None:
    """A pendulum that takes all time to the top changes as its neighbours say, which swing or go round."""
    module = gqm.build(gqm.derive(gqm.families.circle(), gqm.Gravity()), name="passage_top", folder=generated_folder)
    t, step, given = np.array([0.2, 1.0, 2.0]), 1e-5, {"lam0": 0.0, "v0": 4.0, "L": 1.0, "g": 4.0}
    motion = module.solve(**given)
    assert motion.kind == "asymptotic"
    found = motion.sensitivity(t, tuple(given))
    for k, (name, value) in enumerate(given.items()):
        up, down = (module.solve(**given | {name: value + sign * step}) for sign in (1, -1))
        for field in ("lam", "v", "normal_force"):
            wanted = (getattr(up.state(t), field) - getattr(down.state(t), field)) / (2 * step)
            np.testing.assert_allclose(getattr(found, field)[k], wanted, rtol=1e-6, atol=1e-6)


def test_what_there_is_not(slope: ModuleType) -> None:
    """Such motions have no period and no place of rest, and a horizon does not move."""
    motion = slope.solve(0, t_max=0.5)
    for quantity in ("period", "half_period", "action", "rest_position"):
        with pytest.raises(SolutionError, match=f"has no {quantity}"):
            motion.gradient(quantity)
    assert motion.gradient("t_end", ("k", "lam0")) == {"k": 0.0, "lam0": 0.0}
    down = slope.solve(0, 1, t_max=0.5)
    assert down.gradient("turning_points", ("k", "lam0")) == {"k": (), "lam0": ()}


def test_lifted_off_at_once(generated_folder: Path) -> None:
    """A body that flies off where it is launched changes as the launch does, with losses and without, and its end at
    t = 0 does not.
    """
    curve, side = gqm.Curve.graph("-x**2", parameter="x"), {"contact": "above"}
    for law, name in ((gqm.Gravity(), "free"), (gqm.Gravity() + gqm.QuadraticDrag(b="1/20"), "dragged")):
        module = gqm.build(gqm.derive(curve, law), name=f"passage_flies_{name}", folder=generated_folder)
        motion, names = module.solve(0.5, 5.0, **side), ("lam0", "v0", "m")
        assert motion.legs[-1].end == "liftoff"
        assert motion.gradient("t_end", names) == dict.fromkeys(names, 0.0)
        changes = motion.sensitivity(0.0, names)
        np.testing.assert_allclose(changes.lam, [1.0, 0.0, 0.0], atol=1e-15)
        np.testing.assert_allclose(changes.v, [0.0, 1.0, 0.0], atol=1e-14)
        # N = m (g - 2 v**2/(1 + 4 x**2))/sqrt(1 + 4 x**2), at x = 1/2
        by_place = 2 * (3 * 25 - 9.81) / 2**1.5
        wanted = [by_place, -2 * 5 / 2**0.5, (9.81 - 25) / 2**0.5]
        np.testing.assert_allclose(changes.normal_force, wanted, rtol=1e-13)
        for quantity in ("normal_force_min", "normal_force_max"):
            np.testing.assert_allclose(list(motion.gradient(quantity, names).values()), wanted, rtol=1e-13)
        for quantity in ("v_min", "v_max"):
            np.testing.assert_allclose(list(motion.gradient(quantity, names).values()), [0, 1, 0], atol=1e-14)


@pytest.mark.parametrize(
    "force", [gqm.Gravity(), pytest.param(RUBBING, marks=pytest.mark.extended)], ids=["free", "rubbing"]
)
def test_released_from_a_cusp(force: gqm.Kernel, generated_folder: Path) -> None:
    """Along a cycloid released from its cusp, the angle of the wheel is sqrt(g/R) times the time, and does not
    change with the launch place in first order. With a launch speed v0 the body is earlier by v0/g. At the launch
    itself place and speed change by the launch speed alone, and N = 2 m g sin(u/2), which changes with the angle u, by
    m sqrt(g/R). With losses the derivatives with respect to the launch speed were refused, and at the launch all of
    them. Without losses those at times up to 1e-6 s were refused, and those of N at the launch were NaN, or 0 with
    losses. A launch out of the curve is refused.
    """
    wheel = {"x": "R*(u - sin(u))", "z": "R*(cos(u) - 1)", "parameter": "u", "domain": (0, 3)}
    curve = gqm.Curve.parametric(**wheel, parameters={"R": "1/2"})
    name = f"released_from_a_cusp_{force is RUBBING}"
    module = gqm.build(gqm.derive(curve, force), name=name, folder=generated_folder)
    motion, given = module.solve(0), (0.5, 9.81)
    time = 2.0 * np.sqrt(given[0] / given[1])
    assert motion.time_at(2) == pytest.approx(time, rel=1e-15)
    names, wanted = ("R", "g", "lam0"), [0.5 * time / given[0], -0.5 * time / given[1], 0.0]
    assert list(motion.gradient("time_at", names, lam=2).values()) == pytest.approx(wanted, rel=1e-14, abs=1e-15)
    swept = module.sweep("time_at", lam0=[0.0, 0.0], lam=2.0, gradient=(*names, "v0")).gradient
    np.testing.assert_allclose(swept, [[*wanted, -1.0 / given[1]]] * 2, rtol=1e-14, atol=1e-15)
    assert motion.gradient("time_at", "v0", lam=2)["v0"] == pytest.approx(-1.0 / given[1], rel=1e-15)
    rate = np.sqrt(given[1] / given[0])
    assert motion.sensitivity([0.1, 0.2], "v0").lam == pytest.approx(rate / given[1], rel=1e-14)
    at_launch = motion.sensitivity(0.0, (*names, "v0"))
    np.testing.assert_array_equal([at_launch.lam, at_launch.x, at_launch.z], 0.0)
    assert at_launch.v.tolist() == [0.0, 0.0, 0.0, 1.0]
    np.testing.assert_allclose(at_launch.normal_force, [0.0, 0.0, 0.0, rate], rtol=1e-13, atol=1e-13)
    soon = motion.sensitivity([1e-7, 1e-6], (*names, "v0"))
    angle = rate * np.array([1e-7, 1e-6])
    wanted_soon = [-angle, 0.5 * angle / given[1], 0.0 * angle, np.full(2, rate / given[1])]
    # The place of a motion with losses has an error of 1e-17 there.
    within = 1e-10 if force is RUBBING else 3e-14
    np.testing.assert_allclose(soon.lam, wanted_soon, rtol=within)
    np.testing.assert_allclose(soon.normal_force[3], rate * np.cos(0.5 * angle), rtol=within)
    motion = module.solve(0, 0, -1)
    for ask in (lambda: motion.gradient("time_at", lam=2), lambda: motion.sensitivity([0.1, 0.2])):
        with pytest.raises(SolutionError, match="respect to v0, because the body is released at rest from a cusp"):
            ask()


@pytest.mark.extended
def test_released_from_a_cusp_whose_place_is_rounded(generated_folder: Path) -> None:
    """A body on a deltoid is released at a cusp at 2 pi/3. Its path depends on sqrt(g) t alone, and with a launch speed
    it is earlier by that over the acceleration, g cos(30 degrees). All such derivatives were refused.
    """
    curve = gqm.Curve.parametric(x="2*cos(t) + cos(2*t)", z="2*sin(t) - sin(2*t)", parameter="t", period="2*pi")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="rounded_cusp", folder=generated_folder)
    motion, times, names = module.solve("2*pi/3"), np.array([1e-6, 1e-3, 0.1, 0.5]), ("g", "lam0", "v0")
    found, state = motion.sensitivity(times, names), motion.state(times)
    pull = 9.81 * np.sqrt(0.75)
    np.testing.assert_allclose(found.s[0], 0.5 * times * state.v / 9.81, rtol=1e-9)  # the place is rounded
    np.testing.assert_allclose(found.s[0, 2:], 0.5 * times[2:] * state.v[2:] / 9.81, rtol=1e-13)
    np.testing.assert_allclose(found.s[2], state.v / pull, rtol=1e-9)
    np.testing.assert_allclose(found.s[2, 2:], state.v[2:] / pull, rtol=1e-13)
    for row in (found.lam, found.v, found.normal_force):
        np.testing.assert_array_equal(row[1], 0.0)
    at_launch = motion.sensitivity([0.0, 1e-6], names)
    np.testing.assert_allclose(at_launch.normal_force[:, 0], [0.5, 0.0, -1.18993761819214], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(at_launch.normal_force[:, 0], at_launch.normal_force[:, 1], rtol=4e-6, atol=1e-15)


@pytest.mark.parametrize(
    ("mu", "b"),
    [(0, 0), pytest.param(0.2, 0, marks=pytest.mark.extended), pytest.param(0.2, 0.5, marks=pytest.mark.extended)],
)
def test_released_backwards_from_a_slanted_cusp(mu: float, b: float, generated_folder: Path) -> None:
    """With a launch speed v0 the body is earlier by v0 over the acceleration at the cusp, which friction diminishes by
    the share mu where the track falls by 45 degrees. Without losses, the derivative of the velocity at the launch had
    the wrong sign for a body that moves backwards; with losses all of this was refused.
    """
    force = gqm.Gravity()
    for loss, is_there in ((gqm.CoulombFriction(mu=mu), mu), (gqm.QuadraticDrag(b=b), b)):
        force = force + loss if is_there else force
    curve = gqm.Curve.parametric(x="u**2", z="u**3/2 - u**2", parameter="u", domain=(-1, 0))
    name = f"slanted_cusp_{mu > 0}_{b > 0}"
    module = gqm.build(gqm.derive(curve, force), name=name, folder=generated_folder)
    motion, delay = module.solve(0, 0, -1), -np.sqrt(2.0) / (9.81 * (1.0 - mu))
    assert motion.gradient("time_at", "v0", lam=-0.8)["v0"] == pytest.approx(delay, rel=1e-14)
    at_launch = motion.sensitivity(0.0, ("g", "lam0", "v0"))
    found, wanted = [at_launch.lam, at_launch.s, at_launch.v], [[0, 0, 0], [0, 0, 0], [0, 0, -1]]
    np.testing.assert_allclose(found, wanted, atol=1e-15)
