"""Space curves agree with independent results: 40-digit times and forces, closed forms, DOP853 and planar motions."""

import json
import pickle
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf
from naive import ulps
from paths import DATA
from scipy.integrate import solve_ivp

import generated.helix_coulomb
import generated.viviani
import gqm_sym as gqm
from gqm_sym.errors import DeclarationError, InputError
from gqm_sym.kernels.base import DIRECTION, W

ROWS = {row["name"]: row for row in json.loads((DATA / "space_curves.json").read_text(encoding="utf-8"))}
# Modules are made for these curves; the others have the same functions.
BUILT = ("lying_helix", "sprung_helix", "saddle_lap")
U = sp.Symbol("u", real=True)

Build = Callable[[str, Any, Any], ModuleType]


def derived(row: dict[str, Any]) -> gqm.Model:
    """Return the model of one of the twelve curves."""
    x, y, z = row["curve"]
    force = gqm.Gravity() if row["potential"] == "g*z" else gqm.Potential(row["potential"])
    return gqm.derive(gqm.Curve.space(x=x, y=y, z=z, parameter="u"), force)


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", ROWS)
def test_closed_forms_of_the_twelve(name: str) -> None:
    """Closed forms of the twelve give V**2 and the contact force, along each axis and in length, to 30 digits."""
    row = ROWS[name]
    model, launch, g, v2 = derived(row), row["launch"], sp.Symbol("g", real=True), sp.Symbol("v2", real=True)
    known = {model.lam0: sp.Rational(launch["lam0"]), model.v0: sp.Rational(launch["v0"])}
    forms = (model.speed_squared.xreplace(known), model.normal_force_at(v2), *model.normal_force_vector_at(v2))
    call = sp.lambdify((model.parameter, v2, g, model.mass), forms, "mpmath", cse=True)
    with mp.workdps(40):
        for place in row["expected"]["places"]:
            true = [mpf(part) for part in place["force"]]
            speed, force, *vector = call(mpf(place["lam"]), mpf(place["v2"]), mpf("9.81"), mpf(1))
            size = mp.norm(true)
            assert abs(speed - mpf(place["v2"])) < 1e-30 * size
            assert mp.norm([a - b for a, b in zip(vector, true, strict=True)]) < 1e-30 * size
            assert abs(abs(force) - size) < 1e-30 * size


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", [*BUILT, "viviani"])
def test_motions_of_some_of_the_twelve(name: str, built: Build) -> None:
    """Periods are right to half an ulp, turning points to one, and contact forces to some roundings of their terms."""
    row, model = ROWS[name], None
    if name == "viviani":
        module = generated.viviani
    else:
        model = derived(row)
        module = built(name, model.curve, model.force)
    expected, launch = row["expected"], row["launch"]
    motion = module.solve(launch["lam0"], launch["v0"])
    assert motion.kind == expected["kind"]
    quantity = "half_period" if motion.kind == "libration" else "period"
    assert ulps(getattr(motion, quantity), mpf(expected[quantity])) <= 0.501
    for found, true in zip(sorted(motion.turning_points), expected.get("turning_points", ()), strict=True):
        assert ulps(found, mpf(true)) <= 1.0
    places = [place["lam"] for place in expected["places"]]
    path = module.pass1(places, lam0=launch["lam0"], v0=launch["v0"])
    found = np.stack([path.normal_x, path.normal_y, path.normal_z], axis=1)
    true = np.array([[float(part) for part in place["force"]] for place in expected["places"]])
    size = np.linalg.norm(true, axis=1)
    assert np.all(np.linalg.norm(found - true, axis=1) < 8e-16 * size)
    assert np.abs(path.normal_force) == pytest.approx(size, rel=8e-16)
    assert np.all(np.abs(path.v2 - [float(place["v2"]) for place in expected["places"]]) < 8e-16 * (size + path.v2))


