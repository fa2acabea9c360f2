"""Every conservative problem of the reference tables has the right digits through the public interface."""

import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from naive import Point, error, overstatement, pendulum, point, scale, ulps
from problems import PROBLEMS, TRACKS, Problem, number, where

MotionOf = Callable[[Problem], Any]
ModuleOf = Callable[[str], ModuleType]

# Half periods and periods are the doubles nearest to the true values, also if a barrier is close or heights agree to
# many digits. Worst measured: 0.49.
NEAREST = 0.51

# The tolerance of positions in the first ten periods, relative to their scale. Worst measured: 5.0e-16.
TEN_PERIODS = 10.0
POSITION = 1e-15
# If the orbit is small and far from the origin, the rounding of the place and its coordinates is added.
COORDINATE_ULPS = 2.0

# The tolerance of lam(t) in the paper's example, in its first period and after 1000 s, relative to the scale of lam.
# Worst measured: 1.8e-16.
FIRST_PERIOD = 4e-16
AFTER_1000_S = 4e-16

# The tolerances of the speed field at a float: V**2, N, kappa, ds.
FIELD_ULPS = 4.0
# Kappa of a curve whose metric varies divides by a root cubed, and N has kappa and V**2 as factors: half a dozen
# roundings each. Worst measured: 4.1 (ellipse) and 5.6 (ellipse).
COMPOSED_ULPS = 6.0

# A turning point is the nearest double.
TURNING_POINT_ULPS = 1.0

# The relative tolerance of times of single events. Worst measured: 6.3e-16.
EVENT_TIME = 1e-15

# The largest ratio of the error bound to the larger of a last place of the scale and the decade's largest error.
USEFUL = 100.0

EXAMPLE = PROBLEMS["example1_pendulum"]


def named(problems: list[Problem]) -> dict[str, Any]:
    """Return arguments of ``parametrize`` that give each problem its slug."""
    return {"argvalues": problems, "ids": [problem.slug for problem in problems]}


@pytest.mark.sample(25)
def test_kind(problem: Problem, motion_of: MotionOf) -> None:
    """Every motion is of the kind that the exact inputs make it."""
    assert motion_of(problem).kind == problem.kind


@pytest.mark.parametrize("problem", **named(where(half_period=True)))
def test_half_period(problem: Problem, motion_of: MotionOf) -> None:
    """A half period is the nearest double, and the period is twice as long."""
    motion = motion_of(problem)
    assert problem.half_period is not None
    assert ulps(motion.half_period, problem.half_period) <= NEAREST
    assert motion.period == 2 * motion.half_period


@pytest.mark.parametrize("problem", **named(where(loop_time=True)))
def test_loop_time(problem: Problem, motion_of: MotionOf) -> None:
    """The period of a circulation is the time of one lap."""
    period = motion_of(problem).period
    assert problem.loop_time is not None
    assert ulps(period, problem.loop_time) <= NEAREST


@pytest.mark.parametrize(
    "problem",
    **named([p for p in PROBLEMS.values() if p.turning_points is not None and p.kind != "rest"]),
)
def test_turning_points(problem: Problem, motion_of: MotionOf) -> None:
    """All turning points are the doubles nearest to the true ones, in the order in which they are met."""
    actual = motion_of(problem).turning_points
    assert problem.turning_points is not None
    assert len(actual) == len(problem.turning_points)
    for lam, expected in zip(actual, problem.turning_points, strict=True):
        assert ulps(lam, expected) <= TURNING_POINT_ULPS


@pytest.mark.sample(9)
@pytest.mark.parametrize("problem", **named(where(positions=True)))
def test_positions(problem: Problem, motion_of: MotionOf) -> None:
    """In the first ten periods lam, x, z and v are right to the rounding of their scales."""
    motion, track = motion_of(problem), TRACKS[problem.track]
    of = scale(problem, track)
    for row in problem.within(TEN_PERIODS):
        truth = point(problem, track, number(row.lam))
        state = motion.state(row.t)
        assert error(motion.lam(row.t), row.lam) <= POSITION * of.lam
        assert error(state.lam, row.lam) <= POSITION * of.lam
        for actual, expected in ((state.x, truth.x), (state.z, truth.z)):
            place = math.ulp(float(expected)) + float(truth.ds) * math.ulp(float(row.lam))
            rounding = COORDINATE_ULPS * place
            assert error(actual, expected) <= POSITION * of.place + rounding
        assert error(state.v, row.v) <= POSITION * of.v


@pytest.mark.sample(16)
@pytest.mark.parametrize("problem", **named(where(positions=True)))
def test_the_error_bound_is_honest(problem: Problem, motion_of: MotionOf) -> None:
    """No position, early or late, has a larger error than ``error_bound`` says."""
    motion = motion_of(problem)
    for row in problem.positions:
        assert error(motion.lam(row.t), row.lam) <= motion.error_bound(row.t)


