"""Every conservative motion obeys these laws; Hypothesis chooses the launches."""

import math
from collections.abc import Callable
from types import ModuleType

from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp, mpf
from naive import error, pendulum, pendulum_half_period, ulps
from selection import examples

ModuleOf = Callable[[str], ModuleType]

# Two half periods that must be the same number come from different roundings of the same inputs.
SAME_ULPS = 4.0
# The tolerance of half periods against closed forms, at amplitudes away from the separatrix.
CLOSED_FORM_ULPS = 4.0
# The tolerances of positions relative to their scale: for one evaluation, and for a comparison of two.
POSITION = 1e-14
TWO_POSITIONS = 4e-14
# The tolerance of the energy per unit mass, relative to the largest kinetic energy.
ENERGY = 1e-14

lengths = st.floats(0.1, 10.0)
gravities = st.floats(0.5, 30.0)
# Small swings are drawn by their exponent, because W loses its digits there if anything is subtracted.
small = st.floats(-8.0, -1.0).map(lambda exponent: 10.0**exponent)
amplitudes = st.one_of(small, st.floats(0.1, 3.0))
fractions = st.floats(0.0, 1.0)
some = examples(40)


@some
@given(amplitude=amplitudes, length=lengths, g=gravities)
def test_a_pendulum_swings_as_elliptic_integrals_say(
    module_of: ModuleOf, amplitude: float, length: float, g: float
) -> None:
    """The half period is 2*K(sin(A/2))*sqrt(L/g) for the given floats, for small swings too."""
    motion = module_of("circle").solve(lam0=amplitude, L=length, g=g)
    with mp.workdps(50):
        truth = pendulum_half_period(amplitude, mp.sqrt(mpf(g) / mpf(length)))
    assert motion.kind == "libration"
    assert ulps(motion.half_period, truth) <= CLOSED_FORM_ULPS


@some
@given(amplitude=amplitudes, length=lengths, g=gravities, phase=st.floats(-4.0, 4.0))
def test_a_pendulum_is_where_elliptic_functions_say(
    module_of: ModuleOf, amplitude: float, length: float, g: float, phase: float
) -> None:
    """The angle is 2*asin(k*cd(omega*t, k)) at any time, before the launch too."""
    motion = module_of("circle").solve(lam0=amplitude, L=length, g=g)
    t = phase * motion.period
    with mp.workdps(50):
        truth = pendulum(amplitude, mp.sqrt(mpf(g) / mpf(length)), t)
    assert error(motion.lam(t), truth) <= POSITION * 2 * amplitude


@some
@given(lam0=st.floats(-1.5, 1.5), v0=st.floats(0.0, 5.0), share=st.floats(-3.0, 3.0))
def test_energy_is_conserved(module_of: ModuleOf, lam0: float, v0: float, share: float) -> None:
    """v**2/2 + g*z is constant, and v**2 is the square of the signed v."""
    assume(abs(lam0) > 1e-3 or v0 > 1e-3)
    motion = module_of("bowl").solve(lam0=lam0, v0=v0)
    at_launch = motion.state(0.0)
    state = motion.state(share * motion.period)
    most = v0**2 / 2 + 9.81 * at_launch.z
    assert abs(state.v2 / 2 + 9.81 * state.z - most) <= ENERGY * 2 * most
    assert abs(state.v**2 - state.v2) <= ENERGY * 4 * most


@some
@given(lam0=st.floats(-1.0, 1.0), v0=st.floats(0.1, 3.0), share=fractions)
def test_time_runs_both_ways(module_of: ModuleOf, lam0: float, v0: float, share: float) -> None:
    """If the body is launched in the other direction, it is at t where it was at -t."""
    solve = module_of("bowl").solve
    forward, backward = (solve(lam0=lam0, v0=v0, direction=way) for way in (1, -1))
    low, high = sorted(forward.turning_points)
    t = share * forward.period
    assert abs(forward.lam(t) - backward.lam(-t)) <= TWO_POSITIONS * (high - low)
    assert abs(forward.state(t).v + backward.state(-t).v) <= TWO_POSITIONS * 10 * (1 + v0)


@some
@given(lam0=st.floats(0.1, 1.5), share=st.floats(0.1, 0.9))
def test_stopped_and_sent_back_it_returns(module_of: ModuleOf, lam0: float, share: float) -> None:
    """From any state, a body launched back with the same speed returns to where it began."""
    solve = module_of("bowl").solve
    out = solve(lam0=lam0)
    t = share * out.half_period
    there = out.state(t)
    back = solve(lam0=there.lam, v0=abs(there.v), direction=1)
    # At its end the body is at rest, so that an error in time counts squared, and one in energy as it is.
    assert abs(back.lam(t) - lam0) <= 10 * TWO_POSITIONS * lam0


