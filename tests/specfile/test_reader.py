"""Curve files are read, or refused in clear words."""

import contextlib
import json
import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from paths import ROOT
from selection import examples

from gqm_sym.errors import SpecFileError
from gqm_sym.kernels import KERNELS
from gqm_sym.specfile import Spec, json_schema, read_spec
from gqm_sym.specfile.schema import CURVES, FAMILY_MODELS

EXAMPLES = sorted((ROOT / "curves").glob("*.yaml"))

PLAIN = """\
name: track
curve:
  graph: {z: h*x**2, parameter: x, domain: [-2, 2]}
kernel:
  gravity: {}
parameters: {h: 3}
launch: {lam0: 1/2, v0: 0}
"""


def read(folder: Path, text: str | bytes) -> Spec:
    """Read a file with this content, under a short name."""
    path = folder / "a.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_spec(path)


def mistakes(folder: Path, text: str | bytes) -> list[str]:
    """Read a wrong file, and return the messages without the name of the folder."""
    with pytest.raises(SpecFileError) as caught:
        read(folder, text)
    assert str(caught.value) == "\n".join(caught.value.mistakes)
    return [line.removeprefix(f"{folder}{os.sep}") for line in caught.value.mistakes]


def edited(*changes: tuple[str, str]) -> str:
    """Return the plain file with some of its text replaced."""
    text = PLAIN
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


GRAPH = "graph: {z: h*x**2, parameter: x, domain: [-2, 2]}"
NAME_RULE = "a name is made of ASCII letters, digits and _, and begins with a letter"

