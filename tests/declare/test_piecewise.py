"""Rails are declared in Python and in YAML, and impossible ones are refused with the name of the piece."""

import math
from pathlib import Path
from typing import Any

import pytest
from railed import LOOP, built, chart_of

import gqm_sym as gqm
from gqm_sym.errors import DeclarationError, ParameterError, SolutionError


def test_joints_must_match(tmp_path: Path) -> None:
    """At joints, place and tangent must agree within 1e-9; the message names the joint and the difference."""
    curve = gqm.Curve.graph("(x - 1)*(x - 1 + tilt) + gap", domain=(1, 2))
    module = built(tmp_path, "joint", [gqm.line(length=1), curve])
    assert chart_of(module, gap=1e-10, tilt=1e-10).high > 2.0
    for gap, tilt in ((1e-8, 0), (0, 1e-8), (0.5, -2)):
        missed = rf"{gap:.3g} and {abs(math.atan(tilt)):.3g} rad"
        with pytest.raises(
            DeclarationError, match=rf"piece 2 \(curve\): begins at .* {missed} off where the piece before"
        ):
            module.solve(lam0=0.5, v0=1, gap=gap, tilt=tilt)
    half = built(tmp_path, "open", [gqm.line(length=3), gqm.arc(radius=1, angle="pi")], closed=True)
    with pytest.raises(
        DeclarationError, match=r"closed: the start lies at .* off where the last piece ends: .* both must"
    ):
        half.solve(lam0=1)


@pytest.mark.parametrize(
    ("pieces", "given", "error", "message"),
    [
        ([gqm.line(length="q")], {"q": -1}, ParameterError, r"piece 1 \(line\): length: must be positive, got -1.0"),
        (
            [gqm.arc(radius="q", angle=1)],
            {"q": 0},
            ParameterError,
            r"piece 1 \(arc\): radius: must be positive, got 0.0",
        ),
        ([gqm.arc(radius=1, angle="q")], {"q": 0}, ParameterError, r"piece 1 \(arc\): angle: must not be zero"),
        (
            [gqm.arc(radius=1, angle="q")],
            {"q": 1e6},
            ParameterError,
            r"piece 1 \(arc\): turns by 1e\+06 rad; 100000 is",
        ),
        (
            [gqm.Curve.graph("x", domain=("q", 0))],
            {"q": 1},
            ParameterError,
            r"piece 1 \(curve\): domain: must have finite",
        ),
        (
            [gqm.Curve.graph("log(x)", domain=("q", 1))],
            {"q": -1},
            SolutionError,
            r"piece 1 \(curve\): the curve is not fin",
        ),
        (
            [gqm.Curve.graph("abs(x)", domain=("q", 1))],
            {"q": -0.3},
            SolutionError,
            r"piece 1 \(curve\): the curve has a cu",
        ),
    ],
)
def test_numbers_that_cannot_be(
    pieces: list[Any], given: dict[str, float], error: type[Exception], message: str, tmp_path: Path
) -> None:
    """Lengths, angles and domains that depend on parameters are checked when their values are known."""
    module = built(tmp_path, "wrong", pieces)
    with pytest.raises(error, match=message):
        module.solve(lam0=0, v0=1, **given)


@pytest.mark.parametrize(
    ("declare", "message"),
    [
        (lambda: gqm.line(length=0), "line: length: must be positive, got 0"),
        (lambda: gqm.arc(radius="-2", angle=1), "arc: radius: must be positive, got -2"),
        (lambda: gqm.arc(radius=2, angle=0), "arc: angle: must not be zero"),
        (lambda: gqm.arc(radius=2, angle=-90), "arc: angle: -90 rad are 14.3 turns; for degrees write '-90 deg'"),
        (lambda: gqm.clothoid(length="1 +", kappa_start=0, kappa_end=1), "clothoid: length: "),
        (lambda: gqm.Curve.piecewise([]), "piecewise: no pieces; give one or more"),
        (
            lambda: gqm.Curve.piecewise(["line"]),
            "piecewise: piece 1: must be a line, an arc, a clothoid, a transition or a curve with formulas, got 'line'",
        ),
        (
            lambda: gqm.Curve.piecewise([gqm.Curve.graph("x**2")]),
            r"piecewise: piece 1 \(graph\): domain: must have two ends",
        ),
        (
            lambda: gqm.Curve.piecewise([gqm.Curve.piecewise([gqm.line(length=1)])]),
            "piecewise: piece 1: a curve of kind 'piecewise' cannot be a piece",
        ),
        (lambda: gqm.Curve.piecewise([gqm.line(length="s")]), "piecewise: 's' is the arc length of the rail"),
        (
            lambda: gqm.Curve.piecewise([gqm.Curve.graph("x", domain=(0, 1))], start=(0, 0)),
            "piecewise: start: the first piece is a curve with a place of its own",
        ),
        (
            lambda: gqm.Curve.piecewise([gqm.line(length=1)], start=3),
            r"piecewise: start: must be a pair \(x, z\), or three numbers in space, got 3",
        ),
        (
            lambda: gqm.Curve.piecewise([gqm.line(length=1)], closed=1),
            "piecewise: closed: must be True or False, got 1",
        ),
        (
            lambda: gqm.Curve.piecewise([gqm.Curve.graph("q*x", domain=(0, 1), parameters={"q": k}) for k in (1, 2)]),
            r"piecewise: piece 2 \(graph\): 'q' is 2 there and 1 before",
        ),
    ],
)
def test_declarations_that_cannot_be(declare: Any, message: str) -> None:
    """A declaration that is wrong for all values of the parameters is refused at once."""
    with pytest.raises(gqm.GQMError, match=f"^{message}"):
        declare()


