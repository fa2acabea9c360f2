"""Fields and kinds of motions are documented, and names that were changed say so."""

import typing
from dataclasses import fields
from typing import Any

import pytest
from paths import ROOT

import generated.pendulum as pendulum
from gqm_sym.arguments import ChecksArguments
from gqm_sym.errors import ArgumentError, renamed
from gqm_sym.runtime.launch import kinds
from gqm_sym.runtime.launch.speed import Pass1
from gqm_sym.runtime.motion.at_rest import MotionAtRest
from gqm_sym.runtime.motion.events import Event, Leg
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.state import State
from gqm_sym.runtime.sweep import quantities
from gqm_sym.runtime.sweep.result import DESCRIBED


def test_a_renamed_attribute_says_its_new_name() -> None:
    """An old attribute of an object or module says its new name; any other missing name is refused as usual."""
    motion: Any = object.__new__(MotionAtRest)
    with pytest.raises(
        AttributeError, match="a motion has no attribute 'conditioning'; it is called 'condition_number'"
    ):
        motion.conditioning  # noqa: B018
    with pytest.raises(AttributeError, match=r"a motion has no attribute 'nonsense'$"):
        motion.nonsense  # noqa: B018
    assert not hasattr(motion, "__deepcopy__")
    of_module = renamed({"old": "new"}, "module 'm'")
    with pytest.raises(AttributeError, match="module 'm' has no attribute 'old'; it is called 'new' now"):
        of_module("old")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: m.time_at(1, 2), "motion.time_at: takes only lam without a name, got 2 without one; it takes lam"),
        (lambda m: m.time_at(), "motion.time_at: 'lam' must be given; it takes lam"),
        (lambda m: m.lam(1, 2), "motion.lam: takes only t without a name"),
        (lambda m: m.state(time=1), "motion.state: there is no argument 'time'; .*it takes t"),
        (lambda m: m.exceedance("vertical"), "motion.exceedance: 'levels' must be given; it takes load, levels"),
        (lambda m: m.period_to(), "motion.period_to: 'digits' must be given"),
        (lambda m: m.gradient("period", order=2, by="L"), "motion.gradient: there is no argument 'by'"),
    ],
)
def test_wrong_arguments_of_a_method_are_explained(call: Any, message: str) -> None:
    """Wrong arguments are explained in the words of the package, and not with the names of its classes."""
    with pytest.raises(ArgumentError, match=f"^{message}"):
        call(pendulum.solve(-0.37))


def test_other_type_errors_pass_unchanged() -> None:
    """Only a call that does not fit its signature is explained."""

    class Body(ChecksArguments):
        _called = "body"

        def move(self, by: float) -> None:
            raise TypeError("from inside")

    with pytest.raises(TypeError, match=r"^from inside$"):
        Body().move(1.0)


@pytest.mark.parametrize("record", [State, Pass1, Event, Leg])
def test_every_field_of_a_result_is_documented(record: Any) -> None:
    """Every field of a result is documented with its unit or meaning, under "Attributes"."""
    names = getattr(record, "_fields", None) or [field.name for field in fields(record)]
    described = [line.split(":")[0] for line in record.__doc__.splitlines() if " : " in line and line[4:5] != " "]
    assert {name.strip() for line in described for name in line.split(",")} == set(names)


def test_every_kind_and_end_is_documented() -> None:
    """Every kind and end is documented in `Motion`, `Event` and `Leg`, where a user looks."""
    for kind in typing.get_args(kinds.MotionKind):
        assert f'"{kind}"' in str(Motion.__doc__)
    for kind in kinds.EVENT_KINDS:
        assert f'"{kind}"' in str(Event.__doc__)
        assert f'"{kind}"' in str(kinds.__doc__)
    for end in kinds.LEG_ENDS:
        assert f'"{end}"' in str(Leg.__doc__)


def test_sweeps_and_gradients_ask_what_a_motion_has() -> None:
    """Sweeps and gradients have one list of quantities; each is an attribute of a motion, is described, and is on the
    page of sweeps.
    """
    page = (ROOT / "docs" / "howto" / "sweeps.md").read_text(encoding="utf-8")
    assert set(quantities.QUANTITIES) == {*kinds.QUANTITIES, *kinds.LOAD_EXTREMES}
    for name in quantities.QUANTITIES:
        assert hasattr(Motion, name)
        assert name in DESCRIBED or f"{name[:-1]}_lower" in DESCRIBED
        assert f"`{name}`" in page
    for name in kinds.QUANTITIES:
        assert f'"{name}"' in str(Motion.gradient.__doc__)
