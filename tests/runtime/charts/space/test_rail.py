"""Rails in space agree with helices, a 30-digit solution of the frame's equations, planar rails and pendulums."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from railed import LOOP, built, chart_of

import gqm_sym as gqm
from gqm_sym.errors import ArgumentError, DeclarationError, GQMError, ParameterError
from gqm_sym.specfile import read_spec

# Roundings of coordinates, as a share of the largest.
ROUNDING = 4e-16

YAW = ("0.1", "0.2", "-0.03", "0.01", "0", "0.001")
PITCH = ("0.05", "-0.1", "0.02")
ROLL = ("0.3", "0", "0.01", "0", "-0.002")
START, ANGLES = (1, 2, 3), ("1/2", "1/4", "1/3")


def polynomial(coefficients: tuple[str, ...]) -> str:
    """Return the text of a polynomial in s."""
    return " + ".join(f"({value})*s**{power}" for power, value in enumerate(coefficients))


def frame_truth(places: list[Any]) -> list[Any]:
    """Return coordinates and the frame on a transition, from the equations of the frame."""
    heading, climb, roll = mpf(1) / 2, mpf(1) / 4, mpf(1) / 3
    ahead = mp.matrix([mp.cos(climb) * mp.cos(heading), mp.cos(climb) * mp.sin(heading), mp.sin(climb)])
    level = mp.matrix([-mp.sin(heading), mp.cos(heading), 0])
    above = mp.matrix([-mp.sin(climb) * mp.cos(heading), -mp.sin(climb) * mp.sin(heading), mp.cos(climb)])
    left, up = mp.cos(roll) * level - mp.sin(roll) * above, mp.cos(roll) * above + mp.sin(roll) * level

    def slope(s: Any, y: Any) -> Any:
        # The coefficients are doubles in the module.
        yaw, pitch, rate = (sum(mpf(float(c)) * s**k for k, c in enumerate(rates)) for rates in (YAW, PITCH, ROLL))
        t, side, top = y[3:6], y[6:9], y[9:12]
        return [
            *t,
            *(yaw * a + pitch * b for a, b in zip(side, top, strict=True)),
            *(-yaw * a - rate * b for a, b in zip(t, top, strict=True)),
            *(-pitch * a + rate * b for a, b in zip(t, side, strict=True)),
        ]

    found = mp.odefun(slope, 0, [*map(mpf, START), *ahead, *left, *up])
    return [found(place) for place in places]


@pytest.mark.extended
def test_transition(tmp_path: Path) -> None:
    """With rates of degree 5, coordinates, tangents and the roll are those of the frame's equations in 25 digits."""
    rates = {"yaw": polynomial(YAW), "pitch": polynomial(PITCH), "roll": polynomial(ROLL)}
    module = built(tmp_path, "bent", [gqm.transition(length=3, **rates)], start=START, heading=ANGLES, roll="pieces")
    chart = chart_of(module)
    places = [0.75, 2.0, 3.0]
    with mp.workdps(25):
        truth = frame_truth([mpf(place) for place in places])
    for k, place in enumerate(places):
        errors = [abs(mpf(float(a)) - b) for a, b in zip(chart.coordinates([place])[:, 0], truth[k][:3], strict=True)]
        assert max(errors) <= 8 * ROUNDING
        dz = chart.points([place])[2, 0]
        assert abs(mpf(float(dz)) - truth[k][5]) <= ROUNDING
        ahead, left, up = (truth[k][3 + 3 * row : 6 + 3 * row] for row in range(3))
        across = [part / mp.hypot(ahead[0], ahead[1]) for part in (-ahead[1], ahead[0])]
        lean = mp.atan2(*(row[0] * across[0] + row[1] * across[1] for row in (up, left)))
        found = module.pass1([place], 0, 1).roll[0]
        assert abs(mpf(float(found)) - lean) <= 4 * ROUNDING


@pytest.mark.extended
def test_helix(tmp_path: Path) -> None:
    """Constant curvature and torsion give a helix, many turns long."""
    radius, rise = 2.0, 0.75
    square = radius**2 + rise**2
    rates = {"yaw": "R/(R**2 + c**2)", "roll": "-c/(R**2 + c**2)"}
    given = {"start": ("R", 0, 0), "heading": ("pi/2", "atan(c/R)"), "parameters": {"R": "2", "c": "3/4"}}
    module = built(tmp_path, "helix", [gqm.transition(length=80, **rates)], **given)
    s = np.linspace(0, 80, 401)
    found, angle = module.pass1(s, 0, 1), s / np.sqrt(square)
    truth = (radius * np.cos(angle), radius * np.sin(angle), rise * angle)
    for row, wanted in zip((found.x, found.y, found.z), truth, strict=True):
        # Curvature and torsion are rounded as parameters are, which turns the last end by some roundings of 80/2.1.
        np.testing.assert_allclose(row, wanted, rtol=0, atol=80 * ROUNDING)
    np.testing.assert_allclose(found.kappa, radius / square, rtol=1e-14)