# A row has the kind of mistake, the file, and everything that the message must contain.
WRONG: dict[str, tuple[str | bytes, list[str]]] = {
    "unknown key": (
        edited(("launch:", "lunch:")),
        ["a.yaml:7:1: unknown key 'lunch'; did you mean launch?"],
    ),
    "unknown key in a section": (
        edited(("parameter: x", "param: x")),
        ["a.yaml:3:22: curve.graph: unknown key 'param'; did you mean parameter?"],
    ),
    "missing keys": (
        "title: nothing else\n",
        [
            "a.yaml:1:1: name is missing; add name: pendulum",
            "a.yaml:1:1: curve is missing; add curve: {graph: {z: x**3, parameter: x}}",
            "a.yaml:1:1: kernel is missing; add kernel: {gravity: {}}",
        ],
    ),
    "wrong type, a list": (
        edited(("name: track", "name: [track]")),
        ["a.yaml:1:7: name: must be a single value, got a list"],
    ),
    "wrong type, a value": (
        edited(("gravity: {}", "gravity: 9.81")),
        ["a.yaml:5:12: kernel.gravity: must be a mapping, as in {}, got '9.81'"],
    ),
    "wrong type, nothing": (
        edited((f"\n  {GRAPH}", "")),
        ["a.yaml:2:1: curve: must be a mapping, as in {graph: {z: x**3, parameter: x}}, got nothing"],
    ),
    "a force in place of the forces": (
        edited(("kernel:\n  gravity: {}", "kernel: gravity")),
        ["a.yaml:4:9: kernel: must be a mapping, as in {gravity: {}}, got 'gravity'"],
    ),
    "a family in place of its mapping": (
        edited((GRAPH, "family: circle")),
        ["a.yaml:3:11: curve.family: must be a mapping, as in {name: circle}, got 'circle'"],
    ),
    "a decimal comma": (
        edited(("gravity: {}", "gravity: {g: 9,81}")),
        ["a.yaml:5:18: kernel.gravity: unknown key '81'; a comma separates entries; write a decimal point, as in 0.7"],
    ),
    "a domain of one end": (
        edited(("[-2, 2]", "[-2]")),
        ["a.yaml:3:44: curve.graph.domain: must have two entries, as in [a, b], got 1"],
    ),
    "a domain the wrong way round": (
        edited(("[-2, 2]", "[2, -2]")),
        ["a.yaml:3:44: curve.graph.domain: must have lo < hi, got (2, -2); write the lower end first"],
    ),
    "an undefined symbol": (
        edited(("h*x**2", "h*x**2 + kk")),
        ["a.yaml:3:23: 'kk' is not in parameters; add it there, as in kk: 1 (null: to be given at run time)"],
    ),
    "a misspelt symbol": (
        edited(("h*x**2", "hight*x**2"), ("{h: 3}", "{height: 3}")),
        [
            "a.yaml:3:14: 'hight' is not in parameters; add it there, as in hight: 1 "
            "(null: to be given at run time), or did you mean height?",
            "a.yaml:6:14: parameters: 'height' is used neither by the curve nor by the kernel; remove it, or use it",
        ],
    ),
    "an undefined argument of a kernel": (
        edited(("gravity: {}", "gravity: {}\n  rolling: {}")),
        ["a.yaml:6:3: 'beta' is not in parameters; add it there, as in beta: 1 (null: to be given at run time)"],
    ),
    "negative friction": (
        edited(("gravity: {}", "gravity: {}\n  coulomb: {mu: -0.1}")),
        ["a.yaml:6:13: kernel.coulomb: 'mu' must be at least 0, got -0.1"],
    ),
    "negative friction among the parameters": (
        edited(("gravity: {}", "gravity: {}\n  coulomb: {}"), ("{h: 3}", "{h: 3, mu: -0.1}")),
        ["a.yaml:7:20: parameters: 'mu' must be at least 0, got -0.1"],
    ),
    "static friction below that of sliding": (
        edited(("gravity: {}", "gravity: {}\n  coulomb: {mu_static: mu_s}"), ("{h: 3}", "{h: 3, mu: 0.4, mu_s: 0.3}")),
        ["a.yaml:7:29: parameters: 'mu_s' must be at least mu = 0.4, got 0.3"],
    ),
    "what rolls and slides": (
        edited(("gravity: {}", "coulomb: {mu: 0.1}\n  rolling: {beta: 1}")),
        [
            "a.yaml:6:3: kernel.rolling: rolling and coulomb exclude each other: a body that rolls without slipping "
            "does not slide; leave one of them out (rolling has mu_static, the friction that it needs)"
        ],
    ),
    "no form of surface tension": (
        edited(("gravity: {}", "surface_tension: {gamma: 1, ell_c: 1, form: wet}")),
        ["a.yaml:5:47: kernel.surface_tension.form: must be 'resistance' or 'printed', got 'wet'"],
    ),
    "a law without its expression": (
        edited(("gravity: {}", "law: {}")),
        ["a.yaml:5:3: kernel.law: A is missing; add A: -direction*k*W"],
    ),
    "a law with a symbol of nowhere": (
        edited(("gravity: {}", "law: {A: -kk*x*W*direction}")),
        ["a.yaml:5:13: 'kk' is not in parameters; add it there, as in kk: 1 (null: to be given at run time)"],
    ),
    "gravity only among the parameters": (
        edited(("gravity: {}", "potential: {U: h*z}"), ("{h: 3}", "{h: 3, g: 9.81}")).replace("h*x**2", "x**2"),
        ["a.yaml:6:20: parameters: 'g' is used neither by the curve nor by the kernel; add gravity: {} to kernel"],
    ),
    "no identifier": (
        edited(("name: track", "name: 2nd-track")),
        [f"a.yaml:1:7: name: '2nd-track' cannot be a name: {NAME_RULE}"],
    ),
    "a keyword for a name": (
        edited(("name: track", "name: class")),
        ["a.yaml:1:7: name: 'class' cannot be a name: it is a word of Python's; choose another"],
    ),
    "a parameter that shadows a function": (
        edited(("{h: 3}", "{h: 3, sin: 1}")),
        ["a.yaml:6:20: parameters.sin: 'sin' cannot be a name: it is a function of the grammar; choose another"],
    ),
    "a parameter in other letters": (
        edited(("{h: 3}", "{h: 3, ω: 1}")),
        [f"a.yaml:6:20: parameters.ω: 'ω' cannot be a name: {NAME_RULE}"],
    ),
    "no expression": (
        edited(("h*x**2", "h*x^2")),
        ["a.yaml:3:17: curve.graph.z: unexpected '^'; write ** for a power"],
    ),
    "no expression, in quotes": (
        edited(("h*x**2", '"h*x^2"')),
        ["a.yaml:3:18: curve.graph.z: unexpected '^'; write ** for a power"],
    ),
    "division by zero": (
        edited(("h*x**2", "h*x**2/(1 - 1)")),
        ["a.yaml:3:24: curve.graph.z: division by zero"],
    ),
    "text for a number": (
        edited(("{h: 3}", "{h: tall}")),
        ["a.yaml:6:17: parameters.h: must be a number, got tall, which contains 'tall'"],
    ),
    "true for a number": (
        edited(("{h: 3}", "{h: true}")),
        ["a.yaml:6:17: parameters.h: must be a number, got true, which contains 'true'"],
    ),
    "NaN": (
        edited(("lam0: 1/2", "lam0: .nan")),
        ["a.yaml:7:16: launch.lam0: must be a finite number, got .nan"],
    ),
    "infinity": (
        edited(("{h: 3}", "{h: {value: -.inf, unit: m}}")),
        ["a.yaml:6:25: parameters.h.value: must be a finite number, got -.inf"],
    ),
    "beyond doubles": (
        edited(("lam0: 1/2", "lam0: 1e350")),
        ["a.yaml:7:16: launch.lam0: must be within the range of doubles, got 1e350"],
    ),
    "a launch outside the domain": (
        edited(("lam0: 1/2", "lam0: 2.0000001")),
        ["a.yaml:7:16: launch.lam0: 2.0000001 is outside the curve's domain; give one within [-2, 2]"],
    ),
    "a launch outside a domain of parameters": (
        edited(("[-2, 2]", "[null, h]"), ("lam0: 1/2", "lam0: 4")),
        ["a.yaml:7:16: launch.lam0: 4 is outside the curve's domain; give one within [-oo, 3]"],
    ),
    "a domain that vanishes with a parameter": (
        edited(("[-2, 2]", "[1/h, null]"), ("{h: 3}", "{h: 0}")),
        [
            "a.yaml:7:16: launch.lam0: the curve's domain ends at zoo with these parameters, "
            "no real number; change the parameters or the domain"
        ],
    ),
    "a domain that is complex with a parameter": (
        edited(("[-2, 2]", "[null, sqrt(h)]"), ("{h: 3}", "{h: -1}")),
        [
            "a.yaml:7:16: launch.lam0: the curve's domain ends at I with these parameters, "
            "no real number; change the parameters or the domain"
        ],
    ),
    "a negative speed": (
        edited(("v0: 0", "v0: -2")),
        [
            "a.yaml:7:25: launch.v0: must not be negative, got -2; "
            "give a speed, and direction: -1 to launch towards decreasing parameter"
        ],
    ),
    "no direction": (
        edited(("v0: 0", "direction: 0")),
        ["a.yaml:7:32: launch.direction: must be 1 or -1 (the sign of ds/dt at launch), got '0'"],
    ),
    "no time": (
        edited(("v0: 0", "t_max: 0")),
        ["a.yaml:7:28: launch.t_max: must be positive, got 0; give a time in seconds"],
    ),
    "a launch without a place": (
        edited(("lam0: 1/2, ", "")),
        ["a.yaml:7:1: launch: lam0 is missing; add lam0: -pi/2 + 6/5"],
    ),
    "a launch by a point": (
        edited(("v0: 0", "point: [0, 1]")),
        [
            "a.yaml:7:21: launch: point is for implicit curves, tracks and rails; give lam0, the curve's parameter at "
            "launch"
        ],
    ),
    "duplicate keys": (
        PLAIN + "name: other\n",
        ["a.yaml:8:1: the key 'name' is given twice (first in line 1); keep one of them"],
    ),
    "two curves": (
        edited((GRAPH, f"{GRAPH}\n  polar: {{r: theta}}")),
        [
            "a.yaml:4:3: curve: declared as graph and as polar; give exactly one of graph, parametric, polar, family, "
            "space, implicit, points, pieces"
        ],
    ),
    "no curve": (
        edited((f"\n  {GRAPH}", " {}")),
        [
            "a.yaml:2:1: curve: is empty; give exactly one of graph, parametric, polar, family, space, "
            "implicit, points, pieces"
        ],
    ),
    "a point for a curve": (
        edited(
            (GRAPH, "parametric: {x: h, z: 2, parameter: u}"),
        ),
        [
            "a.yaml:3:39: curve.parametric: neither coordinate depends on the parameter 'u'; "
            "x = h, z = 2 is a point, not a curve"
        ],
    ),
    "an unknown family": (
        edited((GRAPH, "family: {name: spline, a: h, b: 1}")),
        [
            "a.yaml:3:12: curve.family: unknown family 'spline'; known are cartesian_graph, circle, "
            "ellipse, parabola, log_spiral, catenary, cycloid, helix, conical_helix, torus_knot, viviani, implicit"
        ],
    ),
    "a family that was probably meant": (
        edited((GRAPH, "family: {name: elipse, a: h, b: 1}")),
        ["a.yaml:3:12: curve.family: unknown family 'elipse'; did you mean ellipse?"],
    ),
    "a name that means two things": (
        edited((GRAPH, "family: {name: ellipse, a: h, b: h}")),
        ["a.yaml:3:30: curve.family: the name 'h' means two things; give one of them another name, as in b=\"b_2\""],
    ),
    "an empty file": (
        "",
        ["a.yaml:1:1: the file is empty; give at least name, curve and kernel"],
    ),
    "comments alone": (
        "# soon\n",
        ["a.yaml:1:1: the file is empty; give at least name, curve and kernel"],
    ),
    "a list": (
        "- name\n- curve\n",
        ["a.yaml:1:1: the file holds a list, not a mapping; begin with 'name: ...'"],
    ),
    "a word": (
        "track\n",
        ["a.yaml:1:1: the file holds a single value, not a mapping; begin with 'name: ...'"],
    ),
    "a binary file": (
        b"\x7fELF\x02\x01\x01\x00\x00",
        ["a.yaml:1:1: the file is binary; give a YAML file"],
    ),
    "a control character": (
        b"name: tr\x07ck\n",
        ["a.yaml:1:9: the character '\\x07' is not allowed in YAML; give a text file, in UTF-8"],
    ),
    "Latin-1": (
        "name: a\ntitle: Fahrt über".encode("latin-1"),
        ["a.yaml:2:14: this is not UTF-8 text; save it as UTF-8"],
    ),
    "UTF-16": (
        PLAIN.encode("utf-16"),
        ["a.yaml:1:1: the file is UTF-16 text; save it as UTF-8"],
    ),
    "not YAML": (
        edited(("name: track", "name: [track")),
        [
            "a.yaml:2:6: this is not YAML: expected ',' or ']', but got ':'; "
            "separate entries by commas and close the bracket"
        ],
    ),
    "tabs": (
        "curve:\n\tgraph: {}\n",
        ["a.yaml:2:1: this is not YAML: found character '\\t' that cannot start any token; indent with spaces"],
    ),
    "an impossible escape": (
        'name: "\\UFFFFFFFF"\n',
        ["a.yaml:1:1: a quoted text has an escape that is no character; mend it"],
    ),
    "two documents": (
        PLAIN + "---\n" + PLAIN,
        ["a.yaml:8:1: a second document begins; give one document a file"],
    ),
    "a tag": (
        edited(("name: track", "name: !!python/name:os.system track")),
        [
            "a.yaml:1:7: the tag 'tag:yaml.org,2002:python/name:os.system' is not allowed; "
            "write the plain value, without a tag"
        ],
    ),
    "an anchor and its alias": (
        edited(("{h: 3}", "{h: &h 3, m: *h}")),
        [
            "a.yaml:6:17: the anchor &h is not allowed; write the value out where it is needed",
            "a.yaml:6:26: the alias *h is not allowed; write the value out, or put the text in quotes",
        ],
    ),
    "a key that is a list": (
        "? [a, b]\n: 1\n" + PLAIN,
        [
            "a.yaml:1:3: a key is a list; keys are single words",
        ],
    ),
    "a title of two lines": (
        PLAIN + 'title: "one\\ntwo"\n',
        ["a.yaml:8:8: title: must be one line of at most 200 printable characters"],
    ),
    "nesting": (
        "name: " + "[" * 50_000,
        ["a.yaml:1:1: the line is longer than 10000 characters; break it"],
    ),
    "nesting in short lines": (
        "name:\n" + " [[[[[\n" * 5_000,
        ["a.yaml:5:6: values are nested deeper than 20 levels; such a file needs five"],
    ),
    "too many values": (
        "name:\n" + "- 1\n" * 2000,
        ["a.yaml:999:3: more than 1000 values; give a file for one curve or one sweep"],
    ),
    "too large": (
        PLAIN + "#" * (1 << 20),
        ["a.yaml:1:1: the file is larger than 64 KiB; such a file has a few hundred bytes"],
    ),
}


