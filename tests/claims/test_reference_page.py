"""The Python reference is complete: it has everything that is exported, and each docstring describes the arguments."""

import inspect
import re
from collections.abc import Iterator
from typing import Any

import pytest
from paths import ROOT

import gqm_sym as gqm
from gqm_sym import design, figures, jax, runtime, studies, torch
from gqm_sym.declare import families
from gqm_sym.declare.banking import Banking
from gqm_sym.derivation.forces.rider import Rider
from gqm_sym.fitting.result import Fit
from gqm_sym.fitting.uncertainty import Estimate, Uncertainty
from gqm_sym.runtime.gradients.sensitivity import Sensitivity
from gqm_sym.runtime.gradients.spectrum import Fourier
from gqm_sym.runtime.legs.variations.answers import Switch
from gqm_sym.smoothing import Smoothing

PAGE = (ROOT / "docs" / "reference" / "api.md").read_text(encoding="utf-8")

# Public functions return these, or attributes hold them, but they are not exported by name.
RETURNED = (Banking, Estimate, Fit, Fourier, Rider, Sensitivity, Switch, Uncertainty)
IN_PACKAGES = {"gqm_sym.smoothing": Smoothing, "gqm_sym.studies": studies.Plan}
# Generated modules call these, and their docstrings describe them.
INNER = {"CompiledModel", "compiler"}
# `State` inherits these from `dict` and refuses them.
OF_DICT = set(dir(dict))


def exported() -> dict[str, Any]:
    """Return every exported function and class by its full name."""
    found = {f"gqm_sym.{name}": getattr(gqm, name) for name in gqm.__all__}
    for room in (design, figures, jax, torch):
        found |= {f"{room.__name__}.{name}": getattr(room, name) for name in room.__all__}
    found |= {f"gqm_sym.runtime.{name}": getattr(runtime, name) for name in runtime.__all__ if name not in INNER}
    found |= {f"{one.__module__}.{one.__qualname__}": one for one in RETURNED}
    found |= {f"{package}.{one.__qualname__}": one for package, one in IN_PACKAGES.items()}
    found["gqm_sym.studies.run"] = studies.run
    return {name: one for name, one in found.items() if not inspect.ismodule(one)}


EXPORTED = exported()


def functions() -> Iterator[tuple[str, Any]]:
    """Yield the exported functions, and the public methods of exported classes, by name."""
    for name, one in EXPORTED.items():
        if not inspect.isclass(one):
            yield name, one
            continue
        for owner in one.__mro__:
            if owner.__module__.startswith("gqm_sym"):
                for key, member in vars(owner).items():
                    plain = member.__func__ if isinstance(member, staticmethod | classmethod) else member
                    if not key.startswith("_") and key not in OF_DICT and inspect.isfunction(plain):
                        yield f"{name}.{key}", plain
    yield "gqm_sym.families.circle", type(families.circle).__call__
    yield from ((f"gqm_sym.families.{name}", getattr(families, name)) for name in ("cartesian_graph", "implicit"))


FUNCTIONS = dict(functions())


def described(text: str) -> set[str]:
    """Return the names that the sections of a NumPy docstring describe."""
    lines = re.findall(r"^([*\w]+(?:, [*\w]+)*)(?: : .*)?$", text, flags=re.MULTILINE)
    return {name.lstrip("*") for line in lines for name in line.split(", ")}


@pytest.mark.parametrize("name", EXPORTED)
def test_everything_is_on_the_page(name: str) -> None:
    """Everything public is on the page by its full name, as Sphinx finds it."""
    assert re.search(rf"{re.escape(name)}\b", PAGE)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_argument_is_described(name: str) -> None:
    """Every argument is described in a section of the docstring; ``**more`` stands for arguments that are described."""
    text = inspect.getdoc(FUNCTIONS[name]) or ""
    assert text
    missing = set(inspect.signature(FUNCTIONS[name]).parameters) - {"self", "cls", "more"} - described(text)
    assert sorted(missing) == []


@pytest.mark.parametrize("name", [name for name, one in EXPORTED.items() if inspect.isclass(one)])
def test_every_field_is_described(name: str) -> None:
    """The docstring of a class, or of the class that it extends, has a section with its fields."""
    owner = EXPORTED[name]
    texts = [inspect.cleandoc(one.__doc__ or "") for one in owner.__mro__ if one.__module__.startswith("gqm_sym")]
    assert texts[0]
    fields = {field for field in getattr(owner, "__annotations__", {}) if not field.startswith("_")}
    assert sorted(fields - set().union(*map(described, texts))) == []
