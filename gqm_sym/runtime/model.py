"""The model of a generated module, and the questions that it answers: Pass 1, one motion, sweeps."""

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.literals.numbers import read_numbers
from gqm_sym.runtime.compiled.streaming import LARGE
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues
from gqm_sym.runtime.launch.problem import bind
from gqm_sym.runtime.launch.request import Launch, LaunchRequest, read_launch
from gqm_sym.runtime.launch.speed import Pass1, fill_loads, path_and_force_at, room

if TYPE_CHECKING:
    from gqm_sym.runtime.motion.motion import Motion
    from gqm_sym.runtime.sweep.sweep import Sweep

# Places of a load map that a thread is worth starting for.
MIN_PLACES_PER_THREAD = 2**16

NOTHING: Array = np.empty(0)


@cache
def _solver(dissipative: bool) -> "Callable[[Formulas, ParameterValues, Launch], Motion]":
    """What solves a launch, loaded when it is needed: a process that solves one model needs one of the two."""
    if dissipative:
        from gqm_sym.runtime.legs.dissipative import dissipate

        return dissipate
    from gqm_sym.runtime.motion.conservative import solve

    return solve


class CompiledModel(Formulas):
    """The compiled functions and exact formulas of one generated module, with what can be asked of them.

    The attributes are those of `Formulas`.
    """

    __slots__ = ()

    def pass1(self, request: LaunchRequest, given: tuple[Any, ...], lam: Any, out: Any = None) -> Pass1:
        """Pass 1 at places of the curve, into new arrays or those of ``out``."""
        p = self.numbers(given)
        launch = read_launch(self, p, request)
        f = bind(self, p, launch)
        if isinstance(lam, np.ndarray) and lam.dtype == np.float64:
            places, low, shape = np.ascontiguousarray(lam).reshape(-1), NOTHING, lam.shape
        else:
            places, low, shape = read_numbers(lam, where=self.parameter)
            low = low if low.any() else NOTHING
        found = room(shape, places, out)
        if self.dissipation is not None:
            from gqm_sym.runtime.legs.dissipative import launch_leg

            v2 = launch_leg(self, p, launch, places)
            x, z, ds, kappa, force = path_and_force_at(f.addresses, f.p, places, v2)
            for array, values in zip(found, (x, z, ds, kappa, v2, force), strict=True):
                array[...] = values.reshape(shape)
            return found
        start, w0, load_map = launch.lam0, launch.v0.value**2, 0 if self.load_map is None else self.load_map.address
        rows, past = tuple(array.reshape(-1) for array in found), len(found) * places.nbytes >= LARGE

        def fill(part: slice) -> None:
            ends = part.start, part.stop
            fill_loads(f.addresses, load_map, f.p, start.value, start.low, w0, places, low, rows, *ends, past)

        run_in_threads(fill, places.size, MIN_PLACES_PER_THREAD)
        return found

    def solve(self, request: LaunchRequest, given: tuple[Any, ...]) -> "Motion":
        """The motion that a launch begins."""
        p = self.numbers(given)
        launch = read_launch(self, p, request)
        find = _solver(self.dissipation is not None)
        if not self.rolling_radius:
            return find(self, p, launch)
        from gqm_sym.runtime.motion.rolling import check_end, check_launch

        check_launch(self, bind(self, p, launch), launch.lam0.value)
        motion = find(self, p, launch)
        check_end(self, motion.legs)
        return motion

    def sweep(
        self, quantity: str, launches: LaunchRequest, given: tuple[Any, ...], *, lam: Any, client: Any, source: str
    ) -> "Sweep":
        """One quantity over arrays of launches and parameters, here or on a cluster that is sent the module's file."""
        if client is not None:
            from gqm_sym.runtime.sweep.cluster import sweep_on

            parameters = dict(zip(self.parameters, given, strict=True))
            arguments = {**launches._asdict(), "lam": lam, **parameters}
            del arguments["point"]
            return sweep_on(client, source, self.name, quantity, arguments)
        from gqm_sym.runtime.sweep.sweep import sweep

        return sweep(self, quantity, launches, given, lam, self.solve)