@pytest.mark.parametrize("case", WRONG.values(), ids=WRONG.keys())
def test_a_mistake_is_one_clear_line(case: tuple[str | bytes, list[str]], tmp_path: Path) -> None:
    """Each mistake is named with line, column, what is there and what would be right."""
    text, expected = case
    assert expected == mistakes(tmp_path, text)


def test_all_mistakes_come_together(tmp_path: Path) -> None:
    """One pass reports mistakes of syntax, structure and meaning, in the file's order."""
    text = """\
name: 2bad
curve:
  parametric: {x: L*cos(theta, z: L*sin(theta), parametr: theta}
kernel:
  gravty: {}
  coulomb: {nu: 1}
parameters:
  lam0: 3
  q: {valu: 3}
  q: 4
launch: {v0: -1, direction: left}
"""
    found = mistakes(tmp_path, text.replace("cos(theta,", "cos(theta),"))
    places = [tuple(map(int, line.split(":")[1:3])) for line in found]
    assert sorted(places) == places
    assert places == [
        *[(1, 7), (3, 3), (3, 50), (5, 3), (6, 13), (8, 3), (9, 3), (9, 7), (10, 3), (11, 1)],
        (11, 29),
    ]
    assert found[4].endswith("kernel.coulomb: unknown key 'nu'; did you mean mu?")


