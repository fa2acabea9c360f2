"""Periods as functions for JAX agree with elliptic integrals, if JAX is installed."""

import sys
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.errors import GQMError

# The relative tolerance of values and derivatives.
CLOSE = 1e-14


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a pendulum, whose angle is measured from below."""
    model = gqm.derive(gqm.families.circle(), gqm.Gravity())
    return gqm.build(model, name="for_jax", folder=tmp_path_factory.mktemp("jax"))


@pytest.fixture
def half_period(pendulum: ModuleType) -> Callable:
    """Return the half period as a function for JAX, in doubles."""
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    return gqm.jax.half_period(pendulum)


def true(amplitude: float, length: float) -> mpf:
    """Return the half period of a pendulum, by Legendre's integral."""
    return 2 * mp.sqrt(mpf(length) / mpf("9.81")) * mp.ellipk(mp.sin(mpf(amplitude) / 2) ** 2)


def test_without_jax_it_says_what_to_install(pendulum: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error names the extra to install."""
    monkeypatch.setitem(sys.modules, "jax", None)
    with pytest.raises(GQMError, match=r"jax: needs jax, which is not installed; .* extra \[jax\]"):
        gqm.jax.period(pendulum)


def test_values_and_derivatives(half_period: Callable) -> None:
    """Gradients, in reverse and forward mode, are those of the elliptic integral."""
    import jax

    with mp.workdps(40):
        wanted = true(1.2, 0.75), mp.diff(true, (1.2, 0.75), (1, 0)), mp.diff(true, (1.2, 0.75), (0, 1))
    value, slopes = jax.value_and_grad(lambda q: half_period(q[0], L=q[1]))(np.array([1.2, 0.75]))
    assert [abs(mpf(float(a)) / b - 1) < CLOSE for a, b in zip((value, *slopes), wanted, strict=True)] == [True] * 3
    _, along = jax.jvp(lambda a: half_period(a, L=0.75), (1.2,), (2.0,))
    assert float(along) == 2.0 * float(slopes[0])


@pytest.mark.extended
def test_compiled_and_mapped(pendulum: ModuleType, half_period: Callable) -> None:
    """Under `jit` and `vmap`, nested too, the numbers are those of a sweep; NaN where there is no period."""
    import jax

    places, lengths = np.array([0.1, 0.9, np.pi]), np.array([0.5, 2.0])
    swept = pendulum.sweep("half_period", places[:, None], L=lengths, gradient="lam0")
    by_length = jax.vmap(jax.value_and_grad(lambda a, length: half_period(a, L=length)), in_axes=(None, 0))
    values, slopes = jax.jit(jax.vmap(by_length, in_axes=(0, None)))(places, lengths)
    np.testing.assert_array_equal(values, swept.values)
    np.testing.assert_array_equal(slopes, swept.gradient[..., 0])
    assert np.isnan(half_period(0.0, L=1.0))


def test_what_is_not_varied_has_no_say(half_period: Callable) -> None:
    """The mass has no influence, and numbers that are not varied have no derivative."""
    import jax

    both = jax.grad(lambda q: half_period(1.2, L=0.75, m=q[0], g=q[1]))(np.array([2.0, 9.81]))
    with mp.workdps(40):
        assert abs(mpf(float(both[1])) / (-true(1.2, 0.75) / (2 * mpf("9.81"))) - 1) < CLOSE
    assert float(both[0]) == 0.0


def test_a_name_that_is_none(half_period: Callable) -> None:
    """A misspelt parameter is reported with the list of parameters, and so is one that is missing."""
    with pytest.raises(GQMError, match="L: has no default and was not given"):
        half_period(1.2)
    with pytest.raises(GQMError, match=r"jax\.half_period: there is no argument 'length'; it takes lam0, v0, L, g, m"):
        half_period(1.2, length=2.0)


def test_what_has_no_derivative_or_is_no_number(half_period: Callable) -> None:
    """Second derivatives, and arguments that are no numbers, are refused by one clear error; text is read."""
    import jax

    with pytest.raises(GQMError, match=r"jax\.half_period: JAX gets no second derivatives; motion\.gradient"):
        jax.grad(jax.grad(half_period))(1.2, L=0.75)
    with pytest.raises(GQMError, match=r"jax\.half_period: lam0: must be a number or an array, got 1j"):
        half_period(1j, L=0.75)
    with mp.workdps(40):
        found = float(half_period("90 deg", L="75 cm"))
        assert abs(mpf(found) / true(mp.pi / 2, 0.75) - 1) < CLOSE
