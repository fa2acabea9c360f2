"""V**2 and the time on short parts agree with solutions of the law in 25 digits, on a part alone and along a track."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numba
import numpy as np
import pytest
from friction_in_space import panel, solution
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.runtime.legs.panels.few_nodes import ROOM_FOR_FEW, few_buffer, keep_few, pass_few
from gqm_sym.runtime.model import CompiledModel

ULP = 2.0**-52


@numba.njit
def kept(width: float, direction: int, work: Any, data: Any) -> bool:
    """Keep a part from the second number on."""
    return keep_few(width, direction, work, data, 1)


@numba.njit
def passed(v2: float, data: Any) -> Any:
    """Pass the part that is kept from the second number on."""
    return pass_few(v2, data, 1, few_buffer())


@pytest.mark.sample(4)
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(("width", "v2"), [(0.03125, 0.6), (0.03125, 3.0), (0.03125, 40.0), (0.05, 1.0), (0.0625, 3.0)])
def test_a_part(direction: int, width: float, v2: float) -> None:
    """The rounding errors are those of the result, also where the contact force depends on V**2 far from linearly."""
    data = np.zeros(1 + ROOM_FOR_FEW)
    assert kept(width, direction, panel(width, direction), data)
    found, (end, time) = passed(v2, data), solution(width, direction, v2, 25)
    assert abs(found.end - end) <= ULP * end
    assert abs(found.time - time) <= 2 * ULP * time
    assert found.low <= min(v2, end) <= max(v2, end) <= found.high


def test_parts_that_need_more_nodes() -> None:
    """Long parts are not kept, and those next to a turn are passed in another way."""
    data = np.zeros(1 + ROOM_FOR_FEW)
    assert not kept(0.5, 1, panel(0.5, 1), data)
    assert kept(0.03125, -1, panel(0.03125, -1), data)
    assert np.isnan([passed(v2, data).time for v2 in (0.01, 0.1, 0.2)]).all()


# On a circle of radius 1 that is tilted by 30 degrees, gravity has these parts along its plane and across.
G, MU = mpf("9.81"), mpf("0.05")
ALONG, ACROSS = G / 2, G * mp.sqrt(3) / 2


def slope_on_circle(side: int, angle: Any, w: Any) -> Any:
    """Return dW/dangle on a leg towards the other side, with the angle from the lowest point."""
    return -2 * ALONG * mp.sin(angle) + 2 * side * MU * mp.hypot(w + ALONG * mp.cos(angle), ACROSS)


def next_turn(start: Any) -> tuple[Any, Any]:
    """Return the next turn, and the time to it."""
    side = int(mp.sign(start))
    from_start = mp.odefun(lambda d, w: [-side * slope_on_circle(side, start - side * d, w[0])], 0, [mpf(0)])
    guess = 2 * abs(start) - 4 * MU  # for small angles
    length = mp.findroot(lambda d: from_start(d)[0], (guess, 0.99 * guess))
    end = start - side * length
    # Next to the end W is found from there, where it has all its digits.
    from_end = mp.odefun(lambda d, w: [side * slope_on_circle(side, end + side * d, w[0])], 0, [mpf(0)])
    half = mp.sqrt(length / 2)
    parts = (mp.quad(lambda u, w=w: 2 * u / mp.sqrt(w(u * u)[0]), [0, half]) for w in (from_start, from_end))
    return end, sum(parts)


@pytest.fixture(scope="module")
def rings(tmp_path_factory: pytest.TempPathFactory) -> Callable[[int], CompiledModel]:
    """Return the circle with friction, put together from some pieces."""
    folder = tmp_path_factory.mktemp("rings")

    @cache
    def built(pieces: int) -> CompiledModel:
        parts = [gqm.transition(length=f"2*pi/{pieces}", yaw=1) for _ in range(pieces)]
        curve = gqm.Curve.piecewise(parts, start=(0, 0, 0), heading=(0, 0, "pi/6"), closed=True)
        forces = gqm.Gravity() + gqm.CoulombFriction()
        return gqm.build(gqm.derive(curve, forces), name=f"ring_of_{pieces}", folder=folder)

    return built


@pytest.mark.extended
@pytest.mark.parametrize(("pieces", "amplitude"), [(80, 0.18), (80, 0.21), (80, 0.55), (8, 0.55), (8, 1.1)])
def test_times_to_rest_on_a_tilted_circle(pieces: int, amplitude: float, rings: Callable[[int], CompiledModel]) -> None:
    """Legs along some short pieces, on which V**2 is far from linear, and along many; and turns sought on parts of long
    pieces.
    """
    launch = np.pi - amplitude
    with mp.workdps(18):
        place, time = mp.pi - mpf(launch), mpf(0)
        while ALONG * abs(mp.sin(place)) > MU * mp.hypot(ALONG * mp.cos(place), ACROSS):
            place, more = next_turn(place)
            time += more
    swept = rings(pieces).sweep("t_end", launch, 0.0, mu=0.05, g=9.81).values
    np.testing.assert_allclose(swept, float(time), rtol=2e-14)


def test_peaks_on_a_tilted_circle(rings: Callable[[int], CompiledModel]) -> None:
    """The largest speed and contact force are found on the pieces on which they are, up to which both increase."""
    launch = np.pi - 0.55
    with mp.workdps(18):
        start = mp.pi - mpf(launch)
        w = mp.odefun(lambda d, w: [-slope_on_circle(1, start - d, w[0])], 0, [mpf(0)])
        fastest = mp.findroot(lambda d: slope_on_circle(1, start - d, w(d)[0]), (start - 0.11, start - 0.1))
        heaviest = mp.findroot(
            lambda d: ALONG * mp.sin(start - d) - slope_on_circle(1, start - d, w(d)[0]), (start - 0.08, start - 0.07)
        )
        speed = mp.sqrt(w(fastest)[0])
        force = mp.hypot(w(heaviest)[0] + ALONG * mp.cos(start - heaviest), ACROSS)
    given = {"mu": 0.05, "g": 9.81, "t_max": 10.0}
    ring = rings(80)
    np.testing.assert_allclose(ring.sweep("v_max", launch, 0.0, **given).values, float(speed), rtol=1e-15)
    np.testing.assert_allclose(ring.sweep("normal_force_max", launch, 0.0, **given).values, float(force), rtol=1e-15)
