"""Calls from compiled runtime code into the compiled functions of a generated module, by address.

A first-class function argument costs 30 to 60 microseconds to pass from Python; an integer address costs
nothing, and the code that calls it can be cached on disk.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gqm_sym.runtime.compiled.registers import line_of


def _call(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    """Lower ``address(arguments...)``: arrays by the address of their data, numbers as they are."""
    values = []
    for kind, value in zip(signature.args[1:], args[1:], strict=True):
        if isinstance(kind, types.Array):
            value = context.make_array(kind)(context, builder, value).data
        values.append(value)
    function = ir.FunctionType(ir.VoidType(), [value.type for value in values])
    builder.call(builder.inttoptr(args[0], function.as_pointer()), values)
    return context.get_dummy_value()


@intrinsic
def call_path_and_contact_force(_, address, n, lam, v2, p, out):  # type: ignore[no-untyped-def]
    """Fill x, z, ds, kappa and the normal force."""
    return types.void(address, n, lam, v2, p, out), _call


@intrinsic
def call_load_map(_, address, n, w0, level, lam, p, out):  # type: ignore[no-untyped-def]
    """Fill x, z, ds, kappa, V**2 and the normal force."""
    return types.void(address, n, w0, level, lam, p, out), _call


@intrinsic
def call_effective_potential(_, address, n, lam, p, out):  # type: ignore[no-untyped-def]
    """Fill the climb and its slope."""
    return types.void(address, n, lam, p, out), _call


@intrinsic
def call_potential_divdiff1(_, address, n, a, lam, d, p, out):  # type: ignore[no-untyped-def]
    """Fill the climb's first divided difference from ``a`` and ds."""
    return types.void(address, n, a, lam, d, p, out), _call


@intrinsic
def call_potential_divdiff2(_, address, n, a, b, da, db, p, out):  # type: ignore[no-untyped-def]
    """Fill the climb's second divided difference over a, lam, b and ds."""
    return types.void(address, n, a, b, da, db, p, out), _call


@intrinsic
def call_bounds(_, address, lo, hi, p, out):  # type: ignore[no-untyped-def]
    """Fill enclosures of the climb's slope and of ds over [lo, hi]."""
    return types.void(address, lo, hi, p, out), _call


@intrinsic
def call_potential_divdiff1_batch(_, address, n, a, lam, d, p, out):  # type: ignore[no-untyped-def]
    """Fill climb[a, lam], ds and the climb's slope, each for a launch of its own."""
    return types.void(address, n, a, lam, d, p, out), _call


@intrinsic
def call_potential_divdiff2_batch(_, address, n, a, b, da, db, p, out):  # type: ignore[no-untyped-def]
    """Fill climb[a, lam, b] and ds, each for an orbit of its own."""
    return types.void(address, n, a, b, da, db, p, out), _call


@intrinsic
def call_bounds_batch(_, address, n, lo, hi, p, out):  # type: ignore[no-untyped-def]
    """Fill enclosures of the climb's slope and of ds over many intervals, each for parameters of its own."""
    return types.void(address, n, lo, hi, p, out), _call


@intrinsic
def call_orbit_invariants_batch(_, address, n, a, b, p, out):  # type: ignore[no-untyped-def]
    """Fill what is the same all along an orbit, for many orbits."""
    return types.void(address, n, a, b, p, out), _call


@intrinsic
def call_time_integrand_batch(_, address, n, fall, rise, p, out):  # type: ignore[no-untyped-def]
    """Fill (dt/du)**2, and what that is divided by, for many orbits at the same share of their swing."""
    return types.void(address, n, fall, rise, p, out), _call


@intrinsic
def call_integrand_invariants_batch(_, address, n, half, p, out):  # type: ignore[no-untyped-def]
    """Fill what is the same all along a swing, for many orbits."""
    return types.void(address, n, half, p, out), _call


@intrinsic
def call_turning_by_closed_form_batch(_, address, n, offset, v2, p, out):  # type: ignore[no-untyped-def]
    """Fill half the width of orbits, the growth of the climb, and the square of the sine at the turning point."""
    return types.void(address, n, offset, v2, p, out), _call


@intrinsic
def call_agm_arguments_batch(_, address, n, half, p, out):  # type: ignore[no-untyped-def]
    """Fill the squares of two numbers whose arithmetic-geometric mean is pi over the half period, for many orbits."""
    return types.void(address, n, half, p, out), _call


@intrinsic
def call_speed_equation(_, address, n, work, rows, v, nu, p):  # type: ignore[no-untyped-def]
    """Fill ds/dlam, P, Q, n0 and kappa for a leg of signs v and nu.

    ``rows`` are the positions in the array ``work`` at which the places begin, V**2, and the results: numba would count
    references to views.
    """

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        address, n, work, positions, v, nu, p = args
        line = line_of(context, builder, signature.args[2], work)
        kinds = (*signature.args[:2], *(types.CPointer(types.float64),) * 2, *signature.args[4:7])
        kinds = (*kinds, types.CPointer(types.float64))
        places, speeds, out = (builder.gep(line, [builder.extract_value(positions, k)]) for k in range(3))
        return _call(context, builder, types.void(*kinds), (address, n, places, speeds, v, nu, p, out))

    return types.void(address, n, work, rows, v, nu, p), lower


@intrinsic
def call_static_balance(_, address, n, lam, p, out):  # type: ignore[no-untyped-def]
    """Fill the accelerations from rest, forwards and backwards."""
    return types.void(address, n, lam, p, out), _call


@intrinsic
def call_field(_, address, n, x, z, p, out):  # type: ignore[no-untyped-def]
    """Fill the value, the gradient and the second derivatives of F."""
    return types.void(address, n, x, z, p, out), _call


@intrinsic
def call_segment(_, address, n, lam, p, out):  # type: ignore[no-untyped-def]
    """Fill x, z, ds, dx/ds, dz/ds and kappa."""
    return types.void(address, n, lam, p, out), _call
