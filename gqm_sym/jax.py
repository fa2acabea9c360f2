"""Functions for JAX: periods of a generated module with their exact derivatives, for ``grad``, ``jit`` and ``vmap``."""

from collections.abc import Callable
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np

from gqm_sym.arguments import launch_arguments
from gqm_sym.optional import require

__all__ = ["half_period", "period"]


def half_period(module: ModuleType) -> Callable[..., Any]:
    """Return the half period of a module's motions as a function for JAX.

    Parameters
    ----------
    module : module
        A generated module of a motion without losses on a curve with formulas.

    Returns
    -------
    callable
        ``f(lam0, v0=0.0, **parameters)``: launch place and speed in m/s and run-time parameters, numbers or arrays that
        broadcast; the half period in s, NaN where the motion has none. Its derivatives with respect to all of them are
        those of ``module.sweep(..., gradient=...)``, in forward and reverse mode. It is computed in doubles, and
        returned in JAX's precision: set ``jax_enable_x64`` to keep all digits.

    Raises
    ------
    SolutionError
        If JAX is not installed (extra ``[jax]``).
    InputError
        Raised by the returned function for a name that is not a parameter of the module, or for a parameter without
        default that was not given.

    Notes
    -----
    The derivatives are tangents of the integral (MATHS, section 3; paper, eq. 17), not of the steps of a solver. Second
    derivatives by JAX are not available.
    """
    return _for_jax(module, "half_period")


def period(module: ModuleType) -> Callable[..., Any]:
    """Return the period of a module's motions as a function for JAX; see `half_period`.

    Parameters
    ----------
    module : module
        A generated module of a motion without losses on a curve with formulas.

    Returns
    -------
    callable
        ``f(lam0, v0=0.0, **parameters)``, in s.
    """
    return _for_jax(module, "period")


@require("jax")
def _for_jax(module: ModuleType, quantity: str) -> Callable[..., Any]:
    import jax
    from jax import numpy as jnp

    def computed(names: tuple[str, ...], wrt: tuple[str, ...], arguments: tuple[Any, ...]) -> Any:
        """Return a sweep as one step of JAX: the values or, if names to differentiate by are given, the derivatives,
        with one more axis.
        """

        def call(*given: Any) -> Any:
            arrays = {name: np.asarray(array, dtype=np.float64) for name, array in zip(names, given, strict=True)}
            found = module.sweep(quantity, **arrays, **({"gradient": wrt} if wrt else {}))
            return np.asarray(found.gradient if wrt else found.values, dtype=out.dtype)

        arrays = jnp.broadcast_arrays(*arguments)
        shape = (*arrays[0].shape, *((len(wrt),) if wrt else ()))
        out = jax.ShapeDtypeStruct(shape, arrays[0].dtype)  # type: ignore[no-untyped-call, unused-ignore]
        return jax.pure_callback(call, out, *arrays, vmap_method="broadcast_all")

    @cache
    def differentiable(names: tuple[str, ...]) -> Any:
        value: Any = jax.custom_jvp(lambda *arguments: computed(names, (), arguments))

        def tangent(primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> Any:
            zero = jax.custom_derivatives.SymbolicZero
            varied = {name: t for name, t in zip(names, tangents, strict=True) if not isinstance(t, zero)}
            slopes = computed(names, tuple(varied), primals)
            return value(*primals), sum(slopes[..., k] * t for k, t in enumerate(varied.values()))

        value.defjvp(tangent, symbolic_zeros=True)
        return value

    def function(lam0: Any, v0: Any = 0.0, **parameters: Any) -> Any:
        given = launch_arguments(f"jax.{quantity}", module.PARAMETERS, lam0, v0, parameters)
        return differentiable(tuple(given))(*(jnp.asarray(value, dtype=float) for value in given.values()))

    return function
