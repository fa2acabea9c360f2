"""Sweep files at their limits are handled: long reading, wrong entries in tables, and launches without a value."""

import os
import time
from pathlib import Path
from typing import Any

import pytest

from gqm_sym import emission
from gqm_sym.cli import tool
from gqm_sym.errors import InputError, SpecFileError
from gqm_sym.specfile import companion_files
from gqm_sym.studies import read_sweep, reader

SWING = (
    "name: swing\ncurve: {family: {name: circle, L: L}}\nkernel: {gravity: {}}\nparameters: {L: 1}\n"
    "launch: {lam0: 1.2, v0: 0, contact: above}\n"
)
SWEEP = "curve: swing.yaml\nquantities: [period]\n"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with a curve file, in which commands run."""
    monkeypatch.chdir(tmp_path)
    Path("swing.yaml").write_text(SWING)
    Path("a.csv").write_text("lam0\n1\n2\n")
    return tmp_path


def sweep(text: str) -> Path:
    """Write a sweep file."""
    path = Path("a.yaml")
    path.write_text(SWEEP + text)
    return path


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("grid: {lam0: {begin: 0, stop: 1, num: 2}}", "3:15: grid.lam0: unknown key 'begin'; allowed are"),
        ("table: {fil: a.csv}", "3:9: table: unknown key 'fil'; did you mean file?"),
        ("table: {units: {lam0: rad}}", "3:1: table: file is missing; add file: "),
        ("grid: {lam0: [1, 2]}\nfixed: {v0: {val: 1}}", "4:14: fixed.v0: unknown key 'val'; did you mean value?"),
        ("table: {file: a.csv, units: {v0: m/s}}", "3:30: table.units: 'a.csv' has no column 'v0'; it has lam0"),
    ],
)
def test_keys_that_are_none(text: str, message: str, here: Path) -> None:
    """Unknown keys are reported at their place, with the list of keys."""
    with pytest.raises(SpecFileError) as caught:
        read_sweep(sweep(text))
    assert any(mistake.startswith(f"a.yaml:{message}") for mistake in caught.value.mistakes), caught.value


def test_reading_has_a_budget(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that takes too long to read is refused with its name."""
    monkeypatch.setattr(reader, "SECONDS", -1.0)
    with pytest.raises(SpecFileError, match=r"^a\.yaml: reading: not done after -1 s of processor time; write fewer"):
        read_sweep(sweep("grid: {lam0: [1, 2]}"))


def test_what_is_derived_and_emitted_is_not_reading(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Derivation and emission have budgets of their own, so that a slow machine is no mistake of the sweep file."""

    def slowly(*arguments: Any, **names: Any) -> Any:
        end = time.thread_time() + reader.SECONDS
        while time.thread_time() <= end:
            pass
        return emit(*arguments, **names)

    emit = emission.emit
    monkeypatch.setattr(reader, "emit", slowly)
    assert read_sweep(sweep("grid: {lam0: [1, 2]}")).quantities == ("period",)


def test_a_sweep_may_give_the_other_side_back(here: Path) -> None:
    """The curve file's contact holds unless the sweep has one of its own, which may be both sides."""
    assert read_sweep(sweep("grid: {lam0: [1, 2]}")).fixed["contact"] == "above"
    assert "contact" not in read_sweep(sweep("grid: {lam0: [1, 2]}\ncontact: bilateral")).fixed


def test_what_has_no_value_is_counted(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A body at rest has no period, which is counted; an earlier file or folder is replaced."""
    sweep("grid: {lam0: [0, 1, 2]}\ncontact: bilateral")
    for _ in range(2):
        assert tool.main(["sweep", "a.yaml", "-o", "a.zarr", "--force"]) == 0
        said = capsys.readouterr().out.splitlines()
        assert said[0] == "  3 lam0: period"
        assert said[1].startswith("  period: 1 without a value: ")
        assert said[-1] == "wrote a.zarr"
    assert Path("a.zarr").is_dir()


# These may take the place of a file while it is opened.


@pytest.mark.parametrize("kind", ["a pipe", "no right"])
def test_a_table_that_changes_meanwhile(kind: str, here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A table is checked again after it is opened, and a pipe does not block."""
    if kind == "a pipe":
        os.mkfifo("pipe")
        monkeypatch.setattr(companion_files, "companion_path", lambda *_, **__: here / "pipe")
        message = "'a.csv': is not a plain file; give a CSV file"
    else:

        def refuse(*_: Any) -> int:
            raise PermissionError(13, "Permission denied")

        monkeypatch.setattr(companion_files.os, "open", refuse)
        message = r"'a\.csv': cannot be read \(Permission denied\); give a CSV file"
    with pytest.raises(InputError, match=message):
        read_sweep(sweep("table: a.csv"))