def test_a_state_in_space_is_that_of_pass1() -> None:
    """Coordinates and forces at times are those at the places of these times, which agree with the curve itself."""
    motion = generated.viviani.solve("3/10")
    state = motion.state(np.linspace(0.0, 1000.0, 41))
    assert state._fields[-4:] == ("y", "normal_x", "normal_y", "normal_z")
    # Viviani's curve lies on a sphere of radius 2 and on a cylinder of radius 1.
    assert state.x**2 + state.y**2 + state.z**2 == pytest.approx(np.full(41, 4.0), rel=4e-15)
    assert (state.x - 1.0) ** 2 + state.y**2 == pytest.approx(np.ones(41), rel=4e-15)
    assert np.all(state.lam == motion.lam(state.t))
    path = generated.viviani.pass1(state.lam, lam0="3/10")
    for name in ("y", "normal_x", "normal_y", "normal_z", "normal_force"):
        assert getattr(state, name) == pytest.approx(
            getattr(path, name), rel=1e-12, abs=1e-12 * state.normal_force.max()
        )
    force = np.stack([state.normal_x, state.normal_y, state.normal_z])
    assert np.linalg.norm(force, axis=0) == pytest.approx(state.normal_force, rel=4e-16 * 4)
    one = motion.state(0.25)
    assert one.y == motion.state(np.array([0.25])).y[0]
    assert "normal_z (N)" in str(one)
    assert one._replace(t=0.0).y == one.y
    assert pickle.loads(pickle.dumps(one)) == one
    data = motion.to_xarray(np.array([0.25]))
    assert (data.y.item(), data.normal_y.item(), data.y.units) == (one.y, one.normal_y, "m")


@pytest.mark.extended
def test_states_of_laps_and_of_legs_in_space(built: Build) -> None:
    """After a thousand laps the body is still on the curve; along legs, states at one time are those at many."""
    model = derived(ROWS["saddle_lap"])
    motion = built("saddle_lap", model.curve, model.force).solve("1", "5")
    late = motion.state(1000.4 * motion.period)
    assert late.x**2 + late.y**2 == pytest.approx(1.0, rel=4e-16)
    assert late.z == pytest.approx((late.x**2 - late.y**2) / 2, abs=4e-16)
    slide = generated.helix_coulomb.solve(0, 3, direction=-1, t_max=20)
    times = np.array([[0.0, 0.1], [3.0, 19.0]])
    states = slide.state(times)
    assert states.normal_y.shape == (2, 2)
    for place in np.ndindex(2, 2):
        one = slide.state(float(times[place]))
        assert one == tuple(np.asarray(field)[place] for field in states)
        assert one.x**2 + one.y**2 == pytest.approx(4.0, rel=4e-16)


def helix_truth(w: str) -> tuple[mpf, mpf]:
    """Return distance and time from rest to V**2 = w on the helix of radius 2 and slope 0.5 rad with mu = 0.2."""
    g, mu, slope = mpf("9.81"), mpf("0.2"), mpf("0.5")
    kappa = mp.cos(slope) ** 2 / 2

    def law(w: mpf) -> mpf:
        return 2 * (g * mp.sin(slope) - mu * mp.sqrt(kappa**2 * w**2 + g**2 * mp.cos(slope) ** 2))

    way = mp.quad(lambda w: 1 / law(w), mp.linspace(0, mpf(w), 9))
    return way, mp.quad(lambda v: 2 / law(v * v), mp.linspace(0, mp.sqrt(mpf(w)), 9))


