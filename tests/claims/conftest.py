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


@pytest.fixture(scope="module")
def build_train(built: Callable[[str, Any, Any], ModuleType]) -> Callable[..., ModuleType]:
    """Build the module of a train along a curve under a force law, once under one name; that of a body for no cars."""

    def module(name: str, curve: Any, law: Any, cars: int = 3) -> ModuleType:
        return built(name, curve, law + gqm.Train(cars=cars) if cars else law)

    return module
