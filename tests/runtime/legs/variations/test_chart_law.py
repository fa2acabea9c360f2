"""Derivatives of motions with losses along charts agree with the circle as a formula, and with closed forms on a
rail.
"""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.loading import load

# The tolerance of derivatives over several legs, relative to the largest of an array.
TOLERANCE = 1e-13


@pytest.fixture(scope="module")
def ring(generated_folder: Path) -> ModuleType:
    """Return a rough circle as an implicit curve, in arc length from the bottom."""
    curve = gqm.Curve.implicit("x**2 + z**2 - R**2", start=(0, "-R"), parameters={"R": 1})
    force = gqm.Gravity() + gqm.CoulombFriction(mu="3/20", mu_static="1/5")
    return gqm.build(gqm.derive(curve, force), name="rough_ring", folder=generated_folder)


@pytest.fixture(scope="module")
def rail(generated_folder: Path) -> ModuleType:
    """Return a line down, an arc and a line up, with friction; the curvature jumps between them, and so does the
    force.
    """
    pieces = [gqm.line(length="p"), gqm.arc(radius="r", angle="6/5"), gqm.line(length=3)]
    curve = gqm.Curve.piecewise(pieces, heading="-h", parameters={"p": 2, "r": "3/2", "h": "3/10"})
    model = gqm.derive(curve, gqm.Gravity() + gqm.CoulombFriction(mu="1/2"))
    return gqm.build(model, name="rough_rail", folder=generated_folder)


LAUNCHES = [
    (1.5, 1.25, 0.5, (0.1, 0.7, 1.9, 3.0)),
    (0.3, 1.1, 9.0, (0.3, 0.9, 2.0, 2.7)),
    (-0.4, 1.1, -9.0, (0.3, 0.9, 2.0, 2.7)),
    (1.0, 1.0, 0.0, (0.3, 0.9, 1.5)),
]


@pytest.mark.extended
@pytest.mark.parametrize(("arc", "radius", "v0", "times"), LAUNCHES)
def test_states_on_a_circle(arc: float, radius: float, v0: float, times: tuple[float, ...], ring: ModuleType) -> None:
    """Sensitivities, ends and turning points are those of the circle as a formula, also over laps."""
    circle = load(str(ROOT / "generated" / "circle_coulomb.py"), "circle_coulomb")
    speed = {"v0": abs(v0), "direction": 1 if v0 >= 0.0 else -1}
    one, other = ring.solve(lam0=arc, R=radius, **speed), circle.solve(lam0=f"{arc!r}/{radius!r}", L=radius, **speed)
    found, wanted = one.sensitivity(np.array(times)), other.sensitivity(np.array(times))

    def on_circle(name: str, by: Callable[[str], Any]) -> Any:
        """Return the derivative at a given arc length of launch, from those at a given angle of launch."""
        if name == "R":
            return by("L") - arc / radius**2 * by("lam0")
        return by("lam0") / radius if name == "lam0" else by(name)

    rows = dict(zip(wanted.wrt, range(len(wanted.wrt)), strict=True))
    for field in ("x", "z", "v", "normal_force", "lam"):
        for name, row in zip(found.wrt, getattr(found, field), strict=True):
            truth = on_circle(name, lambda key, f=field: getattr(wanted, "s" if f == "lam" else f)[rows[key]])
            truth = truth + (field == "lam" and name == "lam0")
            assert np.abs(row - truth).max() <= TOLERANCE * max(np.abs(truth).max(), 1e-3), (field, name)
    ends, on_formula = one.gradient("t_end"), other.gradient("t_end")
    size = max(map(abs, on_formula.values()))
    for name, value in ends.items():
        assert abs(value - on_circle(name, on_formula.__getitem__)) <= TOLERANCE * size, name
    turns, of_formula = one.gradient("turning_points", "v0")["v0"], other.gradient("turning_points", "v0")["v0"]
    assert np.abs(np.array(turns) - radius * np.array(of_formula)).max() <= TOLERANCE * 10.0


