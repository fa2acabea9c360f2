"""Beside samples of a panel, functions do not exceed the limits that follow from the samples."""

import numpy as np
import pytest

from gqm_sym.runtime.sweep.tables.layout import SAMPLE_POINTS, SAMPLES
from gqm_sym.runtime.sweep.tables.samples import is_same_joint, limit_beside

DENSE = np.linspace(-1.0, 1.0, 4001)


def limits_of(values: np.ndarray) -> list[float]:
    """Return the limit beside each sample that is not NaN."""
    samples = SAMPLE_POINTS.copy(), values
    return [limit_beside(samples, 1.0, i, False) for i in range(SAMPLES) if values[i] == values[i]]


@pytest.mark.parametrize("sharpness", [0.1, 1.0, 2.0])
def test_limits(sharpness: float) -> None:
    """They are not below the top of a function with one peak, wherever it is, nor above the end to which it rises."""
    for middle in (*np.linspace(-2.0, 2.0, 41), *np.linspace(-1.05, -0.95, 41)):
        values = np.exp(-sharpness * (SAMPLE_POINTS - middle) ** 2)
        top = np.exp(-sharpness * (DENSE - middle) ** 2).max()
        assert max(limits_of(values)) >= top * (1 - 1e-15)
        if abs(middle) > 1.1:
            assert max(limits_of(values)) == values.max()


def test_cut_panels() -> None:
    """A sample beside the end of a stretch has that end for its neighbour."""
    values = -SAMPLE_POINTS
    values[:3] = np.nan
    limits = limits_of(values)
    assert max(limits) == limits[0] == values[3]


def test_joints() -> None:
    """The two sides of a joint are the same place, and no other places are."""
    assert is_same_joint((3, 1.0), (4, -1.0))
    assert is_same_joint((4, -1.0), (3, 1.0))
    assert not is_same_joint((3, 1.0), (5, -1.0))
    assert not is_same_joint((3, -1.0), (4, 1.0))
    assert not is_same_joint((3, 0.5), (4, -0.5))
