"""The units that are allowed for each number of a curve file."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from gqm_sym.declare import Curve
from gqm_sym.declare.measures import curve_formulas, parameter_dimension
from gqm_sym.dimensions import NUMBER, Dimension, Formulas, dimension, found_dimensions, unit_of
from gqm_sym.expressions import name_or_value
from gqm_sym.kernels import KERNELS, Kernel
from gqm_sym.kernels.base import UNITS, kernel_formulas
from gqm_sym.literals.units import read_unit

# The units of the parameters of force laws, by their arguments, and of the numbers of a launch.
KERNEL_UNITS = UNITS
LAUNCH_UNITS = {"v0": "m/s", "t_max": "s"}


def expected_units(
    data: Mapping[str, Any],
    curve: Curve | None,
    kernel: Kernel | None,
    given: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, str]:
    """Return the units of the run-time parameters of a curve file, from their roles and the formulas that contain them.

    Parameters
    ----------
    data
        The valid part of the file.
    curve, kernel
        The declarations in the file, None for each that is wrong.
    given
        The units of parameters, in order; if the formulas leave several undetermined, the first ones determine the
        others.
    """
    units = _by_role(data)
    formulas = Formulas() if curve is None else curve_formulas(curve)
    if kernel is not None:
        formulas += kernel_formulas(kernel)
    if curve is not None and not curve.charted:
        formulas.variables[curve.parameter.name] = parameter_dimension(curve)
    known = {name: _dimension(unit) for name, unit in units.items()}
    for name, unit in given.items():
        if name not in (found := found_dimensions(formulas, known)) and name not in units:
            known[name] = _dimension(unit)
        elif unit_of(found.get(name)):
            units.setdefault(name, unit_of(found[name]))
    last = {name: unit_of(own) for name, own in found_dimensions(formulas, known).items()}
    inherited = {name: unit for name, unit in last.items() if unit and name not in {*given, *formulas.variables}}
    return {**inherited, **units}


def _by_role(data: Mapping[str, Any]) -> dict[str, str]:
    """Return the units of the kernels' arguments, as far as these are mappings of names and values."""
    terms = data.get("kernel")
    units: dict[str, str] = {}
    for key, term in terms.items() if isinstance(terms, Mapping) else ():
        if key not in KERNELS or not isinstance(term, Mapping):
            continue
        for argument in KERNELS[key].arguments:
            called = term.get(argument)
            if argument in KERNEL_UNITS and (called is None or isinstance(called, str)):
                units[_parameter_name(called, argument)] = KERNEL_UNITS[argument]
    return {**units, "m": "kg", "g": "m/s**2"}


def launch_units(curve: Curve | None) -> dict[str, str]:
    """Return the units of a launch; that of the curve's parameter only if the kind of curve determines it."""
    own = None if curve is None else parameter_dimension(curve)
    # The parameter of a parametric curve may have any dimension; as the argument of sines and cosines it is an angle.
    lam0 = {} if own is None else {"lam0": "rad" if own == NUMBER else "m"}
    return {**LAUNCH_UNITS, **lam0}


def _dimension(unit: str) -> Dimension:
    return dimension(*read_unit(unit, where="unit").dimension)


def _parameter_name(given: str | None, argument: str) -> str:
    return argument if given is None else name_or_value(given, argument)[0]
