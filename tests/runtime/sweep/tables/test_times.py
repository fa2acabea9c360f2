"""Sweeps along curves without formulas agree with closed forms, quadrature of the definition, and single motions."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from mpmath import mp, mpf
from railed import built

import gqm_sym as gqm
from gqm_sym.runtime.sweep.groups import tabulated
from gqm_sym.runtime.sweep.quantities import STATUS_SENTENCES

with mp.workdps(40):
    G = mpf("9.81")

# The tolerance of half periods is twice the distance from 1 to the next double, relative.
TWO_ULPS = 2.0 * 2.0**-52

# The relative tolerance of times and loads on a rail whose parts are given in doubles.
ROUNDING = 2e-15


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a ring of radius 1 as an implicit curve; arc length is the angle from its lowest place."""
    curve = gqm.Curve.implicit("x**2 + z**2 - 1", start=(0, -1))
    return gqm.build(gqm.derive(curve, gqm.Gravity()), name="implicit_ring", folder=tmp_path_factory.mktemp("ring"))


@pytest.fixture(scope="module")
def bend(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return two inclines at 45 degrees, tangent to an arc between them."""
    pieces = [gqm.line(length=3), gqm.arc(radius="R", angle="pi/2"), gqm.line(length=3)]
    return built(tmp_path_factory.mktemp("bend"), "bend", pieces, start=(0, 0), heading="-pi/4")


@pytest.fixture(scope="module")
def track(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a spline of degree 5 through 61 points."""
    x = np.linspace(-2, 2, 61)
    curve = gqm.Curve.sampled(np.column_stack([x, 0.5 * x * x + 0.01 * np.cos(3 * x)]))
    return gqm.build(gqm.derive(curve, gqm.Gravity()), name="measured", folder=tmp_path_factory.mktemp("measured"))


def _half_period_on_bend(distance: float, radius: float) -> tuple[mpf, mpf]:
    """Return the half period of a body released at a distance from the arc, and V**2 in the middle of the arc."""
    with mp.workdps(30):
        d, r, root = mpf(distance), mpf(radius), mp.sqrt(2) / 2
        fall = 2 * G * d * root
        most = fall + 2 * G * r * (1 - root)
        arc = 4 * r / mp.sqrt(most) * mp.ellipf(mp.pi / 8, 4 * G * r / most)
        return 2 * mp.sqrt(2 * d / (G * root)) + arc, most


def test_half_periods_on_a_ring(ring: ModuleType) -> None:
    """Half periods on a ring agree with the pendulum's closed form, and so do times of rounds."""
    amplitude = np.random.default_rng(3).uniform(1e-3, 2.5, 100)
    swept = ring.sweep("half_period", amplitude)
    assert swept.route_counts() == {"single": 100}
    for value, a in zip(swept.values, amplitude, strict=True):
        with mp.workdps(30):
            truth = 2 * mp.ellipk(mp.sin(mpf(a) / 2) ** 2) / mp.sqrt(G)
        assert abs(mpf(value) - truth) <= TWO_ULPS * value
    speed = np.linspace(7.0, 20.0, 9)
    for value, v in zip(ring.sweep("period", 0.0, speed).values, speed, strict=True):
        assert float(value) == pytest.approx(float(4 * mp.ellipk(4 * G / mpf(v) ** 2) / mpf(v)), rel=ROUNDING)


@pytest.mark.extended
def test_half_periods_of_a_ball_on_a_track_of_short_pieces(tmp_path: Path) -> None:
    """The path of a ball's centre depends on the curvature of the track, of which a chart of 200 pieces has few digits;
    half periods are those that `solve` rounds correctly.
    """
    x = np.linspace(-2, 2, 201)
    curve = gqm.Curve.sampled(np.column_stack([x, 0.5 * x * x + 0.01 * np.cos(3 * x)]))
    module = gqm.build(
        gqm.derive(curve, gqm.Gravity() + gqm.Rolling(radius="1/20", beta="2/5")), name="ball", folder=tmp_path
    )
    places = np.random.default_rng(8).uniform(3.3, 4.8, 60)
    swept = module.sweep("half_period", places).values
    truth = np.array([module.solve(place).half_period for place in places.tolist()])
    assert (np.abs(swept - truth) <= 2.0 * np.spacing(truth)).all()


def test_times_on_a_rail_with_joints(bend: ModuleType) -> None:
    """Panels begin where the curvature jumps; places on both inclines are passed at the times of uniform
    acceleration.
    """
    places = np.random.default_rng(4).uniform(0.05, 2.9, 60)
    radius = np.where(np.arange(60) % 2, 1.0, 0.25)  # two curves in one sweep
    half, ends = bend.sweep("half_period", places, R=radius), bend.sweep("turning_points", places, R=radius)
    assert not half.status.any()
    there = places + 0.5 * (3.0 - places)
    arrival = bend.sweep("time_at", places, lam=there, R=radius)
    for k, place in enumerate(places.tolist()):
        truth, _ = _half_period_on_bend(3.0 - place, float(radius[k]))
        assert float(half.values[k]) == pytest.approx(float(truth), rel=ROUNDING)
        length = 6.0 + np.pi / 2 * radius[k]
        assert list(ends.values[k]) == pytest.approx([place, length - place], rel=ROUNDING)
        assert arrival.values[k] == pytest.approx(float(mp.sqrt((there[k] - place) * 4 / (G * mp.sqrt(2)))), rel=4e-15)


def _time_round_a_quarter(g: mpf, drop: mpf) -> mpf:
    """Return the time for a quarter of a circle of radius 3, after a given fall along a wall, to the floor."""
    return mp.quad(lambda angle: 3 / mp.sqrt(2 * g * (drop + 3 * mp.sin(angle))), [0, mp.pi / 4, mp.pi / 2])


def test_a_turning_point_beside_a_joint(bend: ModuleType) -> None:
    """Next to the joint V**2 has a branch point on the panel behind it, which slows the convergence of dt/dphi."""
    places = np.array([2.9, 2.99, 2.996, 2.9996, 2.99999, 2.999999, 2.9999999, 2.99999998])
    swept = bend.sweep("half_period", places, R=3)
    assert swept.route_counts() == {"single": len(places)}
    for place, value in zip(places.tolist(), swept.values, strict=True):
        truth, _ = _half_period_on_bend(3.0 - place, 3.0)
        assert abs(mpf(value) - truth) <= TWO_ULPS * value
        with mp.workprec(53):
            assert bend.solve(place, R=3).half_period == float(+truth)


def test_bodies_that_run_off_the_end(tmp_path: Path) -> None:
    """Bodies run down a wall, through a quarter of a circle and along the floor, or up the wall and over its top."""
    pieces = [gqm.line(length=1), gqm.arc(radius=3, angle="pi/2"), gqm.line(length=4)]
    module = built(tmp_path, "wall", pieces, start=(0, 0), heading="-pi/2")
    rng, count = np.random.default_rng(8), 40
    place, g = rng.uniform(0.05, 0.95, count), rng.uniform(5, 15, count)
    speed, sense = rng.uniform(0.2, 3, count) * (np.arange(count) % 4 > 0), 1 - 2 * (np.arange(count) % 3 == 1)
    launch, floor = (place, speed, sense), 1 + 1.5 * np.pi + 2
    swept = {
        what: module.sweep(what, *launch, g=g, **({"lam": floor} if what == "time_at" else {}))
        for what in ("t_end", "time_at", "v_max", "v_min", "normal_force_max", "half_period")
    }
    assert all(one.route_counts() == {"single": count} for one in swept.values())
    assert set(swept["half_period"].status) == {2}
    low = module.sweep("t_end", 1 + 1.5 * np.pi * np.array([0.6, 0.9, 0.99]))  # the arc's slope vanishes where it ends
    assert low.route_counts() == {"single": 3}
    for value, share in zip(low.values, (0.6, 0.9, 0.99), strict=True):
        angle = mp.pi / 2 * (1 - mpf(share))
        k = mp.sin(angle / 2)
        truth = mp.sqrt(3 / G) * mp.ellipk(k**2) + 4 / (2 * k * mp.sqrt(3 * G))
        assert float(value) == pytest.approx(float(truth), rel=4e-15)
    over = 0
    for k in range(count):
        s, v, a = mpf(place[k]), mpf(speed[k]), mpf(g[k])
        falls, turns = sense[k] > 0 or v == 0, v * v < 2 * a * s
        end, middle, fastest, slowest = (v - mp.sqrt(abs(v * v - 2 * a * s))) / a, None, v, 0
        if falls or turns:
            drop = 1 - s + v * v / (2 * a)
            arc = _time_round_a_quarter(a, drop)
            fastest, slowest = mp.sqrt(2 * a * (drop + 3)), v if falls else 0
            end = mp.sqrt(2 * drop / a) + (-v if falls else v) / a + arc + 4 / fastest
            middle = end - 2 / fastest
            assert swept["normal_force_max"].values[k] == pytest.approx(float(a + fastest**2 / 3), rel=ROUNDING)
        else:
            slowest, over = mp.sqrt(v * v - 2 * a * s), over + 1
        for what, truth in {"t_end": end, "time_at": middle, "v_max": fastest, "v_min": slowest}.items():
            if truth is None:
                assert swept[what].status[k] == STATUS_SENTENCES.index("the motion is never at the place asked for")
            else:
                assert swept[what].values[k] == pytest.approx(float(truth), rel=4e-15)
    assert over > 0


def test_extremes_on_a_rail_with_joints(bend: ModuleType) -> None:
    """N jumps where the arc begins; its smallest value is on the inclines, and its largest in the middle of the arc."""
    places = np.linspace(0.05, 2.9, 25)
    largest, least = bend.sweep("normal_force_max", places, R=1), bend.sweep("normal_force_min", places, R=1)
    fastest = bend.sweep("v_max", places, R=1)
    assert largest.route_counts() == {"single": 25}
    for k, place in enumerate(places.tolist()):
        _, v2 = _half_period_on_bend(3.0 - place, 1.0)
        assert largest.values[k] == pytest.approx(float(G + v2), rel=ROUNDING)
        assert least.values[k] == pytest.approx(float(G) / np.sqrt(2.0), rel=ROUNDING)
        assert fastest.values[k] == pytest.approx(float(mp.sqrt(v2)), rel=ROUNDING)


def test_extremes_and_arrivals_on_a_ring(ring: ModuleType) -> None:
    """In both directions N is 3 g cos(s) - 2 g + V0**2, and arrivals agree with the incomplete elliptic integral."""
    for lam0, sense, ahead in ((0.3, 1, 9.0), (-2.0, -1, 3.1), (3.0, 1, 0.4)):
        w0 = 9.0**2 - 2 * float(G) * (1 - np.cos(lam0))
        launch = (lam0, np.sqrt(w0), sense)
        assert ring.sweep("v_max", *launch).values == pytest.approx(9.0, rel=ROUNDING)
        assert ring.sweep("v_min", *launch).values == pytest.approx(np.sqrt(81 - 4 * float(G)), rel=ROUNDING)
        assert ring.sweep("normal_force_max", *launch).values == pytest.approx(float(G) + 81.0, rel=ROUNDING)
        place = lam0 + sense * ahead
        first, last = sorted((lam0 / 2, place / 2))
        with mp.workdps(30):
            modulus = 4 * G / 81
            truth = 2 * (mp.ellipf(mpf(last), modulus) - mp.ellipf(mpf(first), modulus)) / 9
        assert ring.sweep("time_at", *launch, lam=place).values == pytest.approx(float(truth), rel=4e-15)


@pytest.mark.parametrize("implicit", [True, False])
def test_where_a_body_leaves_a_ring(implicit: bool, ring: ModuleType, module_of: Callable[[str], ModuleType]) -> None:
    """Thrown up inside a ring a body leaves where 3 cos(s) = 2 - V0**2/g; a slower one swings, and a faster one
    stays.
    """
    share = np.array([1.0, 2.2, 3.0, 4.9, 5.1])  # V0**2 as a multiple of g
    speed = np.sqrt(share * float(G))
    sweep = ring.sweep if implicit else lambda *args, **given: module_of("circle").sweep(*args, L=1, **given)
    swept = sweep("t_end", 0.0, speed, contact="above")
    assert swept.route_counts() == {"single": 5}
    assert np.isnan(swept.values).tolist() == [True, False, False, False, True]
    for k in (1, 2, 3):
        v0 = mpf(speed[k])
        with mp.workdps(30):
            place = mp.acos((2 - v0**2 / G) / 3)
            truth = 2 * mp.ellipf(place / 2, 4 * G / v0**2) / v0
            on_way = 2 * mp.ellipf(mpf(float(place) / 2) / 2, 4 * G / v0**2) / v0
        assert swept.values[k] == pytest.approx(float(truth), rel=1e-13)
        arrivals = sweep("time_at", 0.0, speed[k], lam=np.array([0.5, 1.01]) * float(place), contact="above")
        assert arrivals.route_counts() == {"single": 2}  # the second place is beyond that where contact is lost
        assert arrivals.values == pytest.approx([float(on_way), np.nan], rel=1e-13, nan_ok=True)
        cut = sweep("t_end", 0.0, speed[k], contact="above", t_max=0.9 * float(truth))
        assert cut.values == pytest.approx(0.9 * float(truth))
    assert sweep("half_period", 0.0, speed, contact="above").status_counts() == {STATUS_SENTENCES[2]: 4}
    assert sweep("t_end", 0.0, speed, contact="below").values.tolist() == [0.0] * 5
    every_other = np.repeat(0.0, 10)[::2]
    assert np.array_equal(sweep("t_end", every_other, speed, contact="above").values, swept.values, equal_nan=True)


@pytest.mark.extended
def test_rolling_in_a_hoop(tmp_path: Path) -> None:
    """The centre of a ball swings as a pendulum of length L - rho and inertia 1 + beta; a ball too large is refused."""
    model = gqm.derive(gqm.families.circle(L="L"), gqm.Gravity() + gqm.Rolling(beta="2/5", radius="rho"))
    module = gqm.build(model, name="hoop", folder=tmp_path)
    amplitude, radius = np.linspace(0.1, 2.5, 12), np.linspace(0.05, 0.5, 12)
    for value, a, rho in zip(
        module.sweep("half_period", amplitude, L=1, rho=radius).values, amplitude, radius, strict=True
    ):
        truth = 2 * mp.ellipk(mp.sin(mpf(a) / 2) ** 2) * mp.sqrt((1 - mpf(rho)) * mpf(7) / 5 / G)
        assert float(value) == pytest.approx(float(truth), rel=ROUNDING)
    swept = module.sweep("half_period", amplitude[:2], L=1, rho=[0.5, 1.5])
    assert swept.status.tolist() == [0, STATUS_SENTENCES.index("the launch is refused; solve says why")]


@pytest.mark.extended
def test_fastest_place_beside_the_launch(tmp_path: Path) -> None:
    """On an ellipse a ball launched beside the lowest place is fastest behind its launch, as its energy says."""
    ellipse = gqm.Curve.parametric(x="2*cos(u)", z="sin(u)", parameter="u", period="2*pi")
    force = gqm.Gravity() + gqm.Rolling(beta="2/5", radius="rho")
    module = gqm.build(gqm.derive(ellipse, force), name="ellipse_ball", folder=tmp_path)
    for lam0, sense in ((-1.5528, 1), (-1.5888, -1)):
        root = np.sqrt(np.cos(lam0) ** 2 + 4 * np.sin(lam0) ** 2)
        height = 1.0 + np.sin(lam0) - 0.05 * (1.0 + 2 * np.sin(lam0) / root)
        swept = module.sweep("v_max", lam0, 6.0, sense, rho=0.05)
        assert float(swept.values) == pytest.approx(np.sqrt(36.0 + 2 * float(G) * height / 1.4), rel=ROUNDING)
        assert swept.route_counts() == {"single": 1}


def test_a_place_far_away_does_not_stop_a_sweep(module_of: Callable[[str], ModuleType]) -> None:
    """Where doubles do not resolve places there is no answer; the other launches have theirs."""
    swept = module_of("circle").sweep("half_period", [1e17, 1e15, 0.5], L=1)
    assert np.isnan(swept.values).tolist() == [True, True, False]


def test_parameters_of_every_launch(bend: ModuleType) -> None:
    """Every launch has its own parameters; if one set gives no rail, only that launch is refused."""
    mass, radius = np.linspace(1.0, 20.0, 12), np.where(np.arange(12) == 5, -1.0, 0.5)
    swept, good = bend.sweep("half_period", 1.0, m=mass, R=radius), np.arange(12) != 5
    assert np.array_equal(swept.values[good], np.full(11, bend.sweep("half_period", 1.0, R=0.5).values))
    assert np.flatnonzero(swept.status).tolist() == [5]


@pytest.mark.extended
@pytest.mark.parametrize("kind", ["rail", "implicit", "sampled"])
def test_forces_of_every_launch_share_a_table(kind: str, tmp_path: Path) -> None:
    """Launches with their own g, Omega and m are answered as by `solve`, from one table, alone or with others."""
    x = np.linspace(-2, 2, 41)
    curve = {
        "rail": gqm.Curve.piecewise(
            [gqm.line(length=1), gqm.arc(radius=2, angle="pi/2"), gqm.line(length=1)], heading="-pi/4"
        ),
        "implicit": gqm.Curve.implicit("x**4 + z**4 - x*z/5 - 1", start=(0, -1)),
        "sampled": gqm.Curve.sampled(np.column_stack([x, 0.5 * x * x + 0.01 * np.cos(3 * x)])),
    }[kind]
    module = gqm.build(gqm.derive(curve, gqm.Gravity() + gqm.RotatingFrame()), name=f"shared_{kind}", folder=tmp_path)
    rng, count = np.random.default_rng(7), 12
    middle = module.equilibria(Omega=0.3)[-1].lam
    given = {"g": rng.uniform(5, 20, count), "Omega": rng.uniform(-0.9, 0.9, count), "m": rng.uniform(0.5, 2, count)}
    launch = (middle + rng.uniform(-0.9, 0.9, count), rng.uniform(0, 1.5, count) * (rng.random(count) < 0.5))
    made = tabulated.cache_info().misses
    swept, force = (module.sweep(what, *launch, **given) for what in ("half_period", "normal_force_max"))
    assert tabulated.cache_info().misses == made + 1
    assert swept.route_counts() == {"single": count}
    for k in range(count):
        here = {name: float(values[k]) for name, values in given.items()}
        motion = module.solve(launch[0][k], launch[1][k], **here)
        assert bool(swept.status[k]) == (motion.kind != "libration")
        if motion.kind == "libration":
            assert abs(swept.values[k] - motion.half_period) <= TWO_ULPS * motion.half_period
        assert force.values[k] == pytest.approx(motion.normal_force_max.value, rel=ROUNDING)
        alone = module.sweep("half_period", launch[0][k], launch[1][k], **here)
        assert np.array_equal(alone.values, swept.values[k], equal_nan=True)


def _largest_force(k: mpf, x0: float, z0: float) -> mpf:
    """Return the largest N on x**4 + z**4 - x*z/5 = 1 about its lower side, after a start from rest at (x0, z0).

    In addition to gravity a spring of stiffness k pulls a body of 1 kg towards (1, 2).
    """

    def negative_slope(x: mpf) -> mpf:
        return -mp.diff(force, x)

    def force(x: mpf) -> mpf:
        z = mp.findroot(lambda z: x**4 + z**4 - x * z / 5 - 1, z0)
        fx, fz, fxx, fxz, fzz = 4 * x**3 - z / 5, 4 * z**3 - x / 5, 12 * x**2, -mpf(1) / 5, 12 * z**2
        size = mp.sqrt(fx * fx + fz * fz)
        kappa = (fxx * fz**2 - 2 * fxz * fx * fz + fzz * fx**2) / size**3
        fall = G * (z0 - z) + k / 2 * ((x0 - 1) ** 2 + (z0 - 2) ** 2 - (x - 1) ** 2 - (z - 2) ** 2)
        return 2 * kappa * fall - (k * (x - 1) * fx + (G + k * (z - 2)) * fz) / size

    with mp.workdps(40):
        x0, z0 = mpf(x0), mpf(z0)
        return force(mp.findroot(negative_slope, x0 - mpf("0.04")))


@pytest.mark.extended
def test_the_largest_force_on_a_small_swing(tmp_path: Path) -> None:
    """If the samples of a panel are far from the peak, parabolas follow it."""
    curve = gqm.Curve.implicit("x**4+z**4-x*z/5-1", start=(0, -1))
    force = gqm.Gravity() + gqm.Potential("k*((x-1)**2+(z-2)**2)/2")
    module = gqm.build(gqm.derive(curve, force), name="pulled", folder=tmp_path)
    places = np.array([0.3019884852508021, 0.3211793244158188, 0.3349973888307294])
    swept = module.sweep("normal_force_max", places, k=0.7)
    for value, place in zip(swept.values, places.tolist(), strict=True):
        motion = module.solve(place, k=0.7)
        truth = float(_largest_force(mpf(7) / 10, motion.state(0.0).x, motion.state(0.0).z))
        assert value == pytest.approx(truth, rel=1e-14)
        assert motion.normal_force_max.value == pytest.approx(truth, rel=1e-14)


def _half_period_in_a_flat_well(lam0: float, a: mpf, b: mpf) -> mpf:
    """Return the half period after a start from rest at an arc length from the lowest place of (x/a)**4 + (z/b)**4 =
    1.
    """

    def height(x: mpf) -> mpf:
        return (1 - (x / a) ** 4) ** mpf("0.25")

    def speed(x: mpf) -> mpf:
        return mp.sqrt(1 + (b * x**3 / a**4 / height(x) ** 3) ** 2)

    def time(phi: mpf) -> mpf:
        p, q = height(x0), height(x0 * mp.sin(phi))
        fall = 2 * G * b * (1 + mp.sin(phi) ** 2) / ((p + q) * (p * p + q * q))
        return speed(x0 * mp.sin(phi)) * a**2 / x0 / mp.sqrt(fall)

    x0 = mp.findroot(lambda x: mp.quad(speed, [0, x]) - lam0, lam0)
    return 2 * mp.quad(time, [0, mp.pi / 4, mp.pi / 2])


@pytest.mark.extended
def test_small_swings_in_a_flat_well(tmp_path: Path) -> None:
    """V**2 grows as the fourth power of the amplitude, and is far below its range on a panel."""
    curve = gqm.Curve.implicit("(x/a)**4 + (z/b)**4 - 1", start=(0, "-b"))
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="flat_well", folder=tmp_path)
    size, places = {"a": 3.211745185445401, "b": 0.9}, np.array([4e-3, 0.0068, 0.01, 0.0214, 0.1, 0.5])
    half = module.sweep("half_period", places, **size)
    assert half.route_counts() == {"single": len(places)}
    ends = module.sweep("turning_points", places, **size).values
    assert ends[:, 0] == pytest.approx(-places, rel=2e-14)
    arrival = module.sweep("time_at", places, lam=0.0, **size).values
    for place, value, quarter in zip(places.tolist(), half.values, arrival, strict=True):
        with mp.workdps(25):
            truth = _half_period_in_a_flat_well(place, mpf(size["a"]), mpf(size["b"]))
        assert float(value) == pytest.approx(float(truth), rel=2e-14)
        assert float(quarter) == pytest.approx(float(truth / 2), rel=2e-14)


