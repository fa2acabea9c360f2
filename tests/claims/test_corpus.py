"""Every explicit curve of the corpus of famous curves is tested through the public interface and as YAML."""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from naive import error, overstatement, ulps
from paths import DATA

import gqm_sym as gqm

# The tolerances, relative to the scale of each: turning points and times; what pass1 fills; a position at any t, also
# after 1000 periods.
TURNING = 1e-14
PERIOD_ULPS = 2.0
TIME = 1e-14
SAMPLE = 1e-13
POSITION = 8e-15

# The largest ratio of the error bound to the larger of a last place of the scale and the decade's largest error.
USEFUL = 100.0

# A derivative that vanishes exactly has a difference of this size.
ZERO = 1e-25

ORBIT_POINTS = 401

# These are solved from their YAML files too; for the others the text of the module is compared.
SOLVED_FROM_YAML = ("Cardioid", "Lissajous curves", "Parabola")

Expected = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class FamousCurve:
    """An entry of the corpus, with its numbers as text."""

    name: str
    kind: str
    parameter: str
    texts: tuple[str, ...]
    parameters: tuple[tuple[str, str], ...]
    domain: tuple[str, str]
    period: str | None

    @property
    def slug(self) -> str:
        """Return the name as an identifier."""
        return "corpus_" + "".join(c if c.isalnum() else "_" for c in self.name.lower())

    @property
    def ends(self) -> dict[str, Any]:
        """Return the period of a closed curve, or the regular range of another one."""
        return {"domain": self.domain} if self.period is None else {"period": self.period}

    def declare(self) -> gqm.Curve:
        """Declare the curve in the kind that the corpus gives."""
        given = {"parameter": self.parameter, **self.ends}
        if self.kind == "parametric":
            x, z = self.texts
            return gqm.Curve.parametric(x=x, z=z, **given)
        return getattr(gqm.Curve, self.kind)(*self.texts, **given)

    def derive(self) -> gqm.Model:
        """Derive the motion under gravity."""
        return gqm.derive(self.declare(), gqm.Gravity(), parameters=dict(self.parameters))

    def yaml(self, launch: Expected) -> str:
        """Write the curve as a curve file."""
        keys = {"parametric": ("x", "z"), "graph": ("z",), "polar": ("r",)}[self.kind]
        said = {**dict(zip(keys, self.texts, strict=True)), "parameter": self.parameter}
        curve = [f"    {key}: {value}" for key, value in said.items()]
        curve += [f"    {key}: {_flow(value)}" for key, value in self.ends.items()]
        start = ", ".join(f"{key}: {launch[key]}" for key in ("lam0", "v0", "direction"))
        return "\n".join(
            (
                f"name: {self.slug}",
                "curve:",
                f"  {self.kind}:",
                *curve,
                "kernel:",
                "  gravity: {}",
                "parameters:",
                *(f"  {name}: {value}" for name, value in self.parameters),
                f"launch: {{{start}}}",
                "",
            )
        )


def _flow(value: str | tuple[str, str]) -> str:
    return value if isinstance(value, str) else f"[{', '.join(value)}]"


@dataclass(frozen=True, slots=True, kw_only=True)
class FamousMotion:
    """A launch on a famous curve, and the expected results."""

    curve: FamousCurve
    count: int
    m: str
    g: str
    launch: Expected
    expect: Expected

    @property
    def slug(self) -> str:
        """Return the curve's slug and a number."""
        return f"{self.curve.slug.removeprefix('corpus_')}_{self.count}"

    @property
    def start(self) -> dict[str, Any]:
        """Return the arguments of ``module.solve``, all of them exact."""
        return {key: self.launch[key] for key in ("lam0", "v0", "direction")} | {"m": self.m, "g": self.g}

    def __hash__(self) -> int:
        return hash(self.slug)


def _read() -> list[FamousMotion]:
    motions = []
    for entry in json.loads((DATA / "curves.json").read_text(encoding="ascii")):
        if entry["kind"] == "implicit":
            continue
        curve = FamousCurve(
            name=entry["name"],
            kind=entry["kind"],
            parameter=entry["parameter"],
            texts=(entry["x"], entry["z"]) if entry["kind"] == "parametric" else (entry["expr"],),
            parameters=tuple(entry["params"].items()),
            domain=tuple(entry["domain"]),
            period=entry["period"],
        )
        for count, motion in enumerate((entry, *entry.get("also", ())), start=1):
            given = {key: motion[key] for key in ("launch", "expect")}
            motions.append(FamousMotion(curve=curve, count=count, m=entry["m"], g=entry["g"], **given))
    return motions


