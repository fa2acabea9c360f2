"""One motion in space, declared in two ways, has the same answers.

A curve may have another parameter, be turned about the vertical, mirrored, cut into pieces or begin elsewhere, a law
may have terms whose coefficients are zero, and units may be others.
"""

from collections.abc import Callable
from math import ldexp, pi
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from selection import examples

import gqm_sym as gqm
from generated import helix_coulomb, viviani

Build = Callable[[str, Any, Any], ModuleType]
Law = dict[str, float]

# The share of the largest value of each quantity by which two motions may differ: a few roundings of places.
SAME = 1e-14

# Second derivatives along points some 3 m apart hold 2e-14/m from roundings of coordinates of up to 50 m. With squares
# of speeds of up to 800 m2/s2 this is 4e-13 of the largest contact force.
ALONG_POINTS = 5e-13

FIELDS = ("z", "v", "v2", "kappa", "normal_force")
LOADS = ("n_vertical", "n_lateral", "n_longitudinal")
# Places of launch. Motions from places next to the lowest one, at 0, have tests of their own.
PLACES = st.floats(-1.2, 1.2).filter(lambda place: abs(place) > 1e-3)
SPEEDS = st.just(0.0) | st.floats(0.2, 2.5)

X, Y, Z = "u + sin(u)/5", "sin(2*u)/4", "u**2/2 - u**3/20"


def answers(module: ModuleType, lam0: float, v0: float, way: int = 1, t_max: float = 2.0, **more: Any) -> Law:
    """Return what a motion is like that does not depend on axes and parameters, by name."""
    motion = module.solve(lam0, v0, way, t_max=t_max, **more)
    state = motion.state(min(t_max, motion.t_end) * np.array([0.1, 0.35, 0.6, 0.97]))
    found = {"t_end": motion.t_end, "v_max": motion.v_max.value, "most": motion.normal_force_max.value}
    found["least"] = motion.normal_force_min.value
    # Speeds along a parameter that runs backwards have the other sign.
    fields = {name: np.abs(getattr(state, name)) for name in FIELDS}
    fields |= {name: np.abs(getattr(state, name)) for name in LOADS if hasattr(state, name)}
    return found | {f"{name} {index}": value for name, row in fields.items() for index, value in enumerate(row)}


def assert_same(one: Law, other: Law, tolerance: float = SAME) -> None:
    """Two motions have the same answers, in proportion to the largest value of each quantity."""
    assert one.keys() == other.keys()
    for name, value in one.items():
        size = max(1.0, *(abs(one[key]) for key in one if key.split()[0] == name.split()[0]))
        assert other[name] == pytest.approx(value, rel=0, abs=tolerance * size), name


@given(lam0=st.floats(0.2, 3.0), v0=st.just(0.0) | st.floats(0.1, 5.0))
@examples(40, otherwise=2)
def test_viviani_is_its_own_mirror_image(lam0, v0):
    """The plane y = 0 mirrors the curve, which is then run through in the other direction."""
    one, other = answers(viviani, lam0, v0, 1), answers(viviani, 2 * pi - lam0, v0, -1)
    assert_same(one, other, 4 * SAME)


@given(lam0=st.floats(-6.0, 6.0), v0=st.floats(0.1, 5.0), turns=st.integers(-3, 3))
@examples(40, otherwise=2)
def test_helix_some_turns_further(lam0, v0, turns):
    """All turns of a helix with friction are alike but for their height."""
    one, other = (answers(helix_coulomb, lam0 + 2 * pi * k, v0, -1) for k in (0, turns))
    without = [{name: value for name, value in row.items() if not name.startswith("z")} for row in (one, other)]
    assert_same(*without, tolerance=4 * SAME)