def test_small_swings_beside_an_edge_of_a_piece(tmp_path: Path) -> None:
    """Speeds, turning points and arrivals have all digits, however small the swing is."""
    curve = gqm.Curve.implicit("x**2 + z**2 - 1", start=("3/5", "-4/5"))
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="ring_from_its_side", folder=tmp_path)
    with mp.workdps(30):
        bottom = -mp.asin(mpf(3) / 5)
        places = float(bottom) + 10.0 ** np.random.default_rng(5).uniform(-5, 0, 40)
        there = float(bottom) + 0.5 * (places - float(bottom))
        fastest, arrival = module.sweep("v_max", places), module.sweep("time_at", places, lam=there)
        ends = module.sweep("turning_points", places).values[:, 0]
        assert fastest.route_counts() == arrival.route_counts() == {"single": 40}
        for k, place in enumerate(places.tolist()):
            amplitude, angle = mpf(place) - bottom, mpf(float(there[k])) - bottom
            share = mp.sin(amplitude / 2)
            time = mp.ellipk(share**2) - mp.ellipf(mp.asin(mp.sin(angle / 2) / share), share**2)
            assert float(fastest.values[k]) == pytest.approx(float(2 * mp.sqrt(G) * share), rel=4e-15)
            assert float(arrival.values[k]) == pytest.approx(float(time / mp.sqrt(G)), rel=4e-15)
            assert abs(mpf(float(ends[k])) - (bottom - amplitude)) <= 2.0**-52