def test_a_helix_with_friction() -> None:
    """The law of motion has constant coefficients, so that distance and time are integrals over V**2 with a known
    limit.
    """
    module = generated.helix_coulomb
    numbers = {"R": 2, "c": "-2*tan(1/2)", "mu": "0.2"}
    motion = module.solve(0, 0, t_max=300, **numbers)
    with mp.workdps(30):
        for w in ("0.01", "5", "30", "55"):
            way, time = helix_truth(w)
            lam = float(way * mp.cos(mpf("0.5")) / 2)
            assert module.pass1(lam, lam0=0, **numbers).v2 == pytest.approx(float(w), rel=1e-14)
            assert motion.time_at(lam) == pytest.approx(float(time), rel=1e-14)
    state = motion.state(290.0)
    assert state.v2 == pytest.approx(56.8285107057949251514199278096, rel=1e-14)
    sine, cosine = np.sin(0.5), np.cos(0.5)
    assert state.normal_force == pytest.approx(np.hypot(9.81 * cosine, cosine**2 / 2 * state.v2), rel=1e-14)
    # Friction balances gravity along the slope.
    assert 0.2 * state.normal_force == pytest.approx(9.81 * sine, rel=1e-14)
    assert [leg.end for leg in motion.legs] == ["horizon"]


@pytest.mark.extended
@pytest.mark.parametrize("mu", ["0.2", "0"])
def test_sweeps_of_a_helix_in_pieces(mu: str, built: Build) -> None:
    """Along a rail of many pieces of a helix, with friction or with drag alone, sweeps agree with the closed forms."""
    curvature, pieces = "cos(1/2)**2/2", 40
    piece = gqm.transition(length="3/10", yaw=curvature, roll="cos(1/2)*sin(1/2)/2")
    rail = gqm.Curve.piecewise([piece] * pieces, start=("0", "0", "0"), heading=("0", "-1/2"))
    force = gqm.Gravity() + (gqm.CoulombFriction() if mu != "0" else gqm.QuadraticDrag(b="1/10"))
    module = built(f"helix_in_pieces_{mu[-1]}", rail, force)
    given = {"mu": float(mu)} if mu != "0" else {}
    cosine, kappa = np.cos(0.5), np.cos(0.5) ** 2 / 2
    with mp.workdps(30):
        for w in ("1", "20", "40"):
            if mu != "0":
                way, time = helix_truth(w)
            else:
                limit = mpf("98.1") * mp.sin(mpf("0.5"))
                way, time = -5 * mp.log(1 - mpf(w) / limit), 10 * mp.atanh(mp.sqrt(mpf(w) / limit)) / mp.sqrt(limit)
            found = {
                quantity: float(module.sweep(quantity, 0.0, 0.0, **asked, **given).values)
                for quantity, asked in (
                    ("time_at", {"lam": float(way)}),
                    ("v_max", {"t_max": float(time)}),
                    ("normal_force_max", {"t_max": float(time)}),
                    ("normal_force_min", {"t_max": float(time)}),
                )
            }
            assert found["time_at"] == pytest.approx(float(time), rel=2e-15)
            assert found["v_max"] == pytest.approx(np.sqrt(float(w)), rel=4e-15)
            assert found["normal_force_max"] == pytest.approx(np.hypot(9.81 * cosine, kappa * float(w)), rel=4e-15)
            assert found["normal_force_min"] == pytest.approx(9.81 * cosine, rel=4e-15)


@pytest.mark.extended
@pytest.mark.parametrize("force", [gqm.CoulombFriction(), gqm.QuadraticDrag(b="1/20")])
def test_a_length_that_almost_vanishes_is_not_negative(force: gqm.Kernel, built: Build) -> None:
    """On a vertical part of a rail N is zero, and its square has few digits beside that; further on a body begins with
    the contact force of its weight.
    """
    bend = {"yaw": "1/10", "pitch": "pi/8"}
    pieces = [gqm.transition(length="1"), gqm.transition(length="4", **bend), gqm.transition(length="1")]
    rail = gqm.Curve.piecewise(pieces, start=("0", "0", "4"), heading=("0", "-pi/2"))
    module = built(f"vertical_part_{force.drag != 0}", rail, gqm.Gravity() + force)
    given = {} if force.drag else {"mu": 0.05}
    launches = np.linspace(0.5, 1.5, 11)
    swept = module.sweep("normal_force_min", launches, 0.0, t_max=1.0, **given).values
    assert swept.min() >= 0.0
    assert swept[:6] == pytest.approx(0.0, abs=1e-14)
    # A load that grows along the way is the smallest at rest.
    at_rest = [float(module.pass1(lam, lam0=lam, v0=0.0, **given).normal_force) for lam in launches[6:].tolist()]
    assert swept[6:] == pytest.approx(at_rest, rel=1e-14)


