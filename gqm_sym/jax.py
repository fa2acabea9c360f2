"""Functions for JAX: periods of a generated module with their exact derivatives, for ``grad``, ``jit`` and ``vmap``."""

from collections.abc import Callable
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np

from gqm_sym.arguments import launch_arguments, short
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.literals.numbers import read_number
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
    derivatives by JAX are refused; ``motion.gradient(..., order=2)`` has them.
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

    model = module.MODEL
    units = {"lam0": model.units.get(model.parameter), "v0": "m/s", **model.units}

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
        first: Any = jax.custom_jvp(lambda wrt, *arguments: computed(names, wrt, arguments), nondiff_argnums=(0,))

        def second(*_: Any) -> Any:
            raise SolutionError(
                f"jax.{quantity}: JAX gets no second derivatives; motion.gradient('{quantity}', order=2) has them"
            )

        def tangent(primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> Any:
            zero = jax.custom_derivatives.SymbolicZero
            varied = {name: t for name, t in zip(names, tangents, strict=True) if not isinstance(t, zero)}
            slopes = first(tuple(varied), *primals)
            return value(*primals), sum(slopes[..., k] * t for k, t in enumerate(varied.values()))

        first.defjvp(second)
        value.defjvp(tangent, symbolic_zeros=True)
        return value

    def as_array(name: str, value: Any) -> Any:
        """Return an argument as an array of JAX."""
        if isinstance(value, str):
            value = read_number(value, where=name, unit=units.get(name)).value
        try:
            return jnp.asarray(value, dtype=float)
        except (TypeError, ValueError):
            raise InputError(f"jax.{quantity}: {name}: must be a number or an array, got {short(value)}") from None

    def function(lam0: Any, v0: Any = 0.0, **parameters: Any) -> Any:
        given = launch_arguments(f"jax.{quantity}", module.PARAMETERS, lam0, v0, parameters)
        return differentiable(tuple(given))(*(as_array(name, value) for name, value in given.items()))

    return function