@pytest.mark.extended
def test_loads_on_riders(tmp_path: Path) -> None:
    """On a helix by its rates the frame stays level; loads and their rates are those on the helix by its formulas."""
    rates = {"yaw": "R/(R**2 + c**2)", "roll": "-c/(R**2 + c**2)"}
    given = {"start": ("R", 0, 0), "heading": ("pi/2", "atan(c/R)"), "parameters": {"R": "2", "c": "3/4"}}
    module = built(tmp_path, "level", [gqm.transition(length=20, **rates)], **given, roll="pieces", heartline="11/10")
    formulas = {"x": "2*cos(u)", "y": "2*sin(u)", "z": "3*u/4", "parameter": "u"}
    curve = gqm.Curve.space(**formulas, roll=0, heartline="11/10")
    other = gqm.build(gqm.derive(curve, gqm.Gravity()), name="helix_by_formulas", folder=tmp_path)
    rate = np.sqrt(4 + 9 / 16)
    ours, theirs = module.solve(18, v0=3).state(1.5), other.solve(18 / rate, v0=3).state(1.5)
    for name in ours._fields[10:]:
        assert ours[name] == pytest.approx(theirs[name], rel=1e-14, abs=2e-14), name


@pytest.mark.extended
def test_a_loop_has_no_level(tmp_path: Path) -> None:
    """Where the tangent is vertical the frame has no roll angle; on steep climbs it has one."""
    loop = gqm.transition(length=8, pitch="1/2")
    module = built(tmp_path, "loop", [gqm.line(length=1), loop], start=(0, 0, 0), roll="pieces")
    with pytest.raises(DeclarationError, match=r"piece 2 \(transition\): its tangent is vertical"):
        module.solve(0.5)
    steep = gqm.transition(length=3, pitch="1/2", yaw="1/10")
    chart = chart_of(built(tmp_path, "steep", [gqm.line(length=1), steep], start=(0, 0, 0), roll="pieces"))
    assert np.isfinite(chart.block).all()
    closed = built(tmp_path, "leaning", [gqm.transition(length="2*pi", yaw=1, roll="s*(2*pi - s)/10")], closed=True)
    with pytest.raises(DeclarationError, match="off where the last piece ends"):
        closed.solve(1)


@pytest.mark.parametrize(("radius", "amplitude"), [(1, 1.25), (5, 2.0), (2, 0.125)])
def test_a_tilted_circle(tmp_path: Path, radius: float, amplitude: float) -> None:
    """A circle tilted by 30 degrees closes, and is a pendulum under half of gravity."""
    ring = [gqm.transition(length="2*pi*R", yaw="1/R")]
    module = built(tmp_path, "ring", ring, closed=True, heading=(0, 0, "pi/6"))
    launch = radius * (np.pi - amplitude)
    with mp.workdps(30):
        half = mp.pi / 2 - mpf(launch) / (2 * radius)
        truth = 2 * mp.sqrt(2 * radius / mpf("9.81")) * mp.ellipk(mp.sin(half) ** 2)
        assert module.solve(launch, R=radius).half_period == float(truth)


@pytest.mark.extended
def test_planar_rail_is_the_case_without_y(tmp_path: Path) -> None:
    """Lines, arcs and clothoids in space with y = 0 are the planar rail: its coordinates, curvature and times."""
    module = built(tmp_path, "flat", LOOP, start=(0, 0, 0))
    values = {"a": 3, "c": 2, "R": 4}
    length = 2 * 3 + 2 * 2 + 2 * np.pi * 4 - 2
    flat = built(tmp_path, "planar", LOOP)
    s = np.linspace(0, length, 200)
    ours, theirs = (one.pass1(s, 0, 20, **values) for one in (module, flat))
    for name in ("x", "z"):
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=0, atol=30 * ROUNDING)
    np.testing.assert_allclose(ours.kappa, np.abs(theirs.kappa), rtol=0, atol=1e-15)
    assert not ours.y.any()
    times = [one.solve(0, 20, **values).t_end for one in (module, flat)]
    assert times[0] == pytest.approx(times[1], rel=1e-15)


