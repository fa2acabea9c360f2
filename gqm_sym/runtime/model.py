"""The model of a generated module, which computes pass 1, single motions and sweeps."""

from collections.abc import Callable, Mapping
from functools import cache
from math import nan
from types import MappingProxyType, ModuleType
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from gqm_sym.arguments import unknown_argument
from gqm_sym.errors import ArgumentError, InputError, LaunchError, SolutionError
from gqm_sym.literals.numbers import flat_doubles, read_numbers, without_unit
from gqm_sym.loading import load_text
from gqm_sym.runtime.compiled.streaming import LARGE
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.trial import begin_launch
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues
from gqm_sym.runtime.launch.problem import bind, bind_all
from gqm_sym.runtime.launch.request import Launch, LaunchRequest, read_launch
from gqm_sym.runtime.launch.rider import fill_rows as fill_rider_rows
from gqm_sym.runtime.launch.speed import (
    MAP_ROWS,
    MAP_ROWS_IN_SPACE,
    Pass1,
    Pass1InSpace,
    Pass1OfRider,
    fill_load_map,
    length,
    load_map_arrays,
    path_and_force_at,
    path_in_space,
)

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.equilibria import Equilibrium
    from gqm_sym.runtime.motion.motion import Motion
    from gqm_sym.runtime.sweep.result import Sweep

# The smallest number of places of a load map for which another thread is started.
MIN_PLACES_PER_THREAD = 2**16

# The number of places whose rows in space stay in the cache until they are copied to the load map.
PLACES_IN_CACHE = 2**12

NO_LOW_PARTS: Array = np.empty(0)

# The arguments of a module's functions in addition to its run-time parameters.
ARGUMENTS = {
    "pass1": ("lam", "lam0", "v0", "direction", "out"),
    "solve": LaunchRequest._fields,
    "sweep": ("quantity", "lam0", "v0", "direction", "lam", "t_max", "contact", "gradient", "client"),
    "equilibria": ("between",),
}

NO_ARGUMENTS: Mapping[str, Any] = MappingProxyType({})


@cache
def _solver(dissipative: bool) -> "Callable[[Formulas, ParameterValues, Launch], Motion]":
    """Return the function that solves a launch. It is imported when needed, because a process often needs only one of
    the two.
    """
    if dissipative:
        from gqm_sym.runtime.legs.dissipative import dissipate

        return dissipate
    from gqm_sym.runtime.motion.conservative import solve

    return solve


@cache
def _rolling() -> ModuleType:
    """Return what checks the track, the launch and the end of a body with a radius, imported when needed."""
    from gqm_sym.runtime.motion import rolling

    return rolling