def along_rail(lam0: Any, v0: Any, p: Any, r: Any, h: Any, g: Any, mu: Any) -> tuple[Any, Any, Any]:
    """Return the turn on the line up, the place of rest on the arc, and the contact force at the start of the arc.

    On each piece dW/ds = -2 g sin(theta) - 2 v mu (g cos(theta) + W/radius), with the closed form of the arc.
    """
    w = v0**2 + 2 * g * (mp.sin(h) - mu * mp.cos(h)) * (p - lam0)
    force = g * mp.cos(h) + w / r

    def potential(theta: Any, v: int) -> Any:
        """Return a solution on the arc, so that W less it is an exponential of -2 v mu theta."""
        k = 2 * v * mu
        return 2 * g * r * ((1 - k * v * mu) * mp.cos(theta) - (k + v * mu) * mp.sin(theta)) / (1 + k * k)

    begin, end = -h, mpf(6) / 5 - h
    w = potential(end, 1) + (w - potential(begin, 1)) * mp.exp(-2 * mu * (end - begin))
    up = w / (2 * g * (mp.sin(end) + mu * mp.cos(end)))
    w = 2 * g * (mp.sin(end) - mu * mp.cos(end)) * up

    def left(theta: Any) -> Any:
        """Return W on the way back."""
        return potential(theta, -1) + (w - potential(end, -1)) * mp.exp(2 * mu * (theta - end))

    rest = mp.findroot(left, (-mpf(1) / 5, end / 2), solver="anderson")
    return p + r * (end - begin) + up, p + r * (rest - begin), force


@pytest.mark.extended
def test_jumps_of_the_force(rail: ModuleType) -> None:
    """Turning points, the place of rest and the largest force have the right derivatives by launch, force and shape of
    the rail.
    """
    launch = {"lam0": "1/2", "v0": "9", "p": "2", "r": "3/2", "h": "3/10", "g": "981/100", "mu": "1/2"}
    motion = rail.solve(**launch)
    turns, rest, force = (motion.gradient(q) for q in ("turning_points", "rest_position", "normal_force_max"))
    with mp.workdps(40):
        exact = {name: mpf(text.split("/")[0]) / mpf((text + "/1").split("/")[1]) for name, text in launch.items()}
        values = along_rail(**exact)
        assert motion.turning_points[0] == pytest.approx(float(values[0]), rel=1e-14)
        for name in launch:
            slopes = [
                float(mp.diff(lambda x, k=k, n=name: along_rail(**{**exact, n: x})[k], exact[name], h=mpf(10) ** -15))
                for k in range(3)
            ]
            found = (turns[name][0], rest[name], force[name])
            for value, slope in zip(found, slopes, strict=True):
                assert abs(value - slope) <= TOLERANCE * max(1.0, abs(slope)), name


def on_a_slope(lam0: Any, v0: Any, g: Any, mu: Any, t: Any) -> tuple[Any, Any]:
    """Return place and velocity of a body that is thrown up a slope of 3:4, stops and slides down."""
    rise, hold = g * mpf("0.6"), mu * g * mpf("0.8")
    up, stop = rise + hold, v0 / (rise + hold)
    if t < stop:
        return lam0 + v0 * t - up * t**2 / 2, v0 - up * t
    down, late = rise - hold, t - stop
    return lam0 + v0 * stop / 2 - down * late**2 / 2, -down * late


def test_a_track_through_points(generated_folder: Path) -> None:
    """Points on a straight line have the line as their spline, with friction up and down a slope."""
    points = [(0.8 * s, 0.6 * s) for s in (0.0, 0.7, 1.9, 3.0, 4.4, 5.5, 7.0, 8.0)]
    model = gqm.derive(gqm.Curve.sampled(points), gqm.Gravity() + gqm.CoulombFriction(mu="1/4"))
    module = gqm.build(model, name="rough_slope", folder=generated_folder)
    launch, times = {"lam0": 2.0, "v0": 6.0, "g": 9.81, "mu": 0.25}, (0.3, 0.7, 1.2)
    motion = module.solve(**launch)
    found, slopes = motion.sensitivity(times, tuple(launch)), motion.gradient("time_at", lam=2.5)
    turn = motion.gradient("turning_points")
    with mp.workdps(40):
        exact = {name: mpf(value) for name, value in launch.items()}
        up = exact["g"] * (mpf("0.6") + mpf("0.8") * exact["mu"])
        for k, name in enumerate(launch):
            for i, t in enumerate(times):
                for row, field in enumerate((found.lam, found.v)):
                    wanted = mp.diff(
                        lambda x, n=name, t=t, r=row: on_a_slope(**{**exact, n: x}, t=mpf(t))[r], exact[name]
                    )
                    assert abs(field[k, i] - wanted) <= TOLERANCE * max(1, abs(wanted)), (name, t)
        wanted = {"lam0": 1, "v0": exact["v0"] / up, "g": -(exact["v0"] ** 2) / (2 * up * exact["g"])}
        for name, value in wanted.items():
            assert abs(turn[name][0] - value) <= TOLERANCE, name
        # The body passes 2.5 on its way up, with v**2 = v0**2 - 2 up d.
        assert abs(slopes["lam0"] + 1 / mp.sqrt(exact["v0"] ** 2 - up)) <= TOLERANCE


