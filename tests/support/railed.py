"""Tests make rails, their modules and their charts."""

from pathlib import Path
from types import ModuleType
from typing import Any

import gqm_sym as gqm
from gqm_sym.runtime.charts.chart import Chart

# The rail is a loop between clothoids.
LOOP = [
    gqm.line(length="a"),
    gqm.clothoid(length="c", kappa_start=0, kappa_end="1/R"),
    gqm.arc(radius="R", angle="2*pi - c/R"),
    gqm.clothoid(length="c", kappa_start="1/R", kappa_end=0),
    gqm.line(length="a"),
]


def built(folder: Path, name: str, pieces: list[Any], **options: Any) -> ModuleType:
    """Return a module for motion under gravity along a rail."""
    return gqm.build(gqm.derive(gqm.Curve.piecewise(pieces, **options), gqm.Gravity()), name=name, folder=folder)


def chart_of(module: ModuleType, **given: Any) -> Chart:
    """Return the chart that a module makes of its rail."""
    numbers = module.MODEL.numbers(tuple((module.PARAMETERS | given).values()))
    return module.MODEL.charted(numbers)
