"""A report is one well-formed page, complete in itself, that shows what the motion says."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

import gqm_sym as gqm
from gqm_sym.cli import tool
from gqm_sym.report import _formulas, _with_written_parentheses
from gqm_sym.runtime.launch.kinds import LOADS

HTML, SVG, MATH = (
    "{http://www.w3.org/1999/xhtml}",
    "{http://www.w3.org/2000/svg}",
    "{http://www.w3.org/1998/Math/MathML}",
)

FILE = """\
name: swing
title: '<script src="http://example.org/x.js">&amp;</script>'
curve:
  family: {name: circle, L: L}
kernel:
  gravity: {}
parameters:
  L: {value: 100, unit: cm, description: "length < 2 m"}
launch: {lam0: 5/2}
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with a curve file, in which commands run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "swing.yaml").write_text(FILE)
    return tmp_path


def page(*arguments: str) -> ElementTree.Element:
    """Return the tree of the page that the command writes."""
    assert tool.main(["report", "swing.yaml", *arguments, "-o", "swing.html"]) == 0
    return ElementTree.fromstring(Path("swing.html").read_text(encoding="utf-8"))


def rows(tree: ElementTree.Element) -> list[list[str]]:
    """Return the rows of all tables."""
    return [["".join(cell.itertext()) for cell in row] for row in tree.iter(f"{HTML}tr")]


def test_a_page_is_complete_in_itself(here: Path) -> None:
    """The page fetches and runs nothing, whatever the file says; every reference is to a place in the page that
    exists.
    """
    tree = page()
    tags = {element.tag.split("}")[1] for element in tree.iter()}
    assert not tags & {"script", "link", "img", "iframe", "object"}
    ids = [element.get("id") for element in tree.iter() if element.get("id")]
    assert len(ids) == len(set(ids))
    for element in tree.iter():
        for name, value in element.items():
            assert not name.startswith("on")
            if name.endswith(("href", "src")):
                # The bar of colours is a picture in the page itself.
                assert value.startswith("data:image/png;base64,") or value[1:] in ids
            for target in re.findall(r"url\(([^)]*)\)", value):
                assert target[1:] in ids
    style = "".join(tree.find(f"{HTML}head/{HTML}style").itertext())  # type: ignore[union-attr]
    assert "url(" not in style
    assert "@import" not in style


def test_what_a_page_says(here: Path) -> None:
    """A page has formulas, figures, events, parameters with their units, and the file itself."""
    tree = page()
    first = Path("swing.html").read_bytes()
    page()
    assert Path("swing.html").read_bytes() == first, "the same input gives the same bytes"
    spec = gqm.read_spec("swing.yaml")
    model = spec.derive()
    assert len(list(tree.iter(f"{MATH}math"))) == len(model.closed_forms())
    shown = ["".join(math.itertext()) for math in tree.iter(f"{MATH}math")]
    assert "κ=1L" in [text.replace("\u2062", "") for text in shown]
    assert len(list(tree.iter(f"{SVG}svg"))) == 3
    motion = gqm.build(model, name="swing").solve(**spec.launch)
    table = rows(tree)
    assert ["kind", "libration"] in table
    assert ["period (s)", repr(motion.period)] in table
    assert ["L", "1", "m", "length < 2 m"] in table
    for event in motion.events:
        assert [event.kind, *map(repr, (event.t, event.lam, event.x, event.z))] in table
    (source,) = tree.iter(f"{HTML}pre")
    assert source.text == FILE
    assert tree.find(f"{HTML}head/{HTML}title").text == f"swing: {spec.title}"  # type: ignore[union-attr]


def test_formulas_are_written_as_people_write_them() -> None:
    """Partial derivatives, functions of arc length, signs of velocity and force, and V**2 as a power are written as
    usual.
    """
    track = gqm.Curve.implicit("x**2*z + z**3 + 1", start=(0, -1))
    rough = gqm.derive(track, gqm.Gravity() + gqm.CoulombFriction())
    shown = [ElementTree.fromstring(block) for block in _formulas(rough) if block.startswith("<div")]
    texts = ["".join(block.itertext()).replace("\u2062", "").replace(" ", "") for block in shown]
    assert {"∂F∂x=2xz", "∂2F∂x2=2z", "∂2F∂x∂z=2x", "κ=κ(s)", "dzds=sin(α(s))"} <= set(texts)
    assert any(text.startswith("W=V2=") for text in texts)
    assert any("sgnV" in text and "sgnN" in text for text in texts)
    assert not any("chart" in text or "contact" in text for text in texts)


def test_parentheses_of_older_printers_are_drawn() -> None:
    """SymPy 1.13 prints an element that browsers have dropped, with the signs as its attributes; these are drawn."""
    old = '<mi>f</mi><mfenced><mi>x</mi><mfenced close="|" open="|"><mi>y</mi></mfenced></mfenced>'
    new = "<mi>f</mi><mrow><mo>(</mo><mi>x</mi><mrow><mo>|</mo><mi>y</mi><mo>|</mo></mrow><mo>)</mo></mrow>"
    assert _with_written_parentheses(old) == new


@pytest.mark.extended
@pytest.mark.parametrize("launch", [["--lam0=0"], ["--lam0=pi/2", "--v0=9", "--t-max=1"]])
def test_other_motions(launch: list[str], here: Path) -> None:
    """Rest, circulation and a horizon have pages; the options of the launch are those of gqm solve."""
    given = launch[0].split("=")[1]
    assert ["launch at theta", given] in rows(page(*launch))


@pytest.mark.extended
def test_where_it_is_written(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The page is written to the caller's folder by the name in the file; wrong input writes nothing."""
    assert tool.main(["report", "swing.yaml"]) == 0
    assert capsys.readouterr().out == "wrote swing.html\n"
    Path("swing.html").unlink()
    assert tool.main(["report", "swing.yaml", "--v0=-1"]) == 2
    assert tool.main(["report", "none.yaml"]) == 2
    assert sorted(path.name for path in here.iterdir()) == ["swing.yaml"]


TRAIN = """\
name: hills
curve:
  space: {x: 40*cos(u), y: 60*sin(u), z: 6*cos(3*u), parameter: u, roll: [coordinated, 14]}
kernel:
  gravity: {}
  train: {length: 9, cars: 4}
launch: {lam0: 0, v0: 10, t_max: 3}
"""


@pytest.mark.extended
def test_a_coaster(here: Path) -> None:
    """A page on a banked track has the extremes of loads, of a train also those of three cars, and their pictures."""
    (here / "swing.yaml").write_text(TRAIN)
    tree = page()
    found = {row[0]: row[1:] for row in rows(tree) if row}
    assert [load for load in found if load in ("vertical", "lateral", "longitudinal")] == list(LOADS)
    assert 1.0 < float(found["vertical"][2]) < 1.5
    assert len(found["first"]) == len(found["middle"]) == len(found["last"]) == 6
    captions = ["".join(caption.itertext()) for caption in tree.iter(f"{HTML}figcaption")]
    assert [caption.split(",")[0] for caption in captions][-2:] == [
        "What riders feel in three cars",
        "The track with the vertical load",
    ]