MOTIONS = _read()
GRADIENTS = json.loads((DATA / "gradients.json").read_text(encoding="ascii"))["corpus"]
CURVES = list(dict.fromkeys(motion.curve for motion in MOTIONS))

ModuleOf = Callable[[FamousCurve], ModuleType]
MotionOf = Callable[[FamousMotion], Any]


def of_kind(*kinds: str) -> dict[str, Any]:
    """Return arguments of ``parametrize``: the motions of these kinds by their slugs."""
    motions = [motion for motion in MOTIONS if motion.expect["kind"] in kinds]
    return {"argvalues": motions, "ids": [motion.slug for motion in motions]}


EVERY_MOTION = pytest.mark.parametrize("famous", **of_kind("libration", "circulation", "transit"))
EVERY_CURVE = pytest.mark.parametrize("curve", CURVES, ids=[curve.slug for curve in CURVES])


@pytest.fixture(scope="session")
def famous_module(generated_folder: Path) -> ModuleOf:
    """Return the generated module of a famous curve."""
    built: dict[str, ModuleType] = {}

    def module(curve: FamousCurve) -> ModuleType:
        if curve.slug not in built:
            built[curve.slug] = gqm.build(curve.derive(), name=curve.slug, folder=generated_folder)
        return built[curve.slug]

    return module


@pytest.fixture(scope="session")
def famous_motion(famous_module: ModuleOf) -> MotionOf:
    """Return a motion of the corpus, solved once."""
    solved: dict[str, Any] = {}

    def motion(famous: FamousMotion) -> Any:
        if famous.slug not in solved:
            solved[famous.slug] = famous_module(famous.curve).solve(**famous.start)
        return solved[famous.slug]

    return motion


@dataclass(frozen=True, slots=True, kw_only=True)
class Scale:
    """The scales that "of its scale" refers to."""

    lam: float
    place: float
    v: float


@cache
def scale(famous: FamousMotion) -> Scale:
    """Return the largest |lam| or the orbit's range of it, the extent of the orbit in the plane, and the largest
    speed.
    """
    expect, lam0 = famous.expect, float(famous.launch["lam0"])
    if expect["kind"] == "libration":
        low, high = (float(text) for text in expect["turning_points"])
    elif expect["kind"] == "circulation":
        low, high = lam0, lam0 + float(famous.curve.period or "nan")
    else:
        met = [lam0, float(famous.launch["to"]), *(float(row["lam"]) for row in expect["positions"])]
        low, high = min(met), max(met)
    lams = np.linspace(low, high, ORBIT_POINTS)
    x, z = coordinates(famous.curve, lams)
    z0 = coordinates(famous.curve, np.array(lam0))[1]
    fastest = float(famous.launch["v0"]) ** 2 + 2 * float(famous.g) * float(z0 - z.min())
    return Scale(
        lam=max(abs(low), abs(high), high - low),
        place=float(max(np.ptp(x), np.ptp(z))),
        v=fastest**0.5,
    )


