"""How the answers of a motion change with its launch and its parameters, and the spectrum of one that repeats."""

from typing import Any

import numpy as np

from gqm_sym.arguments import one_of, short
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.orbit import check_force
from gqm_sym.runtime.gradients.sensitivity import Sensitivity
from gqm_sym.runtime.gradients.spectrum import Fourier
from gqm_sym.runtime.launch.kinds import QUANTITIES
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.motion.parts.positions import Positions


class Derivatives(Positions):
    """A motion of which one asks for derivatives; kinds of motion that have none say so."""

    def gradient(self, quantity: str, wrt: Any = None, *, lam: Any = None, order: int = 1) -> dict[str, Any]:
        """The derivatives of a quantity of this motion by its launch and run-time parameters.

        Parameters
        ----------
        quantity : str
            "turning_points", "v_max", "v_min", "normal_force_max", "normal_force_min", "time_at" or "t_end"; of a
            periodic motion also "half_period", "period" or "action", and of one with losses "rest_position".
        wrt : str or sequence of str, optional
            What the derivatives are by: run-time parameters, "lam0" and "v0"; all of them if not given.
        lam : number, optional
            For "time_at": the place, as of `time_at`.
        order : int
            2 for the second derivatives of "half_period" or "period".

        Returns
        -------
        dict
            A float for each name; of turning points a tuple, in the order of `turning_points`. At ``v0 = 0`` the
            derivative by v0 is that for greater speeds. Of second derivatives a dict for each name, with a float for
            each other.

        Raises
        ------
        InputError
            If there is no such quantity or parameter.
        SolutionError
            If the motion does not have the quantity, or gradients are not there yet for motions of its kind.
        """
        one_of(quantity, QUANTITIES, where="gradient: quantity")
        if (lam is None) == (quantity == "time_at"):
            raise InputError(f"lam: is the place that 'time_at' asks about, got {short(lam)} with {quantity!r}")
        if type(order) is not int or order not in (1, 2):
            raise InputError(f"gradient: order must be 1 or 2, got {short(order)}")
        if order == 2:
            return self._second_gradient(quantity, wrt)
        check_force(self.problem.formulas, quantity)
        return self._gradient(quantity, wrt) if lam is None else self._arrival_gradient(lam, wrt)

    def _gradient(self, quantity: str, wrt: Any) -> dict[str, Any]:
        raise self._without_gradients()

    def _second_gradient(self, quantity: str, wrt: Any) -> dict[str, dict[str, float]]:
        raise SolutionError(f"gradient: only periodic motions have second derivatives; this one is {self.kind!r}")

    def _arrival_gradient(self, lam: Any, wrt: Any) -> dict[str, Any]:
        """The derivatives of the time at which the body is at a place: what carries it on makes that earlier."""
        t = self.time_at(lam)
        state, changes, f = self.state(t), self._sensitivity(t, wrt), self.problem.functions
        if state.v == 0.0:
            raise SolutionError("gradient: time_at of a place where the body turns has none")
        rate = state.v / path_and_force_at(f.addresses, f.p, np.array([state.lam]), np.zeros(1))[2, 0]
        return dict(zip(changes.wrt, (-changes.lam / rate).tolist(), strict=True))

    @property
    def nearest_switch(self) -> Any:
        """The turn at which a motion with friction comes nearest to resting, or to one leg more; None if there is none.

        Returns
        -------
        Switch or None
            Its time ``t``, its place ``lam``, and ``margin``: by how much the pull along the track is larger there than
            what can hold the body, as a share of the latter, negative where it stays. The derivatives of a motion are
            those for the legs that it has; at a margin of 0 they are one-sided.
        """
        return None

    def sensitivity(self, t: Any, wrt: Any = None) -> Sensitivity:
        """The derivatives of the state at given times by launch and run-time parameters.

        Of a periodic motion they are as exact, and take as long, after a million periods as after one. With losses they
        are carried from leg to leg.

        Parameters
        ----------
        t : number or array_like
            Times in s from launch, as for `lam`.
        wrt : str or sequence of str, optional
            What the derivatives are by, as for `gradient`.

        Returns
        -------
        Sensitivity
            Arrays with one row for each name, of the shape of ``t``.

        Raises
        ------
        InputError
            If there is no such parameter, or as `lam`.
        SolutionError
            If gradients are not there yet for motions of this kind, or on curves in space.
        """
        check_force(self.problem.formulas, "sensitivity")
        return self._sensitivity(t, wrt)

    def _sensitivity(self, t: Any, wrt: Any) -> Sensitivity:
        """`sensitivity`, of which the contact force is right only where that has a sign."""
        raise self._without_gradients()

    def place_changes(self, t: Any, wrt: Any) -> Array:
        """The derivatives of the curve parameter alone, as of `sensitivity`, which takes longer."""
        return self._sensitivity(t, wrt).lam

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
        """dT/dE, the derivative of the period by the energy per mass, in s3/m2; raises what `action` does."""
        raise self._without_period("period_slope")

    def fourier(self, quantity: str, n: int) -> Fourier:
        """The Fourier coefficients of a quantity over one period (libration and circulation).

        Parameters
        ----------
        quantity : str
            "x", "z", "v" or "normal_force"; of a libration also "lam" or "s".
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
        """What is raised by motions that do not repeat, by the name of what was asked for."""
        return SolutionError(
            f"{asked}: only a libration or a circulation has one; this motion is of kind {self.kind!r}"
        )

    def _without_gradients(self) -> SolutionError:
        """What is raised by motions without gradients."""
        return SolutionError(
            "gradients: only librations, circulations and motions with losses have them yet; "
            f"this motion is of kind {self.kind!r}"
        )
