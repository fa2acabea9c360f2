"""Implicit curves work in all stages: the corpus, the paper's family, singular points, bad input and YAML."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf
from naive import error, overstatement, ulps
from paths import DATA

import gqm_sym as gqm
from gqm_sym.cli.gen import main
from gqm_sym.declare.implicit import X, Z
from gqm_sym.errors import DeclarationError, GQMError, LaunchError

# The tolerances relative to the scale of each (MATHS, section 7): turning points and times; what pass1 fills; a
# position, however late.
TURNING = 1e-15
TIME = 1e-14
SAMPLE = 1e-13
POSITION = 8e-15
# The tolerance of a period in its last places, and the largest ratio of error_bound to what is necessary.
PERIOD_ULPS = 0.5
USEFUL = 100

Expected = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class FamousMotion:
    """A motion of the corpus on an implicit curve, with its numbers as text."""

    entry: Expected
    count: int

    @property
    def slug(self) -> str:
        """Return the curve's name as an identifier."""
        return "implicit_" + "".join(c if c.isalnum() else "_" for c in self.entry["name"].lower())

    @property
    def motion(self) -> Expected:
        """Return the launch and the expected results."""
        return (self.entry, *self.entry.get("also", ()))[self.count]

    @property
    def start(self) -> Expected:
        """Return arguments of ``module.solve`` besides the place."""
        launch = {key: self.motion["launch"][key] for key in ("v0", "direction")}
        return launch | {key: self.entry[key] for key in ("m", "g")}

    @property
    def along(self) -> float:
        """Return the scale of places on the curve."""
        expect = self.motion["expect"]
        if expect["kind"] == "circulation":
            return float(self.entry["period"])
        low, high = (float(text) for text in expect["turning_points"])
        return max(abs(low), abs(high), high - low)

    def derive(self) -> gqm.Model:
        """Declare the curve as the corpus gives it, but a closed one without its domain."""
        entry = self.entry
        ends = {} if entry["period"] else {"domain": entry["domain"]}
        curve = gqm.Curve.implicit(entry["F"], start=entry["start"], tangent=entry["tangent"], **ends)
        return gqm.derive(curve, gqm.Gravity(), parameters=entry["params"])

    def yaml(self) -> str:
        """Write the curve as a curve file, with a launch by its point."""
        entry, launch = self.entry, self.motion["launch"]
        lines = [f"name: {self.slug}", "curve:", "  implicit:", f"    F: {entry['F']}"]
        lines += [f"    start: [{', '.join(entry['start'])}]", f"    tangent: {entry['tangent']}"]
        if not entry["period"]:
            lines.append(f"    domain: [{', '.join(entry['domain'])}]")
        lines += ["kernel:", "  gravity: {}", "parameters:"]
        lines += [f"  {name}: {value}" for name, value in entry["params"].items()]
        place = f"point: [{', '.join(launch['point'])}]"
        lines.append(f"launch: {{{place}, v0: {launch['v0']}, direction: {launch['direction']}}}")
        return "\n".join([*lines, ""])


MOTIONS = [
    FamousMotion(entry=entry, count=count)
    for entry in json.loads((DATA / "curves.json").read_text(encoding="ascii"))
    if entry["kind"] == "implicit"
    for count in range(1 + len(entry.get("also", ())))
]
ModuleOf = Callable[[FamousMotion], ModuleType]
EVERY_MOTION = pytest.mark.parametrize("famous", MOTIONS, ids=lambda famous: f"{famous.slug}_{famous.count + 1}")
EVERY_CURVE = pytest.mark.parametrize(
    "famous", [famous for famous in MOTIONS if famous.count == 0], ids=lambda famous: famous.slug
)
BOTH_LAUNCHES = pytest.mark.parametrize("by", ["lam0", "point"])


@pytest.fixture(scope="module")
def famous_module(generated_folder: Path) -> ModuleOf:
    """Return the generated module of a famous curve."""
    built: dict[str, ModuleType] = {}

    def module(famous: FamousMotion) -> ModuleType:
        if famous.slug not in built:
            built[famous.slug] = gqm.build(famous.derive(), name=famous.slug, folder=generated_folder)
        return built[famous.slug]

    return module