class CompiledModel(Formulas):
    """The compiled functions and formulas of one generated module, with the computations that use them.

    A generated module has one as ``MODEL``; its functions ``pass1``, ``solve`` and ``sweep`` call the methods here. The
    attributes are those of `Formulas`.
    """

    __slots__ = ()

    def refuse(self, called: str, unknown: Mapping[str, Any]) -> NoReturn:
        """Refuse an argument that a function of the module does not have; the message suggests the one that was
        probably meant.

        Parameters
        ----------
        called : str
            One of the functions in `ARGUMENTS`.
        unknown : mapping
            The arguments that it does not have.
        """
        known = (*ARGUMENTS[called], *self.parameters)
        raise ArgumentError(unknown_argument(f"{self.name}.{called}", next(iter(unknown)), known))

    def pass1(
        self,
        request: tuple[Any, ...],
        parameters: tuple[Any, ...],
        lam: Any,
        out: Any = None,
        unknown: Mapping[str, Any] = NO_ARGUMENTS,
    ) -> Pass1 | Pass1InSpace | Pass1OfRider:
        """Return position, curvature, V**2 and contact force at places of the curve (MATHS, section 2).

        Parameters
        ----------
        request : tuple
            The launch that determines V**2: the first fields of a `LaunchRequest`.
        parameters : tuple
            Values of the run-time parameters, in the order of the attribute ``parameters``.
        lam : number or array_like
            Places, as values of the curve parameter; strings, ints and Fractions are exact.
        out : tuple of arrays, optional
            Arrays of doubles of the shape of ``lam`` to be filled, as many as are returned; new ones are made if not
            given.
        unknown : mapping, optional
            Arguments that the module's function does not have, which are refused.

        Returns
        -------
        Pass1, or Pass1InSpace for a space curve
            Arrays of the shape of ``lam``. Formulas are evaluated at any place; beyond the ends of a track that is
            known by points, by pieces or by an equation, all values are NaN.

        Raises
        ------
        InputError
            If a number cannot be read, the launch is impossible, or ``out`` cannot be filled.
        """
        if unknown:
            self.refuse("pass1", unknown)
        p = self.numbers(parameters)
        launch = read_launch(self, p, LaunchRequest(*request))
        if lam is None:
            raise InputError(f"lam: not given; pass one place or many, as values of {self.parameter}")
        f = bind(self, p, launch)
        if isinstance(lam, np.ndarray) and lam.dtype == np.float64:
            places, low_parts, shape = flat_doubles(lam), NO_LOW_PARTS, lam.shape
        else:
            places, low_parts, shape = read_numbers(lam, where=self.parameter, unit=self.units.get(self.parameter))
            low_parts = low_parts if low_parts.any() else NO_LOW_PARTS
        kind = Pass1 if self.path_in_space is None else Pass1InSpace if self.rider_loads is None else Pass1OfRider
        arrays, beyond = load_map_arrays(kind, shape, places, out), self._beyond_ends(p, places)
        if self.dissipation is not None:
            from gqm_sym.runtime.legs.dissipative import launch_leg

            v2 = launch_leg(self, p, launch, places)
            x, z, ds, kappa, force = path_and_force_at(f.addresses, f.p, places, v2)
            for array, values in zip(arrays, (x, z, ds, kappa, v2, force), strict=False):
                array[...] = values.reshape(shape)
            self._fill_in_space(f.p, launch, places, arrays, MAP_ROWS)
            return _without(arrays, beyond)
        start = (launch.lam0.value, launch.lam0.low, launch.v0.value**2)
        filled = MAP_ROWS if self.path_in_space is None else MAP_ROWS_IN_SPACE
        addresses = (0 if function is None else function.address for function in (self.load_map, self.path_in_space))
        of_map = (*addresses, launch.direction if self.directed else 0)
        rows = tuple(array.reshape(-1) for array in arrays[:filled])
        to_fill = (*rows, *(NO_LOW_PARTS,) * (MAP_ROWS_IN_SPACE - filled))
        past_cache = len(rows) * places.nbytes >= LARGE

        def fill(part: slice) -> None:
            ends = part.start, part.stop
            fill_load_map(f.addresses, of_map, f.p, start, (places, low_parts), to_fill, ends, past_cache)

        run_in_threads(fill, places.size, MIN_PLACES_PER_THREAD)
        self._fill_in_space(f.p, launch, places, arrays, filled)
        return _without(arrays, beyond)

    def _fill_in_space(
        self, p: Array, launch: Launch, places: Array, arrays: Pass1 | Pass1InSpace | Pass1OfRider, filled: int
    ) -> None:
        """Fill the rows that only the load map of a space curve has, but for those that are filled already."""
        if self.path_in_space is None or filled == len(arrays):
            return
        v2, force = arrays.v2.reshape(-1), arrays.normal_force.reshape(-1)
        rows = [array.reshape(-1) for array in arrays[filled:]]
        directions = np.array([float(launch.direction)])
        if launch.v0.value == 0.0 and (filled == MAP_ROWS or self.rider_loads is not None):
            # From rest the body may move to either side of the launch.
            side = np.sign(places - launch.lam0.value)
            directions = np.where(side != 0.0, side, float(launch.direction))
        in_space = rows[: MAP_ROWS_IN_SPACE - filled]
        of_rider, large = tuple(rows[len(in_space) :]), arrays.v2.nbytes * len(rows) >= LARGE

        def fill_block(part: slice) -> None:
            ahead = directions[part] if directions.size > 1 else np.broadcast_to(directions, (part.stop - part.start,))
            found = path_in_space(self, p, places[part], v2[part], ahead)
            force[part] = length(found[1:]) if self.directed else force[part]
            for row, values in zip(in_space, found, strict=True):
                row[part] = values

        def fill(part: slice) -> None:
            for begin in range(part.start, part.stop if in_space else part.start, PLACES_IN_CACHE):
                fill_block(slice(begin, min(begin + PLACES_IN_CACHE, part.stop)))
            if of_rider:
                fill_rider_rows(self, p, (places, v2, directions, force), of_rider, part, large=large)

        run_in_threads(fill, places.size, MIN_PLACES_PER_THREAD)

    def _beyond_ends(self, p: ParameterValues, places: Array) -> NDArray[np.bool_] | None:
        """Return which places lie beyond the ends of a curve without formulas, where it does not exist; None if there
        are none.
        """
        numbers = self.domain(p).numbers
        if self.chart is None or not places.size or (numbers.low <= places.min() and places.max() <= numbers.high):
            return None
        beyond: NDArray[np.bool_] = (places < numbers.low) | (places > numbers.high)
        return beyond

    def solve(
        self, request: tuple[Any, ...], parameters: tuple[Any, ...], unknown: Mapping[str, Any] = NO_ARGUMENTS
    ) -> "Motion":
        """Compute the motion that begins with a launch.

        Parameters
        ----------
        request : tuple
            The launch: the fields of a `LaunchRequest`, which itself takes long to make.
        parameters : tuple
            Values of the run-time parameters, in the order of the attribute ``parameters``.
        unknown : mapping, optional
            Arguments that the module's function does not have, which are refused.

        Returns
        -------
        Motion
            The motion, which computes its answers on request.

        Raises
        ------
        InputError
            If a number cannot be read or the launch is impossible.
        SolutionError
            If the motion cannot be computed, or a rolling body reaches a place where it does not fit into its track.
        """
        begin_launch()
        if unknown:
            self.refuse("solve", unknown)
        p = self.numbers(parameters)
        launch = read_launch(self, p, request)
        solve = _solver(self.dissipation is not None)
        if not self.rolling_radius:
            return solve(self, p, launch)
        rolling, f, lam0 = _rolling(), bind_all(self, p), launch.lam0.value
        rolling.check_track(self, f)
        try:
            motion = solve(self, p, launch)
        except (LaunchError, SolutionError):
            rolling.check_launch(self, f, lam0)
            raise
        if motion.kind not in ("libration", "circulation"):  # the search for the ends of these has proved that ds > 0
            rolling.check_launch(self, f, lam0)
            rolling.check_end(self, f, motion.legs)
        return motion

    def sweep(
        self,
        quantity: str,
        launches: tuple[Any, ...],
        parameters: tuple[Any, ...],
        *,
        lam: Any,
        client: Any,
        gradient: Any = None,
        unknown: Mapping[str, Any] = NO_ARGUMENTS,
    ) -> "Sweep":
        """Compute one quantity over arrays of launches and parameters, on this machine or on a Dask cluster.

        Parameters
        ----------
        quantity : str
            One of `gqm_sym.runtime.launch.kinds.QUANTITIES`.
        launches : tuple
            The fields of a `LaunchRequest`: arrays or numbers, which broadcast against each other and against the
            parameters.
        parameters : tuple
            Arrays or numbers, in the order of the attribute ``parameters``.
        lam : array_like or None
            The places for "time_at".
        client : distributed.Client or None
            The cluster; None for this machine.
        gradient : str or sequence of str, optional
            The names with respect to which derivatives are computed: run-time parameters, "lam0" and "v0".
        unknown : mapping, optional
            Arguments that the module's function does not have, which are refused.

        Returns
        -------
        Sweep
            The values, in the shape to which all arguments broadcast.

        Raises
        ------
        InputError
            If the quantity is unknown, or numbers cannot be read or do not broadcast.
        """
        begin_launch()
        if unknown:
            self.refuse("sweep", unknown)
        named = dict(zip(self.parameters, parameters, strict=True))
        own = self.units.get(self.parameter)
        units = {**self.units, "lam0": own, "lam": own, "v0": "m/s", "t_max": "s"}
        arguments = {
            name: without_unit(value, where=name, unit=units.get(name))
            for name, value in {**LaunchRequest(*launches)._asdict(), "lam": lam, **named}.items()
        }
        asked, lam = LaunchRequest(**{name: arguments[name] for name in LaunchRequest._fields}), arguments["lam"]
        parameters = tuple(arguments[name] for name in self.parameters)
        del arguments["point"]
        from gqm_sym.runtime.sweep.result import with_arguments

        if gradient is not None:
            from gqm_sym.runtime.sweep.gradients import sweep_with_gradient

            if client is not None:
                raise InputError("gradient: is not available in a sweep on a cluster (client); leave one of them out")
            swept = sweep_with_gradient(self, quantity, asked, parameters, lam, self.solve, gradient)
            return with_arguments(swept, quantity, arguments)
        if client is not None:
            from gqm_sym.runtime.sweep.cluster import sweep_on

            module = self.source, self.text, self.name
            return with_arguments(sweep_on(client, module, quantity, arguments), quantity, arguments)
        from gqm_sym.runtime.sweep.sweep import sweep

        return with_arguments(sweep(self, quantity, asked, parameters, lam, self.solve), quantity, arguments)

    def equilibria(
        self, parameters: tuple[Any, ...], between: Any = None, unknown: Mapping[str, Any] = NO_ARGUMENTS
    ) -> "tuple[Equilibrium, ...]":
        """Return the places at which a body at rest stays, in ascending order; see `gqm_sym.runtime.launch.equilibria`.

        Parameters
        ----------
        parameters : tuple
            Values of the run-time parameters, in the order of the attribute ``parameters``.
        between : pair of numbers, optional
            The range of the curve parameter to search; by default the whole domain, or one period.
        unknown : mapping, optional
            Arguments that the module's function does not have, which are refused.
        """
        if unknown:
            self.refuse("equilibria", unknown)
        from gqm_sym.runtime.launch.equilibria import equilibria

        return equilibria(self, self.numbers(parameters), between)

    def __deepcopy__(self, memo: Any) -> "CompiledModel":
        """Return the same model, because it never changes."""
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the model by its module's text, which is imported where the copy is made.

        Raises
        ------
        SolutionError
            If the module was not imported from a file.
        """
        if not self.text:
            raise SolutionError(f"{self.name}: is not imported from a file, so it cannot be pickled; build it first")
        return _model_of, (self.source, self.text, self.name)


def _without(
    arrays: Pass1 | Pass1InSpace | Pass1OfRider, beyond: NDArray[np.bool_] | None
) -> Pass1 | Pass1InSpace | Pass1OfRider:
    """Return the arrays of a load map with NaN at places beyond the ends of the curve."""
    if beyond is not None:
        for array in arrays:
            array.reshape(-1)[beyond] = nan
    return arrays


def _model_of(source: str, text: str, name: str) -> Any:
    """Return the model of a generated module with this text."""
    return load_text(source, text, name).MODEL
