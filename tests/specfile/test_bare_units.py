"""Texts such as "50 cm" are read in each place of a curve file, and quantities in each argument of a curve.

They are converted if a dimension is known, and otherwise refused with what to write instead.
"""

import math
from pathlib import Path
from typing import Any

import pytest
import sympy as sp
from pint import UnitRegistry

import gqm_sym as gqm
from gqm_sym.errors import GQMError, SpecFileError
from gqm_sym.specfile import read_spec
from gqm_sym.specfile.spec import Spec

FILE = "name: a\ncurve: {CURVE}\nkernel: {KERNEL}\nparameters: {PARAMETERS}\nlaunch: {LAUNCH}\n"
PARTS = {
    "CURVE": "{parametric: {x: R*sin(u), z: -R*cos(u), parameter: u}}",
    "KERNEL": "{gravity: {}}",
    "PARAMETERS": "{R: 1}",
    "LAUNCH": "{lam0: 0.5}",
}
RING = "implicit: {F: x**2 + z**2 - 1, start: [100 cm, 0]}"


def read(folder: Path, **parts: str) -> Spec:
    """Return the declaration in a file of these parts."""
    text = FILE
    for name, part in {**PARTS, **parts}.items():
        text = text.replace("{" + name + "}", part)
    path = folder / "a.yaml"
    path.write_text(text)
    (folder / "t.csv").write_text("x,z\n" + "".join(f"{x},{x * x / 40}\n" for x in range(-6, 7)))
    return read_spec(path)


@pytest.mark.parametrize(
    ("part", "text", "parameters"),
    [
        ("PARAMETERS", "{R: 50 cm}", {"R": "0.5"}),
        ("PARAMETERS", "{R: 1, m: 250 g, g: 981 cm/s**2}", {"R": "1", "m": "0.25", "g": "9.81"}),
        ("LAUNCH", "{lam0: 30 deg, v0: 3.6 km/h, t_max: 2 min}", {"lam0": "pi/6", "v0": "1", "t_max": "120"}),
        ("LAUNCH", "{lam0: 30 °}", {"lam0": "pi/6"}),
    ],
)
def test_parameters_and_launches(part: str, text: str, parameters: dict[str, str], tmp_path: Path) -> None:
    """A text such as "50 cm" means the same as its value and unit apart."""
    spec = read(tmp_path, **{part: text})
    assert dict(spec.launch if part == "LAUNCH" else spec.parameters) == parameters


@pytest.mark.parametrize(
    ("curve", "domain", "period"),
    [
        ("graph: {z: x**2, domain: [-50 cm, 0.5 m]}", (-sp.Rational(1, 2), sp.Rational(1, 2)), None),
        ("parametric: {x: sin(u), z: cos(u), parameter: u, period: 360 deg}", (None, None), 2 * sp.pi),
        ("polar: {r: 1 + theta**2, domain: [-90 deg, 90 °]}", (-sp.pi / 2, sp.pi / 2), None),
        (
            "implicit: {F: x**2 + z**2 - 1, start: [1 m, 0], domain: [-50 cm, 50 cm]}",
            (-sp.Rational(1, 2), sp.Rational(1, 2)),
            None,
        ),
        ("family: {name: ellipse, a: 200 cm, b: 1 m}", (None, None), 2 * sp.pi),
    ],
)
def test_domains_periods_and_families(curve: str, domain: Any, period: Any, tmp_path: Path) -> None:
    """The ends of a parameter are converted from the unit in which the kind of curve measures it."""
    found = read(tmp_path, CURVE="{" + curve + "}", PARAMETERS="{}", LAUNCH="{lam0: 0.25}").curve
    assert found.period == period
    assert found.domain == domain


def test_rails_points_and_places(tmp_path: Path) -> None:
    """Units are read in pieces and where they begin, in the scatter of points, in the start of a level curve and in a
    launch point.
    """
    pieces = "line: {length: 50 cm}}, {arc: {radius: 200 cm, angle: 90 deg}}, "
    pieces += "{clothoid: {length: 1 m, kappa_start: 0.5 1/m, kappa_end: 0}"
    rail = "{pieces: {pieces: [{" + pieces + "}], start: [50 cm, 1], heading: -90 deg}}"
    found = read(tmp_path, CURVE=rail, PARAMETERS="{}").curve.definition
    half = sp.Rational(1, 2)
    assert found.start == (half, 1, -sp.pi / 2)
    assert [piece.numbers for piece in found.pieces] == [(half,), (2, sp.pi / 2), (1, half, 0)]
    level = read(tmp_path, CURVE="{" + RING + "}", PARAMETERS="{}", LAUNCH="{point: [0, -100 cm]}")
    assert level.launch["point"] == ["0", "-1"]
    assert [float(x) for x in level.curve.definition.start] == [1.0, 0.0]
    smooth = (
        read(tmp_path, CURVE=f"{{points: {{file: t.csv, smoothing: {text}}}}}", PARAMETERS="{}")
        for text in ("2 mm", "{value: 2, unit: mm}", "0.002")
    )
    assert len({spec.curve.definition.points for spec in smooth}) == 1