def test_many_mistakes_are_cut_off(tmp_path: Path) -> None:
    """A file with very many mistakes does not flood the terminal."""
    text = "".join(f"k{n}: {n}\n" for n in range(200))
    found = mistakes(tmp_path, text)
    assert len(found) == 51
    assert found[-1] == "a.yaml: and 153 more mistakes; mend these first"


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_right(path: Path) -> None:
    """Every file in curves/ is read, is called as its name says, and can be solved."""
    spec = read_spec(path)
    assert spec.name == path.stem
    assert spec.launch is not None


def test_numbers_stay_text(tmp_path: Path) -> None:
    """A scalar arrives as it is written, whatever YAML or a double would make of it."""
    text = edited(
        ("{h: 3}", "{h: {value: 0.10, unit: 1/m, description: how steep}, m: 1e-3}"),
        ("launch: {lam0: 1/2, v0: 0}", "launch: {lam0: '-pi/2 + 6/5', v0: 9.81, direction: -1}"),
    )
    spec = read(tmp_path, text)
    assert dict(spec.parameters) == {"h": "0.10", "m": "1e-3"}
    assert spec.launch is not None
    assert dict(spec.launch) == {"lam0": "-pi/2 + 6/5", "v0": "9.81", "direction": -1}
    assert (spec.notes["h"].unit, spec.notes["h"].description) == ("1/m", "how steep")


