"""Derivatives of a motion with respect to launch and parameters, and the spectrum of a periodic motion."""

from collections.abc import Iterable
from math import isfinite, isnan, nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gqm_sym.arguments import one_of, short
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.orbit import check_force
from gqm_sym.runtime.gradients.passages.launch_limit import limit_at_launch
from gqm_sym.runtime.gradients.quantities import selected
from gqm_sym.runtime.gradients.sensitivity import Sensitivity
from gqm_sym.runtime.gradients.spectrum import Fourier
from gqm_sym.runtime.launch.kinds import EXTREMES, QUANTITIES
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.motion.parts.positions import Positions

# The longest time in s after a launch from a cusp from which the derivatives of the contact force there follow.
LONGEST_START = 16.0


def _is_unknown(value: Any) -> bool:
    """Return whether a derivative, or one of several, is NaN."""
    # NumPy takes microseconds for one number.
    return bool(isnan(value) if type(value) is float else np.isnan(value).any())


class Derivatives(Positions):
    """The derivatives of a motion; kinds of motion without derivatives raise an error."""

    def gradient(self, quantity: str, wrt: Any = None, *, lam: Any = None, order: int = 1) -> dict[str, Any]:
        """Return the derivatives of a quantity with respect to launch and run-time parameters.

        Parameters
        ----------
        quantity : str
            "turning_points", "v_max", "v_min", "normal_force_max", "normal_force_min", "time_at" or "t_end"; for a
            periodic motion also "half_period", "period" or "action"; for a motion with losses also "rest_position".
        wrt : str or sequence of str, optional
            The names with respect to which derivatives are taken: run-time parameters, "lam0" and "v0"; by default all
            of them.
        lam : number, optional
            The place for "time_at", as in `time_at`.
        order : int
            2 for the second derivatives of "half_period" or "period".

        Returns
        -------
        dict
            A float for each name, or for turning points a tuple in the order of `turning_points`. At ``v0 = 0`` the
            derivative with respect to v0 is that for greater speeds. For second derivatives, a dict for each name with
            a float for each other name.

        Raises
        ------
        InputError
            If there is no such quantity or parameter.
        SolutionError
            If the motion does not have the quantity, or motions of its kind have no gradients.
        """
        one_of(quantity, QUANTITIES, where="gradient: quantity")
        if (lam is None) == (quantity == "time_at"):
            raise InputError(
                f"lam: must be given with 'time_at', and with no other quantity, got {short(lam)} with {quantity!r}"
            )
        if type(order) is not int or order not in (1, 2):
            raise InputError(f"gradient: order must be 1 or 2, got {short(order)}")
        if order == 2:
            return self._second_gradient(quantity, wrt)
        found = self._known_gradient(quantity, wrt, lam)
        self._check_known(f"gradient of {quantity}", found, found.values())
        return found

    def _known_gradient(self, quantity: str, wrt: Any, lam: Any = None) -> dict[str, Any]:
        """Return `gradient`, with NaN for names with respect to which there is no derivative although others exist.

        Parameters
        ----------
        quantity, wrt, lam
            As for `gradient`, whose other errors are raised.
        """
        check_force(self.problem.formulas, quantity)
        if quantity in EXTREMES:
            names = selected(self.problem.formulas.parameters, wrt)  # checked before anything is computed
            extreme = getattr(self, quantity)
            if extreme.t == 0.0 and quantity.startswith("normal_force") and self._is_released_at_cusp:
                kept = tuple(name for name in names if name not in ("lam0", "v0"))
                changes = self._limit_of_sensitivity(self._sensitivity(0.0, kept), np.array(True), kept)
                return dict.fromkeys(names, nan) | dict(zip(kept, changes.normal_force.tolist(), strict=True))
            if not isfinite(extreme.value):
                raise SolutionError(
                    f"gradient: {quantity} has none, because the contact force grows without bound towards the cusp at "
                    "which this motion ends"
                )
        return self._gradient(quantity, wrt) if lam is None else self._arrival_gradient(lam, wrt)

    def _check_known(self, what: str, names: Iterable[str], values: Iterable[Any]) -> None:
        """Refuse derivatives along a charted curve with respect to parameters near which there is no such curve, and
        with respect to the speed of a body at rest at a cusp, through which it would be thrown out of the curve.

        Raises
        ------
        SolutionError
            If there are such parameters.
        """
        charted = self.problem.formulas.chart is not None
        if not charted and self.problem.w0 != 0.0:
            return
        unknown = [name for name, value in zip(names, values, strict=True) if _is_unknown(value)]
        if unknown and (charted or self._is_at_rest_in_cusp):
            if charted:
                why = "the curve does not exist for neighbouring values (an exponent of a negative number must be an "
                why += "integer)"
            elif "normal_force" in what:
                why = "the contact force jumps at the cusp from which the body is released, and has no bound there for "
                why += "a body that moves"
            else:
                why = "the body is released at rest from a cusp, through which it would be thrown out of the curve"
            raise SolutionError(
                f"{what}: there is no derivative with respect to {', '.join(unknown)}, because {why}; name the others "
                "in wrt"
            )

    def _gradient(self, quantity: str, wrt: Any) -> dict[str, Any]:
        raise self._without_gradients()

    def _second_gradient(self, quantity: str, wrt: Any) -> dict[str, dict[str, float]]:
        raise SolutionError(f"gradient: only periodic motions have second derivatives; this one is {self.kind!r}")

    def _arrival_gradient(self, lam: Any, wrt: Any) -> dict[str, Any]:
        """Return the derivatives of the time at which the body is at a place; it is earlier if the body moves on."""
        t = self.time_at(lam)
        state, f = self.state(t), self.problem.functions
        found = self._slopes_of_arrival(state, wrt)
        if found is not None:
            return found
        changes = self._sensitivity(t, wrt)
        if state.v == 0.0 or self._is_turn(state.lam):
            raise SolutionError("gradient: time_at of a place where the body turns has none")
        rate = state.v / path_and_force_at(f.addresses, f.p, np.array([state.lam]), np.zeros(1))[2, 0]
        return dict(zip(changes.wrt, (-changes.lam / rate).tolist(), strict=True))

    def _slopes_of_arrival(self, _: Any, wrt: Any) -> dict[str, Any] | None:
        """Return the derivatives of the time of a state at a fixed place, where they do not follow from those at a
        fixed time without a loss of digits; otherwise None.
        """
        return None

    def _is_turn(self, _: float) -> bool:
        """Return whether the body turns at a place, as nearly as doubles show it."""
        return False

    @property
    def nearest_switch(self) -> Any:
        """The turn at which a motion with friction is nearest to a change of its number of legs; None if there is none.

        Returns
        -------
        Switch or None
            Its time ``t``, its place ``lam``, and ``margin``: the force along the track minus the largest static
            friction, divided by the latter; negative if the body stays. Derivatives are those for the present number of
            legs, and one-sided at a margin of 0.
        """
        return None

    def sensitivity(self, t: Any, wrt: Any = None) -> Sensitivity:
        """Return the derivatives of the state at given times with respect to launch and run-time parameters.

        For a periodic motion they are as accurate, and take as long, after a million periods as after one. With losses
        they are passed on from leg to leg. Those at t = 0 of a body that is released at rest from a cusp are the limits
        just after the launch, because the curvature is infinite at the cusp.

        Parameters
        ----------
        t : number or array_like
            Times in s from launch, as for `lam`.
        wrt : str or sequence of str, optional
            The names with respect to which derivatives are taken, as in `gradient`.

        Returns
        -------
        Sensitivity
            Arrays with one row for each name, of the shape of ``t``.

        Raises
        ------
        InputError
            If there is no such parameter, or as `lam`.
        SolutionError
            If motions of this kind, or on such a curve, have no gradients.
        """
        check_force(self.problem.formulas, "sensitivity")
        found = self._sensitivity(t, wrt)
        in_cusp = self._is_at_rest_in_cusp
        if in_cusp or self.problem.formulas.chart is not None:
            self._check_known("sensitivity", found.wrt, found.lam)
        if not in_cusp:  # reading times once more takes longer than all else
            return found
        at_launch = np.asarray(self._times(t)[0] == 0.0).reshape(found.lam.shape[1:])
        return self._limit_of_sensitivity(found, at_launch, wrt) if at_launch.any() else found

    def _limit_of_sensitivity(self, found: Sensitivity, at_launch: NDArray[np.bool_], wrt: Any) -> Sensitivity:
        """Return derivatives of states with those of the contact force at a release from a cusp, where the curvature is
        infinite, and only the force after the launch has derivatives.
        """
        if self._is_released_at_cusp:
            found.normal_force[:, at_launch] = limit_at_launch(
                lambda times: self._sensitivity(times, wrt).normal_force, min(self.t_end, LONGEST_START)
            )[:, np.newaxis]
        return found

    def _sensitivity(self, t: Any, wrt: Any) -> Sensitivity:
        """Return `sensitivity`, whose contact force is right only if that has a sign."""
        raise self._without_gradients()

    def place_changes(self, t: Any, wrt: Any = None) -> Array:
        """Return the derivatives of the curve parameter alone, which is faster than `sensitivity`.

        Parameters
        ----------
        t, wrt
            As in `sensitivity`, whose errors are raised too.

        Returns
        -------
        ndarray
            The row ``lam`` of `sensitivity`.
        """
        found = self._sensitivity(t, wrt)
        self._check_known("sensitivity", found.wrt, found.lam)
        return found.lam

    @property
    def action(self) -> float:
        """The integral of (1 + beta) V ds over one period, per mass, in m2/s (libration and circulation).

        Raises
        ------
        SolutionError
            As `gradient`.
        """
        raise self._without_period("action")

    @property
    def period_slope(self) -> float:
        """dT/dE, the slope of the period over the energy per mass, in s3/m2; raises the errors of `action`."""
        raise self._without_period("period_slope")

    def fourier(self, quantity: str, n: int) -> Fourier:
        """Return the Fourier coefficients of a quantity over one period (libration and circulation).

        Parameters
        ----------
        quantity : str
            "x", "z", "v" or "normal_force"; for a libration also "lam" or "s".
        n : int
            The order of the last coefficient.

        Returns
        -------
        Fourier
            Arrays ``a`` and ``b`` from order 0 to n: the quantity is the sum of a[k] cos(2 pi k t/T) and
            b[k] sin(2 pi k t/T), with t from launch.

        Raises
        ------
        InputError
            If there is no such quantity or order.
        SolutionError
            If the quantity does not repeat.
        """
        raise SolutionError(f"fourier: only a motion that repeats has coefficients; it is of kind {self.kind!r}")

    def _without_period(self, asked: str) -> SolutionError:
        """Return the error of motions that do not repeat, with the name of the requested quantity."""
        return SolutionError(
            f"{asked}: only a libration or a circulation has one; this motion is of kind {self.kind!r}"
        )

    def _without_gradients(self) -> SolutionError:
        """Return the error of motions without gradients."""
        return SolutionError(f"gradients: there are none of a motion of kind {self.kind!r}")
