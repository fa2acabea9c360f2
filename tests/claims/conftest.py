"""Fixtures of the tests of what the project promises."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import pytest

import gqm_sym as gqm


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, Any, Any], ModuleType]:
    """Build the module of a curve under a whole force law, once under one name."""
    folder, modules = tmp_path_factory.mktemp("modules"), {}

    def module(name: str, curve: Any, law: Any) -> ModuleType:
        if name not in modules:
            modules[name] = gqm.build(gqm.derive(curve, law), name=name, folder=folder)
        return modules[name]

    return module