def test_a_file_of_windows_is_read(tmp_path: Path) -> None:
    """A byte order mark and carriage returns change nothing."""
    spec = read(tmp_path, ("\ufeff" + PLAIN).replace("\n", "\r\n").encode())
    assert spec.name == "track"


def test_a_long_expression_may_be_folded(tmp_path: Path) -> None:
    """Block scalars may hold expressions over several lines."""
    graph = "graph:\n    z: >-\n      h*x**2\n      + x**4\n    parameter: x"
    assert str(read(tmp_path, edited((GRAPH, graph))).curve.z) == "h*x**2 + x**4"


CURVES_AS_WRITTEN = {
    "graph": ("graph: {z: x**2 - h}", "x", "-h + x**2"),
    "parametric": (
        "parametric: {x: h*cos(u), z: h*sin(u), parameter: u, period: 2*pi}",
        "h*cos(u)",
        "h*sin(u)",
    ),
    "polar": ("polar: {r: h*theta}", "h*theta*cos(theta)", "h*theta*sin(theta)"),
    "family": ("family: {name: parabola, a: h}", "x", "h*x**2"),
    "family, another parameter": ("family: {name: parabola, a: h, parameter: u}", "u", "h*u**2"),
    "family, inverted": (
        "family: {name: cycloid, R: h, inverted: true}",
        "h*(theta - sin(theta))",
        "-h*(1 - cos(theta))",
    ),
    "cartesian graph": ("family: {name: cartesian_graph, phi: h*x}", "x", "h*x"),
}