@pytest.mark.parametrize(
    ("kernel", "parameters"),
    [
        ("{gravity: {g: 981 cm/s**2}}", {"g": "9.81"}),
        ("{gravity: {}, coulomb: {mu: 10 percent}}", {"mu": "0.1"}),
        ("{gravity: {}, drag: {b: 10 g/m}}", {"b": "0.01"}),
    ],
)
def test_kernels(kernel: str, parameters: dict[str, str], tmp_path: Path) -> None:
    """Units are read in the values of the forces' own parameters."""
    defaults = dict(read(tmp_path, KERNEL=kernel).kernel.defaults)
    assert {name: defaults[name] for name in parameters} == parameters


@pytest.mark.parametrize(
    ("part", "text", "message"),
    [
        ("PARAMETERS", "{R: 50 kg}", "parameters.R.unit: must be in m or a multiple of it, got kg"),
        ("PARAMETERS", "{R: {value: 50 cm}}", "parameters.R.value: must be a number, got 50 cm; write unit: cm"),
        ("LAUNCH", "{lam0: 0.5, v0: 3 m}", "launch.v0.unit: must be in m/s or a multiple of it, got m"),
        ("CURVE", "{graph: {z: R, domain: [-1 kg, 1]}}", "graph.domain: must be in m or a multiple of it, got kg"),
        ("CURVE", "{parametric: {x: R*u, z: u**2, parameter: u, domain: [0 m, 1]}}", "domain: a unit is not known"),
        ("CURVE", "{graph: {z: 50 cm}}", "graph.z: a unit is not known for it, got cm; give a plain number"),
        ("CURVE", "{pieces: [{line: {length: 50 kg}}]}", "line: length: must be in m or a multiple of it, got kg"),
        ("CURVE", "{points: {file: t.csv, smoothing: 1 s}}", "smoothing: must be in m or a multiple of it, got s"),
        ("CURVE", "{" + RING.replace("100 cm", "1 s") + "}", "start: must be in m or a multiple of it, got s"),
        ("KERNEL", "{gravity: {}, potential: {U: 3 m}}", "potential.U: a unit is not known for it, got m"),
    ],
)
def test_what_is_refused(part: str, text: str, message: str, tmp_path: Path) -> None:
    """Another dimension, and a unit where none is known, are refused with the line and with what is right."""
    with pytest.raises(SpecFileError) as caught:
        read(tmp_path, **{part: text})
    assert message in str(caught.value)


def test_a_point_in_seconds_is_refused(tmp_path: Path) -> None:
    """The coordinates of a launch are lengths."""
    with pytest.raises(SpecFileError, match=r"launch.point.0: must be in m or a multiple of it, got s"):
        read(tmp_path, CURVE="{" + RING + "}", PARAMETERS="{}", LAUNCH="{point: [1 s, 0]}")


def test_quantities_in_declarations() -> None:
    """Quantities mean the same as their numbers in SI."""
    u = UnitRegistry()
    cm, deg = u.Quantity(50, "cm"), u.Quantity(90, "deg")
    assert gqm.line(length=cm) == gqm.line(length="50 cm") == gqm.line(length="1/2")
    assert gqm.arc(radius=cm, angle=deg) == gqm.arc(radius="1/2", angle="pi/2")
    kappa = u.Quantity(2, "1/m")
    bent = gqm.clothoid(length=cm, kappa_start=kappa, kappa_end="0")
    assert bent == gqm.clothoid(length="1/2", kappa_start=2, kappa_end=0)
    assert gqm.Curve.graph("x**2", domain=(-cm, cm)).domain == gqm.Curve.graph("x**2", domain=("-1/2", "1/2")).domain
    ring = gqm.Curve.parametric(x="cos(u)", z="sin(u)", parameter="u", period=4 * deg)
    assert ring.period == 2 * sp.pi
    rail = gqm.Curve.piecewise([gqm.line(length=1)], start=(cm, 0), heading=deg)
    assert rail.definition.start == (sp.Rational(1, 2), 0, sp.pi / 2)
    x = [float(k) for k in range(9)]
    z = [k * k / 40 for k in x]
    tracks = [gqm.Curve.sampled(x, z, smoothing=given) for given in (u.Quantity(2, "mm"), "2 mm", 0.002)]
    assert len({track.definition.points for track in tracks}) == 1
    for wrong in (
        lambda: gqm.line(length=u.Quantity(1, "kg")),
        lambda: gqm.arc(radius=1, angle=cm),
        lambda: gqm.Curve.graph("x**2", domain=(u.Quantity(0, "s"), None)),
        lambda: gqm.Curve.graph(cm),
        lambda: gqm.Curve.parametric(x="u", z="u**2", parameter="u", domain=(cm, None)),
        lambda: gqm.Curve.sampled(x, z, smoothing="2 s"),
    ):
        with pytest.raises(GQMError, match=r"must be |a unit is not known for it"):
            wrong()


@pytest.mark.parametrize("heading", ["pi", "180 deg", math.pi, "-3*pi"])
def test_a_line_that_runs_back_is_level(heading: Any, tmp_path: Path) -> None:
    """The height of the line does not change, so that no speed is lost (it rose by the rounding of sin(pi))."""
    curve = gqm.Curve.piecewise([gqm.line(length=2)], heading=heading)
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="level", folder=tmp_path)
    motion = module.solve(1, 1, 1)
    assert motion.t_end == 1.0
    state = motion.state([0.25, 1.0])
    assert state.z.tolist() == [0.0, 0.0]
    assert state.x.tolist() == [-1.25, -2.0]
    assert state.v2.tolist() == [1.0, 1.0]