@pytest.mark.sample(16)
@pytest.mark.parametrize("problem", **named([p for p in where(positions=True) if p.kind != "rest"]))
def test_the_error_bound_is_useful(problem: Problem, motion_of: MotionOf) -> None:
    """The bound is at most a hundred times the error. The worst ratio measured is 42."""
    rows = [(row.t, row.lam) for row in problem.positions]
    assert overstatement(motion_of(problem), rows, scale(problem, TRACKS[problem.track]).lam) <= USEFUL


def test_the_error_bound_holds_at_any_time(motion_of: MotionOf) -> None:
    """In the paper's example the bound holds from a millisecond to a billion seconds, and includes the rounding of the
    answer.
    """
    motion = motion_of(EXAMPLE)
    times = np.geomspace(1e-3, 1e9, 300)
    found, bounds = motion.lam(times), motion.error_bound(times)
    # A state states the largest error on its interval of the table.
    ratio = motion.state(times).error / bounds
    assert 1.0 - 1e-5 <= ratio.min() <= ratio.max() < 1.25
    with mp.workdps(50):
        frequency, amplitude, lowest = mp.sqrt(number("9.81")), number("6/5"), -mp.pi / 2
        for t, lam, bound in zip(times, found, bounds, strict=True):
            assert error(lam, lowest + pendulum(amplitude, frequency, mpf(float(t)))) <= bound


def test_quadrature_error_and_condition_number_are_told_apart(motion_of: MotionOf) -> None:
    """Near a separatrix the quadrature is as good as elsewhere, while the launch determines less and less."""
    calm, near = motion_of(EXAMPLE), motion_of(PROBLEMS["pendulum_nearly_upright"])
    assert calm.quadrature_error < 1e-14
    assert near.quadrature_error < 1e-14
    assert calm.condition_number < 2
    # At an angle of 1e-6 below the hilltop, V**2's regular factor is the square of that at the top.
    assert near.condition_number > 1e5
    rest = motion_of(PROBLEMS["pendulum_at_the_bottom"])
    assert (rest.quadrature_error, rest.condition_number) == (0.0, 1.0)


@pytest.mark.sample(13)
@pytest.mark.parametrize("problem", **named(where(samples=True)))
def test_speed_field(problem: Problem, module_of: ModuleOf) -> None:
    """V**2, N, kappa and ds of ``pass1`` agree with the definitions for the given floats.

    Errors are within units in the last place of the largest term of V**2 = v0**2 + 2*g*(z0 - z) and of N = m*(g*x_s +
    kappa*V**2).
    """
    lams = np.array([float(number(row.lam)) for row in problem.samples])
    field = module_of(problem.track).pass1(lams, **problem.launch)
    of = scale(problem, TRACKS[problem.track])
    for k, lam in enumerate(lams):
        truth = point(problem, TRACKS[problem.track], float(lam))
        v2_term, normal_term = terms(problem, truth)
        assert error(field.v2[k], truth.v2) <= FIELD_ULPS * math.ulp(v2_term)
        assert error(field.normal_force[k], truth.normal_force) <= COMPOSED_ULPS * math.ulp(normal_term)
        assert ulps(field.kappa[k], truth.kappa) <= COMPOSED_ULPS
        assert ulps(field.ds[k], truth.ds) <= FIELD_ULPS
        assert error(field.x[k], truth.x) <= FIELD_ULPS * math.ulp(of.place)
        assert error(field.z[k], truth.z) <= FIELD_ULPS * math.ulp(of.place)


def terms(problem: Problem, truth: Point) -> tuple[float, float]:
    """Return the largest terms of V**2 and of N at a place."""
    start = number(problem.v0) ** 2
    v2_term = max(start, abs(truth.v2 - start))
    mass = number(dict(problem.parameters).get("m", "1"))
    bending = mass * abs(truth.kappa) * v2_term
    return float(v2_term), float(max(bending, abs(truth.normal_force - bending)))


def test_speed_field_of_the_paper_s_example(module_of: ModuleOf) -> None:
    """V**2, N and kappa of the paper's Example 1 are within 4 units in their own last places."""
    lams = np.array([float(number(row.lam)) for row in EXAMPLE.samples])
    field = module_of("pendulum").pass1(lams, **EXAMPLE.launch)
    for k, lam in enumerate(lams):
        truth = point(EXAMPLE, TRACKS["pendulum"], float(lam))
        assert ulps(field.v2[k], truth.v2) <= FIELD_ULPS
        assert ulps(field.normal_force[k], truth.normal_force) <= FIELD_ULPS
        assert ulps(field.kappa[k], truth.kappa) <= FIELD_ULPS


