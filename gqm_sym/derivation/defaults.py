"""The run-time parameters of a model: those of its curve and its force law, joined and checked."""

from collections.abc import Mapping

from gqm_sym.declare import Curve
from gqm_sym.errors import DeclarationError
from gqm_sym.kernels.base import CONTACT_SIGN, DIRECTION, Kernel, W, Y
from gqm_sym.parameters import COMMON, COMMON_DEFAULTS, COORDINATES, Given, Value, read_value, refuse_out_of_range


def join(curve: Curve, kernel: Kernel, given: Mapping[str, Given | None]) -> tuple[tuple[str, Value | None], ...]:
    """Join the parameters of curve and kernel, g and m last, with the defaults given for this model.

    Raises
    ------
    DeclarationError
        If a name has two meanings, or a default belongs to no parameter or is out of range.
    """
    own, forced = dict(curve.defaults), dict(kernel.defaults)
    lam = curve.parameter.name
    if lam in forced:
        raise DeclarationError(
            f"derive: {lam!r} is the curve's parameter and a parameter of the kernel; give one of them another name"
        )
    for name in own.keys() & forced.keys():
        if name not in COMMON:
            raise DeclarationError(
                f"derive: the name {name!r} means one thing in the curve and another in the "
                f'kernel; give one of them another name, as in {name}="{name}2"'
            )
    if lam in COMMON:
        raise DeclarationError(
            f"derive: {lam!r} means {'gravity' if lam == 'g' else 'mass'} everywhere; "
            "give the curve's parameter another name"
        )
    values: dict[str, Value | None] = {**own, **forced}
    values.setdefault("m", COMMON_DEFAULTS["m"])
    order = [name for name in values if name not in COMMON]
    order += [name for name in COMMON if name in values]
    for name, value in given.items():
        if name not in values:
            raise DeclarationError(
                f"derive: parameters: {name!r} is not a parameter of this curve or force; they have {', '.join(order)}"
            )
        values[name] = None if value is None else read_value(value, where=f"parameters: {name}")
    positive = (*curve.positive, *kernel.positive, "m")
    refuse_out_of_range(values, positive, kernel.at_least, where="derive: parameters")
    if not kernel.conservative:
        _refuse_own_names((lam, *order))
    _refuse_strangers(kernel, (lam, *order))
    return tuple((name, values[name]) for name in order)


def _refuse_own_names(names: tuple[str, ...]) -> None:
    for name in names:
        if name in (W.name, CONTACT_SIGN.name):
            what = "V**2" if name == W.name else "the sign of the contact force"
            raise DeclarationError(f"derive: {name!r} means {what} under this kernel; choose another name")


def _refuse_strangers(kernel: Kernel, names: tuple[str, ...]) -> None:
    """Refuse names in a user's own law that mean nothing here."""
    known = {*names, *COORDINATES, Y.name, W.name, DIRECTION.name}
    for symbol in sorted(kernel.tangential_law.free_symbols, key=str):
        if symbol.name not in known:
            raise DeclarationError(
                f"derive: law: {symbol.name!r} is not known on this curve, whose parameter is {names[0]!r}; "
                f"write the law in {names[0]}, x, z, {W.name}, {DIRECTION.name} and parameters"
            )
