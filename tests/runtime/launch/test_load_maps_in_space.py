"""Load maps of space curves have the contact force as a vector, with all digits also next to a launch from rest."""

import json
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf
from naive import ulps
from paths import DATA

import generated.viviani
import gqm_sym as gqm
from gqm_sym.runtime.launch.speed import BLOCK

# The tolerances relative to the largest contact force: of the rows, worst measured 3.5e-16, and of its length, worst
# measured 5.1e-16.
SCALE, OF_LENGTH = 4e-16, 8e-16
LAUNCH = 0.4

ROWS = {row["name"]: row for row in json.loads((DATA / "space_curves.json").read_text(encoding="utf-8"))}
U = sp.Symbol("u", real=True)


def exact(u: float, v0: float) -> list[mpf]:
    """Return y and the contact force on Viviani's curve (a = 1, g = 9.81, m = 1) from its derivatives."""
    with mp.workdps(40):
        at, half, g = mpf(u), mpf(u) / 2, mpf("9.81")
        first = [-mp.sin(at), mp.cos(at), mp.cos(half)]
        second = [-mp.cos(at), -mp.sin(at), -mp.sin(half) / 2]
        w = mpf(v0) ** 2 - 4 * g * (mp.sin(half) - mp.sin(mpf(LAUNCH) / 2))
        size = mp.sqrt(sum(a * a for a in first))
        ahead = [a / size for a in first]
        along = sum(a * b for a, b in zip(ahead, second, strict=True))
        bend = [(b - a * along) / size**2 for a, b in zip(ahead, second, strict=True)]
        up = [mpf(0), mpf(0), mpf(1)]
        force = [w * k + g * (e - ahead[2] * a) for k, e, a in zip(bend, up, ahead, strict=True)]
        return [mp.sin(at), *force]


@pytest.mark.parametrize("v0", [0.0, 1e-3, 9.0])
def test_the_contact_force_along_each_axis(v0: float) -> None:
    """Far from the launch and next to it, y and the contact force are those of the curve's derivatives."""
    random = np.random.default_rng(5)
    gaps = 10.0 ** random.uniform(-14, 0, 60) * random.choice([-1, 1], 60)
    lam = np.concatenate([random.uniform(-6, 6, 60), LAUNCH + gaps])
    path = generated.viviani.pass1(lam, LAUNCH, v0)
    found = np.array([path.y, path.normal_x, path.normal_y, path.normal_z])
    true = np.array([[float(value) for value in exact(u, v0)] for u in lam.tolist()]).T
    size = np.linalg.norm(true[1:], axis=0)
    assert np.all(np.abs(found - true) < SCALE * size.max())
    assert path.normal_force == pytest.approx(size, abs=OF_LENGTH * size.max(), rel=0)


@pytest.mark.extended
@pytest.mark.parametrize("v0", [0.0, 9.0])
def test_the_contact_force_in_a_frame_that_turns(v0: float, tmp_path: Path) -> None:
    """The Coriolis part has the sign of the direction of launch, and from rest that of the side of the launch."""
    curve = gqm.Curve.space(x="1 + cos(u)", y="sin(u)", z="2*sin(u/2)", parameter="u")
    module = gqm.build(
        gqm.derive(curve, gqm.Gravity() + gqm.RotatingFrame(Omega="3/2")), name="turning_map", folder=tmp_path
    )
    lam = np.concatenate([LAUNCH + np.linspace(-3.0, 3.0, BLOCK + 8), [LAUNCH]])
    with mp.workdps(40):
        spin, g, height = mpf("1.5"), mpf("9.81"), sp.Symbol("z")
        potential = sp.Rational(981, 100) * height - sp.Rational(9, 8) * (sp.Symbol("x") ** 2 + sp.Symbol("y") ** 2)
        coordinates = [1 + sp.cos(U), sp.sin(U), 2 * sp.sin(U / 2)]
        start = mpf(LAUNCH)
        still = np.array(by_definition(coordinates, potential, lam.tolist(), mpf(v0) ** 2, start))

        def half(u: float) -> mpf:
            return g * 2 * mp.sin(mpf(u) / 2) - spin**2 * (1 + mp.cos(u))

        true = []
        for u, force in zip(lam.tolist(), still, strict=True):
            v2 = max(mpf(v0) ** 2 - 2 * (half(u) - half(LAUNCH)), mpf(0))
            way = 1 if v0 else mp.sign(mpf(u) - start)
            size = mp.sqrt(1 + mp.cos(mpf(u) / 2) ** 2)
            aside = 2 * spin * way * mp.sqrt(v2) / size
            true.append([float(force[0] - aside * mp.cos(u)), float(force[1] - aside * mp.sin(u)), float(force[2])])
    path, reachable = module.pass1(lam, LAUNCH, v0), module.pass1(lam, LAUNCH, v0).v2 >= 0.0
    found = np.array([path.normal_x, path.normal_y, path.normal_z]).T[reachable]
    size = np.linalg.norm(np.array(true)[reachable], axis=1)
    # Next to a launch from rest the square root of V**2 has half the digits of the place.
    assert np.all(np.abs(found - np.array(true)[reachable]) < 2e-15 * size.max())
    assert path.normal_force[reachable] == pytest.approx(size, rel=4e-15)


