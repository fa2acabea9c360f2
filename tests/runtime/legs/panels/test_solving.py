"""V**2 with friction along tracks in space past places where the contact force vanishes, to rounding."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm

Build = Callable[..., ModuleType]

G, RADIUS, START, STOP, SPEED = 9.81, 20.0, 0.6, -0.7, 13.1
# The largest error of V**2 and of the time, as a share. Worst measured: 2e-15.
ERROR = 8e-15


def over_the_hill(mu: float) -> tuple[mpf, mpf, int]:
    """Return V**2 at the end of the hill, the time to there, and how often N changes its sign, in 30 digits.

    Against the angle of climb, which decreases, V**2 is an exponential and a harmonic function as long as N has a sign.
    """
    angle, stop, w, time, changes = mpf(START), mpf(STOP), mpf(SPEED) ** 2, mpf(0), 0
    g, radius = mpf(G), mpf(RADIUS)
    sign = 1 if g * mp.cos(angle) > w / radius else -1
    while angle > stop:
        k = 2 * mpf(mu) * sign
        of_sine, of_cosine = 2 * g * radius, k * g * radius
        a = (of_cosine + k * of_sine) / (1 + k * k)
        b = k * a - of_sine
        c = (w - a * mp.sin(angle) - b * mp.cos(angle)) * mp.exp(k * angle)

        def v2(at: Any, a: mpf = a, b: mpf = b, c: mpf = c, k: mpf = k) -> mpf:
            return a * mp.sin(at) + b * mp.cos(at) + c * mp.exp(-k * at)

        def force(at: Any, v2: Any = v2) -> mpf:
            return g * mp.cos(at) - v2(at) / radius

        end = stop
        for step in mp.linspace(angle, stop, 200)[1:]:
            if force(step) * sign < 0:
                end = mp.findroot(force, (step, step + (mpf(START) - stop) / 200), solver="anderson")
                break
        time += mp.quad(lambda at, v2=v2: radius / mp.sqrt(v2(at)), [end, angle])
        if end != stop:
            changes, sign = changes + 1, -sign
        angle, w = end, v2(end)
    return w, time, changes


@pytest.mark.parametrize("mu", [0.02, 0.08])
def test_friction_past_places_where_the_contact_force_vanishes(build: Build, mu: float) -> None:
    """On a hill in a vertical plane, on a track that goes on in space, a body that the track holds back from above and
    from below passes places where N vanishes, beside which |N| has a kink.
    """
    hill = gqm.arc(radius="20", angle="-1.3")
    track = gqm.Curve.piecewise([hill, gqm.transition(length=5, yaw="0.01")], start=(0, 0, 0), heading=(0, "0.6"))
    module = build("hill_of_a_rail_in_space", track, gqm.CoulombFriction())
    with mp.workdps(30):
        w, time, changes = over_the_hill(mu)
    end = RADIUS * (START - STOP)
    assert changes == 2
    found = module.solve(0, v0="13.1", mu=mu)
    assert found.t_end > time
    assert abs(module.pass1(np.array([end]), lam0=0, v0="13.1", mu=mu).v2[0] - w) <= ERROR * w
    assert abs(float(module.sweep("time_at", 0.0, SPEED, lam=end, mu=mu).values) - time) <= ERROR * time