def test_a_helix_too_rough_holds_the_body() -> None:
    """Uphill the body stops where friction and gravity have used up its energy, and with tan(slope) < mu it stays
    there.
    """
    motion = generated.helix_coulomb.solve(0, 10, direction=-1, R=2, c="-2*tan(1/2)", mu="0.7")
    assert [leg.end for leg in motion.legs] == ["rest"]
    assert generated.helix_coulomb.solve(0, 0, mu="0.7").kind == "rest"
    energy = motion.energy(motion.t_end)
    assert energy.kinetic == pytest.approx(0.0, abs=1e-12)
    assert energy.lost == pytest.approx(50.0 - energy.potential, rel=1e-13)


def dop853(mu: float, b: float, lam0: float, v0: float, times: list[float]) -> Any:
    """Integrate Newton's law in three coordinates on Viviani's curve, with friction and drag and the energy lost to
    them.
    """

    def slopes(_: float, state: Any) -> list[float]:
        u, rate, _, _ = state
        first = np.array([-np.sin(u), np.cos(u), np.cos(u / 2)])
        second = np.array([-np.cos(u), -np.sin(u), -np.sin(u / 2) / 2])
        size = np.linalg.norm(first)
        tangent, speed = first / size, size * rate
        bend = (second - tangent * (tangent @ second)) * rate**2
        weight = np.array([0.0, 0.0, -9.81])
        force = np.linalg.norm(bend - (weight - tangent * (tangent @ weight)))
        against = (mu * force + b * speed**2) * np.sign(speed)
        change = tangent @ weight - against
        return [rate, (change - tangent @ second * rate**2) / size, abs(speed) * mu * force, abs(speed) * b * speed**2]

    start = [lam0, v0 / np.sqrt(1.0 + np.cos(lam0 / 2) ** 2), 0.0, 0.0]
    return solve_ivp(slopes, (0.0, max(times)), start, method="DOP853", rtol=1e-13, atol=1e-14, t_eval=times)


@pytest.mark.extended
def test_friction_and_drag_against_dop853(built: Build) -> None:
    """The place, V**2, and the work of friction and drag agree with DOP853 through a turn."""
    module = built("rough_viviani", generated_curve(), gqm.Gravity() + gqm.CoulombFriction() + gqm.QuadraticDrag())
    motion = module.solve(-2.0, 4.0, mu=0.1, b=0.02, t_max=20)
    turn = motion.legs[0].t_end
    # DOP853 cannot pass the jump of friction at a turn, so that it is asked for times before the first.
    times = [share * turn for share in (0.1, 0.4, 0.7, 0.95)]
    truth = dop853(0.1, 0.02, -2.0, 4.0, times)
    state = motion.state(np.array(times))
    assert state.lam == pytest.approx(truth.y[0], abs=1e-10)
    ds = np.sqrt(1.0 + np.cos(truth.y[0] / 2) ** 2)
    assert state.v == pytest.approx(truth.y[1] * ds, abs=1e-10)
    assert motion.energy(np.array(times)).lost == pytest.approx(truth.y[2] + truth.y[3], abs=1e-10)
    assert [leg.end for leg in motion.legs][-1] == "rest"
    # The work of friction on each leg is that of |N| over the distance: the trapezoidal rule in the angle of a swing
    # converges fast.
    lost = 0.0
    for leg in motion.legs:
        share = 0.5 - 0.5 * np.cos(np.pi * (np.arange(400) + 0.5) / 400)
        at = motion.state(leg.t_start + (leg.t_end - leg.t_start) * share)
        weight = np.sin(np.pi * (np.arange(400) + 0.5) / 400) * np.pi / 800 * (leg.t_end - leg.t_start)
        lost += float(weight @ ((0.1 * at.normal_force + 0.02 * at.v2) * np.abs(at.v)))
    assert motion.energy(motion.t_end).lost == pytest.approx(lost, rel=1e-4)