def coordinates(curve: FamousCurve, lams: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return places of the curve as SymPy and NumPy give them."""
    lam = sp.Symbol(curve.parameter)
    given = {name: sp.Rational(value) for name, value in curve.parameters}
    forms = [sp.sympify(text, locals={curve.parameter: lam}).subs(given) for text in curve.texts]
    if curve.kind == "graph":
        forms.insert(0, lam)
    elif curve.kind == "polar":
        forms = [forms[0] * sp.cos(lam), forms[0] * sp.sin(lam)]
    x, z = sp.lambdify([lam], forms, "numpy")(lams)
    return np.broadcast_to(x, lams.shape), np.broadcast_to(z, lams.shape)


def test_all_explicit_curves_are_here() -> None:
    """The corpus has 25 curves of three kinds, and 36 motions of three kinds."""
    assert len(CURVES) == 25
    assert {curve.kind for curve in CURVES} == {"parametric", "graph", "polar"}
    assert {motion.expect["kind"] for motion in MOTIONS} == {"libration", "circulation", "transit"}


@pytest.mark.sample(5)
@pytest.mark.parametrize("famous", **of_kind("libration"))
def test_libration(famous: FamousMotion, famous_motion: MotionOf, famous_module: ModuleOf) -> None:
    """A libration goes between two turning points, which it meets in order, half a period apart."""
    motion, expect, of = famous_motion(famous), famous.expect, scale(famous)
    assert motion.kind == "libration"
    met = list(zip(expect["turning_points"], expect["turning_points_xz"], strict=True))
    # A launch from rest is at the first turning point, and the body moves in the direction of the other.
    if (famous.launch["direction"] > 0) is not (famous.launch["v0"] == "0"):
        met.reverse()
    assert len(motion.turning_points) == 2
    turned = famous_module(famous.curve).pass1(motion.turning_points, **famous.start)
    for k, (lam, (x, z)) in enumerate(met):
        assert error(motion.turning_points[k], lam) <= TURNING * of.lam
        assert error(turned.x[k], x) <= TURNING * of.place
        assert error(turned.z[k], z) <= TURNING * of.place
    assert ulps(motion.half_period, expect["half_period"]) <= PERIOD_ULPS
    assert motion.period == 2 * motion.half_period


@pytest.mark.sample(3)
@pytest.mark.parametrize("famous", **of_kind("circulation"))
def test_circulation(famous: FamousMotion, famous_motion: MotionOf) -> None:
    """A circulation passes its place again after each loop time."""
    motion = famous_motion(famous)
    assert motion.kind == "circulation"
    assert len(motion.turning_points) == 0
    assert ulps(motion.period, famous.expect["loop_time"]) <= PERIOD_ULPS


@pytest.mark.sample(2)
@pytest.mark.parametrize("famous", **of_kind("libration", "circulation"))
def test_derivatives_of_periods(famous: FamousMotion, famous_motion: MotionOf, famous_module: ModuleOf) -> None:
    """Derivatives by each parameter and the launch are those of differences of 30 digits; the mass does not matter, and
    a sweep has the same ones within two roundings of the integral of their absolute values.
    """
    known = GRADIENTS[f"{famous.curve.name}, {famous.count}"]
    motion = famous_motion(famous)
    found = motion.gradient(known["quantity"])
    for name, wanted in known["by"].items():
        assert error(found[name], wanted) <= PERIOD_ULPS * 2.0**-52 * abs(float(wanted)) + ZERO, name
    assert {name for name, value in found.items() if value == 0.0} >= set(found) - set(known["by"])
    names = tuple(known["by"])
    launch = {name: float(Fraction(value)) for name, value in famous.start.items()} | {
        name: float(Fraction(value)) for name, value in famous.curve.parameters
    }
    module = famous_module(famous.curve)
    alone, swept = module.solve(**launch), module.sweep(known["quantity"], **launch, gradient=names)
    wanted, means = alone.gradient(known["quantity"], names), alone._derivatives._means[0][:, 3]
    rows = {name: row for row, name in enumerate((*module.PARAMETERS, "lam0", "v0"), start=1)}
    share = math.pi if known["quantity"] == "half_period" else 1.0
    for value, name in zip(swept.gradient.reshape(-1), names, strict=True):
        assert abs(value - wanted[name]) <= PERIOD_ULPS * 2.0**-52 * max(abs(wanted[name]), share * means[rows[name]])


@pytest.mark.sample(3)
@pytest.mark.parametrize("famous", **of_kind("transit"))
def test_transit(famous: FamousMotion, famous_motion: MotionOf) -> None:
    """The first time at the given place is correct; beyond it the body may turn or leave."""
    expected = famous.expect["transit_time"]
    assert error(famous_motion(famous).time_at(famous.launch["to"]), expected) <= TIME * float(expected)


@pytest.mark.sample(3)
@pytest.mark.parametrize("famous", **of_kind("transit"))
def test_derivatives_of_transits(famous: FamousMotion, famous_motion: MotionOf) -> None:
    """The derivatives of the time at the given place are those of differences of 30 digits."""
    motion = famous_motion(famous)
    for name, wanted in GRADIENTS[f"{famous.curve.name}, {famous.count}"]["by"].items():
        found = motion.gradient("time_at", name, lam=famous.launch["to"])[name]
        assert error(found, wanted) <= TIME * max(abs(float(wanted)), float(famous.expect["transit_time"])), name


@pytest.mark.sample(3)
@pytest.mark.parametrize("famous", **of_kind("transit"))
def test_transit_in_a_sweep(famous: FamousMotion, famous_module: ModuleOf) -> None:
    """Compiled loops give the same times, also for bodies that leave the curve."""
    swept = famous_module(famous.curve).sweep("time_at", lam=famous.launch["to"], **famous.start)
    assert set(swept.route_counts()) <= {"batch", "single"}
    expected = famous.expect["transit_time"]
    assert error(swept.values.item(), expected) <= TIME * float(expected)


@pytest.mark.sample(5)
@EVERY_MOTION
def test_speed_field(famous: FamousMotion, famous_module: ModuleOf) -> None:
    """ds, kappa, V**2 and N are correct at the sampled places, relative to the largest value among the samples."""
    samples = famous.expect["samples"]
    field = famous_module(famous.curve).pass1([row["lam"] for row in samples], **famous.start)
    for name in ("ds", "kappa", "v2", "normal_force"):
        largest = max(abs(float(row[name])) for row in samples)
        for actual, row in zip(getattr(field, name), samples, strict=True):
            assert error(actual, row[name]) <= SAMPLE * largest


@pytest.mark.sample(5)
@EVERY_MOTION
def test_positions(famous: FamousMotion, famous_motion: MotionOf) -> None:
    """lam, x, z and v are correct at each time; a periodic motion's last time is more than 1000 periods late."""
    motion, of = famous_motion(famous), scale(famous)
    rows = famous.expect["positions"]
    states = motion.state([row["t"] for row in rows])
    for k, row in enumerate(rows):
        along = max(of.lam, abs(float(row["lam"])))
        assert error(motion.lam(row["t"]), row["lam"]) <= POSITION * along
        assert error(states.lam[k], row["lam"]) <= POSITION * along
        assert error(states.x[k], row["x"]) <= POSITION * of.place
        assert error(states.z[k], row["z"]) <= POSITION * of.place
        assert error(states.v[k], row["v"]) <= POSITION * of.v


@pytest.mark.sample(5)
@EVERY_MOTION
def test_the_error_bound_is_honest(famous: FamousMotion, famous_motion: MotionOf) -> None:
    """No position, early or late, has a larger error than ``error_bound`` says."""
    motion = famous_motion(famous)
    for row in famous.expect["positions"]:
        assert error(motion.lam(row["t"]), row["lam"]) <= motion.error_bound(row["t"])


@pytest.mark.sample(5)
@EVERY_MOTION
def test_the_error_bound_is_useful(famous: FamousMotion, famous_motion: MotionOf) -> None:
    """The error bound is at most a hundred times the error. The worst ratio measured is 31."""
    rows = [(row["t"], row["lam"]) for row in famous.expect["positions"]]
    assert overstatement(famous_motion(famous), rows, scale(famous).lam) <= USEFUL


def first_launch(curve: FamousCurve) -> FamousMotion:
    """Return the first motion on a curve."""
    return next(motion for motion in MOTIONS if motion.curve == curve)


@pytest.mark.sample(3)
@EVERY_CURVE
def test_a_curve_file_gives_the_same_module(
    curve: FamousCurve, famous_module: ModuleOf, generated_folder: Path, tmp_path: Path
) -> None:
    """The module is the same byte by byte, whether declared in Python or in YAML, and the launch is read as written."""
    famous_module(curve)
    path = tmp_path / "curve.yaml"
    launch = first_launch(curve).launch
    path.write_text(curve.yaml(launch), encoding="utf-8")
    spec = gqm.read_spec(path)
    text = gqm.emit(spec.derive(), name=spec.name)
    assert text == (generated_folder / f"{curve.slug}.py").read_text(encoding="utf-8")
    assert spec.launch is not None
    assert {key: str(spec.launch[key]) for key in ("lam0", "v0")} == {key: launch[key] for key in ("lam0", "v0")}
    assert spec.launch["direction"] == launch["direction"]


@pytest.mark.extended
@pytest.mark.parametrize("name", SOLVED_FROM_YAML)
def test_a_curve_file_gives_the_same_digits(name: str, tmp_path: Path) -> None:
    """The half period and a late position can be computed from the curve file alone."""
    famous = next(motion for motion in MOTIONS if motion.curve.name == name)
    path = tmp_path / "curve.yaml"
    path.write_text(famous.curve.yaml(famous.launch), encoding="utf-8")
    spec = gqm.read_spec(path)
    assert spec.launch is not None
    module = gqm.build(spec.derive(), name=spec.name, folder=tmp_path)
    motion = module.solve(**spec.launch)
    assert ulps(motion.half_period, famous.expect["half_period"]) <= PERIOD_ULPS
    late = famous.expect["positions"][-1]
    assert error(motion.lam(late["t"]), late["lam"]) <= POSITION * scale(famous).lam