@pytest.mark.extended
def test_a_rail_in_space_is_the_planar_one(generated_folder: Path) -> None:
    """A rail of transitions in a vertical plane has the derivatives of the planar rail of lines and arcs."""
    force, given = gqm.Gravity() + gqm.CoulombFriction(mu="1/10") + gqm.QuadraticDrag(b="1/50"), {"r": "3/2"}
    flat = gqm.Curve.piecewise([gqm.line(length=2), gqm.arc(radius="r", angle="2"), gqm.line(length=3)], heading="-1")
    pieces = [gqm.transition(length=2), gqm.transition(length="2*r", pitch="1/r"), gqm.transition(length=3)]
    rail = gqm.Curve.piecewise(pieces, heading=("1/2", "-1"))
    one, other = (
        gqm.build(gqm.derive(curve, force), name=f"varied_{name}", folder=generated_folder).solve(
            0.75, 0.5, t_max=4, **given
        )
        for name, curve in (("flat", flat), ("turned", rail))
    )
    for quantity in ("v_max", "normal_force_max", "normal_force_min", "turning_points"):
        wanted, found = one.gradient(quantity), other.gradient(quantity)
        for name, value in wanted.items():
            assert np.asarray(found[name]) == pytest.approx(np.asarray(value), rel=TOLERANCE, abs=TOLERANCE), quantity
    wanted, found = (motion.gradient("time_at", lam=4.25) for motion in (one, other))
    assert list(found.values()) == pytest.approx(list(wanted.values()), rel=TOLERANCE, abs=TOLERANCE)
    times = np.array([0.25, 1.0, 2.5, 3.75])
    here, there = one.sensitivity(times), other.sensitivity(times)
    assert here.wrt == there.wrt
    for field, share, by in (("x", np.cos(0.5), "x"), ("y", np.sin(0.5), "x"), ("z", 1.0, "z"), ("v", 1.0, "v")):
        expected = share * getattr(here, by)
        assert np.abs(getattr(there, field) - expected).max() <= TOLERANCE * np.abs(expected).max()
    assert np.abs(there.normal_force - here.normal_force).max() <= 4 * TOLERANCE * np.abs(here.normal_force).max()


@pytest.mark.extended
@pytest.mark.parametrize("name", ["points", "rail"])
def test_in_space_as_differences(name: str, generated_folder: Path) -> None:
    """Derivatives along points and rails in space are those of differences of answers, also by a shape."""
    u = np.linspace(-2.0, 2.0, 41)
    pieces = [
        gqm.transition(length="1"),
        gqm.transition(length="4", yaw="q", pitch="pi/8"),
        gqm.transition(length="4", yaw="-1/10", pitch="pi/8"),
        gqm.transition(length="2"),
    ]
    rail = gqm.Curve.piecewise(pieces, start=("0", "0", "4"), heading=("0", "-pi/2"))
    points = gqm.Curve.sampled(np.column_stack([u, 0.3 * np.sin(u), 0.5 * u * u]))
    curve, start, given = (points, 4.0, {}) if name == "points" else (rail, 2.0, {"q": 0.125})
    force = gqm.Gravity() + gqm.CoulombFriction() + gqm.QuadraticDrag(b="c")
    module = gqm.build(gqm.derive(curve, force), name=f"varied_{name}", folder=generated_folder)
    known = {"lam0": start, "mu": 0.0625, "c": 0.03125, "g": 9.8125, **given}
    fields, step = ("lam", "x", "y", "z", "v", "normal_force"), 2.0**-13

    def moved(**changed: float) -> Any:
        return module.solve(v0=0.0, direction=1, t_max=3.0, **{**known, **changed})

    def answers(motion: Any) -> Any:
        state, turns = motion.state(2.375), motion.turning_points
        numbers = [motion.time_at(3.0), motion.v_max.value, motion.normal_force_max.value, turns[0]]
        return np.array([*numbers, *(getattr(state, field) for field in fields)])

    motion = moved()
    gradients = [motion.gradient("time_at", lam=3.0), *map(motion.gradient, ("v_max", "normal_force_max"))]
    turns, changes = motion.gradient("turning_points"), motion.sensitivity(2.375)
    for key, value in known.items():
        at = changes.wrt.index(key)
        found = [*(gradient[key] for gradient in gradients), turns[key][0]]
        found += [getattr(changes, field)[at] for field in fields]
        near, far = (
            (answers(moved(**{key: value + k * step})) - answers(moved(**{key: value - k * step}))) / (2.0 * k * step)
            for k in (1, 2)
        )
        assert found == pytest.approx((4.0 * near - far) / 3.0, rel=2e-8, abs=2e-8), key