def test_all_implicit_curves_are_here() -> None:
    """The corpus has six implicit curves and eight motions on them."""
    assert len({famous.slug for famous in MOTIONS}) == 6
    assert len(MOTIONS) == 8


@pytest.mark.sample(1)
@EVERY_MOTION
@BOTH_LAUNCHES
def test_motion(famous: FamousMotion, by: str, famous_module: ModuleOf) -> None:
    """Kind, turning points, half period or loop time, and positions are right in both launch directions."""
    expect, launch = famous.motion["expect"], famous.motion["launch"]
    motion = famous_module(famous).solve(**{by: launch[by]}, **famous.start)
    assert motion.kind == expect["kind"]
    if expect["kind"] == "libration":
        for place, text in zip(sorted(motion.turning_points), expect["turning_points"], strict=True):
            assert error(place, text) <= TURNING * famous.along
        assert ulps(motion.half_period, expect["half_period"]) <= PERIOD_ULPS
    else:
        assert ulps(motion.period, expect["loop_time"]) <= PERIOD_ULPS
    with mp.workdps(50):
        period = mpf(expect["loop_time"]) if motion.kind == "circulation" else 2 * mpf(expect["half_period"])
        assert abs(mpf(motion.period_to(33)) / period - 1) <= mpf(10) ** -32
    orbit = motion.state(np.linspace(0.0, motion.period, 401))
    extent, fastest = max(np.ptp(orbit.x), np.ptp(orbit.z)), np.abs(orbit.v).max()
    rows = expect["positions"]
    states = motion.state([row["t"] for row in rows])
    for k, row in enumerate(rows):
        far = max(famous.along, abs(float(row["lam"])))
        assert error(states.lam[k], row["lam"]) <= POSITION * far
        assert error(motion.lam(row["t"]), row["lam"]) <= POSITION * far
        assert error(states.x[k], row["x"]) <= POSITION * extent
        assert error(states.z[k], row["z"]) <= POSITION * extent
        assert error(states.v[k], row["v"]) <= POSITION * fastest


@pytest.mark.extended
@EVERY_MOTION
def test_the_error_bound(famous: FamousMotion, famous_module: ModuleOf) -> None:
    """The bound holds at every time, early and late, and is at most a hundred times the error. The worst ratio measured
    is 79.
    """
    motion = famous_module(famous).solve(lam0=0, **famous.start)
    rows = [(row["t"], row["lam"]) for row in famous.motion["expect"]["positions"]]
    for t, place in rows:
        assert error(motion.lam(t), place) <= motion.error_bound(t)
    assert overstatement(motion, rows, famous.along) <= USEFUL


@EVERY_MOTION
def test_speed_field(famous: FamousMotion, famous_module: ModuleOf) -> None:
    """x, z, ds, kappa, V**2 and N are right at the sampled places, relative to the largest among the samples."""
    samples = famous.motion["expect"]["samples"]
    field = famous_module(famous).pass1([row["lam"] for row in samples], lam0=0, **famous.start)
    for name in field._fields:
        largest = max(abs(float(row[name])) for row in samples)
        for actual, row in zip(getattr(field, name), samples, strict=True):
            assert error(actual, row[name]) <= SAMPLE * largest, name


@pytest.mark.sample(5)
@EVERY_CURVE
def test_a_curve_file_gives_the_same_module(
    famous: FamousMotion, famous_module: ModuleOf, generated_folder: Path, tmp_path: Path
) -> None:
    """The module is the same byte by byte, whether declared in Python or in YAML."""
    famous_module(famous)
    path = tmp_path / "curve.yaml"
    path.write_text(famous.yaml(), encoding="utf-8")
    spec = gqm.read_spec(path)
    text = gqm.emit(spec.derive(), name=spec.name)
    assert text == (generated_folder / f"{famous.slug}.py").read_text(encoding="utf-8")