@pytest.mark.extended
def test_the_largest_speed_of_small_swings(tmp_path: Path) -> None:
    """On the loop of a strophoid, r = -a*cos(2*t)/cos(t) in polar coordinates about its node, the largest speed is
    right.
    """
    curve = gqm.Curve.implicit("x**2*(a - z) - z**2*(a + z)", start=("-a/(2*sqrt(3))", "-a/2"), tangent=-1)
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="swings_on_a_strophoid", folder=tmp_path)
    with mp.workdps(30):

        def speed(t: mpf) -> mpf:
            slope = 2 * mp.sin(2 * t) * mp.tan(t) - mp.cos(2 * t) / mp.cos(t) ** 2
            return mp.sqrt(slope**2 + 4 * mp.sin(2 * t) ** 2)

        def length(t: mpf) -> mpf:
            return mp.quad(speed, [0, t])

        below = length(mp.pi / 6)
        places = -float(below) + np.array([1e-4, -1e-4, 1e-3, -1e-3, 1e-2, 0.3])
        swept = module.sweep("v_max", places, a=1)
        assert swept.route_counts() == {"single": len(places)}
        for place, value in zip(places.tolist(), swept.values, strict=True):
            way = abs(mpf(place) + below)
            top = mp.findroot(lambda t, way=way: length(t) - way, way)
            truth = 2 * mp.sqrt(G) * mp.sin(top)
            assert float(value) == pytest.approx(float(truth), rel=4e-15)