def generated_curve() -> gqm.Curve:
    """Return Viviani's curve with a radius of 1."""
    return gqm.Curve.space(x="1 + cos(u)", y="sin(u)", z="2*sin(u/2)", parameter="u")


PLANAR = (("u", "u**2/2"), ("2*sin(u)", "-cos(u)"), ("u - sin(u)", "cos(u) - 1"))


@pytest.mark.sample(3)
@pytest.mark.parametrize(("h", "z"), PLANAR)
@pytest.mark.parametrize(("cosine", "sine"), [("1", "0"), ("0", "1"), ("3/5", "4/5")])
def test_a_vertical_plane_is_the_planar_case(h: str, z: str, cosine: str, sine: str) -> None:
    """The closed forms are those of the planar curve, with friction too, and the contact force keeps its sign."""
    force = gqm.Gravity() + gqm.CoulombFriction() + gqm.QuadraticDrag()
    flat = gqm.derive(gqm.Curve.parametric(x=h, z=z, parameter="u"), force)
    turned = gqm.derive(gqm.Curve.space(x=f"{cosine}*({h})", y=f"{sine}*({h})", z=z, parameter="u"), force)
    for name in ("z", "ds", "dzds", "kappa", "static_normal_load", "effective_potential", "speed_squared", "notes"):
        assert getattr(turned, name) == getattr(flat, name), name
    assert turned.dissipation == flat.dissipation
    assert (turned.curvature_binormal, turned.loads) == ((), ())
    assert turned.normal == tuple(
        part * sp.Rational(share)
        for part, share in zip((-flat.dzds, -flat.dzds, flat.dxds), (cosine, sine, "1"), strict=True)
    )
    assert sp.simplify(turned.dxds - sp.Rational(cosine) * flat.dxds) == 0


def test_a_force_across_a_vertical_plane_makes_the_contact_force_a_vector() -> None:
    """If a curve in the plane of x and z is pulled along y, the contact force balances that pull too."""
    curve = gqm.Curve.space(x="u", y="0", z="u**2/2", parameter="u")
    model = gqm.derive(curve, gqm.Gravity() + gqm.Potential("k*y + x*y"))
    assert model.normal == ()
    v2 = sp.Symbol("v2", real=True)
    k = sp.Symbol("k", real=True)
    assert sp.simplify(model.normal_force_vector_at(v2)[1] - model.mass * (k + U)) == 0


@pytest.mark.parametrize(("cosine", "sine"), [("4/5", "3/5"), ("-5/13", "12/13")])
def test_a_tilted_planar_curve(cosine: str, sine: str) -> None:
    """The motion of a tilted planar curve is the planar one with the part of g in its plane; the contact force balances
    the other part.
    """
    tilted = gqm.Curve.space(x="2*cos(u)", y=f"-{sine}*sin(u)", z=f"{cosine}*sin(u)", parameter="u")
    flat = gqm.Curve.parametric(x="2*cos(u)", z="sin(u)", parameter="u")
    model, plane = gqm.derive(tilted, gqm.Gravity()), gqm.derive(flat, gqm.Gravity())
    g = sp.Symbol("g", real=True)
    assert model.ds == plane.ds
    assert model.effective_potential == plane.effective_potential.xreplace({g: g * sp.Rational(cosine)})
    for place, v2 in (("0.3", "4.5"), ("-2.1", "0.2"), ("1.7", "30")):
        at = {U: sp.Rational(place), g: sp.Rational("9.81"), model.mass: 2}
        within = {**at, g: at[g] * sp.Rational(cosine)}
        in_plane = float(plane.normal_force_at(sp.Rational(v2)).xreplace(within).evalf(30))
        found = float(model.normal_force_at(sp.Rational(v2)).xreplace(at).evalf(30))
        assert found == pytest.approx(np.hypot(in_plane, 2 * 9.81 * float(sp.Rational(sine))), rel=1e-14)


