"""The model of a generated module, which answers for pass 1, single motions and sweeps."""

from collections.abc import Callable
from functools import cache
from math import nan
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gqm_sym.literals.numbers import read_numbers
from gqm_sym.runtime.compiled.streaming import LARGE
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues
from gqm_sym.runtime.launch.problem import bind
from gqm_sym.runtime.launch.request import Launch, LaunchRequest, read_launch
from gqm_sym.runtime.launch.speed import Pass1, fill_load_map, load_map_arrays, path_and_force_at

if TYPE_CHECKING:
    from gqm_sym.runtime.motion.motion import Motion
    from gqm_sym.runtime.sweep.sweep import Sweep

# The fewest places of a load map for which another thread is started.
MIN_PLACES_PER_THREAD = 2**16

NO_LOW_PARTS: Array = np.empty(0)


@cache
def _solver(dissipative: bool) -> "Callable[[Formulas, ParameterValues, Launch], Motion]":
    """The function that solves a launch; it is imported when needed, for a process often needs one of the two only."""
    if dissipative:
        from gqm_sym.runtime.legs.dissipative import dissipate

        return dissipate
    from gqm_sym.runtime.motion.conservative import solve

    return solve


class CompiledModel(Formulas):
    """The compiled functions and formulas of one generated module, with the computations that they serve.

    A generated module has one as ``MODEL``; its functions ``pass1``, ``solve`` and ``sweep`` call the methods here. The
    attributes are those of `Formulas`.
    """

    __slots__ = ()

    def pass1(self, request: LaunchRequest, parameters: tuple[Any, ...], lam: Any, out: Any = None) -> Pass1:
        """Position, curvature, V**2 and contact force at places of the curve (MATHS, section 2).

        Parameters
        ----------
        request : LaunchRequest
            The launch that V**2 belongs to.
        parameters : tuple
            Values of the run-time parameters, in the order of the attribute ``parameters``.
        lam : number or array_like
            Places, as values of the curve parameter; strings, ints and Fractions are exact.
        out : tuple of six arrays, optional
            Arrays of doubles of the shape of ``lam`` to be filled; new ones are made if not given.

        Returns
        -------
        Pass1
            Arrays of the shape of ``lam``. Formulas are evaluated at any place; beyond the ends of a track that is
            known by points, by pieces or by an equation, all values are NaN.

        Raises
        ------
        InputError
            If a number cannot be read, the launch is impossible, or ``out`` cannot be filled.
        """
        p = self.numbers(parameters)
        launch = read_launch(self, p, request)
        f = bind(self, p, launch)
        if isinstance(lam, np.ndarray) and lam.dtype == np.float64:
            aligned = lam if lam.flags.aligned else lam.copy()
            places, low_parts, shape = np.ascontiguousarray(aligned).reshape(-1), NO_LOW_PARTS, lam.shape
        else:
            places, low_parts, shape = read_numbers(lam, where=self.parameter)
            low_parts = low_parts if low_parts.any() else NO_LOW_PARTS
        arrays, beyond = load_map_arrays(shape, places, out), self._beyond_ends(p, places)
        if self.dissipation is not None:
            from gqm_sym.runtime.legs.dissipative import launch_leg

            v2 = launch_leg(self, p, launch, places)
            x, z, ds, kappa, force = path_and_force_at(f.addresses, f.p, places, v2)
            for array, values in zip(arrays, (x, z, ds, kappa, v2, force), strict=True):
                array[...] = (values if beyond is None else np.where(beyond, nan, values)).reshape(shape)
            return arrays
        start = (launch.lam0.value, launch.lam0.low, launch.v0.value**2)
        load_map = 0 if self.load_map is None else self.load_map.address
        rows, past_cache = tuple(array.reshape(-1) for array in arrays), len(arrays) * places.nbytes >= LARGE

        def fill(part: slice) -> None:
            ends = part.start, part.stop
            fill_load_map(f.addresses, load_map, f.p, start, (places, low_parts), rows, ends, past_cache)

        run_in_threads(fill, places.size, MIN_PLACES_PER_THREAD)
        if beyond is not None:
            for row in rows:
                row[beyond] = nan
        return arrays

    def _beyond_ends(self, p: ParameterValues, places: Array) -> NDArray[np.bool_] | None:
        """Which places lie beyond the ends of a curve without formulas, where there is nothing; None if none does."""
        numbers = self.domain(p).numbers
        if self.chart is None or not places.size or (numbers.low <= places.min() and places.max() <= numbers.high):
            return None
        beyond: NDArray[np.bool_] = (places < numbers.low) | (places > numbers.high)
        return beyond

    def solve(self, request: LaunchRequest, parameters: tuple[Any, ...]) -> "Motion":
        """The motion that a launch begins.

        Parameters
        ----------
        request : LaunchRequest
            The launch.
        parameters : tuple
            Values of the run-time parameters, in the order of the attribute ``parameters``.

        Returns
        -------
        Motion
            The motion, which computes what it is asked for.

        Raises
        ------
        InputError
            If a number cannot be read or the launch is impossible.
        SolutionError
            If the motion cannot be computed, or a rolling body comes to where it does not fit into its track.
        """
        p = self.numbers(parameters)
        launch = read_launch(self, p, request)
        solve = _solver(self.dissipation is not None)
        if not self.rolling_radius:
            return solve(self, p, launch)
        from gqm_sym.runtime.motion.rolling import check_end, check_launch

        check_launch(self, bind(self, p, launch), launch.lam0.value)
        motion = solve(self, p, launch)
        check_end(self, motion.legs)
        return motion

    def sweep(
        self, quantity: str, launches: LaunchRequest, parameters: tuple[Any, ...], *, lam: Any, client: Any, source: str
    ) -> "Sweep":
        """One quantity over arrays of launches and parameters, on this machine or on a Dask cluster.

        Parameters
        ----------
        quantity : str
            One of `gqm_sym.runtime.sweep.sweep.QUANTITIES`.
        launches : LaunchRequest
            Arrays or numbers, which broadcast against each other and against the parameters.
        parameters : tuple
            Arrays or numbers, in the order of the attribute ``parameters``.
        lam : array_like or None
            The places that "time_at" asks about.
        client : distributed.Client or None
            The cluster; None for this machine.
        source : str
            The path of the generated module, whose text is sent to a cluster.

        Returns
        -------
        Sweep
            Values of the shape that all arguments broadcast to.

        Raises
        ------
        InputError
            If the quantity is unknown, or numbers cannot be read or do not broadcast.
        """
        if client is not None:
            from gqm_sym.runtime.sweep.cluster import sweep_on

            named = dict(zip(self.parameters, parameters, strict=True))
            arguments = {**launches._asdict(), "lam": lam, **named}
            del arguments["point"]
            return sweep_on(client, source, self.name, quantity, arguments)
        from gqm_sym.runtime.sweep.sweep import sweep

        return sweep(self, quantity, launches, parameters, lam, self.solve)
