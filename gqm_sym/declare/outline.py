"""Points of a curve with formulas, for drawing it."""

from collections.abc import Mapping
from math import pi
from typing import TYPE_CHECKING, Any

import sympy as sp

from gqm_sym.arguments import not_given
from gqm_sym.errors import ParameterError
from gqm_sym.parameters import exact_value, read_value

if TYPE_CHECKING:
    from gqm_sym.declare.curve import Curve

SAMPLES = 400


def values_of(curve: "Curve", given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the value of each run-time parameter: the given one, or its default.

    Raises
    ------
    ParameterError
        If a parameter has no value.
    """
    values = {**dict(curve.defaults), **given}
    for name, value in values.items():
        if value is None:
            raise ParameterError(not_given(name))
    return values


def outline(curve: "Curve", lam: Any, given: Mapping[str, Any]) -> tuple[list[float], ...]:
    """Return the coordinates x and z, or x, y and z, of successive points of a curve with formulas; NaN where they are
    not real.

    Parameters
    ----------
    curve
        A curve that is not charted.
    lam
        The range of the parameter, a pair of numbers or None.
    given
        Values of run-time parameters.
    """
    values = {
        sp.Symbol(name, real=True): exact_value(read_value(value, where=name))
        for name, value in values_of(curve, given).items()
    }
    low, high = _range(curve, lam, values)
    forms = [sp.lambdify(curve.parameter, form.xreplace(values), "math") for form in curve.point]
    places = [low + (high - low) * k / SAMPLES for k in range(SAMPLES + 1)]
    return tuple([_number(form, place) for place in places] for form in forms)


def _range(curve: "Curve", lam: Any, values: dict[sp.Symbol, sp.Expr]) -> tuple[float, float]:
    if lam is not None:
        low, high = (float(exact_value(read_value(end, where="lam"))) for end in lam)
        return low, high
    given = [None if end is None else float(end.xreplace(values)) for end in (*curve.domain, curve.period)]
    low, high = (-1.0, 1.0) if curve.kind == "graph" else (0.0, 2.0 * pi)
    begin, end, period = given
    if begin is None and end is None:
        return (0.0, period) if period is not None else (low, high)
    if begin is None:
        return (end or 0.0) - (high - low), end or 0.0
    return begin, begin + (high - low) if end is None else end


def _number(form: Any, place: float) -> float:
    try:
        return float(form(place))
    except (ArithmeticError, ValueError, TypeError):
        return float("nan")