def test_the_command_solves_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The command solves the file, and prints the right half period in its table."""
    famous = MOTIONS[-1]
    path = tmp_path / "curve.yaml"
    path.write_text(famous.yaml(), encoding="utf-8")
    assert main([str(path), "-o", str(tmp_path), "--solve"]) == 0
    printed = capsys.readouterr().out
    (line,) = (line for line in printed.splitlines() if "half period" in line)
    assert error(float(line.split()[2]), famous.motion["expect"]["half_period"]) <= TIME
    assert "dF/dx" in printed


def test_derivatives_and_orientation() -> None:
    """Gradient, Hessian, tangent and curvature are those of F, with the requested sign of the tangent."""
    F = sp.sympify("sin(x*z) + x**3*z**2 - exp(z)", locals={"x": X, "z": Z})
    at = {X: 0.7, Z: -0.4}
    for tangent in (1, -1):
        level = gqm.derive(gqm.Curve.implicit(F, start=(0, 0), tangent=tangent), gqm.Gravity()).level_set
        assert level is not None
        wanted = (F, *(sp.diff(F, *by) for by in ((X,), (Z,), (X, X), (X, Z), (Z, Z))))
        for row, want in zip(level.rows, wanted, strict=True):
            assert abs(float((row - want).evalf(subs=at))) <= 1e-15
        gradient = np.array([float(row.evalf(subs=at)) for row in level.rows[1:3]])
        along, across = (float(form.evalf(subs=at)) for form in (level.along, level.across))
        assert abs(along * gradient[0] + across * gradient[1]) <= 1e-15
        assert np.sign(along * -gradient[1] + across * gradient[0]) == tangent
        # The divergence of the unit normal (-dz/ds, dx/ds), which for t = (-F_z, F_x)/|grad F| is -grad F/|grad F|.
        turning = -sp.diff(-level.across, X) - sp.diff(level.along, Z)
        assert abs(float((turning - level.kappa).evalf(subs=at))) <= 1e-14


FAMILY_ULPS = 8


@pytest.fixture(scope="module")
def superellipse(generated_folder: Path) -> ModuleType:
    """Return a curve of the paper's family, x**4 + z**4 = 1."""
    curve = gqm.families.implicit("x**4 + z**4 - 1", start=("17**(-1/4)", "-2*17**(-1/4)"))
    return gqm.build(gqm.derive(curve, gqm.Gravity()), name="implicit_superellipse", folder=generated_folder)


@pytest.mark.extended
def test_family(superellipse: ModuleType) -> None:
    """The reference case of the paper's Table 3 is right."""
    cases = json.loads((DATA / "paper_cases.json").read_text(encoding="utf-8"))
    (case,) = (case for case in cases["cases"] if case["id"] == "table3_8_implicit")
    motion = superellipse.solve(lam0=0, v0="1.5")
    expected = case["expected"]
    assert ulps(motion.half_period, expected["half_period"]) <= PERIOD_ULPS
    with mp.workdps(50):
        assert abs(mpf(motion.period_to(39)) / mpf(expected["period"]) - 1) <= mpf(10) ** -38
    width = float(expected["arc_length_between_turning_points"])
    for actual, row in zip(motion.turning_points, expected["turning_points_in_order"], strict=True):
        assert error(actual, row["s"]) <= TURNING * width
    assert error(motion.time_at(motion.turning_points[0]), expected["time_to_first_turning_point"]) <= 1e-14
    rows = expected["positions"]
    states = motion.state([row["t"] for row in rows])
    for k, row in enumerate(rows):
        for name, scale in (("s", width), ("x", 1.7), ("z", 1.7), ("v", 1.6)):
            text = row["V" if name == "v" else name]
            assert error(getattr(states, name)[k], text) <= POSITION * scale
    field = superellipse.pass1([row["s"] for row in expected["pass1"]], lam0=0, v0="1.5")
    for k, row in enumerate(expected["pass1"]):
        for name in ("x", "z", "kappa"):
            assert error(getattr(field, name)[k], row[name]) <= SAMPLE
        assert error(field.v2[k], row["V2"]) <= SAMPLE * 3
        assert error(field.normal_force[k], row["N"]) <= SAMPLE * 20