def test_half_periods_on_a_measured_track(track: ModuleType) -> None:
    """Half periods over dozens of pieces agree with `solve`, which uses extended precision."""
    rng, bottom = np.random.default_rng(6), track.equilibria()[0].lam
    places = np.append(rng.uniform(3.3, 4.8, 16), bottom + 10.0 ** rng.uniform(-5, -1, 8))
    swept = track.sweep("half_period", places)
    assert swept.route_counts() == {"single": 24}
    for value, place in zip(swept.values, places.tolist(), strict=True):
        exact = track.solve(place).half_period
        assert abs(value - exact) <= TWO_ULPS * exact


def test_a_launch_from_rest_at_an_edge_of_a_panel(tmp_path: Path) -> None:
    """The body reaches the bottom after a quarter of a period, from either side; the table has edges at all 1/16."""
    curve = gqm.Curve.graph("x**2", parameter="x", domain=(-2, 2))
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="launch_at_edge", folder=tmp_path)
    places = np.array([-1.25, -0.5, 0.5, 1.0, 1.25])
    found = module.sweep("time_at", places, 0.0, lam=0.0, contact="above").values
    known = [0.5 * module.solve(place, 0.0).half_period for place in places.tolist()]
    np.testing.assert_allclose(found, known, rtol=2e-15)