@pytest.mark.extended
def test_curves_with_formulas(tmp_path: Path) -> None:
    """A helix by its formulas and its continuation by rates are one helix; if they do not meet, the message says
    where.
    """
    helix = gqm.families.helix(R=2, c="3/4", domain=(0, 3))
    rest = gqm.transition(length=5, yaw="2/(4 + 9/16)", roll="-3/4/(4 + 9/16)")
    module = built(tmp_path, "joined", [helix, rest])
    begin = 3 * np.sqrt(4 + 9 / 16)
    s = np.linspace(0, begin + 4.9, 100)
    found, angle = module.pass1(s, 0, 1), s / np.sqrt(4 + 9 / 16)
    truth = (2 * np.cos(angle), 2 * np.sin(angle), 0.75 * angle)
    for row, wanted in zip((found.x, found.y, found.z), truth, strict=True):
        np.testing.assert_allclose(row, wanted, rtol=0, atol=20 * ROUNDING)
    apart = gqm.families.helix(R=2, c="3/4", domain=("3.1", 4))
    with pytest.raises(DeclarationError, match=r"piece 2 \(curve\): begins .* off where the piece before it ends"):
        built(tmp_path, "apart", [helix, apart]).solve(1)


def test_in_a_curve_file(tmp_path: Path) -> None:
    """A transition may be a piece in a curve file, with three coordinates and angles at the start."""
    file = tmp_path / "rail.yaml"
    file.write_text(
        "name: rail\ncurve:\n  pieces:\n    pieces:\n    - line: {length: 2}\n"
        "    - transition: {length: 3, yaw: s/R, roll: 0.1}\n    start: [0, 0, 5]\n    heading: [0, -10 deg]\n"
        "kernel: {gravity: {}}\nparameters: {R: 12}\n"
    )
    spec, heading = read_spec(file), (0, "-10 deg")
    pieces = [gqm.line(length=2), gqm.transition(length=3, yaw="s/R", roll="0.1")]
    assert spec.curve == gqm.Curve.piecewise(pieces, start=(0, 0, 5), heading=heading)
    assert spec.curve.in_space
    text = file.read_text().replace("    heading:", "    roll: pieces\n    heartline: 1.1\n    heading:")
    file.write_text(text)
    banked = gqm.Curve.piecewise(pieces, start=(0, 0, 5), heading=heading, roll="pieces", heartline="1.1")
    assert read_spec(file).curve == banked


LINE = gqm.line(length=1)


@pytest.mark.parametrize(
    ("kind", "declare", "message"),
    [
        (DeclarationError, lambda: gqm.transition(length=0), "length: must be positive"),
        (
            DeclarationError,
            lambda: gqm.transition(length=1, yaw="sin(s)"),
            "yaw: must be a polynomial in s of degree 5",
        ),
        (DeclarationError, lambda: gqm.transition(length=1, roll="s**6"), "roll: must be a polynomial in s"),
        (DeclarationError, lambda: gqm.Curve.piecewise([LINE], start=(0, 0, 0, 0)), r"start: must be a pair \(x, z\)"),
        (DeclarationError, lambda: gqm.Curve.piecewise([LINE], roll="pieces"), "roll: is for rails in space"),
        (ArgumentError, lambda: gqm.Curve.piecewise([LINE], banking=1), "no argument 'banking'"),
        (
            DeclarationError,
            lambda: gqm.Curve.piecewise([gqm.transition(length=1)], start=(0, 0)),
            r"start: must be three numbers",
        ),
        (
            DeclarationError,
            lambda: gqm.Curve.piecewise([LINE], start=(0, 0, 0), heading=(0, 0, 0, 0)),
            "heading: must be an angle, or up to three",
        ),
    ],
)
def test_refused(kind: type[GQMError], declare: Any, message: str) -> None:
    """Pieces and starts that are impossible in space are refused."""
    with pytest.raises(kind, match=message):
        declare()


def test_refused_when_made(tmp_path: Path) -> None:
    """Lengths that are not positive, turns without end, and rails that do not close are refused when they are known."""
    pieces = [gqm.transition(length="a", pitch="q"), gqm.arc(radius="R", angle="b"), LINE]
    module = built(tmp_path, "bad", pieces, closed=True)
    good = {"a": 1, "q": 0.1, "R": 2, "b": 1}
    for change, message in (
        ({"a": -1}, r"piece 1 \(transition\): length: must be positive"),
        ({"q": 1e9}, r"piece 1 \(transition\): turns by 1e\+09 rad"),
        ({"R": 0}, r"piece 2 \(arc\): radius: must be positive"),
        ({"b": 0}, r"piece 2 \(arc\): angle: must not be zero"),
    ):
        with pytest.raises(ParameterError, match=message):
            module.solve(0.5, **{**good, **change})
    with pytest.raises(DeclarationError, match=r"closed: the start lies at .* off where the last piece ends"):
        module.solve(0.5, **good)