def declared(change: str, *, banked: bool) -> gqm.Curve:
    """Return the curve, or the curve with a change."""
    x, y, z, roll, parameter = X, Y, Z, "u/4", "u"
    if change == "turned":
        x, y = f"3*({X})/5 - 4*({Y})/5", f"4*({X})/5 + 3*({Y})/5"
    if change == "mirrored":
        y, roll = f"-({Y})", "-u/4"
    if change == "reparametrised":
        x, y, z, roll = (text.replace("u", "(2*w + 1)") for text in ("u + SIN/5", "SIN2/4", Z, roll))
        x, y, parameter = x.replace("SIN", "sin(2*w + 1)"), y.replace("SIN2", "sin(4*w + 2)"), "w"
    x, y, z = (f"L*({text})" for text in (x, y, z))
    more = {"roll": roll} if banked else {}
    return gqm.Curve.space(x=x, y=y, z=z, parameter=parameter, parameters={"L": 1}, **more)


FRICTION, DRAG = gqm.CoulombFriction(), gqm.QuadraticDrag(b="b")
LAWS = {
    "gravity": (gqm.Gravity(), {}),
    "friction": (gqm.Gravity() + FRICTION, {"mu": 0.1}),
    "drag": (gqm.Gravity() + DRAG, {"b": 0.1}),
    "turning": (gqm.Gravity() + gqm.RotatingFrame() + FRICTION, {"mu": 0.05, "Omega": 0.6}),
}


@pytest.mark.extended
@pytest.mark.parametrize("banked", [False, True])
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("change", ["turned", "mirrored", "reparametrised"])
def test_curves_that_are_congruent(change: str, law: str, banked: bool, built: Build) -> None:
    """A motion does not depend on the parameter of its curve and the axes of the plan, also where contact may be
    lost.
    """
    force, p = LAWS[law]
    # The mirror turns the frame in the other direction.
    other = p | {"Omega": -p["Omega"]} if law == "turning" and change == "mirrored" else p
    modules = [built(f"{of}_{law}_{banked}", declared(of, banked=banked), force) for of in ("plain", change)]
    contact = {"contact": "above"} if banked else {}

    @given(lam0=PLACES, v0=SPEEDS, way=st.sampled_from([1, -1]))
    @examples(25)
    def compared(lam0: float, v0: float, way: int) -> None:
        place = (lam0 - 1) / 2 if change == "reparametrised" else lam0
        # The places are the same ones, not almost: near an equilibrium what differs by a rounding grows.
        lam0 = 2 * place + 1 if change == "reparametrised" else lam0
        one = answers(modules[0], lam0, v0, way, **p, **contact)
        assert_same(one, answers(modules[1], place, v0, way, **other, **contact))

    compared()


DIMENSIONS = {"mu": (0, 0, 0), "b": (1, -1, 0), "Omega": (0, 0, -1), "g": (0, 1, -2), "L": (0, 1, 0), "m": (1, 0, 0)}
OF_ANSWERS = {"t_end": (0, 0, 1), "v_max": (0, 1, -1), "most": (1, 1, -2), "least": (1, 1, -2)}
OF_ANSWERS |= {"z": (0, 1, 0), "v": (0, 1, -1), "v2": (0, 2, -2), "kappa": (0, -1, 0), "normal_force": (1, 1, -2)}


@pytest.mark.extended
@pytest.mark.parametrize("law", LAWS)
def test_units_of_motions_in_space(law: str, built: Build) -> None:
    """In units that are smaller by powers of two, answers are multiplied by these powers."""
    force, p = LAWS[law]
    module, p = built(f"plain_{law}_False", declared("plain", banked=False), force), p | {"L": 1.0, "g": 9.81, "m": 1.0}

    @given(lam0=PLACES, v0=SPEEDS, units=st.tuples(*[st.integers(-20, 20)] * 3))
    @examples(40)
    def compared(lam0: float, v0: float, units: tuple[int, int, int]) -> None:
        def scaled(value: float, dimension: tuple[int, ...], sign: int = 1) -> float:
            return ldexp(value, sign * sum(one * unit for one, unit in zip(dimension, units, strict=True)))

        inside = {name: scaled(value, DIMENSIONS[name]) for name, value in p.items()}
        found = answers(module, lam0, scaled(v0, (0, 1, -1)), t_max=scaled(2.0, (0, 0, 1)), **inside)
        back = {name: scaled(value, OF_ANSWERS[name.split()[0]], -1) for name, value in found.items()}
        assert_same(answers(module, lam0, v0, **p), back)

    compared()