@pytest.mark.parametrize(("cosine", "sine"), [("3/5", "4/5"), ("-5/13", "12/13")])
def test_a_curve_turned_about_the_vertical(cosine: str, sine: str) -> None:
    """Arc length, curvature, |N| and the law of motion do not change, and the force turns with the curve."""
    cosine, sine = sp.Rational(cosine), sp.Rational(sine)
    x, y, z = U, U**3 / 3, U**2 / 2 - U
    force = gqm.Gravity() + gqm.CoulombFriction(mu="1/5")
    turned = gqm.Curve.space(x=cosine * x - sine * y, y=sine * x + cosine * y, z=z, parameter="u")
    models = [gqm.derive(gqm.Curve.space(x=x, y=y, z=z, parameter="u"), force), gqm.derive(turned, force)]
    for place, v2 in (("0.3", "4.5"), ("-2.1", "0.2"), ("1.7", "30")):
        at = {U: sp.Rational(place), sp.Symbol("g", real=True): sp.Rational("9.81"), models[0].mass: 1}
        at |= {DIRECTION: 1, W: sp.Rational(v2), sp.Symbol("mu", real=True): sp.Rational(1, 5)}
        for name in ("ds", "kappa", "static_normal_load", "tangential_acceleration"):
            one, two = (float(getattr(model, name).xreplace(at).evalf(25)) for model in models)
            assert one == pytest.approx(two, rel=1e-14), name
        one, two = (
            [float(part.xreplace(at).evalf(25)) for part in model.normal_force_vector_at(sp.Rational(v2))]
            for model in models
        )
        along = [float(cosine) * one[0] - float(sine) * one[1], float(sine) * one[0] + float(cosine) * one[1]]
        assert two == pytest.approx([*along, one[2]], rel=1e-13, abs=1e-13)


def test_sweeps_of_a_space_curve() -> None:
    """Sweeps give the numbers of single motions, of the contact force too, and no state exceeds its extremes."""
    lam0 = np.array([0.3, -0.5])
    for quantity in ("half_period", "normal_force_max", "normal_force_min", "v_max"):
        swept = generated.viviani.sweep(quantity, lam0=lam0).values
        found = [getattr(generated.viviani.solve(place), quantity) for place in lam0]
        assert swept == pytest.approx([getattr(value, "value", value) for value in found], rel=2e-15)
    motion = generated.viviani.solve(0.3)
    force = motion.state(np.linspace(0.0, motion.period, 4001)).normal_force
    assert force.max() == pytest.approx(motion.normal_force_max.value, rel=1e-6)
    assert force.min() == pytest.approx(motion.normal_force_min.value, rel=1e-6)
    assert motion.normal_force_min.value <= force.min()
    rough = generated.helix_coulomb.sweep("normal_force_max", lam0=0.0, v0=[1.0, 2.0], t_max=1.0)
    found = [generated.helix_coulomb.solve(0.0, v0, t_max=1.0).normal_force_max.value for v0 in (1.0, 2.0)]
    assert rough.values == pytest.approx(found, rel=1e-13)


def test_drag_without_friction_on_a_space_curve(built: Build) -> None:
    """On a helix V**2 tends to g sin/(b/m) exponentially; the contact force of a sweep is that of the motions."""
    module = built("dragged_helix", gqm.families.helix(R=2, c=-1), gqm.Gravity() + gqm.QuadraticDrag(b="1/10"))
    motion = module.solve(0, 0, t_max=10)
    slope, size = 1.0 / np.sqrt(5.0), np.sqrt(5.0)
    state = motion.state(np.array([0.5, 2.0, 9.0]))
    true = 98.1 * slope * -np.expm1(-0.2 * size * state.lam)
    assert state.v2 == pytest.approx(true, rel=1e-14)
    assert state.normal_force == pytest.approx(np.hypot(0.4 * state.v2, 9.81 * 2 / size), rel=1e-14)
    assert module.sweep("normal_force_max", lam0=0.0, v0=0.0, t_max=2.0).values == pytest.approx(
        motion.state(2.0).normal_force, rel=1e-13
    )


