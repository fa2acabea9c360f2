"""Closed forms of the pendulum of length 1 in 40 digits, the reference of most rows."""

from measure import mp, mpf  # with the digits of all truths

G = mpf("9.81")


def half_period(amplitude: float) -> mpf:
    """Return the half period of the pendulum of length 1, in closed form."""
    return 2 * mp.ellipk(mp.sin(mpf(amplitude) / 2) ** 2) / mp.sqrt(G)


def place(amplitude: float, t: float) -> mpf:
    """Angle from the horizontal, released from rest on the right."""
    k = mp.sin(mpf(amplitude) / 2)
    return 2 * mp.asin(k * mp.ellipfun("cd", mp.sqrt(G) * mpf(t), m=k * k)) - mp.pi / 2