@pytest.mark.extended
def test_run_time_parameters(generated_folder: Path) -> None:
    """Start, domain and F may contain run-time parameters, and each set of values has its own chart."""
    curve = gqm.Curve.implicit(
        "x**2 + z**2 - R**2", start=(0, "-R"), domain=(None, "h*R"), parameters={"R": 2, "h": 1}, tangent=1
    )
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="implicit_bowl", folder=generated_folder)
    with mp.workdps(30):
        for radius in (2, 0.5):
            sine = mp.sin(mpf("0.25")) ** 2
            wanted = 2 * mp.sqrt(mpf(radius) / mpf("9.81")) * mp.ellipk(sine)
            assert ulps(module.solve(lam0=radius * 0.5, R=radius).half_period, wanted) <= FAMILY_ULPS
    with pytest.raises(LaunchError, match=r"lam0: must lie in the domain \[-[0-9.]+, 1\.0\] of s, got 1\.5"):
        module.solve(lam0=1.5, R=1)
    with pytest.raises(LaunchError, match=r"domain: must contain 0, where the start point is"):
        module.solve(lam0=0, h=-1)


@pytest.mark.sample(4)
def test_motion_ends_at_a_singular_point(generated_folder: Path) -> None:
    """A body on the strophoid's loop that is fast enough reaches its node, where its motion ends."""
    curve = gqm.Curve.implicit(
        "x**2*(a - z) - z**2*(a + z)", start=("-3*sqrt(3)/10", "-9/10"), tangent=-1, parameters={"a": "9/5"}
    )
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="implicit_strophoid", folder=generated_folder)
    for direction in (1, -1):
        motion = module.solve(lam0=0, v0=5, direction=direction)
        assert motion.kind == "transit"
        assert motion.legs[-1].end == "singular-point"
        event = motion.events[-1]
        assert event.kind == "singular-point"
        assert max(abs(event.x), abs(event.z)) <= 1e-15


def test_start_off_the_curve(generated_folder: Path) -> None:
    """A start point with rounded coordinates is moved onto the curve; another point is refused when its values are
    known.
    """
    curve = gqm.Curve.implicit("x**2 + z**2 - 1", start=("u", "w"))
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="implicit_ring", folder=generated_folder)
    near = module.solve(lam0=0, u=0.6000001, w=-0.8)
    assert abs(near.state(0.0).x - np.cos(np.arctan2(-0.8, 0.6000001))) <= 1e-15
    with pytest.raises(
        LaunchError, match=r"start: \(0\.3, -0\.4\) is not on the curve: it is 0\.5 from it; the nearest"
    ):
        module.solve(lam0=0, u="0.3", w="-0.4")
    with pytest.raises(LaunchError, match=r"point: \(0\.5, -0\.9\) is 0\.029\d* off the curve; the nearest point"):
        module.solve(point=(0.5, -0.9), u="0.6", w="-0.8")


