"""Turning points under Coulomb friction on a circle change as their closed form does, for random launches.

With the angle from the bottom, dW/dtheta = -2 g L sin(theta) - 2 v mu (W + g L cos(theta)) for W = V**2 and v =
sgn(dtheta/dt), as long as the body presses outwards. So W is K exp(-2 mu v theta) + A cos(theta) + B sin(theta).
"""

from typing import Any

from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp, mpf
from paths import ROOT
from selection import examples

from gqm_sym.loading import load

# The largest error, as a share of the largest derivative of the same turning point.
TOLERANCE = 1e-13

NAMES = ("lam0", "v0", "L", "g", "mu")


def speed_squared(theta: mpf, start: mpf, w0: mpf, v: int, length: mpf, g: mpf, mu: mpf) -> mpf:
    """Return W at an angle on a leg that begins with ``w0`` at another angle."""
    a, b = 2 * g * length * (1 - 2 * mu**2) / (1 + 4 * mu**2), -6 * v * mu * g * length / (1 + 4 * mu**2)
    rest = w0 - a * mp.cos(start) - b * mp.sin(start)
    return rest * mp.exp(-2 * mu * v * (theta - start)) + a * mp.cos(theta) + b * mp.sin(theta)


def turns(launch: dict[str, Any], direction: int, near: tuple[float, ...]) -> list[mpf]:
    """Return the turning points after the launch, from doubles beside them."""
    lam0, v0, *rest = (launch[name] for name in NAMES)
    found, start, w0, v = list[mpf](), lam0, v0**2, direction
    for place in near:
        start = mp.findroot(
            lambda theta, start=start, w0=w0, v=v: speed_squared(theta, start, w0, v, *rest), mpf(place)
        )
        found.append(start)
        w0, v = mpf(0), -v
    return found


@given(
    lam0=st.floats(-0.9, 0.9),
    v0=st.floats(0.3, 2.0),
    length=st.floats(0.5, 2.0),
    g=st.floats(8.0, 12.0),
    mu=st.floats(0.01, 0.2),
    direction=st.sampled_from([1, -1]),
)
@examples(40)
def test_turning_points(lam0: float, v0: float, length: float, g: float, mu: float, direction: int) -> None:
    """The derivatives of the first turning points by launch and parameters are those of the closed form."""
    launch = dict(zip(NAMES, (lam0, v0, length, g, mu), strict=True))
    motion = load(str(ROOT / "generated" / "circle_coulomb.py"), "circle_coulomb").solve(**launch, direction=direction)
    count = min(3, len(motion.turning_points))
    near = tuple(motion.turning_points[:count])
    assume(count > 0 and max(map(abs, near)) < 1.5)
    found = motion.gradient("turning_points", NAMES)
    with mp.workdps(60):
        exact, step, changes = {key: mpf(value) for key, value in launch.items()}, mpf(10) ** -20, {}
        for name in NAMES:
            sides = [turns({**exact, name: exact[name] + sign * step}, direction, near) for sign in (1, -1)]
            changes[name] = [(up - down) / (2 * step) for up, down in zip(*sides, strict=True)]
        for k in range(count):
            size = max(abs(changes[name][k]) for name in NAMES)
            for name in NAMES:
                assert abs(found[name][k] - changes[name][k]) <= TOLERANCE * size
