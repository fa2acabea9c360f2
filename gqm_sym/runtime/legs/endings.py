"""What has ended a run of a motion with losses, by name, and why a leg could not be followed."""

from contextlib import suppress
from math import inf, sqrt

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.ends import NEAR_CUSP, domain_end, is_steep, starting_step, too_steep, vanishes
from gqm_sym.runtime.launch.poles import pole_ahead
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.legs.advance import END_LIFTOFF_AT_ONCE, END_REST
from gqm_sym.runtime.legs.body import LEAST_SWING
from gqm_sym.runtime.legs.leg_record import END, HEADING, START
from gqm_sym.runtime.legs.runs.ends import END_ASYMPTOTE, END_LIFTOFF, END_LIMIT, END_TOO_NARROW, END_TURN
from gqm_sym.runtime.legs.variations.law import FormulaLaw

# Legs approach a cusp to within some 1e-8, where roundings of the place hide the decrease of ds/dlam. There ds is at
# most this share of its value a thousandth of the first step away.
CUSP_SHARE = 1e-2

# A fall into a pole of the potential is complete if the rest takes no more than this many roundings of the time.
FALL_ROUNDINGS = 4.0

# The names of the ends of runs that the code alone determines.
END_NAMES = {
    END_TURN: "turn",
    END_REST: "rest",
    END_LIFTOFF: "liftoff",
    END_LIFTOFF_AT_ONCE: "liftoff",
    END_ASYMPTOTE: "asymptote",
}


def end_name(problem: Problem, what: int, record: Array) -> str:
    """Return the name of the end of a run, given its code and its record."""
    if what == END_LIMIT and not problem.period:
        return domain_end(problem, int(record[HEADING])).what
    if what == END_TOO_NARROW:
        near = NEAR_CUSP * starting_step(problem)
        return "cusp" if vanishes(problem, float(record[END]), CUSP_SHARE, near) else "singular-point"
    return END_NAMES.get(what, "")


def check_steepness(problem: Problem, what: int, record: Array) -> None:
    """Refuse a run to a place where ds/dlam has no bound."""
    place = float(record[END])
    if what in (END_LIMIT, END_TOO_NARROW) and is_steep(problem, int(record[HEADING]), place):
        raise too_steep(problem, place)


def check_fall(problem: Problem, record: Array, v2: float, elapsed: float) -> None:
    """Refuse a run that ends before a pole of the potential by more than a rounding of the time ``elapsed``.

    The distance from the pole is a difference of rounded coordinates, so that panels close to it, however narrow,
    resolve the force to a few digits only.
    """
    f, place, heading = problem.functions, float(record[END]), int(record[HEADING])
    pole = pole_ahead(problem, heading, place)
    if pole is None:
        return
    ds = float(path_and_force_at(f.addresses, f.p, np.array([place]), np.zeros(1))[2, 0])
    left = abs(pole - place) * ds / sqrt(v2) if v2 > 0.0 else inf
    if left > FALL_ROUNDINGS * ULP * elapsed:
        name = problem.formulas.parameter
        raise SolutionError(
            f"the body falls into a centre of force at {name} = {pole!r}, where its speed has no bound, and the last "
            f"{left:.2g} s of the fall cannot be followed with losses; give t_max={0.99999 * elapsed:.6g} or less, or "
            "put the centre beside the curve"
        )


def cusp_ahead(problem: Problem, record: Array) -> float:
    """Return the place of a cusp close ahead of the end of a run, which takes less than a rounding of the time.

    If ds/dlam jumps to a negative value at a joint, behind which a body with a radius does not fit, that is the place.
    """
    f, place, heading = problem.functions, float(record[END]), int(record[HEADING])
    near = 0.01 * NEAR_CUSP * starting_step(problem)
    places = place - heading * near * np.array([0.0, 1.0, 2.0])
    ds = path_and_force_at(f.addresses, f.p, places, np.zeros(3))[2]
    if not ds[0] > 0.0:
        return place
    slope, second = (4.0 * ds[1] - 3.0 * ds[0] - ds[2]) / (2.0 * near), (ds[0] - 2.0 * ds[1] + ds[2]) / near**2
    distance = float(ds[0] / slope)
    return place + heading * distance * (1.0 + float(0.5 * second / slope) * distance)


def force_cancels(problem: Problem, record: Array) -> bool:
    """Return whether terms of the force cancel at the end or the start of a leg, so that doubles do not resolve it."""
    with suppress(SolutionError):  # without formulas, or with very long ones, there is no bound on its rounding
        law, heading = FormulaLaw(problem), int(record[HEADING])
        return any(law.cancels(float(record[end]), heading) for end in (START, END))
    return False


def failure(problem: Problem, record: Array, *, cancels: bool) -> SolutionError:
    """Return the error that says why a leg could not be followed; ``cancels`` is whether terms of the force cancel."""
    place = f"V**2 beyond {problem.formulas.parameter} = {float(record[END])!r}"
    if 0.0 < abs(record[[START, END]]).max() < LEAST_SWING:
        return SolutionError(
            f"{place} comes to the end of the range of doubles; launch the body more than {LEAST_SWING!r} from the "
            "equilibrium, or faster"
        )
    if is_steep(problem, int(record[HEADING]), float(record[END])):
        return too_steep(problem, float(record[END]))
    if cancels:
        return SolutionError(
            f"{place} could not be followed: terms of the force cancel there to fewer digits than doubles need; "
            "declare the sum of such forces as one, or make them smaller"
        )
    return SolutionError(f"{place} could not be followed; are the curve and the force smooth there?")