@pytest.mark.parametrize("case", CURVES_AS_WRITTEN.values(), ids=CURVES_AS_WRITTEN.keys())
def test_curves(case: tuple[str, str, str], tmp_path: Path) -> None:
    """Each way to write a curve gives that curve."""
    written, x, z = case
    curve = read(tmp_path, edited((GRAPH, written))).curve
    assert (str(curve.x), str(curve.z)) == (x, z)


def test_kernels_add(tmp_path: Path) -> None:
    """The terms of the kernel add in the file's order; each argument is a name, a value or nothing."""
    forces = "rolling: {beta: 2/5}\n  gravity: {g: g_moon}\n  potential: {U: k*x**2/2}"
    text = edited(("gravity: {}", forces), ("{h: 3}", "{h: 3, g_moon: 1.62, k: null}"))
    spec = read(tmp_path, text)
    assert [name for name, _ in spec.kernel.terms] == ["rolling", "gravity", "potential"]
    assert dict(spec.derive().defaults) == {**{"h": "3", "beta": "2/5", "g_moon": "1.62", "k": None, "m": "1"}}


def test_the_title_is_the_familys_unless_given(tmp_path: Path) -> None:
    """A family brings a title of its own; the file's takes precedence."""
    text = edited((GRAPH, "family: {name: parabola, a: h}"))
    assert read(tmp_path, text).derive().title == "Parabola z = a*x**2"
    assert read(tmp_path, text + "title: Bowl\n").derive().title == "Bowl"


UNFIT = {
    "one name for two things": (
        edited(("gravity: {}", "potential: {U: h*x}")),
        "a.yaml:3:14: the name 'h' means one thing in the curve and another in the kernel; "
        'give one of them another name, as in h="h2"',
    ),
    "a negative mass": (
        edited(("{h: 3}", "{h: 3, m: -1}")),
        "a.yaml:6:20: parameters: 'm' must be positive, got -1",
    ),
    "a negative length": (
        edited((GRAPH, "family: {name: circle, L: h}"), ("{h: 3}", "{h: -3}")),
        "a.yaml:6:14: parameters: 'h' must be positive, got -3",
    ),
}


@pytest.mark.parametrize("case", UNFIT.values(), ids=UNFIT.keys())
def test_what_does_not_go_together(case: tuple[str, str], tmp_path: Path) -> None:
    """A mistake that appears only when curve and kernel are combined is reported with its place in the file too."""
    text, expected = case
    spec = read(tmp_path, text)
    with pytest.raises(SpecFileError) as caught:
        spec.derive()
    assert str(caught.value) == f"{tmp_path}{os.sep}{expected}"


UNSOLVABLE = {
    "no launch": (
        edited(("launch: {lam0: 1/2, v0: 0}", "")),
        ["a.yaml:1:1: launch is missing; solving needs it; add it, as in launch: {lam0: 0.5, v0: 0}"],
    ),
    "no value": (
        edited(("{h: 3}", "{h: null}")),
        ["a.yaml:6:14: parameters.h: is null; solving needs a value; write one, as in h: 1"],
    ),
    "no curve there": (
        edited(("h*x**2", "h*sqrt(x)"), ("lam0: 1/2", "lam0: -1/2")),
        [
            "a.yaml:7:16: launch.lam0: x = -1/2: z is not a finite real number there; "
            "launch where the curve and the forces are defined"
        ],
    ),
    "a pole there": (
        edited(("h*x**2", "h/x"), ("lam0: 1/2", "lam0: 0")),
        [
            "a.yaml:7:16: launch.lam0: x = 0: z is not a finite real number there; "
            "launch where the curve and the forces are defined"
        ],
    ),
    "no double there": (
        edited(("h*x**2", "exp(exp(exp(9*h*x)))"), ("lam0: 1/2", "lam0: 2")),
        [
            "a.yaml:7:16: launch.lam0: x = 2: z is not a finite real number there; "
            "launch where the curve and the forces are defined"
        ],
    ),
}


