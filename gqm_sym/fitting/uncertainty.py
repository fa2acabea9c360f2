"""The uncertainty of a result due to that of launch and parameters, by derivatives and by many exact results."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isfinite
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.arguments import compiled_model, one_of, short, unknown_argument
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.fitting.fit import LAUNCH, units_of
from gqm_sym.fitting.quotients import central_differences
from gqm_sym.fitting.result import Fit, with_deviation
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.model import CompiledModel
from gqm_sym.runtime.sweep.columns import refused
from gqm_sym.runtime.sweep.quantities import QUANTITIES

# The number of results in a sample if none is given, and the largest number.
SAMPLES, MAX_SAMPLES = 10_000, 10_000_000

# The step of a difference quotient, as a share of the number or of its standard deviation, whichever is greater.
STEP = 1e-5


class Estimate(NamedTuple):
    """A value with its standard deviation.

    Attributes
    ----------
    value : float
        The value, in the unit of its quantity.
    std : float
        The standard deviation, in the same unit.
    """

    value: float
    std: float


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, eq=False)
class Uncertainty:
    """An answer with its standard deviation, found in two ways.

    Attributes
    ----------
    quantity : str
        The name of the quantity.
    linear : Estimate
        The answer for the given values, and its standard deviation from the derivatives there.
    sampled : Estimate
        Mean and standard deviation of the answers for values that were drawn at random.
    gradient : dict
        The derivative of the answer with respect to each uncertain number.
    samples : array
        The answers for the values that were drawn, as far as there are answers.
    missing : int
        The number of drawn values without an answer, among them those that no motion has, such as a negative friction
        coefficient.
    """

    quantity: str
    linear: Estimate
    sampled: Estimate
    gradient: dict[str, float]
    samples: Array
    missing: int

    def __str__(self) -> str:
        """Return both results, one below the other."""
        lines = [
            f"{self.quantity}",
            f"  linear   {with_deviation(*self.linear)}",
            f"  sampled  {with_deviation(*self.sampled)}  ({self.samples.size} draws)",
        ]
        if self.missing:
            lines.append(f"  {self.missing} more draws have no {self.quantity}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"<uncertainty of {self.quantity}: {with_deviation(*self.linear)}>"


def uncertainty(
    module: ModuleType,
    quantity: str,
    uncertain: Mapping[str, Any] | Fit,
    *,
    samples: int = SAMPLES,
    seed: int = 0,
    **fixed: Any,
) -> Uncertainty:
    """Return the uncertainty of a quantity of a motion due to that of its launch and parameters.

    Parameters
    ----------
    module : module
        A generated module.
    quantity : str
        A quantity of ``module.sweep`` that is one number: "period", "v_max", "time_at", ...
    uncertain : mapping or Fit
        Run-time parameters, "lam0" or "v0", each with its value and its standard deviation: ``{"L": (1.0, 1e-3)}``.
        These numbers are independent and normally distributed. Alternatively the result of `fit`, with its covariance.
    samples : int
        The number of values that are drawn.
    seed : int
        The seed of the random numbers; the same seed gives the same samples.
    fixed
        All other arguments of the launch and the parameters, as for ``module.sweep``.

    Returns
    -------
    Uncertainty
        ``.linear``, from the derivatives of the quantity, and ``.sampled``, from a sweep. If they differ, the quantity
        is not linear within the standard deviations, and the sample is right.

    Raises
    ------
    InputError
        If a name is unknown, a standard deviation is negative, or the data of a fit do not determine its estimates.
    SolutionError
        If the motion does not have the quantity.

    Notes
    -----
    Derivatives are those of ``motion.gradient``, exact to rounding, or difference quotients if there are none.
    """
    model: CompiledModel = compiled_model(module, where="uncertainty")
    asked = one_of(quantity, tuple(QUANTITIES), where="uncertainty: quantity")
    if asked == "turning_points":
        raise InputError("uncertainty: quantity: turning_points are two numbers; ask for one number")
    if not (isinstance(samples, int | np.integer) and 2 <= samples <= MAX_SAMPLES):
        raise InputError(f"uncertainty: samples: must be a whole number from 2 to {MAX_SAMPLES}, got {short(samples)}")
    if not (isinstance(seed, int | np.integer) and seed >= 0):
        raise InputError(f"uncertainty: seed: must be a whole number of at least 0, got {short(seed)}")
    values, covariance = _read(model, uncertain, fixed)
    known = (*LAUNCH, "direction", "lam", "t_max", "contact", *model.parameters)
    for name in fixed:
        if name not in known:
            raise InputError(unknown_argument("uncertainty", name, known))
    if isinstance(uncertain, Fit):
        fixed = {name: given for name, given in uncertain.arguments.items() if name not in values} | fixed

    def answers(columns: Array) -> Array:
        rows = dict(zip(values, columns.T, strict=True))
        swept: Array = module.sweep(quantity, **{"lam0": 0.0, **fixed, **rows}).values
        return swept

    centre = np.array([*values.values()])
    value = float(answers(centre[None, :])[0])
    if not isfinite(value):
        swept = module.sweep(quantity, **{"lam0": 0.0, **fixed, **values})
        raise SolutionError(f"uncertainty: {quantity}: {'; '.join(swept.status_counts())}")
    gradient = _gradient(module, quantity, values, fixed)
    if gradient is None:
        steps = STEP * np.maximum(np.abs(centre), np.sqrt(np.diag(covariance)))
        steps[steps == 0.0] = STEP
        gradient = central_differences(lambda x: answers(x[None, :])[0], centre, steps)
    drawn = centre + _draws(covariance, int(samples), int(seed))
    found = answers(drawn[_are_permitted(model, values, fixed, drawn)])
    kept = found[np.isfinite(found)]
    return Uncertainty(
        quantity=quantity,
        linear=Estimate(value, float(np.sqrt(gradient @ covariance @ gradient))),
        sampled=Estimate(float(np.mean(kept)), float(np.std(kept, ddof=1))),
        gradient=dict(zip(values, gradient.tolist(), strict=True)),
        samples=kept,
        missing=int(samples - kept.size),
    )


def _read(model: CompiledModel, uncertain: Any, fixed: Mapping[str, Any]) -> tuple[dict[str, float], Array]:
    """Return the uncertain numbers by their names, and their covariance."""
    if isinstance(uncertain, Fit):
        if uncertain.unidentified:
            raise InputError(
                f"uncertainty: the data of the fit do not determine {' and '.join(uncertain.unidentified[0])}"
            )
        return uncertain.estimates, uncertain.covariance
    if not isinstance(uncertain, Mapping) or not uncertain:
        raise InputError(
            "uncertainty: must be a mapping from names to values with their standard deviations, as in "
            f"{{'L': (1.0, 1e-3)}}, or the result of a fit; got {short(uncertain)}"
        )
    units = units_of(model)
    values, deviations = {}, []
    for name, given in uncertain.items():
        if name not in units:
            raise InputError(unknown_argument("uncertainty", str(name), units, what="uncertain number"))
        if name in fixed:
            raise InputError(f"uncertainty: {name} is given twice, as an uncertain number and by keyword")
        if not isinstance(given, tuple | list) or len(given) != 2:
            raise InputError(f"uncertainty: {name}: must be (value, standard deviation), got {short(given)}")
        value, deviation = (read_number(part, where=f"uncertainty: {name}", unit=units[name]).value for part in given)
        if deviation < 0.0:
            raise InputError(f"uncertainty: {name}: the standard deviation must not be negative, got {deviation!r}")
        values[name] = value
        deviations.append(deviation)
    return values, np.diag(np.square(deviations))


def _draws(covariance: Array, samples: int, seed: int) -> Array:
    """Return normally distributed numbers of mean zero, which are the same on every machine up to rounding."""
    deviations = np.sqrt(np.diag(covariance))
    scale = np.where(deviations > 0.0, deviations, 1.0)
    correlation = covariance / np.outer(scale, scale)
    np.fill_diagonal(correlation, 1.0)
    drawn: Array = np.random.default_rng(seed).standard_normal((samples, scale.size))
    return deviations * (drawn @ np.linalg.cholesky(correlation).T)


def _are_permitted(
    model: CompiledModel, names: Iterable[str], fixed: Mapping[str, Any], drawn: Array
) -> NDArray[np.bool_]:
    """Return which of the drawn rows a launch may have: speeds are not negative, and parameters are in their ranges."""
    columns = dict(zip(names, drawn.T, strict=True))
    others = {name: fixed.get(name, default) for name, default in model.parameters.items() if name not in columns}
    for name, given in others.items():
        columns[name] = np.asarray(read_number(given, where=name, unit=model.units.get(name)).value)
    found = np.ones(len(drawn), dtype=np.bool_)
    if "v0" in columns:
        found &= columns["v0"] >= 0.0
    for wrong, _ in refused(model, columns):
        found &= ~wrong
    return found


def _gradient(module: ModuleType, quantity: str, values: dict[str, float], fixed: Mapping[str, Any]) -> Array | None:
    """Return the derivatives of a quantity; None if there are none."""
    launch = {name: value for name, value in fixed.items() if name != "lam"}
    motion = module.solve(**{"lam0": 0.0, **launch, **values})
    try:
        found = motion.gradient(quantity, tuple(values), lam=fixed.get("lam"))
    except (InputError, SolutionError):
        return None
    return np.array([*found.values()], dtype=np.float64)
