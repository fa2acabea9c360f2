"""Extremes of legs that are cut off."""

import numpy as np
import pytest
from mpmath import mp, mpf

from generated import circle_drag


@pytest.mark.parametrize("start", [-1.8, -2.0, -2.3])
def test_an_extreme_next_to_the_end_is_found(start: float) -> None:
    """In air W' = -2*g*sin(theta) - 2*b*W on a circle of radius 1, and the contact force W + g*cos(theta) is largest
    before the lowest place. Motions that end between that place and the next node were taken to be largest where they
    end.
    """
    with mp.workdps(30):
        g, b = mpf("9.81"), mpf("0.1")
        even = 2 * g / (1 + 4 * b**2)
        rest = even * (mp.cos(start) - 2 * b * mp.sin(start)) * mp.exp(2 * b * mpf(start))

        def load(theta: mpf) -> mpf:
            v2 = even * (mp.cos(theta) - 2 * b * mp.sin(theta)) - rest * mp.exp(-2 * b * theta)
            return v2 + g * mp.cos(theta)

        place = mp.findroot(lambda theta: mp.diff(load, theta), -0.1)
        largest = float(load(place))
    time = float(circle_drag.solve(start, 0, 1, t_max=5).time_at(float(place)))
    for end in time * (1.0 + 10.0 ** -np.linspace(1.0, 4.0, 10)):
        found = circle_drag.sweep("normal_force_max", [start], 0.0, 1, t_max=float(end)).values[0]
        assert found == pytest.approx(largest, rel=2e-15)


@pytest.mark.parametrize("angle", [1.4, 1.5, 1.55])
def test_the_smallest_contact_force_at_a_release(angle: float) -> None:
    """It had the rounding errors of the largest one, up to 24 units in the last place of the small value."""
    smallest = circle_drag.sweep("normal_force_min", angle, 0.0, b=0.05, g=9.81, t_max=10)
    exact = mpf(9.81) * mp.cos(mpf(angle))
    assert abs(mpf(float(smallest.values)) / exact - 1) <= 2.0**-52