def test_parameters_of_pieces() -> None:
    """Parameters of pieces are listed once each in order of appearance, with the defaults of curves and those given."""
    pieces = [
        gqm.arc(radius="R", angle="turn"),
        gqm.Curve.graph("k*x + R", domain=(0, "w"), parameters={"k": 2, "w": None, "R": None}, positive=["k"]),
    ]
    curve = gqm.Curve.piecewise(pieces, start=("x0", 0), parameters={"R": "1.5"})
    assert dict(curve.defaults) == {"R": "1.5", "x0": None, "turn": None, "k": 2, "w": None}
    assert curve.positive == ("k",)


YAML = """
name: rail
curve:
  pieces:
{pieces}
kernel: {{gravity: {{}}}}
parameters: {{R: 1.5, c: 2, a: 2}}
"""
WRITTEN = """
    - line: {length: a}
    - clothoid: {length: c, kappa_start: 0, kappa_end: 1/R}
    - arc: {radius: R, angle: 2*pi - c/R}
    - clothoid: {length: c, kappa_start: 1/R, kappa_end: 0}
    - line: {length: a}
"""


def spec(folder: Path, pieces: str, *, parameters: bool = True) -> gqm.Curve:
    """Return the curve of a YAML file."""
    text = YAML.format(pieces=pieces.strip("\n"))
    (folder / "rail.yaml").write_text(text if parameters else text.rpartition("parameters")[0])
    return gqm.read_spec(folder / "rail.yaml").curve


def test_rails_in_yaml(tmp_path: Path) -> None:
    """A rail in YAML is a list of pieces, or a mapping with start, heading and closed; families and graphs are pieces
    too.
    """
    assert spec(tmp_path, WRITTEN).definition == gqm.Curve.piecewise(LOOP).definition
    head = "    start: [0, 1]\n    heading: -pi/6\n    closed: true\n    pieces:"
    long = spec(tmp_path, head + WRITTEN)
    assert long.definition == gqm.Curve.piecewise(LOOP, start=(0, 1), heading="-pi/6", closed=True).definition
    curves = "    - graph: {z: x**2, domain: [0, 1]}\n    - family: {name: parabola, a: 1, domain: [1, 2]}"
    pieces = [gqm.Curve.graph("x**2", domain=(0, 1)), gqm.families.parabola(a="1", domain=(1, 2))]
    assert spec(tmp_path, curves, parameters=False).definition == gqm.Curve.piecewise(pieces).definition


@pytest.mark.parametrize(
    ("pieces", "message"),
    [
        ("    - line: {length: -2}", ":5:5: curve.pieces: piece 1, line: length: must be positive, got -2"),
        ("    - arc: {radius: 2}", ":5:7: curve.pieces.0.arc: angle is missing; add angle: pi/2"),
        (
            "    - {}",
            ":5:5: curve.pieces: piece 1, which is empty: give exactly one of line, arc, clothoid, transition, graph",
        ),
        ("    - {line: {length: 1}, arc: {radius: 1, angle: 1}}", "piece 1, which is line and arc: give exactly one"),
        ("    - spiral: {length: 1}", "curve.pieces.0: unknown key 'spiral'"),
        ("    - line: {length: 1 +}", r":5:25: curve.pieces.0.line.length: "),
        ("    - graph: {z: x**2}", r"piece 1 \(graph\): domain: must have two ends"),
        ("    - family: {name: parabola, b: 1}", "curve.pieces.0.family: unknown key 'b'"),
        ("    start: [0, 1]", "curve.pieces: pieces is missing; add pieces: "),
        (
            "    start: 1\n    pieces: [{line: {length: 1}}]",
            r"curve.pieces.start: must be a list, as in \[a, b\], got '1'",
        ),
    ],
)
def test_mistakes_in_yaml(tmp_path: Path, pieces: str, message: str) -> None:
    """Each mistake in YAML is reported at its place."""
    with pytest.raises(gqm.GQMError, match=message):
        spec(tmp_path, pieces, parameters=False)