def test_rows_do_not_depend_on_their_neighbours() -> None:
    """A place has the same numbers alone and among others, whether their V**2 comes by difference or not."""
    lam = np.concatenate([np.linspace(-1, 3, BLOCK + 9), [LAUNCH], LAUNCH + np.linspace(0, 1e-3, BLOCK)])
    together = np.array(generated.viviani.pass1(lam, LAUNCH, 0.0))
    alone = np.array([generated.viviani.pass1(u, LAUNCH, 0.0) for u in lam.tolist()])
    assert np.array_equal(together, alone.T)
    filled = generated.viviani.pass1(lam, LAUNCH, 0.0, out=[np.empty(lam.size) for _ in together])
    assert np.array_equal(together, filled)


def by_definition(
    coordinates: list[sp.Expr], potential: sp.Expr, lam: list[float], w0: mpf, start: mpf
) -> list[list[mpf]]:
    """Return the contact force at places, from the derivatives of the coordinates and of the potential (m = 1)."""
    axes = sp.symbols("x y z")
    along = dict(zip(axes, coordinates, strict=True))
    forms = [*(sp.diff(form, U) for form in coordinates), *(sp.diff(form, U, 2) for form in coordinates)]
    forms += [*(sp.diff(potential, axis).xreplace(along) for axis in axes), potential.xreplace(along)]
    call = sp.lambdify(U, forms, "mpmath")
    with mp.workdps(40):
        rows, level = [], call(start)[9]
        for place in lam:
            values = call(mpf(place))
            rate, bend, pull, w = values[:3], values[3:6], values[6:9], w0 - 2 * (values[9] - level)
            square = mp.fdot(rate, rate)
            across = [[a - r * mp.fdot(rate, v) / square for a, r in zip(v, rate, strict=True)] for v in (bend, pull)]
            rows.append([w * k / square + f for k, f in zip(*across, strict=True)])
    return rows


@pytest.mark.extended
@pytest.mark.parametrize("name", ["trefoil", "torus_knot", "saddle", "bowl_spiral", "catenary_weave", "tilted_ring"])
def test_the_vector_of_sines_of_multiples(name: str, tmp_path: Path) -> None:
    """The contact force has all digits where sines of many multiples of the parameter would add up to it."""
    row = ROWS[name]
    module = gqm.build(
        gqm.derive(gqm.Curve.space(**dict(zip("xyz", row["curve"], strict=True)), parameter="u"), gqm.Gravity()),
        name=name,
        folder=tmp_path,
    )
    lam0, v0 = row["launch"]["lam0"], row["launch"]["v0"]
    ends = module.solve(lam0, v0).turning_points or (0.0, 6.28)
    lam = np.random.default_rng(3).uniform(min(ends), max(ends), 100)
    path = module.pass1(lam, lam0, v0)
    coordinates = [sp.sympify(form, locals={"u": U}) for form in row["curve"]]
    start, w0 = sp.Rational(lam0), sp.Rational(v0) ** 2
    with mp.workdps(40):
        weight = sp.Rational(981, 100) * sp.Symbol("z")
        exact = by_definition(coordinates, weight, lam.tolist(), mpf(w0.p) / w0.q, mpf(start.p) / start.q)
        found = zip(path.normal_x.tolist(), path.normal_y.tolist(), path.normal_z.tolist(), strict=True)
        errors = [[float(abs(a - b)) for a, b in zip(*pair, strict=True)] for pair in zip(found, exact, strict=True)]
        size = max(float(mp.norm(force)) for force in exact)
    assert np.max(errors) < SCALE * size


