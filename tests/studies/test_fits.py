"""Fit files give estimates in closed form, the result as JSON and as a figure, and mistakes at their lines."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import generated.circle as pendulum
from gqm_sym.cli import tool
from gqm_sym.errors import SpecFileError
from gqm_sym.studies import fit_schema, read_fit

SWING = (
    "name: swing\ncurve: {family: {name: circle, L: L}}\nkernel: {gravity: {}}\n"
    "parameters: {L: {value: 1, unit: m}}\nlaunch: {lam0: 0.8, v0: 0}\n"
)
FIT = """\
title: A pendulum in the stairwell
curve: swing.yaml
data: {file: swings.csv, units: {t: ms, lam: deg}}
sigma: {lam: 0.05 deg}
free:
  L: [100 , 125, 150]
  lam0: null
fixed: {g: 9.81}
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with a curve file, measurements of a pendulum of 1.3 m, and a fit file."""
    monkeypatch.chdir(tmp_path)
    Path("swing.yaml").write_text(SWING)
    t = np.linspace(0.1, 12.0, 60)
    degrees = np.rad2deg(pendulum.solve(0.8, L=1.3).lam(t)) + 0.05 * np.random.default_rng(3).normal(size=t.size)
    rows = [f"{1e3 * one:.6f},{two:.6f}" for one, two in zip(t, degrees, strict=True)]
    Path("swings.csv").write_text("\n".join(["t,lam", *rows]))
    Path("fit.yaml").write_text(FIT.replace("[100 , 125, 150]", "{low: 100, start: 125, high: 150, unit: cm}"))
    return tmp_path


def test_a_fit_from_files(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A fit from files gives numbers in their units, text, JSON and a figure."""
    assert tool.main(["fit", "fit.yaml", "--json", "found.json", "--figure", "fit.svg"]) == 0
    said = capsys.readouterr()
    lines = said.out.splitlines()
    assert lines[0] == "Fit of 2 numbers to 60 measurements"
    assert lines[-2:] == ["wrote found.json", "wrote fit.svg"]
    found = json.loads(Path("found.json").read_text())
    for name, value, unit in (("L", 1.3, "m"), ("lam0", 0.8, "rad")):
        told = found["estimates"][name]
        assert abs(told["value"] - value) < 4.0 * told["std"]
        assert 1e-6 < told["std"] < 1e-3
        assert told["unit"] == unit
    assert (found["title"], found["curve"], found["rank"]) == ("A pendulum in the stairwell", "swing", 2)
    assert (found["degrees_of_freedom"], found["unidentified"]) == (58, [])
    assert found["rms_of_residuals"]["lam"] == pytest.approx(math.radians(0.05), rel=0.3)
    assert found["fixed"]["g"] == "9.81"
    assert "<svg" in Path("fit.svg").read_text()