def test_liftoff_at_a_corner(tmp_path: Path) -> None:
    """A body that leaves a track of straight lines where the force on it changes its side ends at the corner, whatever
    the parameters are.

    The reference is the harmonic motion with friction on the line, in 40 digits.
    """
    points = [[-2.0, 1.824], [-1.429, 0.528], [-0.857, -0.17], [-0.286, -0.063], [0.286, 0.416], [0.857, 0.708]]
    curve = gqm.Curve.sampled([*points, [1.429, 0.777], [2.0, 1.153]], kind="linear")
    law = gqm.Potential("5*(x**2 + z**2)") + gqm.CoulombFriction(mu="1/20")
    module = gqm.build(gqm.derive(curve, law), name="leaves_a_corner", folder=tmp_path)
    launch = 3.724887446488845
    motion = module.solve(launch, direction=-1, t_max=4, contact="above")
    assert [leg.end for leg in motion.legs] == ["liftoff"]
    with mp.workdps(40):
        (x1, z1), (x2, z2) = ((mpf(x), mpf(z)) for x, z in points[4:])
        length = mp.hypot(x2 - x1, z2 - z1)
        before = [mp.hypot(mpf(b[0]) - mpf(a[0]), mpf(b[1]) - mpf(a[1])) for a, b in pairwise(points[:5])]
        corner = ((x2 - x1) * x1 + (z2 - z1) * z1) / length  # its distance from the point nearest to the centre
        load = 10 * abs((x2 - x1) * z1 - (z2 - z1) * x1) / length

        def time(start: Any, mu: Any) -> Any:
            shift = mu * load / 10
            return mp.acos((corner - shift) / (corner + start - mp.fsum(before) - shift)) / mp.sqrt(10)

        given = mpf(launch), mpf(1) / 20
        by_place, by_friction = (mp.diff(time, given, order) for order in ((1, 0), (0, 1)))
        assert motion.t_end == pytest.approx(float(time(*given)), rel=1e-14)
    found = motion.gradient("t_end")
    assert found["m"] == 0.0
    assert found["lam0"] == pytest.approx(float(by_place), rel=1e-12)
    assert found["mu"] == pytest.approx(float(by_friction), rel=1e-12)


def test_the_load_at_a_joint_where_the_body_leaves(tmp_path: Path) -> None:
    """On an arc with friction V**2 is a cos + b sin + c exp(-2 mu heading). The least contact force is its limit from
    the arc where the next one bends away.

    Its derivatives were those of the load that would act on the next arc.
    """
    pieces = [gqm.arc(radius=1, angle="1/2"), gqm.arc(radius=1, angle=-1)]
    force = gqm.Gravity() + gqm.CoulombFriction()
    module = gqm.build(
        gqm.derive(gqm.Curve.piecewise(pieces, heading="-1/4"), force), name="load_at_joint", folder=tmp_path
    )
    given = {"lam0": 0.125, "v0": 4.0, "mu": 0.125, "g": 9.8125, "m": 0.5}

    def load(lam0: complex, v0: complex, mu: complex, g: complex, m: complex) -> complex:
        """Return the contact force in N at the heading 1/4."""
        b = -6 * mu * g / (1 + 4 * mu * mu)
        a = 2 * g + 2 * mu * b
        begin, end = lam0 - 0.25, 0.25
        c = (v0**2 - a * np.cos(begin) - b * np.sin(begin)) * np.exp(2 * mu * begin)
        return m * (g * np.cos(end) + a * np.cos(end) + b * np.sin(end) + c * np.exp(-2 * mu * end))

    motion = module.solve(contact="above", **given)
    assert motion.legs[-1].end == "liftoff"
    found = motion.gradient("normal_force_min")
    for name in given:
        truth = load(**given | {name: given[name] + 1e-30j}).imag / 1e-30
        assert found[name] == pytest.approx(truth, rel=1e-13)
