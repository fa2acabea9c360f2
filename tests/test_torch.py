"""Periods as functions for PyTorch agree with elliptic integrals, if PyTorch is installed."""

import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.errors import GQMError, SolutionError
from gqm_sym.loading import load

# The relative tolerance of values and derivatives.
CLOSE = 1e-14


@pytest.fixture(scope="module")
def pendulum() -> ModuleType:
    """Return a pendulum, whose angle is measured from below."""
    return load(str(ROOT / "generated" / "circle.py"), "circle")


@pytest.fixture
def half_period(pendulum: ModuleType) -> Callable:
    """Return the half period as a function for PyTorch."""
    pytest.importorskip("torch", reason="PyTorch is not installed")
    return gqm.torch.half_period(pendulum)


def true(amplitude: float, length: float) -> mpf:
    """Return the half period of a pendulum, by Legendre's integral."""
    return 2 * mp.sqrt(mpf(length) / mpf("9.81")) * mp.ellipk(mp.sin(mpf(amplitude) / 2) ** 2)


def test_without_pytorch_it_says_what_to_install(pendulum: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error names the extra to install."""
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(GQMError, match=r"torch: needs torch, which is not installed; .* extra \[torch\]"):
        gqm.torch.period(pendulum)


def doubles(*values: Any) -> list[Any]:
    """Return tensors with respect to which one can differentiate."""
    import torch

    return [torch.tensor(value, dtype=torch.float64, requires_grad=True) for value in values]


def test_values_and_derivatives(half_period: Callable) -> None:
    """Gradients, in reverse and forward mode, are those of the elliptic integral."""
    import torch

    with mp.workdps(40):
        wanted = true(1.2, 0.75), mp.diff(true, (1.2, 0.75), (1, 0)), mp.diff(true, (1.2, 0.75), (0, 1))
    amplitude, length = doubles(1.2, 0.75)
    value = half_period(amplitude, L=length)
    value.backward()
    found = value.item(), amplitude.grad.item(), length.grad.item()
    assert [abs(mpf(a) / b - 1) < CLOSE for a, b in zip(found, wanted, strict=True)] == [True] * 3
    _, along = torch.func.jvp(lambda a: half_period(a, L=0.75), (amplitude.detach(),), (torch.tensor(2.0).double(),))
    assert along.item() == 2.0 * found[1]


def test_many_at_once(pendulum: ModuleType, half_period: Callable) -> None:
    """Tensors that broadcast, and `vmap` of `grad`, give the numbers of a sweep; NaN where there is no period."""
    import torch

    places, lengths = np.array([0.1, 0.9, np.pi]), np.array([0.5, 2.0])
    swept = pendulum.sweep("half_period", places[:, None], L=lengths, gradient="lam0")
    here, long = doubles(places[:, None], lengths)
    values = half_period(here, L=long)
    np.testing.assert_array_equal(values.detach(), swept.values)
    values[:2].sum().backward()
    np.testing.assert_allclose(here.grad[:2, 0], swept.gradient[:2, :, 0].sum(axis=1), rtol=1e-15)
    by_length = torch.func.vmap(torch.func.grad(lambda a, length: half_period(a, L=length)), in_dims=(None, 0))
    slopes = torch.func.vmap(by_length, in_dims=(0, None))(here.detach()[:2, 0], long.detach())
    np.testing.assert_array_equal(slopes, swept.gradient[:2, :, 0])
    assert torch.isnan(half_period(0.0, L=1.0))


def test_no_second_derivatives(half_period: Callable) -> None:
    """Second derivatives are refused, and not zero."""
    import torch

    (amplitude,) = doubles(1.2)
    (slope,) = torch.autograd.grad(half_period(amplitude, L=1.0), amplitude, create_graph=True)
    with pytest.raises(SolutionError, match="second derivatives"):
        slope.backward()


def test_a_name_that_is_none(half_period: Callable) -> None:
    """A misspelt parameter is reported with the list of parameters."""
    with pytest.raises(GQMError, match=r"torch\.half_period: there is no argument 'length'; it takes lam0, v0, L"):
        half_period(1.2, length=2.0)