@pytest.mark.parametrize("case", UNSOLVABLE.values(), ids=UNSOLVABLE.keys())
def test_what_cannot_be_solved(case: tuple[str, list[str]], tmp_path: Path) -> None:
    """A file can be right and yet lack what is needed to solve it; then every reason is given."""
    text, expected = case
    spec = read(tmp_path, text)
    model = spec.derive()
    with pytest.raises(SpecFileError) as caught:
        spec.check_solvable(model)
    found = [line.removeprefix(f"{tmp_path}{os.sep}") for line in caught.value.mistakes]
    assert found == expected


@pytest.mark.extended
def test_a_number_that_sympy_stumbles_over(tmp_path: Path) -> None:
    """A sine of 10**300 lies between -1 and 1, whatever SymPy does with the arc sine of it."""
    spec = read(tmp_path, edited(("h*x**2", "h*asin(sin(10**300*x))"), ("lam0: 1/2", "lam0: 2")))
    spec.check_solvable(spec.derive())


def test_unreadable_paths(tmp_path: Path) -> None:
    """A missing file and a folder are named, without a place in them."""
    for path, reason in (
        (tmp_path / "no.yaml", "there is no such file"),
        (tmp_path, "is a folder"),
    ):
        with pytest.raises(SpecFileError) as caught:
            read_spec(path)
        assert str(caught.value).startswith(f"{path}: {reason}")


def test_reading_is_bounded_on_endless_devices() -> None:
    """A device without an end is read as far as a file may be long."""
    with pytest.raises(SpecFileError, match="larger than 64 KiB"):
        read_spec("/dev/zero")


CHARACTERS = "abhxz019.*/+-^()[]{}:,#&!|>'\"%@` \n\t\\~λ"


@settings(examples(300), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_no_file_escapes(data: st.DataObject, tmp_path: Path) -> None:
    """However a file is changed, it is read, or refused with a place in it."""
    text = PLAIN
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(text)))
        stop = data.draw(st.integers(start, min(len(text), start + 12)))
        text = text[:start] + data.draw(st.text(CHARACTERS, max_size=8)) + text[stop:]
    try:
        read(tmp_path, text)
    except SpecFileError as error:
        for line in error.mistakes:
            name, row, column, message = line.removeprefix(f"{tmp_path}{os.sep}").split(":", 3)
            assert name == "a.yaml"
            assert 1 <= int(row) <= text.count("\n") + 2
            assert int(column) >= 1
            assert message.strip()


@settings(examples(200), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(junk=st.binary(max_size=200))
def test_no_bytes_escape(junk: bytes, tmp_path: Path) -> None:
    """Bytes of any kind are refused by a SpecFileError, or are a right file."""
    with contextlib.suppress(SpecFileError):
        read(tmp_path, junk)


def test_schema_is_draft_7() -> None:
    """The schema is plain JSON of the draft that editors know, and its references resolve."""
    schema = json.loads(json.dumps(json_schema()))
    assert schema["$schema"] == "http://json-schema.org/draft-07/schema#"
    assert sorted(schema["required"]) == ["curve", "kernel", "name"]

    def references(node: object) -> list[str]:
        if isinstance(node, dict):
            own = [node["$ref"]] if isinstance(node.get("$ref"), str) else []
            return own + [ref for value in node.values() for ref in references(value)]
        if isinstance(node, list):
            return [ref for value in node for ref in references(value)]
        return []

    names = {ref.removeprefix("#/definitions/") for ref in references(schema)}
    assert names <= schema["definitions"].keys()
    assert "prefixItems" not in json.dumps(schema)


def test_schema_follows_the_tables() -> None:
    """Curve kinds, families and kernels of the tables, and no others, are in the schema."""
    definitions = json_schema()["definitions"]
    assert set(definitions["CurveSection"]["properties"]) == set(CURVES)
    assert set(definitions["KernelSection"]["properties"]) == set(KERNELS)
    families = definitions["CurveSection"]["properties"]["family"]["oneOf"]
    assert len(families) == len(FAMILY_MODELS)
