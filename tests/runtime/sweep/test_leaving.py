"""Sweeps of bodies that leave a curve through one of its ends."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.runtime.sweep import quantities

Build = Callable[..., ModuleType]

G, RISE, TURNS = 9.81, 0.3, 6
HELIX = gqm.families.helix(R=1, c="-3/10", domain=("0", f"{2 * TURNS}*pi"))


def motion_on_helix(lam0: float, v0: float, direction: int, omega: float) -> dict[str, float]:
    """Return the time until a body leaves the helix, and its extremes of speed and contact force per mass.

    The speed downwards grows by g*sin(alpha) in a second, where alpha is the slope. The centrifugal force does no work,
    and the contact force holds a body that moves on a circle at the speed u*cos(alpha) + omega in an inertial frame,
    and carries the weight g*cos(alpha).
    """
    ds = np.sqrt(1.0 + RISE**2)
    fall, level = G * RISE / ds, 1.0 / ds
    down, up = (2.0 * TURNS * np.pi - lam0) * ds, lam0 * ds
    begin = direction * v0
    over = begin < 0.0 and v0 * v0 > 2.0 * fall * up
    end = -np.sqrt(v0 * v0 - 2.0 * fall * up) if over else np.sqrt(v0 * v0 + 2.0 * fall * down)
    round_axis = [u * level + omega for u in (begin, end)]
    slowest = 0.0 if round_axis[0] * round_axis[1] < 0.0 else min(map(abs, round_axis))
    loads = [np.hypot(w * w, G * level) for w in (slowest, max(map(abs, round_axis)))]
    speeds = [0.0 if begin <= 0.0 and not over else min(v0, abs(end)), max(v0, abs(end))]
    names = "t_end", "v_min", "v_max", "normal_force_min", "normal_force_max"
    return dict(zip(names, ((end - begin) / fall, *speeds, *loads), strict=True))


@pytest.mark.extended
def test_down_a_helix_that_turns(build: Build) -> None:
    """Bodies that slide down, or up and back, or up and over the upper end, in frames that turn either way or not at
    all, have the times and the extremes of the closed forms.
    """
    module = build("helix_that_turns", HELIX, gqm.RotatingFrame())
    rng, count = np.random.default_rng(7), 60
    lam0, direction = rng.uniform(0.5, 30.0, count), rng.choice([-1, 1], count)
    v0, omega = rng.exponential(5.0, count) * (np.arange(count) % 4 > 0), 0.0
    for omega in (-0.9, 0.0, 0.7):
        truths = [motion_on_helix(*launch, omega) for launch in zip(lam0, v0, direction, strict=True)]
        largest = np.array([truth["normal_force_max"] for truth in truths])
        for name in truths[0]:
            swept, truth = module.sweep(name, lam0, v0, direction, Omega=omega), np.array([t[name] for t in truths])
            assert swept.route_counts() == {"single": count}
            size = largest if name.startswith("normal") else truth
            assert (np.abs(swept.values - truth) <= 4e-15 * size).all()


@pytest.mark.extended
def test_up_and_down_a_rail_that_turns(build: Build) -> None:
    """The force on a body that turns on a rail in a rotating frame has the extremes of the solved motion, which are
    searched on its panels.
    """
    pieces = [gqm.transition(length="3", yaw="0.5"), gqm.transition(length="3", yaw="-0.2", pitch="-0.1")]
    curve = gqm.Curve.piecewise(pieces, start=("0", "0", "4"), heading=("0", "-1/4"))
    module = build("rail_that_turns", curve, gqm.RotatingFrame(Omega="7/10"))
    places, v0 = np.array([1.5, 2.9, 4.0, 5.2]), np.array([1.0, 2.0, 2.5, 3.0])
    swept = [module.sweep(f"normal_force_{end}", places, v0, -1) for end in ("min", "max")]
    assert all((sweep.route == 1).all() for sweep in swept)
    for k in range(places.size):
        motion = module.solve(float(places[k]), float(v0[k]), -1)
        assert motion.kind == "transit"
        largest = motion.normal_force_max.value
        assert abs(swept[0].values[k] - motion.normal_force_min.value) <= 1e-14 * largest
        assert abs(swept[1].values[k] - largest) <= 1e-14 * largest


def time_down_ramp(lam0: float, end: float) -> Any:
    """Return the time from rest down the curve z = 3/(1 + exp(2*x)), by quadrature with thirty digits."""
    with mp.workdps(30):
        start, width = mpf(lam0), mpf(end) - mpf(lam0)

        def rate(u: Any) -> Any:
            ahead = width * u * u
            x = start + ahead
            fall = 3 * mp.exp(2 * start) * mp.expm1(2 * ahead) / ((1 + mp.exp(2 * start)) * (1 + mp.exp(2 * x)))
            slope = -6 * mp.exp(2 * x) / (1 + mp.exp(2 * x)) ** 2
            return 2 * width * u * mp.sqrt((1 + slope**2) / (2 * mpf(G) * fall))

        return mp.quad(rate, np.linspace(0, 1, 9).tolist(), method="gauss-legendre")


def test_from_rest_where_a_curve_is_almost_level(build: Build) -> None:
    """The time keeps its digits where the slope is far smaller than elsewhere on the curve, before and behind the steep
    part.
    """
    curve = gqm.Curve.graph("3/(1+exp(2*x))", parameter="x", domain=("-6", "6"))
    module, places = build("ramp_between_levels", curve, gqm.Potential("0")), [-4.3, -1.0, 0.2, 2.0, 4.976395596735937]
    swept = module.sweep("t_end", places)
    assert (swept.route == 1).all()
    assert swept.values == pytest.approx([float(time_down_ramp(place, 6.0)) for place in places], rel=1e-15)


def test_over_a_hilltop_inside_an_arc(generated_folder: Path) -> None:
    """A body from rest that passes a hilltop slowly is fastest on the level line at the end; the table of the rail did
    not decide whether it passes, so that its extremes were solved by themselves.
    """
    bends = [("2", "pi/2"), ("3", "-pi/2")]
    arcs = [gqm.arc(radius=radius, angle=angle) for radius, angle in bends]
    last = [gqm.line(length="1/2"), gqm.arc(radius=2, angle="pi/3"), gqm.line(length=2)]
    rail = gqm.Curve.piecewise([gqm.line(length=2), *arcs, *last], start=(0, 5), heading="-pi/3")
    module = gqm.build(gqm.derive(rail, gqm.Gravity()), name="left_hill", folder=generated_folder)
    starts = np.array([2.22, 2.237, 2.25])
    drop = 1.0 - 2.0 * np.cos(starts / 2.0 - 1.0 - np.pi / 3.0) + 5.0 * (np.sqrt(0.75) - 0.5) + np.sqrt(3.0) / 4.0 + 1.0
    fastest = module.sweep("v_max", starts, 0.0)
    assert fastest.route_counts() == {"single": 3}
    assert fastest.values == pytest.approx(np.sqrt(2.0 * G * drop), rel=4e-15)
    assert module.sweep("v_min", starts, 0.0).values.tolist() == [0.0] * 3


def test_bodies_that_go_on_for_ever(generated_folder: Path) -> None:
    """A body escapes from a valley between level plains exactly if its energy suffices; it has no period and no end
    then, and is never at places behind it. All of this is decided in the loop over launches.
    """
    curve = gqm.Curve.space(x="u", y="u/2", z="u**2/(1 + u**2)", parameter="u")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="escape", folder=generated_folder)
    lam0, v0 = np.linspace(-2.5, 2.5, 21), np.tile([0.0, 1.0, 4.0], 7)
    escapes = v0 * v0 > 2.0 * G / (1.0 + lam0 * lam0)
    expected = np.where(escapes, quantities.NOT_PERIODIC, quantities.ANSWERED)
    assert 5 < escapes.sum() < 15
    for name in ("half_period", "turning_points", "v_max", "normal_force_min", "t_end"):
        swept = module.sweep(name, lam0, v0)
        assert swept.route_counts().get("solve", 0) == 0
        assert (swept.status == (quantities.NOT_PERIODIC if name == "t_end" else expected)).all()
    behind = module.sweep("time_at", lam0[escapes], v0[escapes], 1, lam=lam0[escapes] - 0.5)
    assert (behind.status == quantities.NEVER_THERE).all()
    assert behind.route_counts().get("solve", 0) == 0


def test_a_body_that_comes_to_the_centre_of_a_spiral(generated_folder: Path) -> None:
    """The parameter grows without bound there, but not the time, which is that of a fall along the length of the arc:
    on the spiral of slope -1 on a cone, that is from rest sqrt(2 l/(g sin(alpha))).
    """
    spiral = gqm.Curve.space(x="exp(-u)*cos(u)", y="exp(-u)*sin(u)", z="exp(-u)", parameter="u")
    module = gqm.build(gqm.derive(spiral, gqm.Gravity()), name="cone_spiral", folder=generated_folder)
    lam0 = np.array([-1.0, 0.0, 1.0])
    length = np.sqrt(3.0) * np.exp(-lam0)
    swept = module.sweep("t_end", lam0)
    assert swept.values == pytest.approx(np.sqrt(2.0 * np.sqrt(3.0) * length / G), rel=1e-14)
    assert (module.sweep("half_period", lam0).status == quantities.NOT_PERIODIC).all()


@pytest.mark.extended
@pytest.mark.parametrize("roll", ["0", "u/5"])
def test_contact_in_a_rotating_frame(roll: str, build: Build) -> None:
    """Sweeps decide whether a body leaves a track that pushes upwards only, also where the rider does not lean and the
    Coriolis force has no part along his upward direction, but for rounding.
    """
    hills = gqm.Curve.space(x="u", y="sin(u)/3", z="cos(2*u)", parameter="u", domain=("-4", "4"), roll=roll)
    module = build(f"hills_in_a_frame_{len(roll)}", hills, gqm.RotatingFrame(Omega="7/10"))
    lam0, v0 = np.linspace(-1.9, -1.3, 7), np.linspace(2.0, 9.0, 7)
    swept = module.sweep("t_end", lam0, v0, 1, contact="above", t_max=2.0)
    assert swept.route_counts() == {"single": 7}
    motions = [module.solve(*launch, 1, contact="above", t_max=2.0) for launch in zip(lam0, v0, strict=True)]
    assert 1 <= (swept.values < 2.0).sum() <= 6
    assert swept.values == pytest.approx([motion.t_end for motion in motions], rel=1e-13)
