"""The place of the peak of a function between two places is found to the rounding of the function."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from gqm_sym.runtime.motion.parts.peaks import grid_peaks, peak_between


def test_ever_finer_grids_find_a_peak() -> None:
    """A peak inside the range is found to a step of the last grid, and one at an end exactly."""
    *_, inside = grid_peaks(lambda x: -abs(x - 0.3), 0.0, 1.0)
    assert abs(inside.place - 0.3) <= 2**-49
    *_, at_end = grid_peaks(lambda x: x, 0.0, 1.0)
    assert (at_end.place, at_end.value) == (1.0, 1.0)


@pytest.mark.parametrize("width", [0.0, 2.0**-53, 2.0**-50, 2.0**-46, 1e-3])
def test_a_peak_is_sought_between_its_neighbours_only(width: float) -> None:
    """On a panel of the width of a few roundings, polynomials mean nothing beside it."""
    low, high = 1.0 - width, 1.0

    def values(places: np.ndarray) -> np.ndarray:
        assert np.all((places >= low) & (places <= high))
        return places

    assert peak_between(values, low, high, high) >= high - 2.0 * 2.0**-52


# Functions on [0, 1], where they are largest, and with which error this is found.
PEAKS: dict[str, tuple[Callable[[np.ndarray], np.ndarray], float, float]] = {
    "concave": (lambda x: np.cos(x - 0.3), 0.3, 1e-14),
    "concave beside an end": (lambda x: np.cos(x - 1.0 + 1e-7), 1.0 - 1e-7, 1e-14),
    "concave and rising": (lambda x: np.sqrt(4.0 + x), 1.0, 1e-15),
    "two peaks": (partial(np.polyval, np.polyint(-np.poly([0.2, 0.45, 0.75]))), 0.75, 1e-13),
    "flat": (lambda x: -((x - 0.625) ** 4), 0.625, 1e-4),
    "kink": (lambda x: -np.abs(x - 0.3), 0.3, 1e-14),
}


@pytest.mark.parametrize("name", PEAKS)
def test_peaks_of_all_kinds(name: str) -> None:
    """The peak is found where the slope vanishes, the second of two, at an end, and at a kink."""
    function, place, error = PEAKS[name]
    assert abs(peak_between(function, 0.0, 0.5, 1.0) - place) <= error
