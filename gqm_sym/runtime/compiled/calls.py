"""Calls from compiled runtime code into the compiled functions of a generated module, by address.

A first-class function argument costs 30 to 60 microseconds to pass from Python; an integer address costs
nothing, and the code that calls it can be cached on disk.

``call_<function>(address, ...)`` takes the arguments that `interface` lists for that function, and fills ``out``.
"""

from inspect import Parameter, Signature
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gqm_sym.runtime import interface
from gqm_sym.runtime.compiled.emitted import run_at
from gqm_sym.runtime.compiled.registers import line_of
from gqm_sym.runtime.compiled.uncompiled import in_python


def _call(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    """Lower the call of a function at an address: arrays are passed by the address of their data, numbers by value."""
    values = []
    for kind, value in zip(signature.args[1:], args[1:], strict=True):
        if isinstance(kind, types.Array):
            value = context.make_array(kind)(context, builder, value).data
        values.append(value)
    function = ir.FunctionType(ir.VoidType(), [value.type for value in values])
    builder.call(builder.load(builder.inttoptr(args[0], function.as_pointer().as_pointer())), values)
    return context.get_dummy_value()


def _caller(function: str) -> Any:
    """Return the intrinsic that calls a function of the interface at an address, with as many arguments as that
    function takes.
    """

    def call(_: Any, address: Any, *arguments: Any) -> Any:
        return types.void(address, *arguments), _call

    call.__name__ = f"call_{function}"
    # numba reads the signature, and lowers *arguments as one tuple unless they are declared one by one.
    taken = (f"argument_{i}" for i in range(len(getattr(interface, function.upper()).args)))
    names = ("context", "address", *taken)
    call.__signature__ = Signature([Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in names])  # type: ignore[attr-defined]
    made = intrinsic(call)
    in_python(made)(run_at)
    return made


call_path_and_contact_force = _caller("path_and_contact_force")
call_path_in_space = _caller("path_in_space")
call_rider_loads = _caller("rider_loads")
call_load_map = _caller("load_map")
call_effective_potential = _caller("effective_potential")
call_potential_divdiff1 = _caller("potential_divdiff1")
call_potential_divdiff2 = _caller("potential_divdiff2")
call_bounds = _caller("bounds")
call_separated_terms = _caller("separated_terms")

call_potential_divdiff1_batch = _caller("potential_divdiff1_batch")
call_potential_divdiff2_batch = _caller("potential_divdiff2_batch")
call_bounds_batch = _caller("bounds_batch")
call_orbit_invariants_batch = _caller("orbit_invariants_batch")
call_time_integrand_batch = _caller("time_integrand_batch")
call_integrand_invariants_batch = _caller("integrand_invariants_batch")
call_agm_arguments_batch = _caller("agm_arguments_batch")
call_turning_point_batch = _caller("turning_point_batch")

call_squared_contact = _caller("squared_contact")
call_static_balance = _caller("static_balance")
call_segment = _caller("segment")
call_field = _caller("field")


@intrinsic
def call_speed_equation(_, address, n, work, rows, v, nu, p):  # type: ignore[no-untyped-def]
    """Fill ds/dlam, P, Q, n0 and kappa for a leg of signs v and nu.

    ``rows`` are the positions in the array ``work`` at which the places, V**2 and the results begin. They replace
    views, to which numba would count references.
    """

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        address, n, work, positions, v, nu, p = args
        line = line_of(context, builder, signature.args[2], work)
        kinds = (*signature.args[:2], *(types.CPointer(types.float64),) * 2, *signature.args[4:7])
        kinds = (*kinds, types.CPointer(types.float64))
        places, speeds, out = (builder.gep(line, [builder.extract_value(positions, k)]) for k in range(3))
        return _call(context, builder, types.void(*kinds), (address, n, places, speeds, v, nu, p, out))

    return types.void(address, n, work, rows, v, nu, p), lower


@in_python(call_speed_equation)
def _call_speed_equation(address: int, n: int, work: Any, rows: Any, v: Any, nu: Any, p: Any) -> None:
    places, speeds, out = (work.ctypes.data + work.itemsize * int(row) for row in rows)
    run_at(address, n, places, speeds, v, nu, p, out)