def test_the_state_carries_the_speed_field(motion_of: MotionOf) -> None:
    """V**2, N and kappa in ``state`` are those of its own place."""
    for problem in where(source="paper_cases.json"):
        motion = motion_of(problem)
        for row in problem.within(1.0):
            state = motion.state(row.t)
            truth = point(problem, TRACKS[problem.track], float(state.lam))
            field_scale = max(abs(truth.normal_force), abs(number("9.81")))
            assert error(state.v2, truth.v2) <= POSITION * scale_of_v2(problem)
            assert error(state.v2, state.v**2) <= POSITION * scale_of_v2(problem)
            assert error(state.normal_force, truth.normal_force) <= POSITION * 2 * field_scale
            assert ulps(state.kappa, truth.kappa) <= FIELD_ULPS


def scale_of_v2(problem: Problem) -> float:
    """Return the largest V**2 of the motion."""
    return scale(problem, TRACKS[problem.track]).v ** 2


def test_the_paper_s_example_in_its_first_period(motion_of: MotionOf) -> None:
    """lam(t) agrees with Jacobi's elliptic functions within 4e-16 of its scale."""
    motion = motion_of(EXAMPLE)
    allowed = FIRST_PERIOD * scale(EXAMPLE, TRACKS["pendulum"]).lam
    for row in EXAMPLE.within(1.0):
        assert error(motion.lam(row.t), row.lam) <= allowed
    with mp.workdps(50):
        frequency, amplitude, lowest = mp.sqrt(number("9.81")), number("6/5"), -mp.pi / 2
        for t in np.linspace(0.0, 2.2, 45):
            truth = lowest + pendulum(amplitude, frequency, mpf(float(t)))
            assert error(motion.lam(float(t)), truth) <= allowed


def test_the_paper_s_example_after_1000_seconds(motion_of: MotionOf) -> None:
    """After 454 periods the error of lam(t) is still as small."""
    (row,) = (row for row in EXAMPLE.positions if row.t == "1000")
    allowed = AFTER_1000_S * scale(EXAMPLE, TRACKS["pendulum"]).lam
    assert error(motion_of(EXAMPLE).lam(1000), row.lam) <= allowed


@pytest.mark.parametrize(
    "problem",
    **named([p for p in PROBLEMS.values() if any(row.t_first_passage for row in p.samples)]),
)
def test_first_passages(problem: Problem, motion_of: MotionOf) -> None:
    """The first time at a place is right to the last digits for an exact place."""
    motion = motion_of(problem)
    for row in problem.samples:
        if row.t_first_passage is not None:
            expected = float(row.t_first_passage)
            assert error(motion.time_at(row.lam), row.t_first_passage) <= EVENT_TIME * expected


@pytest.mark.parametrize("problem", **named(where(passage=True)))
def test_transit_time(problem: Problem, motion_of: MotionOf) -> None:
    """A motion that never turns again passes a given place at the right time."""
    assert problem.passage is not None
    lam, time = problem.passage
    assert error(motion_of(problem).time_at(lam), time) <= EVENT_TIME * float(time)


@pytest.mark.parametrize("problem", **named(where(first_turn=True)))
def test_first_turn(problem: Problem, motion_of: MotionOf) -> None:
    """The first leg ends with a turn, at the right time."""
    leg = motion_of(problem).legs[0]
    assert problem.first_turn is not None
    assert leg.end == "turn"
    assert leg.t_start == 0
    assert error(leg.t_end, problem.first_turn) <= EVENT_TIME * leg.t_end


@pytest.mark.parametrize("problem", **named(where(end=True)))
def test_an_end_is_named_and_timed(problem: Problem, motion_of: MotionOf) -> None:
    """A motion that reaches a cusp ends there, at the right time."""
    assert problem.end is not None
    name, time = problem.end
    motion = motion_of(problem)
    assert motion.legs[-1].end == name
    assert motion.events[-1].kind == name
    assert error(motion.t_end, time) <= EVENT_TIME * float(time)


@pytest.mark.parametrize("problem", **named(where(contact_changes=True)))
def test_the_contact_force_changes_sign(problem: Problem, motion_of: MotionOf) -> None:
    """The events of a period name each place at which N changes its sign twice, because the body passes it twice."""
    met = sorted(e.lam for e in motion_of(problem).events if e.kind == "contact-sign")
    expected = sorted((*problem.contact_changes, *problem.contact_changes), key=float)
    assert len(met) == len(expected)
    for lam, truth in zip(met, expected, strict=True):
        assert error(lam, truth) <= POSITION * scale(problem, TRACKS[problem.track]).lam


def test_scalars_give_scalars_and_arrays_give_arrays(motion_of: MotionOf) -> None:
    """A number gives a float, and an array of any shape gives an array of the same shape.

    Times in any order are allowed, and each result is independent of the others.
    """
    motion = motion_of(EXAMPLE)
    times = np.array([[3.0, 0.25], [1.5, 1000.0]])
    together = motion.lam(times)
    assert isinstance(motion.lam(0.25), float)
    assert together.shape == times.shape
    assert together.tolist() == [[motion.lam(t) for t in row] for row in times.tolist()]
    state = motion.state(times)
    assert state.lam.shape == state.normal_force.shape == times.shape
    assert motion.lam(np.empty(0)).shape == (0,)