def test_launch_point_on_a_curve_without_end(generated_folder: Path) -> None:
    """However far the curve is followed, a point counts as near it if it is near relative to its place."""
    curve = gqm.Curve.implicit("z - x**2", start=(0, 0), tangent=-1)
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="implicit_parabola", folder=generated_folder)
    half = module.solve(point=("1/2", "1/4")).half_period
    with mp.workdps(30):
        # The half period is 2E(m)/sqrt(2ga) with m = -4 a**2 X**2.
        assert ulps(half, 2 * mp.ellipe(-1) / mp.sqrt(2 * mpf("9.81"))) <= FAMILY_ULPS
    assert module.solve(point=(0, 0)).kind == "rest"
    with pytest.raises(LaunchError, match=r"point: \(5\.0, 0\.0\) is 4\.06 off the curve; the nearest .* \(1\."):
        module.solve(point=(5, 0))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"F": "a**2 - 1"}, r"implicit: F: contains neither x nor z, got a\*\*2 - 1; the curve is where F\(x, z\) = 0"),
        ({"F": "x +* z"}, r"implicit: F: column 4"),
        ({"start": "(1, 0)"}, r"implicit: start: must be a point \(x, z\) of the curve, got '\(1, 0\)'"),
        ({"start": (1, 0, 0)}, r"implicit: start: must be a point \(x, z\)"),
        ({"start": ("x", 0)}, r"implicit: start: x contains a coordinate; only numbers and run-time parameters"),
        ({"tangent": 0}, r"implicit: tangent: must be 1, for .*, or -1, for the opposite; got 0"),
        ({"tangent": True}, r"implicit: tangent: must be 1"),
        ({"domain": (1, 2)}, r"implicit: domain: must contain 0, where the start point is; got \(1, 2\)"),
        ({"domain": (-2, "-1/2")}, r"implicit: domain: must contain 0"),
        ({"parameter": "x"}, r"implicit: parameter: 'x' is a coordinate; give arc length another name, as s"),
        (
            {"F": "x**2 + z**2 - s"},
            r"implicit: 's' is the curve's arc length and stands in F or start; give one of them",
        ),
        ({"parameters": {"R": 1}}, r"implicit curve: parameter 'R' is declared but not used"),
    ],
    ids=lambda value: "" if isinstance(value, str) else "-".join(f"{k}={v}" for k, v in value.items()),
)
def test_bad_declaration(given: dict[str, Any], message: str) -> None:
    """A bad declaration is refused, and the message says what would be right."""
    arguments: dict[str, Any] = {"F": "x**2 + z**2 - 1", "start": (1, 0), **given}
    with pytest.raises(GQMError, match=message):
        gqm.Curve.implicit(arguments.pop("F"), **arguments)


def test_constant_in_disguise() -> None:
    """If F changes with neither coordinate, there is no curve."""
    with pytest.raises(DeclarationError, match="changes neither with x nor with z"):
        gqm.derive(gqm.Curve.implicit("sin(x)**2 + cos(x)**2 - 1", start=(1, 0)), gqm.Gravity())


CURVE = """name: ring
curve:
  implicit: {F: x**2 + z**2 - R**2, start: [R, 0]}
kernel: {gravity: {}}
parameters: {R: 1}
"""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (CURVE.replace("start: [R, 0]", "start: [R]"), "3:44: curve.implicit.start: must have two"),
        (CURVE.replace("start: [R, 0]", "start: [z, 0]"), "3:44: curve.implicit.start: z contains a coordinate"),
        (CURVE.replace("[R, 0]", "[R, 0], tangent: 2"), "tangent: must be 1 or -1 (the sign of the tangent"),
        (CURVE.replace("F: x**2 + z**2 - R**2, ", ""), "curve.implicit: F is missing; add F: x**4 + z**4 - 1"),
        (CURVE.replace("parameters: {R: 1}\n", ""), "3:31: 'R' is not in parameters"),
        (CURVE + "launch: {lam0: 0, point: [1, 0]}\n", "6:1: launch: lam0 and point are given; give one of them"),
        (CURVE + "launch: {v0: 1}\n", "6:1: launch: lam0 is missing"),
        (CURVE + "launch: {point: [1]}\n", "launch.point: must"),
    ],
)
def test_bad_file(text: str, message: str, tmp_path: Path) -> None:
    """Mistakes in a curve file are reported with their places."""
    path = tmp_path / "a.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(GQMError) as caught:
        gqm.read_spec(path)
    assert message in str(caught.value)


@pytest.mark.sample(1)
@pytest.mark.parametrize("force", [gqm.Gravity(), gqm.Gravity() + gqm.QuadraticDrag(b="c")], ids=["free", "drag"])
def test_contact_force_that_touches_zero(force: gqm.Kernel, tmp_path: Path) -> None:
    """At the flat sides of x**4 + z**4 = 1 both parts of N vanish, so that N touches zero without changing its sign."""
    curve = gqm.Curve.implicit("x**4 + z**4 - 1", start=(0, -1))
    module = gqm.build(gqm.derive(curve, force), name="sides", folder=tmp_path)
    losing = {"c": 0.1} if "c" in module.PARAMETERS else {}
    motion = module.solve(lam0=0.2, v0=8, t_max=2, **losing)
    places = [event.z for event in motion.events if event.kind == "contact-sign"]
    assert places
    assert min(abs(z) for z in places) > 0.1
