"""Gradients of periods with respect to every variable agree with differences of periods of 45 digits, for each
conservative force.
"""

import inspect
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf
from paths import ROOT
from selection import examples

from gqm_sym.loading import load

# The step of a difference, whose error is in proportion to its square, and the digits of the periods.
STEP, DIGITS = Fraction(1, 10**11), 45
ULP = 2.0**-52

# There is a module for each force and for each kind of curve, with the places of launch.
LAUNCHES = {
    "catenary": (0.5, 2.0),
    "circle": (-2.0, 2.0),
    "circle_rotating": (0.5, 1.5),
    "circle_spring": (-1.5, 2.0),
    "cycloid_inverted": (3.5, 5.5),
    "double_well": (0.4, 1.1),
    "ellipse": (-2.2, -0.7),
    "kepler": (0.5, 1.5),
    "line_spring": (-2.0, 2.0),
    "log_spiral": (-0.5, 0.3),
    "parabola": (-1.0, 1.0),
    "parabola_rolling": (-0.6, 0.6),
    "pendulum": (-2.8, -0.4),
    "quartic": (-0.9, 0.9),
    "rolling_circle": (-1.5, 1.5),
    "rotating_parabola": (-0.6, 0.6),
    "viviani": (0.3, 1.2),
}


@pytest.mark.extended
@pytest.mark.parametrize("name", LAUNCHES)
@examples(2)
@given(data=st.data())
def test_gradients_of_periods(name: str, data: Any) -> None:
    """Gradients of periods are right to two units in the last place."""
    module, (low, high) = load(str(ROOT / "generated" / f"{name}.py"), name), LAUNCHES[name]
    share, speed = data.draw(st.integers(1, 255)), data.draw(st.integers(1, 64))
    arguments = inspect.signature(module.solve).parameters
    values = {p: Fraction(str(arguments[p].default)) for p in module.PARAMETERS}
    values |= {"lam0": Fraction(low) + Fraction(high - low) * Fraction(share, 256), "v0": Fraction(speed, 256)}
    by = data.draw(st.sampled_from(sorted(values)))

    def period(moved: Fraction) -> mpf:
        beside = values | {by: values[by] + moved}
        return mpf(module.solve(**{name: str(value) for name, value in beside.items()}).period_to(DIGITS))

    found = module.solve(**{name: str(value) for name, value in values.items()}).gradient("period", by)[by]
    with mp.workdps(DIGITS):
        truth = (period(STEP) - period(-STEP)) / (2 * mpf(STEP.numerator) / STEP.denominator)
        # Where the derivative vanishes, the difference is 1e-22, the square of the step.
        assert abs(found - truth) <= 2.0 * ULP * abs(truth) + 1e-20, (by, values)


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", LAUNCHES)
@examples(2)
@given(data=st.data())
def test_gradients_of_swept_periods(name: str, data: Any) -> None:
    """Gradients in sweeps are right to two units in the last place of the integral of the absolute values, which is at
    most four times the derivative where double precision is used.
    """
    module, (low, high) = load(str(ROOT / "generated" / f"{name}.py"), name), LAUNCHES[name]
    place = low + (high - low) * data.draw(st.integers(1, 255)) / 256
    speed = data.draw(st.sampled_from([0.0, 0.125, 0.5]))
    arguments = inspect.signature(module.solve).parameters
    values = {p: float(Fraction(str(arguments[p].default))) for p in module.PARAMETERS}
    values |= {"lam0": place, "v0": speed}
    # At rest the derivative by the speed is one-sided.
    by = data.draw(st.sampled_from(sorted(values if speed else set(values) - {"v0"})))

    def period(moved: Fraction) -> mpf:
        beside = {key: str(Fraction(value) + (moved if key == by else 0)) for key, value in values.items()}
        return mpf(module.solve(**beside).period_to(DIGITS))

    swept = module.sweep("period", **values, gradient=by)
    with mp.workdps(DIGITS):
        truth = (period(STEP) - period(-STEP)) / (2 * mpf(STEP.numerator) / STEP.denominator)
        assert abs(float(swept.gradient[0]) - truth) <= 8.0 * ULP * abs(truth) + 1e-20, (by, values)