def test_limits_on_one_side(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A limit may be the only one, and a fit that ends on it says so."""
    text = Path("fit.yaml").read_text()
    for given in ("{low: 100, start: 125, unit: cm}", "[null, 1.25, 1.29]"):
        Path("fit.yaml").write_text(text.replace("{low: 100, start: 125, high: 150, unit: cm}", given))
        assert tool.main(["fit", "fit.yaml", "--json", "found.json"]) == 0
        found, on_limit = json.loads(Path("found.json").read_text()), given.startswith("[null")
        assert found["at_limits"] == (["L"] if on_limit else [])
        assert found["estimates"]["L"]["value"] == pytest.approx(1.29 if on_limit else 1.3, rel=1e-3)
        assert ("L     1.29, which is its limit" in capsys.readouterr().out) == on_limit
    Path("fit.yaml").write_text(text.replace("{low: 100, start: 125, high: 150, unit: cm}", "[0.5, null]"))
    assert read_fit("fit.yaml").free["L"] == ("0.5", None, None)


def test_what_the_data_do_not_determine(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Periods determine g/L only, and infinity is written as null. Deviations may be a column, and so may launches."""
    Path("periods.csv").write_text("lam0,period,sigma\n10,2.29,5\n40,2.36,5\n80,2.60,5\n")
    Path("periods.yaml").write_text(
        "curve: swing.yaml\ndata: {file: periods.csv, units: {lam0: deg, sigma: ms}}\nfree: {L: 120 cm, g: null}\n"
    )
    assert tool.main(["fit", "periods.yaml", "--json", "found.json"]) == 0
    assert "do not tell L and g apart" in capsys.readouterr().out
    found = json.loads(Path("found.json").read_text())
    assert found["estimates"]["g"]["std"] is None
    assert found["unidentified"] == [["L", "g"]]
    assert read_fit("periods.yaml").data["sigma"]["period"].tolist() == [0.005] * 3


def test_passages_and_names(here: Path) -> None:
    """Passages through the lowest point are fitted; the launch is that of the curve file, except for what is fixed
    here.
    """
    half = pendulum.solve(0.5, L=1.3).half_period
    Path("passages.csv").write_text("passages\n" + "\n".join(f"{half * (k + 0.5):.12f}" for k in range(6)))
    Path("passages.yaml").write_text(
        "curve: swing.yaml\ndata: passages.csv\nplace: 0\nsigma: {passages: 1 ms}\nfree: {L: [1, 2]}\n"
        "fixed: {lam0: {value: 0.5, unit: rad}, direction: 1}\n"
    )
    plan = read_fit("passages.yaml")
    assert plan.fixed == {"lam0": "0.5", "v0": "0", "direction": 1}
    assert plan.free == {"L": ("1", "2")}
    assert plan.fit(pendulum).estimates["L"] == pytest.approx(1.3, rel=1e-10)


def test_the_schema_describes_what_is_read(capsys: pytest.CaptureFixture[str]) -> None:
    """`gqm schema --fit` prints the schema of what is read."""
    assert tool.main(["schema", "--fit"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert schema == fit_schema()
    assert set(schema["properties"]) == {"title", "curve", "data", "free", "sigma", "place", "fixed", "contact"}


MISTAKES = {
    "unknown key": (("title:", "titel:"), "fit.yaml:1:1: unknown key 'titel'; did you mean title?"),
    "no curve": (("swing.yaml", "swung.yaml"), "fit.yaml:2:8: curve: 'swung.yaml': there is no such file"),
    "out of the folder": (
        ("swings.csv", "../swings.csv"),
        "fit.yaml:3:1: data: '../swings.csv': must be a path inside",
    ),
    "a wrong unit": (("t: ms", "t: mm"), "fit.yaml:3:37: data.units.t: must be in s"),
    "a column that is not": (("t: ms", "T: ms"), "data.units: 'swings.csv' has no column 'T'"),
    "an unknown name": (("lam0: null", "lambda0: null"), "fit.yaml:7:3: free: there is no 'lambda0'"),
    "no number": (("low: 100", "low: abc"), "fit.yaml:6"),
    "a direction": (("{g: 9.81}", "{direction: 2}"), "fit.yaml:8:9: fixed: direction must be 1 or -1"),
    "known and sought": (("{g: 9.81}", "{L: 1}"), "fit.yaml:8:9: fixed: 'L' is to be found"),
    "a deviation of nothing": (("sigma: {lam", "sigma: {x"), "fit.yaml:4:9: sigma: 'x' was not measured"),
    "four numbers": (("lam0: null", "lam0: [1, 2, 3, 4]"), "must be a first guess, [low, high]"),
    "a deviation of zero": (("0.05 deg", "0"), "fit.yaml:4:9: sigma: 'lam' must be positive"),
    "nothing free": (("fixed:", "free: {}\nfixed:"), "fit.yaml:8:1"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_mistakes_have_their_place(case: str, here: Path) -> None:
    """Mistakes are reported with line, column, what is wrong, and what would be right."""
    (old, new), said = MISTAKES[case]
    text = Path("fit.yaml").read_text()
    assert old in text
    Path("fit.yaml").write_text(text.replace(old, new, 1))
    with pytest.raises(SpecFileError) as raised:
        read_fit("fit.yaml")
    assert said in str(raised.value)


TABLES = {
    "no number": ("t,lam\n1,2\n3,x\n", "'swings.csv', row 3: 'x' is not a finite decimal number"),
    "a formula": ("t,lam\n1,=1+1\n", "row 2: '=1+1' is not a finite decimal number"),
    "no names": ("1,2\n3,4\n", "row 1: must name the columns"),
    "nothing measured": ("t\n1\n2\n", "data: needs at least one of lam"),
    "an unknown column": ("t,lam,q\n1,2,3\n", "there is no column 'q'"),
}


@pytest.mark.parametrize("case", TABLES)
def test_tables_with_mistakes(case: str, here: Path) -> None:
    """The rows of mistakes in tables are named."""
    text, said = TABLES[case]
    Path("swings.csv").write_text(text)
    Path("fit.yaml").write_text("curve: swing.yaml\ndata: swings.csv\nfree: {L: 1.2}\n")
    with pytest.raises(SpecFileError) as raised:
        read_fit("fit.yaml")
    assert said in str(raised.value)


def test_a_fit_that_cannot_be(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two measurements for three numbers give one line and exit code 2, and nothing is written."""
    Path("swings.csv").write_text("t,lam\n1,0.2\n2,0.3\n")
    Path("fit.yaml").write_text("curve: swing.yaml\ndata: swings.csv\nfree: {L: 1.2, g: 9, lam0: 0.8}\n")
    assert tool.main(["fit", "fit.yaml", "--json", "found.json"]) == 2
    assert "cannot determine 3 numbers" in capsys.readouterr().err
    assert not Path("found.json").exists()
