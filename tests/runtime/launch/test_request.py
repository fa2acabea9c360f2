"""Wrong launches are refused, some arguments may be left out, and arguments may be given in several types."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import gqm_sym as gqm
from gqm_sym.cli import show
from gqm_sym.errors import GQMError, InputError, SolutionError


@pytest.fixture(scope="module")
def circle(module_of: Callable[[str], ModuleType]) -> ModuleType:
    """Return a bead on a circle of radius L, which has no default."""
    return module_of("circle")


@pytest.fixture(scope="module")
def arch(module_of: Callable[[str], ModuleType]) -> ModuleType:
    """Return one arch of a cycloid, with places from 0 to 2 pi."""
    return module_of("cycloid_arch")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"L": None}, r"L: has no default and was not given; pass L=\.\.\."),
        ({"L": [1]}, "L: list given; give one number"),
        ({"L": 0}, "L: must be positive, got 0; the closed forms hold for L > 0"),
        ({"lam0": None}, "lam0: not given; it is the value of lam to launch from"),
        ({"direction": 0}, r"direction: must be 1 or -1 .* got 0"),
        ({"contact": "left"}, "contact: must be one of bilateral, above, below, got 'left'"),
        ({"v0": -1}, "v0: is a speed and cannot be negative, got -1; use direction=-1"),
        ({"v0": 1e-155}, "v0: must be 0 or at least 1e-150 m/s, because its square is computed, got 1e-155"),
        ({"t_max": 0}, "t_max: must be positive, got 0"),
        ({"point": (0, 1)}, "point: circle has a parameter of its own; launch by lam0"),
    ],
)
def test_what_a_launch_is_refused_for(given: dict[str, Any], message: str, circle: ModuleType) -> None:
    """Each refusal names the argument, what is wrong, and what would be right."""
    with pytest.raises(InputError, match=f"^{message}"):
        circle.solve(**({"lam0": 1, "L": 1} | given))


@pytest.mark.parametrize(
    ("called", "given", "message"),
    [
        ("pass1", {}, "lam0: not given; it is the value of lam to launch from"),
        ("pass1", {"lam0": 1}, "lam: not given; pass one place or many, as values of lam"),
        ("solve", {}, "lam0: not given; it is the value of lam to launch from"),
        ("sweep", {}, "quantity: must be one of half_period, .* got None"),
        ("sweep", {"quantity": "period"}, r"lam0: has no default and was not given; pass lam0=\.\.\."),
    ],
)
def test_a_call_without_what_it_needs(called: str, given: dict[str, Any], message: str, circle: ModuleType) -> None:
    """The message says what is missing."""
    with pytest.raises(GQMError, match=f"^{message}"):
        getattr(circle, called)(**given, L=1)


def test_a_place_beyond_the_domain(arch: ModuleType) -> None:
    """The message contains the domain."""
    with pytest.raises(InputError, match=r"lam0: must lie in the domain \[0\.0, 6\.28.*\] of lam, got 7"):
        arch.solve(lam0=7, R=1)


def test_a_place_without_a_curve(tmp_path: Path) -> None:
    """No body can be launched at a place whose coordinates are no numbers."""
    module = gqm.build(gqm.derive(gqm.Curve.graph("sqrt(x)"), gqm.Gravity()), name="root", folder=tmp_path)
    with pytest.raises(InputError, match=r"lam0: the curve has no point at x = -1\.0 with these"):
        module.solve(lam0=-1)


def test_a_sweep_is_refused_for_the_same(circle: ModuleType) -> None:
    """A mistake that holds for all launches of a sweep is reported before any is solved."""
    with pytest.raises(InputError, match=r"^contact: must be one of bilateral, above, below, got 'left'"):
        circle.sweep("half_period", lam0=[0.5, 1.0], v0=0, L=1, contact="left")
    with pytest.raises(InputError, match=r"^quantity: must be one of half_period, "):
        circle.sweep("colour", lam0=[0.5, 1.0], v0=0, L=1)


@pytest.mark.parametrize("digits", [0, 2.5, "ten", 10**9])
def test_digits_that_cannot_be_had(digits: Any, circle: ModuleType) -> None:
    """There is a largest number of digits, and a request for more names it."""
    with pytest.raises(InputError, match="period_to: digits must be a whole number from 1 to"):
        circle.solve(lam0=1, L=1).period_to(digits)


# Printed motions


def said(motion: Any) -> str:
    """Return what the commands print about a launch."""
    return "\n".join(show.motion(motion, "lam"))


def test_what_is_said_of_each_kind(circle: ModuleType, arch: ModuleType) -> None:
    """The commands print only what the motion has: no turning points of a round, no legs of a body at rest, the end of
    an open motion.
    """
    swing = said(circle.solve(lam0=1, L=1))
    assert "half period     " in swing
    assert "turning points  lam = " in swing
    around = said(circle.solve(lam0=0, v0=10, L=1))
    assert "period          " in around
    assert "half period" not in around
    assert "turning points" not in around
    rest = said(circle.solve(lam0=0, L=1))
    assert "kind            rest" in rest
    assert "leg" not in rest
    out = said(arch.solve(lam0=1, R=1))
    assert "ends after      " in out
    with pytest.raises(SolutionError):
        _ = arch.solve(lam0=1, R=1).period
