"""Where the contact force jumps to the other sign at a joint, friction and contact follow it at once."""

from math import cos, inf, sin, sqrt
from pathlib import Path
from types import ModuleType

import pytest
from scipy.integrate import solve_ivp

import gqm_sym as gqm

# An incline of length LINE, and behind it a clothoid whose curvature rises from FIRST to LAST.
G, MU, HEADING, LINE, LENGTH, FIRST, LAST = 9.81, 0.25, -0.75, 1.0, 2.0, -0.75, 1.25


@pytest.fixture(scope="module")
def dip(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a module for friction on the incline and the clothoid."""
    pieces = [gqm.line(length=LINE), gqm.clothoid(length=LENGTH, kappa_start=FIRST, kappa_end=LAST)]
    curve = gqm.Curve.piecewise(pieces, heading=str(HEADING))
    folder: Path = tmp_path_factory.mktemp("dip")
    return gqm.build(gqm.derive(curve, gqm.Gravity() + gqm.CoulombFriction()), name="dip", folder=folder)


def _load(r: float, v2: float) -> float:
    """Return N on the clothoid at the length r from its start."""
    rise = (LAST - FIRST) / LENGTH
    heading = HEADING + FIRST * r + 0.5 * rise * r * r
    return G * cos(heading) + (FIRST + rise * r) * v2


def test_contact_is_lost_where_the_load_jumps(dip: ModuleType) -> None:
    """A fast body leaves the track at the joint, also if the load would become positive again on the same piece."""
    slope, v0 = -G * (sin(HEADING) + MU * cos(HEADING)), 4.0
    v2 = v0 * v0 + 2.0 * slope * LINE
    assert _load(0.0, v2) < 0.0 < _load(LENGTH, v2)
    motion = dip.solve(0.0, v0, 1, contact="above", mu=MU)
    left = motion.events[-1]
    assert (left.kind, left.lam) == ("liftoff", LINE)
    assert left.t == pytest.approx((sqrt(v2) - v0) / slope, rel=4e-16)
    assert float(dip.sweep("t_end", 0.0, v0, 1, contact="above", mu=MU).values) == motion.t_end


@pytest.mark.parametrize("direction", [1, -1])
def test_friction_where_the_load_jumps(direction: int, dip: ModuleType) -> None:
    """Friction also takes energy from a body whose load has jumped to the other sign (DOP853, in parts of one sign).

    It gave energy to the body until the load took its first sign again.
    """

    def rate(r: float, w: list[float], sign: int) -> list[float]:
        rise = (LAST - FIRST) / LENGTH
        heading = HEADING + FIRST * r + 0.5 * rise * r * r
        return [-2.0 * G * sin(heading) - 2.0 * direction * MU * sign * _load(r, w[0])]

    on_line = -2.0 * G * (sin(HEADING) + direction * MU * cos(HEADING)) * LINE
    speed, start, end, sign = (4.0, 0.0, LENGTH, -1) if direction > 0 else (10.0, LENGTH, 0.0, 1)
    v2, least = speed**2 + (on_line if direction > 0 else 0.0), inf
    while start != end:

        def load(r: float, w: list[float], _sign: int) -> float:
            return _load(r, w[0])

        load.terminal, load.direction = True, -sign  # type: ignore[attr-defined]
        run = solve_ivp(rate, (start, end), [v2], "DOP853", args=(sign,), rtol=3e-14, atol=1e-14, events=load)
        start, v2, sign, least = run.t[-1], run.y[0, -1], -sign, min(least, run.y.min())
    assert least > 1.0
    motion = dip.solve(0.0 if direction > 0 else LINE + LENGTH, speed, direction, mu=MU)
    end_v2 = v2 if direction > 0 else v2 - on_line
    assert motion.state(motion.t_end).v2 == pytest.approx(end_v2, rel=1e-12)