def test_bodies_that_rest_on_a_level_line(tmp_path: Path) -> None:
    """A body released on the floor of a half pipe stays: it has a contact force and no period, and is nowhere else."""
    pieces = [gqm.arc(radius=3, angle="pi/2"), gqm.line(length=4), gqm.arc(radius=3, angle="pi/2")]
    module, places = (
        built(tmp_path, "floor", pieces, start=(-5, 4), heading="-pi/2"),
        1.5 * np.pi + np.array([0.1, 2.0]),
    )
    never, not_periodic = (
        STATUS_SENTENCES.index("the motion is never at the place asked for"),
        STATUS_SENTENCES.index("the motion is not of a kind that has this quantity"),
    )
    for contact in ("bilateral", "above"):
        values = {"v_max": 0.0, "v_min": 0.0, "normal_force_min": 9.81, "normal_force_max": 9.81}
        for name, value in values.items():
            swept = module.sweep(name, places, contact=contact)
            assert swept.route_counts() == {"single": 2}
            assert swept.values == pytest.approx(value, rel=2.0 * TWO_ULPS)
        for name in ("half_period", "period", "turning_points", "t_end"):
            swept = module.sweep(name, places, contact=contact)
            assert (swept.route_counts(), swept.status.tolist()) == ({"single": 2}, [not_periodic] * 2)
            assert np.isnan(swept.values).all()
        swept = module.sweep("time_at", places, lam=places[0], contact=contact)
        assert (swept.route_counts(), swept.status.tolist()) == ({"single": 2}, [0, never])
        assert swept.values[0] == 0.0
        assert module.sweep("t_end", places, t_max=3, contact=contact).values.tolist() == [3.0, 3.0]


def test_bodies_at_rest_under_a_level_line(tmp_path: Path) -> None:
    """A track that can only hold down does not hold a body released on its floor: the body leaves at once."""
    pieces = [gqm.arc(radius=3, angle="pi/2"), gqm.line(length=4), gqm.arc(radius=3, angle="pi/2")]
    module = built(tmp_path, "ceiling", pieces, start=(-5, 4), heading="-pi/2")
    places = 1.5 * np.pi + np.array([0.1, 2.0])
    for t_max in (None, 3.0):
        given = {"contact": "below", "t_max": t_max}
        for name, value in {"t_end": 0.0, "v_max": 0.0, "normal_force_max": 9.81}.items():
            swept = module.sweep(name, places, **given)
            assert swept.route_counts() == {"single": 2}
            assert swept.values == pytest.approx(value, rel=2.0 * TWO_ULPS)
        swept = module.sweep("time_at", places, lam=places[0], **given)
        assert (swept.route_counts(), swept.values[0]) == ({"single": 2}, 0.0)
        assert np.isnan(swept.values[1])
        assert np.isnan(module.sweep("half_period", places, **given).values).all()