@pytest.mark.extended
def test_angles_are_not_rounded(tmp_path: Path) -> None:
    """Coordinates keep their last place where the angle is a large multiple of the parameter, with a phase or none."""
    curve = gqm.Curve.space(x="cos(k*u)", y="sin(1001*u + 1)", z="u", parameter="u", parameters={"k": "733"})
    path = gqm.build(gqm.derive(curve, gqm.Gravity()), name="fast_turns", folder=tmp_path).pass1(
        lam := np.random.default_rng(1).uniform(-7, 7, 200), 0.0, 1.0
    )
    with mp.workdps(40):
        for u, x, y in zip(lam.tolist(), path.x.tolist(), path.y.tolist(), strict=True):
            assert ulps(x, mp.cos(733 * mpf(u))) <= 1.0
            assert ulps(y, mp.sin(1001 * mpf(u) + 1)) <= 1.0


def test_a_parameter_that_slows_down(tmp_path: Path) -> None:
    """Next to a zero of ds the contact force keeps its digits, although the derivatives of coordinates are parallel."""
    curve = gqm.Curve.space(x="cos(u**3)", y="sin(u**3)", z="u**3/2", parameter="u", domain=("1/100", "3"))
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="slowing", folder=tmp_path)
    lam = np.array([0.011, 0.02, 0.1, 0.5, 1.2])
    path = module.pass1(lam, 1.0, 6.0)
    coordinates = [sp.cos(U**3), sp.sin(U**3), U**3 / 2]
    with mp.workdps(40):
        exact = by_definition(coordinates, sp.Rational(981, 100) * sp.Symbol("z"), lam.tolist(), mpf(36), mpf(1))
    found = np.array([path.normal_x, path.normal_y, path.normal_z]).T
    true = np.array(exact, dtype=float)
    assert np.all(np.abs(found - true) < 8e-16 * np.linalg.norm(true, axis=1)[:, None])


@pytest.fixture(scope="module")
def banked(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a banked track through points."""
    u = np.linspace(0, 2, 41)
    points = np.stack([10 * u, 3 * np.sin(u), (u - 1) ** 2], axis=1)
    track = gqm.Curve.sampled(points, roll="coordinated", heartline="1")
    folder: Path = tmp_path_factory.mktemp("banked")
    return gqm.build(gqm.derive(track, gqm.Gravity()), name="banked_points", folder=folder)


@pytest.mark.extended
def test_nothing_is_known_beyond_the_ends(banked: ModuleType) -> None:
    """Beyond the ends of a track through points all numbers are NaN, those of riders too."""
    path = banked.pass1(np.array([-1.0, 5.0, 1e3]), 5.0, 1.0)
    for row in path:
        assert np.isnan(row).tolist() == [True, False, True]


@pytest.mark.extended
def test_along_a_chart_next_to_the_launch_and_to_height_zero(tmp_path: Path) -> None:
    """Along a helix without its formulas the height is linear in arc length, so that V**2 is known at every place."""
    helix = gqm.Curve.space(x="cos(u)", y="sin(u)", z="3*u/4", parameter="u", domain=(-10, 10)).in_arc_length()
    module = gqm.build(gqm.derive(helix, gqm.Gravity()), name="charted_helix", folder=tmp_path)
    random = np.random.default_rng(8)
    for start in (12.5, 12.6, 24.0, 3.0):  # the height is 0 at 12.5
        for v0 in (0.0, 1e-3, 20.0):
            gaps = 10.0 ** random.uniform(-12, 0, 100) * random.choice([-1, 1], 100)
            lam = np.concatenate([random.uniform(0, 25, 200), 12.5 + gaps, start + gaps])
            lam = lam[(lam >= 0) & (lam <= 25)]
            found = module.pass1(lam, start, v0)
            with mp.workdps(30):
                gained = [mpf("9.81") * 2 * 3 / 5 * (mpf(s) - mpf(start)) for s in lam.tolist()]
                true = np.array([float(mpf(v0) ** 2 - gain) for gain in gained])
            size = np.maximum(v0**2, np.abs([float(gain) for gain in gained]))
            assert np.all(np.abs(found.v2 - true) <= 1.5e-15 * size)
