"""Functions for PyTorch: periods of a generated module with exact derivatives, for autograd and ``torch.func``."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np

from gqm_sym.arguments import launch_arguments
from gqm_sym.errors import SolutionError
from gqm_sym.optional import require

__all__ = ["half_period", "period"]


def half_period(module: ModuleType) -> Callable[..., Any]:
    """Return the half period of a module's motions as a function for PyTorch.

    Parameters
    ----------
    module : module
        A generated module of a motion without losses on a curve with formulas.

    Returns
    -------
    callable
        ``f(lam0, v0=0.0, **parameters)``: launch place and speed in m/s and run-time parameters, numbers or tensors
        that broadcast; the half period in s as a tensor of doubles on the device of the first tensor, NaN where the
        motion has none. Its derivatives with respect to all of them are those of ``module.sweep(..., gradient=...)``,
        in forward and reverse mode. It is computed on the processor.

    Raises
    ------
    SolutionError
        If PyTorch is not installed (extra ``[torch]``), or for second derivatives.
    InputError
        Raised by the returned function for a name that is not a parameter of the module, or for a parameter without
        default that was not given.

    Notes
    -----
    The derivatives are tangents of the integral (MATHS, section 3; paper, eq. 17), not of the steps of a solver. Second
    derivatives by PyTorch are not available.
    """
    return _for_torch(module, "half_period")


def period(module: ModuleType) -> Callable[..., Any]:
    """Return the period of a module's motions as a function for PyTorch; see `half_period`.

    Parameters
    ----------
    module : module
        A generated module of a motion without losses on a curve with formulas.

    Returns
    -------
    callable
        ``f(lam0, v0=0.0, **parameters)``, in s.
    """
    return _for_torch(module, "period")


@require("torch")
def _for_torch(module: ModuleType, quantity: str) -> Callable[..., Any]:
    import torch

    class SweepFunction(torch.autograd.Function):  # type: ignore[misc, unused-ignore]
        """A sweep as one step of PyTorch: the values or, with names ``wrt``, the derivatives with respect to these,
        with one more axis.
        """

        @staticmethod
        def forward(names: tuple[str, ...], wrt: tuple[str, ...], *given: Any) -> Any:
            arrays = {name: tensor.detach().numpy() for name, tensor in zip(names, given, strict=True)}
            found = module.sweep(quantity, **arrays, **({"gradient": wrt} if wrt else {}))
            return torch.from_numpy(np.array(found.gradient if wrt else found.values, dtype=np.float64))

        @staticmethod
        def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Any) -> None:
            ctx.names, ctx.wrt, *given = inputs
            ctx.save_for_backward(*given)
            ctx.save_for_forward(*given)

        @staticmethod
        def vmap(info: Any, in_dims: tuple[Any, ...], names: Any, wrt: Any, *given: Any) -> Any:
            pairs = zip(given, in_dims[2:], strict=True)
            mapped = [t.expand(info.batch_size, *t.shape) if d is None else t.movedim(d, 0) for t, d in pairs]
            return SweepFunction.apply(names, wrt, *mapped), 0

        @staticmethod
        def backward(ctx: Any, gradient: Any) -> Any:
            wrt = tuple(name for name, needed in zip(ctx.names, ctx.needs_input_grad[2:], strict=True) if needed)
            slopes = _slopes(ctx, wrt)
            by = {name: gradient * slopes[..., k] for k, name in enumerate(wrt)}
            return None, None, *(by.get(name) for name in ctx.names)

        @staticmethod
        def jvp(ctx: Any, _: Any, __: Any, *tangents: Any) -> Any:
            varied = {name: t for name, t in zip(ctx.names, tangents, strict=True) if t is not None}
            slopes = _slopes(ctx, tuple(varied))
            return sum(slopes[..., k] * t for k, t in enumerate(varied.values()))

    def _slopes(ctx: Any, wrt: tuple[str, ...]) -> Any:
        if ctx.wrt:
            raise SolutionError(f"torch.{quantity}: second derivatives by PyTorch are not there")
        return SweepFunction.apply(ctx.names, wrt, *ctx.saved_tensors)

    def function(lam0: Any, v0: Any = 0.0, **parameters: Any) -> Any:
        given = launch_arguments(f"torch.{quantity}", module.PARAMETERS, lam0, v0, parameters)
        devices = [value.device for value in given.values() if isinstance(value, torch.Tensor)]
        doubles = [torch.as_tensor(value, dtype=torch.float64, device="cpu") for value in given.values()]
        found = SweepFunction.apply(tuple(given), (), *torch.broadcast_tensors(*doubles))
        return found.to(devices[0]) if devices else found

    return function
