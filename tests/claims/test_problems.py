"""The table of problems is itself tested, because a wrong reference value would be worse than none."""

import json

import pytest
import sympy as sp
from mpmath import mp, mpf
from naive import point
from paths import DATA
from problems import CORPUS, HARD, PAPER, PROBLEMS, TRACKS, Problem, number, where

AGREEMENT = mpf(10) ** -30


def test_every_entry_is_used() -> None:
    """Every track, tag and name is used by some problem; an unused one is a mistake."""
    assert {problem.track for problem in PROBLEMS.values()} == set(TRACKS)
    assert set(HARD) <= {problem.slug for problem in where(source="closed_forms.json")}


def _declared() -> list[tuple[str, str, dict[str, str], tuple[str, str], str]]:
    """Yield curves as the data files spell them: track, parameter, renamed, (x, z), id."""
    rows = []
    for case in json.loads((DATA / "paper_cases.json").read_text(encoding="ascii"))["cases"]:
        if case["id"] in PAPER:
            curve = case["curve"]
            texts = (curve["x"], curve["z"])
            rows.append((PAPER[case["id"]][0], curve["parameter"], {}, texts, case["id"]))
    for curve in json.loads((DATA / "curves.json").read_text(encoding="ascii")):
        if curve["name"] in CORPUS:
            track, renamed = CORPUS[curve["name"]]
            is_graph = curve["kind"] == "graph"
            texts = (curve["parameter"], curve["expr"]) if is_graph else (curve["x"], curve["z"])
            rows.append((track, curve["parameter"], renamed, texts, curve["name"]))
    return rows


@pytest.mark.parametrize(
    ("track", "parameter", "renamed", "texts"),
    [row[:4] for row in _declared()],
    ids=[row[4] for row in _declared()],
)
def test_a_track_is_the_curve_of_its_source(
    track: str, parameter: str, renamed: dict[str, str], texts: tuple[str, str]
) -> None:
    """The coordinates declared here are those of the data file, symbol by symbol."""
    ours = TRACKS[track]
    names = {parameter: sp.Symbol(ours.parameter)}
    names |= {old: sp.Symbol(new) for old, new in renamed.items()}
    for mine, theirs in zip((ours.x, ours.z), texts, strict=True):
        expected = sp.sympify(theirs, locals=names, rational=True)
        assert sp.expand(sp.sympify(mine, rational=True) - expected) == 0


def test_samples_follow_from_the_definitions(problem: Problem) -> None:
    """V**2, kappa and N are what the definitions give, to 30 digits."""
    for row in problem.samples:
        actual = point(problem, TRACKS[problem.track], row.lam)
        for name in ("v2", "kappa", "normal_force"):
            with mp.workdps(50):
                expected = number(getattr(row, name))
                assert abs(getattr(actual, name) - expected) <= AGREEMENT * max(1, abs(expected))


def test_positions_keep_the_energy(problem: Problem) -> None:
    """The speed at each position follows from the launch's energy."""
    for row in problem.positions:
        with mp.workdps(50):
            lam = number(row.lam)
            kept = point(problem, TRACKS[problem.track], lam).v2
            # The error of lam is relative to all of lam, however many laps it counts.
            assert abs(number(row.v) ** 2 - kept) <= AGREEMENT * max(1, kept, abs(lam))


def test_turning_points_are_where_the_speed_vanishes(problem: Problem) -> None:
    """V**2 is zero at each turning point, and a release from rest is the first of them."""
    for lam in problem.turning_points or ():
        assert abs(point(problem, TRACKS[problem.track], lam).v2) <= AGREEMENT * 100
    if problem.turning_points and number(problem.v0) == 0:
        assert abs(number(problem.turning_points[0]) - number(problem.lam0)) <= AGREEMENT
