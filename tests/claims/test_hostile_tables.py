"""Files of points meant to do harm, and tracks that would take all time or memory, are refused early or bounded."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from confined import confined

import gqm_sym as gqm
from gqm_sym.budgets import budget
from gqm_sym.declare.piecewise import arc
from gqm_sym.errors import BudgetError, DeclarationError, ParameterError, SolutionError, SpecFileError
from gqm_sym.runtime.charts import arc_length, rail
from gqm_sym.runtime.charts.arc_length import rectify
from gqm_sym.runtime.charts.rail import Rail
from gqm_sym.runtime.charts.sampled import Sampled

YAML = "name: track\ncurve: {points: {file: track.csv, kind: linear}}\nkernel: {gravity: {}}\n"
MIB = 1 << 20


@pytest.fixture
def read(tmp_path: Path) -> Callable[[], object]:
    """Read the curve file beside the points."""
    (tmp_path / "a.yaml").write_text(YAML, encoding="utf-8")
    return lambda: gqm.read_spec(tmp_path / "a.yaml")


TABLES = {
    "rows": b"1,2\n" * (8 * MIB - 1),
    "empty rows": b"1" + b"\n" * (31 * MIB) + b"1",
    "one line": b"1," + b"2" * (31 * MIB),
    "commas": b"," * (31 * MIB),
    "blanks": b" " * (31 * MIB),
    "rows of blanks": b"\n".join([b" " * 190] * 100_000),
    "rows of blanks between": b"\n".join([b"," + b" " * 190 + b","] * 1000),
    "nulls": bytes(MIB),
    "a null": b"1,2\n2,3\0\n3,4",
    "quotes": b'"1","2"\n"2","3"\n',
    "a quote without end": b'"1,2\n' + b"2,3\n" * 1000,
    "a formula": b"=1+1,@SUM(1)\n2,3\n",
    "code": b"__import__('os'),1\n2,3\n",
    "names": b"inf,nan\n1,2\n",
    "beyond doubles": b"1e999,1\n1,2\n",
    "underscores": b"1_000,2\n2,3\n",
    "hexadecimal": b"0x10,2\n2,3\n",
    "Arabic digits": "\u0661,\u0662\n2,3\n3,4\n".encode(),
    "full width": "\uff11,\uff12\n2,3\n3,4\n".encode(),
    "another minus": "\u22121,2\n2,3\n".encode(),
    "UTF-16": "1,2\n2,3\n".encode("utf-16"),
    "UTF-32": "1,2\n2,3\n".encode("utf-32"),
    "two encodings": b"x,z\n1,2\n" + "é,1\n".encode("latin-1"),
    "a surrogate": b"1,2\n\xed\xa0\x80,3\n",
    "a mark within": "1,2\n\ufeff2,3\n3,4".encode(),
    "old line ends": b"1,2\r2,3\r3,4\r",
    "other line ends": "1,2\u20282,3\u20283,4\x0b4,5\x855,6".encode(),
    "an escape": b"1,2\n\x1b[2J,3\n",
    "a compressed file": b"\x1f\x8b\x08\x00" + bytes(1000),
}


@pytest.mark.parametrize("attack", TABLES)
def test_no_table_does_harm(attack: str, read: Callable[[], object], tmp_path: Path) -> None:
    """Anything but a table of decimal numbers is refused within bounded time and memory, in printable text."""
    (tmp_path / "track.csv").write_bytes(TABLES[attack])
    with confined(megabytes=300), pytest.raises(SpecFileError, match=r"'track\.csv'") as refused:
        read()
    assert str(refused.value).isprintable()
    assert len(str(refused.value)) < 1000


def test_a_table_without_end(read: Callable[[], object], tmp_path: Path) -> None:
    """Of a file of terabytes no more is read than is allowed, and nothing of a device, a pipe or a folder."""
    table = tmp_path / "track.csv"
    table.touch()
    os.truncate(table, 1 << 42)
    with confined(), pytest.raises(SpecFileError, match="is larger than 32 MiB"):
        read()
    table.unlink()
    for end in ("/dev/zero", "/dev/stdin", "/proc/self/mem", "/proc/self/environ"):
        table.symlink_to(end)
        with confined(), pytest.raises(SpecFileError, match=r"leads out of|no such file|cannot be read"):
            read()
        table.unlink()
    table.mkdir()
    with confined(), pytest.raises(SpecFileError, match=r"not a plain file|cannot be read"):
        read()


def test_links_that_lead_out_and_back(read: Callable[[], object], tmp_path: Path) -> None:
    """A link to itself, a folder that is a link to the outside, and a hard link to a pipe are not followed."""
    table = tmp_path / "track.csv"
    table.symlink_to(table)
    with confined(), pytest.raises(SpecFileError, match=r"'track\.csv': cannot be read"):
        read()
    table.unlink()
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "a.yaml").write_text(YAML.replace("track.csv", "out/track.csv"), encoding="utf-8")
    table.write_text("1,2\n2,3\n3,4\n", encoding="utf-8")
    (inside / "out").symlink_to(tmp_path)
    with confined(), pytest.raises(SpecFileError, match=r"leads out of the YAML file's folder by a link"):
        gqm.read_spec(inside / "a.yaml")


# Charts


@pytest.mark.parametrize("count", [12, 20])
def test_points_without_a_smooth_track(count: int) -> None:
    """Points through which no spline converges are refused, and the message names what to try."""
    z = np.random.default_rng(0).uniform(-3.0, 3.0, count)
    points = "\n".join(f"{k} {float(height)!r}" for k, height in enumerate(z))
    with pytest.raises(SolutionError, match=r"^sampled: no smooth track .*kind 'linear'"):
        Sampled(points=points, kind="spline", closed=False).chart(())


def test_a_rail_that_winds_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    """The number of pieces of each part of a rail is bounded, and so is that of all parts together."""
    monkeypatch.setattr(rail, "MAX_PIECES", 1000)
    pieces = [arc(radius=1 + k, angle=12) for k in range(5)]
    assert gqm.Curve.piecewise(pieces).kind == "piecewise"
    numbers = [n for k in range(5) for n in (1.0 + k, 300.0)]
    maker = Rail(numbers=lambda *_: (0.0, 0.0, 0.0, *numbers), pieces=("arc",) * 5, placed=True)
    with pytest.raises(BudgetError, match=r"^chart: piecewise: piece 4 \(arc\): 1000 pieces reach no farther"):
        maker.chart(())
    once = Rail(numbers=lambda *_: (0.0, 0.0, 0.0, 1.0, 1e6), pieces=("arc",), placed=True)
    with pytest.raises(ParameterError, match="turns by 1e\\+06 rad"):
        once.chart(())


# The length of a sine from 0 to 10 is sqrt(2) E(10, 1/2), by mpmath.
LENGTH = 12.252585234704537


def _wave(frequency: float) -> Callable[..., np.ndarray]:
    def rows(left: np.ndarray, offsets: np.ndarray) -> np.ndarray:
        x = left[:, None] + offsets
        slope, bend = frequency * np.cos(frequency * x), -(frequency**2) * np.sin(frequency * x)
        ds = np.sqrt(1.0 + slope**2)
        return np.stack([x, np.sin(frequency * x), ds, 1.0 / ds, slope / ds, bend / ds**3])

    return rows


def test_a_curve_that_oscillates_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    """A curve that oscillates without end is given up after a number of pieces, with a message that says where; one
    that needs fewer is not.
    """
    monkeypatch.setattr(arc_length, "MAX_PIECES", 500)
    assert rectify(_wave(1.0), np.array([0.0, 10.0]), where="wave").lengths.sum() == pytest.approx(LENGTH, rel=1e-13)
    with confined(10.0), pytest.raises(BudgetError, match=r"^chart: wave: not resolved by 500 pieces near 0\.0; give"):
        rectify(_wave(1e6), np.array([0.0, 10.0]), where="wave")


def test_a_chart_has_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Charts are made within a budget of time, which is checked while they are made."""
    with pytest.raises(BudgetError, match=r"^chart: not done after 0 s"), budget("chart", 0.0, "-"):
        rectify(_wave(1e3), np.array([0.0, 10.0]), where="wave")


def test_points_are_decimal_numbers() -> None:
    """In Python too, digits of other scripts are no numbers; other text goes into the module as it is."""
    with pytest.raises(DeclarationError, match="row 1: '\u0661' is not a decimal number"):
        gqm.Curve.sampled([("\u0661", "2"), ("2", "3")], kind="linear")