REFUSED = (
    (lambda: gqm.Curve.space(x="1", y="2", z="3", parameter="u"), "no coordinate depends on the parameter 'u'"),
    (lambda: gqm.Curve.space(x="u", y="y*u", z="u", parameter="u"), "'y' is a coordinate"),
    (lambda: gqm.Curve.space(x="cos(u)", y="sin(u)", z="u", parameter="u", period="2*pi"), "leave it out"),
    (lambda: gqm.families.torus_knot(p="5/2"), "p: must be a whole number from 1 to 12"),
    (lambda: gqm.families.torus_knot(q=0), "q: must be a whole number from 1 to 12"),
    (lambda: gqm.families.torus_knot(2, 1), r"write families.torus_knot\(R=2, r=1\)"),
    (lambda: gqm.CentralForce(centre=(0, 0, 0, 0)), "two coordinates"),
)
FORCES = (
    (
        gqm.SurfaceTension(form="printed"),
        "surface_tension: form: the printed form's sign is so far known for planar curves only",
    ),
    (gqm.Rolling(radius="1/10"), "on which side of a track in space the body rolls is not known"),
    (gqm.Potential("k*y", parameters={"y": 1, "k": 1}), "'y' is a coordinate on a space curve"),
)


@pytest.mark.parametrize(("declare", "message"), REFUSED)
def test_what_is_no_space_curve_is_refused(declare: Callable[[], object], message: str) -> None:
    """Each declaration that is no space curve is refused with a reason."""
    with pytest.raises(InputError, match=message):
        declare()


@pytest.mark.parametrize(("force", "message"), FORCES)
def test_forces_that_are_not_there_yet_are_refused(force: gqm.Kernel, message: str) -> None:
    """Forces that are not available yet are refused with a reason, and nothing is computed without them."""
    with pytest.raises(DeclarationError, match=message):
        gqm.derive(gqm.families.helix(), gqm.Gravity() + force)


def test_corners_of_space_curves_are_refused() -> None:
    """A corner is refused also if only the third coordinate has it."""
    for y, message in (("abs(u)", "the tangent turns by"), ("u*abs(u)", "the curvature jumps")):
        with pytest.raises(DeclarationError, match=message):
            gqm.derive(gqm.Curve.space(x="u", y=y, z="u**2", parameter="u"), gqm.Gravity())


def test_a_contact_force_without_a_sign() -> None:
    """Questions that need the sign of the contact force are refused; derivatives of the half period are known."""
    with pytest.raises(InputError, match="contact: 'above' needs to know which side"):
        generated.viviani.solve("3/10", contact="above")
    with pytest.raises(InputError, match="contact: 'below' needs to know which side"):
        generated.viviani.sweep("half_period", lam0=0.3, contact="below")
    with pytest.raises(InputError, match="contact: 'above' needs to know which side"):
        gqm.least_speed(generated.viviani, 0.3)
    motion = generated.viviani.solve(0.3)
    step = 1e-5
    near = [generated.viviani.solve(0.3 + side * step).half_period for side in (-1, 1)]
    assert motion.gradient("half_period")["lam0"] == pytest.approx((near[1] - near[0]) / (2 * step), rel=1e-8)


def test_losses_on_space_curves_with_cusps_are_refused() -> None:
    """Losses are refused because a leg does not always stop at a cusp; without losses a motion ends there, and a domain
    may exclude it.
    """
    cusped = {"x": "u**2", "y": "u**3", "z": "-u**2/2", "parameter": "u"}
    with pytest.raises(DeclarationError, match="u may vanish, which is a cusp; losses of energy"):
        gqm.derive(gqm.Curve.space(**cusped), gqm.Gravity() + gqm.CoulombFriction())
    rough = gqm.derive(gqm.Curve.space(**cusped, domain=("1/10", None)), gqm.Gravity() + gqm.CoulombFriction())
    assert rough.dissipation is not None
    assert gqm.derive(gqm.Curve.space(**cusped), gqm.Gravity()).cusp == U