@pytest.mark.extended
@pytest.mark.parametrize(("lam0", "v0", "way"), [(0.3, 2.0, 1), (-0.9, 0.0, 1), (1.1, 1.5, -1)])
def test_laws_that_are_the_same(lam0: float, v0: float, way: int, built: Build) -> None:
    """Gravity is the potential g*z, and forces with coefficients zero are none."""
    curve = declared("plain", banked=False)
    for name in ("friction", "drag"):
        force, p = LAWS[name]
        rest = FRICTION if name == "friction" else DRAG
        known = built(f"plain_{name}_False", curve, force)
        potential = built(f"potential_{name}", curve, gqm.Potential("k*z") + rest)
        one = answers(known, lam0, v0, way, **p)
        assert_same(one, answers(potential, lam0, v0, way, k=9.81, **p))
        free = answers(built("plain_gravity_False", curve, gqm.Gravity()), lam0, v0, way)
        without = answers(known, lam0, v0, way, **dict.fromkeys(p, 0.0))
        assert_same(free | {"t_end": 0.0}, without | {"t_end": 0.0})
    turning = built("plain_turning_False", curve, LAWS["turning"][0])
    rough = answers(built("plain_friction_False", curve, LAWS["friction"][0]), lam0, v0, way, mu=0.05)
    assert_same(rough, answers(turning, lam0, v0, way, mu=0.05, Omega=0.0))


@pytest.mark.extended
def test_pieces_cut_in_two(built: Build) -> None:
    """A joint between two parts of one piece changes nothing."""
    whole = gqm.transition(length=60, yaw="1/40", pitch="-1/100", roll="1/200")
    parts = [gqm.transition(length=length, yaw="1/40", pitch="-1/100", roll="1/200") for length in (20, 40)]
    law = gqm.Gravity() + FRICTION
    options = {"start": (0, 0, 0), "roll": "pieces"}
    one = built("one_piece", gqm.Curve.piecewise([whole], **options), law)
    two = built("two_pieces", gqm.Curve.piecewise(parts, **options), law)
    for lam0, v0, way in ((2.0, 12.0, 1), (19.0, 15.0, 1), (55.0, 20.0, -1), (20.0, 9.0, 1)):
        found = [answers(module, lam0, v0, way, mu=0.04) for module in (one, two)]
        assert_same(*found)


def circuit(first: int) -> np.ndarray:
    """Return points of a closed track, from the given one on."""
    u = 2 * np.pi * np.arange(96) / 96
    across, along, up = 32 * np.cos(u) + 8 * np.cos(2 * u), 50 * np.sin(u), 13 + 9 * np.cos(u) + 4 * np.cos(3 * u)
    return np.roll(np.stack([across, along, up], axis=1), -first, axis=0)


@pytest.mark.extended
def test_closed_tracks_that_begin_elsewhere(built: Build) -> None:
    """A survey of a closed track may begin at each of its points, and a heartline in the track is the track."""
    law = gqm.Gravity() + FRICTION
    roll = 0.2 * np.sin(2 * np.pi * np.arange(96) / 96)
    plain = built("circuit", gqm.Curve.sampled(circuit(0), closed=True, roll=roll), law)
    later = built("circuit_later", gqm.Curve.sampled(circuit(31), closed=True, roll=np.roll(roll, -31)), law)
    lined = built("circuit_lined", gqm.Curve.sampled(circuit(0), closed=True, roll=roll, heartline="h"), law)
    edges = plain.solve(0, 24, mu=0.02).problem.formulas.chart.chart(()).edges
    for v0, way in ((24.0, 1), (20.0, -1), (0.5, 1)):
        one = answers(plain, edges[31], v0, way, t_max=6.0, mu=0.02)
        assert_same(one, answers(later, 0.0, v0, way, t_max=6.0, mu=0.02), ALONG_POINTS)
        assert_same(one, answers(lined, edges[31], v0, way, t_max=6.0, mu=0.02, h=0.0))
