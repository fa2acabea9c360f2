"""The result of a fit, as numbers, text and a figure."""

from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from gqm_sym.fitting.data import UNITS, Measurements
from gqm_sym.optional import require
from gqm_sym.runtime.compiled.types import Array


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, eq=False)
class Fit:
    """Launch and run-time parameters that fit measurements best.

    Attributes
    ----------
    names : tuple of str
        The names that were fitted, in the order of ``covariance``.
    estimates : dict
        The value of each in its unit.
    std : dict
        The standard deviation of each; infinite where the data do not determine it, and zero on a limit.
    covariance : (k, k) array
        The covariance of the estimates, for fixed values of those on limits. Without ``sigma`` it is scaled by the
        deviation of the residuals.
    residuals : dict
        Measured minus fitted values, for each quantity, in its unit.
    chi2 : float
        The sum of squares of the residuals in standard deviations; without ``sigma`` in SI units.
    degrees_of_freedom : int
        The number of measurements minus ``rank``.
    rank : int
        The number of independent combinations of the unknowns that the data determine.
    unidentified : tuple of tuples of str
        For each combination of unknowns without effect on the measured values, the names in it.
    at_limits : tuple of str
        The names whose estimates are limits, beyond which the data would be fitted better. They are held there.
    arguments : dict
        All arguments of ``module.solve`` that give the fitted motion.
    measured : data.Measurements
        The data.
    """

    names: tuple[str, ...]
    estimates: dict[str, float]
    std: dict[str, float]
    covariance: Array
    residuals: dict[str, Array]
    chi2: float
    degrees_of_freedom: int
    rank: int
    unidentified: tuple[tuple[str, ...], ...]
    at_limits: tuple[str, ...]
    arguments: dict[str, Any]
    measured: Measurements

    @property
    def correlation(self) -> Array:
        """The correlations of the estimates, a (k, k) array; NaN on limits and where the data do not determine them."""
        with np.errstate(invalid="ignore"):
            deviations = np.sqrt(np.diag(self.covariance))
            correlation: Array = self.covariance / np.outer(deviations, deviations)
        return correlation

    def __str__(self) -> str:
        """Return the estimates with their standard deviations, and the quality of the fit."""
        width = max(map(len, self.names))
        lines = [f"  {name:<{width}}  {self._estimate(name)}" for name in self.names]
        for names in self.unidentified:
            what = " and ".join(names)
            lines.append(f"  the data do not {f'tell {what} apart' if len(names) > 1 else f'determine {what}'}")
        count = sum(values.size for values in self.residuals.values())
        spread = "" if self.measured.sigma is not None else " (standard deviations from the residuals)"
        return "\n".join(
            [
                f"Fit of {len(self.names)} numbers to {count} measurements{spread}",
                *lines,
                f"  chi2 {self.chi2:.6g} with {self.degrees_of_freedom} degrees of freedom",
            ]
        )

    def _estimate(self, name: str) -> str:
        if name in self.at_limits:
            return f"{self.estimates[name]!r}, which is its limit"
        return with_deviation(self.estimates[name], self.std[name])

    def __repr__(self) -> str:
        return f"<fit of {', '.join(f'{name} = {value!r}' for name, value in self.estimates.items())}>"

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><th>{name}</th><td>{self._estimate(name)}</td></tr>" for name in self.names)
        return f"<table>{rows}</table><pre>{str(self).splitlines()[-1].strip()}</pre>"

    @require("plot")
    def plot(self) -> Any:
        """Draw data and fitted values, and the residuals below, for each quantity.

        Returns
        -------
        matplotlib.figure.Figure
            Two axes for each quantity. The bars are standard deviations.
        """
        from gqm_sym.figures.axes import finished, new_figure

        quantities = self.measured.values
        figure = new_figure(7.0 * len(quantities), 5.5)
        grid = figure.subplots(2, len(quantities), sharex="col", squeeze=False, height_ratios=(3, 1))
        for (name, values), (above, below) in zip(quantities.items(), grid.T, strict=True):
            residuals = self.residuals[name]
            across, label = self._across(values.size)
            order = np.argsort(across)
            bars = None if self.measured.sigma is None else self.measured.sigma[name]
            unit = f" ({UNITS[name]})" if UNITS[name] else ""
            above.errorbar(across, values, bars, fmt=".", color="#0072b2", label="measured", zorder=1)
            above.plot(across[order], (values - residuals)[order], color="#d55e00", label="fitted", zorder=2)
            finished(above, "", f"{name}{unit}")
            below.errorbar(across, residuals, bars, fmt=".", color="#0072b2")
            below.axhline(0.0, color="#d55e00")
            finished(below, label, f"residual{unit}")
        return figure

    def _across(self, count: int) -> tuple[Array, str]:
        """Return the values of the horizontal axis: times, the only column that differs, or numbers."""
        if self.measured.t is not None:
            return self.measured.t, "t (s)"
        if len(self.measured.columns) == 1:
            ((name, column),) = self.measured.columns.items()
            return column, name
        return np.arange(1.0, count + 1.0), "number"


def with_deviation(value: float, std: float) -> str:
    """Return a value with its standard deviation as text, with two digits of the deviation."""
    if not isfinite(std):
        return f"{value:.6g}, not determined"
    if std == 0.0:
        return f"{value!r}"
    digits = max(0, 1 - int(np.floor(np.log10(std))))
    return f"{value:.{digits}f} +- {std:.{digits}f}" if digits < 17 else f"{value!r} +- {std:.1e}"