def test_a_law_of_the_users_own_knows_y() -> None:
    """In a user's own law y is the third coordinate on a space curve, and a parameter on a planar one."""
    law = gqm.Kernel.law("-k*y*W*direction")
    model = gqm.derive(gqm.Curve.space(x="u", y="u**3/3", z="u**2", parameter="u"), gqm.Gravity() + law)
    assert model.parameters == ("k", "g", "m")
    assert model.tangential_acceleration.has(sp.Symbol("k", real=True) * U**3)
    assert "y" in gqm.derive(gqm.Curve.graph("u**2", parameter="u"), gqm.Gravity() + law).parameters


@pytest.mark.extended
def test_periods_of_closed_curves_and_units_of_their_parameters() -> None:
    """The periods of waves are found, and so are the units of the parameters in the coordinates."""
    assert gqm.families.viviani().period == 4 * sp.pi
    assert gqm.families.torus_knot(p=2, q=2).period == sp.pi
    assert gqm.families.helix().period is None
    model = gqm.derive(gqm.families.torus_knot(p=1, q=2), gqm.Gravity() + gqm.Potential("k*(x**2 + y**2)"))
    assert (model.units["R"], model.units["k"]) == ("m", "1/s**2")
    assert "y" not in model.parameters
    R, r, theta = (sp.Symbol(name, real=True) for name in ("R", "r", "theta"))
    assert model.ds == sp.sqrt(4 * r**2 + (R + r * sp.cos(2 * theta)) ** 2)
    assert "y = a*sin(theta)" in str(gqm.families.viviani())


def test_a_central_force_in_space() -> None:
    """The centre of a central force has three coordinates, or lies in the plane y = 0; on a circle about it |N| is
    constant.
    """
    ring = gqm.Curve.space(x="3/5*cos(u)", y="sin(u)", z="4/5*cos(u)", parameter="u")
    for centre in ((0, 0), (0, 0, 0)):
        model = gqm.derive(ring, gqm.CentralForce(centre=centre))
        assert model.effective_potential_slope == 0
        k = sp.Symbol("k", real=True)
        v2 = sp.Symbol("v2", real=True)
        place = {U: sp.Rational(7, 10), k: 3, v2: 2, model.mass: 1}
        assert float(model.normal_force_at(v2).xreplace(place)) == pytest.approx(1.0, rel=1e-14)
    away = gqm.derive(ring, gqm.CentralForce(centre=(0, 2, 0)))
    assert away.effective_potential_slope != 0
    with pytest.raises(DeclarationError, match="a force acts across the curve's plane"):
        gqm.derive(gqm.families.circle(), gqm.CentralForce(centre=(0, 2, 0)))


def test_droplet_on_a_helix(built: Build) -> None:
    """The resistance is constant, so that both legs are those of a body on an incline, until it rests."""
    module = built("droplet_on_helix", gqm.families.helix(R="2", c="3/4"), gqm.Gravity() + gqm.SurfaceTension())
    rate = mp.sqrt(4 + mpf(9) / 16)
    pull, drag = mpf("9.81") * mpf(3) / 4 / rate, mpf("0.07") * 9 * 2 / rate**2
    motion = module.solve(0, v0=4, gamma="0.07", ell_c=3, t_max=3)
    up, down = motion.legs
    assert ulps(up.lam_end, 8 / (pull + drag) / rate) <= 1
    assert ulps(up.t_end, 4 / (pull + drag)) <= 1
    assert down.lam_end == pytest.approx(
        float((8 / (pull + drag) - (pull - drag) * (3 - 4 / (pull + drag)) ** 2 / 2) / rate)
    )
    sticky = module.solve(0, v0=4, gamma="0.07", ell_c=12, t_max=3)
    assert sticky.legs[-1].end == "rest"
    assert sticky.rest_position == pytest.approx(float(8 / (pull + 16 * drag) / rate), rel=1e-15)