@some
@given(amplitude=amplitudes, length=lengths, g=gravities)
def test_scaling_laws(module_of: ModuleOf, amplitude: float, length: float, g: float) -> None:
    """Four times the gravity halves every time; four times the length doubles it."""
    solve = module_of("circle").solve
    one = solve(lam0=amplitude, L=length, g=g).half_period
    strong = solve(lam0=amplitude, L=length, g=4 * g).half_period
    long = solve(lam0=amplitude, L=4 * length, g=g).half_period
    assert abs(2 * strong - one) <= SAME_ULPS * math.ulp(one)
    assert abs(long / 2 - one) <= SAME_ULPS * math.ulp(one)


@some
@given(amplitude=amplitudes, mass=lengths)
def test_mass_changes_the_contact_force_alone(module_of: ModuleOf, amplitude: float, mass: float) -> None:
    """All bodies fall alike, and the contact force is m times that of a unit mass."""
    solve = module_of("circle").solve
    unit, heavy = (solve(lam0=amplitude, L=1, m=m) for m in (1.0, mass))
    t = 0.3 * unit.period
    assert heavy.half_period == unit.half_period
    assert heavy.lam(t) == unit.lam(t)
    load = mass * unit.state(t).normal_force
    assert abs(heavy.state(t).normal_force - load) <= SAME_ULPS * math.ulp(abs(load) + mass * 9.81)


@some
@given(lam0=st.floats(-3.0, 3.0), v0=st.floats(0.1, 9.0), a=st.floats(0.1, 4.0), share=fractions)
def test_a_mirror_changes_signs_alone(module_of: ModuleOf, lam0: float, v0: float, a: float, share: float) -> None:
    """In a symmetric bowl the mirrored launch gives the mirrored motion."""
    solve = module_of("parabola").solve
    right = solve(lam0=lam0, v0=v0, direction=1, a=a)
    left = solve(lam0=-lam0, v0=v0, direction=-1, a=a)
    assert abs(left.half_period - right.half_period) <= SAME_ULPS * math.ulp(right.half_period)
    t = share * right.period
    reach = max(right.turning_points)
    assert abs(left.lam(t) + right.lam(t)) <= TWO_POSITIONS * 2 * reach


@some
@given(lam0=st.one_of(st.floats(0.01, 3.1), small.map(lambda gap: math.pi - gap)), R=lengths)
def test_the_tautochrone_swings_in_one_time(module_of: ModuleOf, lam0: float, R: float) -> None:
    """In an inverted cycloid the half period is 2*pi*sqrt(R/g) from any height."""
    motion = module_of("cycloid_inverted").solve(lam0=lam0, R=R)
    with mp.workdps(50):
        truth = 2 * mp.pi * mp.sqrt(mpf(R) * 100 / 981)
    assert ulps(motion.half_period, truth) <= CLOSED_FORM_ULPS


@some
@given(amplitude=st.one_of(small, st.floats(0.1, 10.0)), a=st.floats(0.1, 4.0))
def test_a_parabola_swings_as_an_elliptic_integral_says(module_of: ModuleOf, amplitude: float, a: float) -> None:
    """The half period on z = a*x**2 is 2*E(-4*a**2*X**2)/sqrt(2*g*a)."""
    motion = module_of("parabola").solve(lam0=amplitude, a=a)
    with mp.workdps(50):
        m = -4 * mpf(a) ** 2 * mpf(amplitude) ** 2
        truth = 2 * mp.ellipe(m) / mp.sqrt(2 * mpf(981) / 100 * mpf(a))
    assert ulps(motion.half_period, truth) <= CLOSED_FORM_ULPS


@some
@given(speed=st.floats(6.5, 30.0), share=fractions, laps=st.integers(-5, 5))
def test_a_circulation_adds_a_turn_each_lap(module_of: ModuleOf, speed: float, share: float, laps: int) -> None:
    """After each loop time the angle is 2*pi further, and the state is the same."""
    motion = module_of("circle").solve(lam0=0.5, v0=speed, L=1)
    t = share * motion.period
    first, later = motion.state(t), motion.state(t + laps * motion.period)
    assert motion.kind == "circulation"
    turned = motion.lam(t + laps * motion.period) - motion.lam(t)
    assert abs(turned - laps * 2 * math.pi) <= TWO_POSITIONS * 12 * math.pi
    assert abs(later.x - first.x) <= TWO_POSITIONS * 12 * math.pi
    assert abs(later.v - first.v) <= TWO_POSITIONS * 12 * speed


@some
@given(lam0=st.floats(0.1, 1.5), share=st.floats(0.05, 0.95))
def test_places_and_times_invert_each_other(module_of: ModuleOf, lam0: float, share: float) -> None:
    """On the first swing ``time_at`` undoes ``lam``, away from the turns where time is a root."""
    motion = module_of("bowl").solve(lam0=lam0)
    t = share * motion.half_period
    assert abs(motion.time_at(motion.lam(t)) - t) <= 20 * TWO_POSITIONS * motion.half_period
