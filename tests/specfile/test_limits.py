"""Mistakes in curve files inside pieces, launches and families are reported at their places, and odd units are read."""

from pathlib import Path

import pytest
import sympy as sp

import gqm_sym as gqm
from gqm_sym.errors import EmissionError, SpecFileError

HEAD, FORCE = "name: a\n", "kernel: {gravity: {}}\n"


def read(folder: Path, text: str) -> gqm.Model:
    """Return the model of a file."""
    (folder / "a.yaml").write_text(text, encoding="utf-8")
    return gqm.read_spec(folder / "a.yaml").derive()


@pytest.mark.parametrize(
    ("curve", "message"),
    [
        (
            "{pieces: {closed: maybe, pieces: [{line: {length: 1}}]}}",
            "2:26: curve.pieces.closed: must be true or false, got 'maybe'",
        ),
        (
            "{pieces: {begin: [0, 0], pieces: [{line: {length: 1}}]}}",
            "2:18: curve.pieces: unknown key 'begin'; allowed are closed, heading, heartline, pieces, roll, start",
        ),
        (
            "{pieces: {pieces: [{line: {length: 1, len: 2}}]}}",
            "2:46: curve.pieces.pieces.0.line: unknown key 'len'; did you mean length?",
        ),
        (
            "{pieces: {pieces: [{family: {name: circle, R: 2, domain: [0, 1]}}]}}",
            "2:51: curve.pieces.pieces.0.family: unknown key 'R'; allowed are L, domain, inverted, name, parameter",
        ),
        (
            "{pieces: [{family: {L: 2}}]}",
            "2:19: curve.pieces.0.family: name is missing; known are cartesian_graph, circle",
        ),
        (
            "{family: {name: circle, R: 2}}",
            "2:32: curve.family: unknown key 'R'; allowed are L, domain, inverted, name, parameter",
        ),
        ("{family: {L: 2}}", "2:9: curve.family: name is missing; known are cartesian_graph, circle"),
        ("{family: {name: circel}}", "2:18: curve.family: unknown family 'circel'; did you mean circle?"),
        (
            "{family: {name: ellipse}}",
            "2:9: 'a' is not in parameters; add it there, as in a: 1 (null: to be given at run time)",
        ),
    ],
)
def test_mistakes_inside_a_curve(curve: str, message: str, tmp_path: Path) -> None:
    """Each mistake is reported with the path to it, and with what may stand there."""
    with pytest.raises(SpecFileError) as caught:
        read(tmp_path, f"{HEAD}curve: {curve}\n{FORCE}")
    found = [mistake.removeprefix(f"{tmp_path / 'a.yaml'}:") for mistake in caught.value.mistakes]
    assert any(mistake.startswith(message) for mistake in found), found


@pytest.mark.parametrize(
    ("curve", "place"),
    [
        ("{pieces: {start: [0, 1e400], pieces: [{line: {length: 1}}]}}", "2:29: curve.pieces.start.1"),
        ("{pieces: [{line: {length: 1e400}}]}", "2:34: curve.pieces.0.line.length"),
        ("{pieces: [{transition: {length: 1, pitch: s - 1e-400*s}}]}", "2:54: curve.pieces.0.transition.pitch"),
        ("{implicit: {F: x**2 + z**2 - 1, start: [0, 1e400]}}", "2:51: curve.implicit.start.1"),
        ("{space: {x: cos(t), y: sin(t), z: 0, parameter: t, period: 1e400}}", "2:67: curve.space.period"),
        ("{points: {file: track.csv, heartline: 1e400 m}}", "2:46: curve.points.heartline"),
    ],
)
def test_numbers_beyond_doubles_in_expressions(curve: str, place: str, tmp_path: Path) -> None:
    """A number that no double can represent is refused at its place; some of them were internal errors at launch."""
    with pytest.raises(SpecFileError) as caught:
        read(tmp_path, f"{HEAD}curve: {curve}\n{FORCE}")
    found = [mistake.removeprefix(f"{tmp_path / 'a.yaml'}:") for mistake in caught.value.mistakes]
    assert f"{place}: the number must be within the range of doubles" in found


def test_numbers_of_too_many_digits(tmp_path: Path) -> None:
    """A number within range whose digits are more than formulas take was an internal error at launch."""
    model = read(tmp_path, f"{HEAD}curve: {{pieces: [{{arc: {{radius: 5.{'3' * 350}, angle: 1}}}}]}}\n{FORCE}")
    with pytest.raises(EmissionError, match="a number of 351 digits; formulas take numbers of at most 308"):
        gqm.emit(model, name="a")


def test_mistakes_inside_a_launch(tmp_path: Path) -> None:
    """The numbers of a launch are mappings of a value and a unit."""
    with pytest.raises(SpecFileError, match=r"4:27: launch\.lam0: unknown key 'units'; did you mean unit\?"):
        read(tmp_path, f"{HEAD}curve: {{graph: {{z: x**2}}}}\n{FORCE}launch: {{lam0: {{value: 1, units: m}}}}\n")


@pytest.mark.parametrize(("unit", "exact"), [("pi", 3 * sp.pi), ("pi*rad", 3 * sp.pi), ("deg/pi", sp.Rational(1, 60))])
def test_multiples_of_pi(unit: str, exact: sp.Expr, tmp_path: Path) -> None:
    """A unit may contain pi, and the value in SI is exact."""
    text = f"{HEAD}curve: {{graph: {{z: sin(a)*x}}}}\n{FORCE}parameters: {{a: {{value: 3, unit: {unit}}}}}\n"
    assert sp.simplify(sp.sympify(str(dict(read(tmp_path, text).defaults)["a"])) - exact) == 0
