"""Calls from compiled runtime code into the compiled functions of a generated module, by address.

Passing a function itself from Python would take 30 to 60 microseconds. Passing an address takes none, and code that
calls it can be cached on disk. The rows that each function fills are in the table of `interface`.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gqm_sym.runtime.compiled.registers import line_of


def _call(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    """Emit the call ``address(arguments...)``; an array is passed by the address of its data, a number by value."""
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
    """Fill x, z, ds/dlam, kappa and the normal force."""
    return types.void(address, n, lam, v2, p, out), _call


@intrinsic
def call_load_map(_, address, n, w0, level, lam, p, out):  # type: ignore[no-untyped-def]
    """Fill x, z, ds/dlam, kappa, V**2 and the normal force."""
    return types.void(address, n, w0, level, lam, p, out), _call


@intrinsic
def call_effective_potential(_, address, n, lam, p, out):  # type: ignore[no-untyped-def]
    """Fill 2*Phi/(1 + beta) and its slope."""
    return types.void(address, n, lam, p, out), _call


@intrinsic
def call_potential_divdiff1(_, address, n, a, lam, d, p, out):  # type: ignore[no-untyped-def]
    """Fill the potential's first divided difference over a and lam = a + d, and ds/dlam."""
    return types.void(address, n, a, lam, d, p, out), _call


@intrinsic
def call_potential_divdiff2(_, address, n, a, b, da, db, p, out):  # type: ignore[no-untyped-def]
    """Fill the potential's second divided difference over a, lam = a + da = b - db and b, and ds/dlam."""
    return types.void(address, n, a, b, da, db, p, out), _call


@intrinsic
def call_bounds(_, address, lo, hi, p, out):  # type: ignore[no-untyped-def]
    """Fill enclosures of the potential's slope and of ds/dlam over [lo, hi]."""
    return types.void(address, lo, hi, p, out), _call


@intrinsic
def call_potential_divdiff1_batch(_, address, n, a, lam, d, p, out):  # type: ignore[no-untyped-def]
    """Fill the first divided difference over a and lam, ds/dlam and the potential's slope for a batch of launches."""
    return types.void(address, n, a, lam, d, p, out), _call


@intrinsic
def call_potential_divdiff2_batch(_, address, n, a, b, da, db, p, out):  # type: ignore[no-untyped-def]
    """Fill the second divided difference over a, lam and b, and ds/dlam, for a batch of orbits."""
    return types.void(address, n, a, b, da, db, p, out), _call


@intrinsic
def call_bounds_batch(_, address, n, lo, hi, p, out):  # type: ignore[no-untyped-def]
    """Fill enclosures of the potential's slope and of ds/dlam over a batch of intervals."""
    return types.void(address, n, lo, hi, p, out), _call


@intrinsic
def call_orbit_invariants_batch(_, address, n, a, b, p, out):  # type: ignore[no-untyped-def]
    """Fill the invariants of a batch of orbits."""
    return types.void(address, n, a, b, p, out), _call


@intrinsic
def call_time_integrand_batch(_, address, n, fall, rise, p, out):  # type: ignore[no-untyped-def]
    """Fill numerator and denominator of (dt/du)**2 for a batch of orbits, at the same share of each swing."""
    return types.void(address, n, fall, rise, p, out), _call


@intrinsic
def call_integrand_invariants_batch(_, address, n, half, p, out):  # type: ignore[no-untyped-def]
    """Fill the invariants of the time integrand of a batch of orbits."""
    return types.void(address, n, half, p, out), _call


@intrinsic
def call_turning_by_closed_form_batch(_, address, n, offset, v2, p, out):  # type: ignore[no-untyped-def]
    """Fill half the width of orbits, the growth of the potential, and the squared sine at the turning point."""
    return types.void(address, n, offset, v2, p, out), _call


@intrinsic
def call_agm_arguments_batch(_, address, n, half, p, out):  # type: ignore[no-untyped-def]
    """Fill the squares of two numbers whose arithmetic-geometric mean is pi/(half period), for a batch of orbits."""
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
    """Fill x, z, ds/dlam, dx/ds, dz/ds and kappa."""
    return types.void(address, n, lam, p, out), _call
