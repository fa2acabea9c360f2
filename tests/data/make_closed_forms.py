"""Make ``closed_forms.json``: motions whose truth is a closed form or one smooth integral.

Run as ``python tests/data/make_closed_forms.py``. Everything is computed by mpmath at 80 digits
from exact inputs, by formulas that never subtract nearly equal numbers, and is checked in a second
way (closed forms against a quadrature of the time integral, quadratures at another precision and
with other panels) before it is written with 40 digits. Nothing here imports ``gqm_sym``.
"""

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

from mpmath import mp, mpf

mp.dps = 80  # This is set before the first number below is made.

DIGITS = 40
SQUARED = mpf(10) ** -130  # findroot compares the square of a residual with this.
G = mpf(981) / 100

Row = dict[str, Any]


def text(value: mpf) -> str:
    """Return ``value`` as text, with the digits that are kept."""
    return mp.nstr(value, DIGITS, strip_zeros=False, min_fixed=-6, max_fixed=6)


def must_agree(one: mpf, other: mpf) -> mpf:
    """Return ``one`` after checking it against a value found in another way."""
    if abs(one - other) > mpf(10) ** (-DIGITS - 5) * max(abs(one), mpf(1)):
        raise AssertionError(f"two ways disagree: {one} and {other}")
    return one


def integral(f: Callable[[mpf], mpf], ends: list[mpf]) -> mpf:
    """Integrate over the panels between ``ends``, twice, and compare."""
    first = mp.quad(f, ends)
    halved = sorted({*ends, *((a + b) / 2 for a, b in pairwise(ends))})
    return must_agree(first, mp.quad(f, halved))


def graded(width: mpf, end: mpf) -> list[mpf]:
    """Return ends of panels from 0 to ``end`` for a peak at 0 that is ``width`` wide."""
    knots = [mpf(0)]
    while width < end / 2:
        knots.append(width)
        width *= 3
    return [*knots, end]


def fold(t: str, lap: mpf) -> tuple[int, mpf]:
    """Split a time into whole laps and the remainder."""
    laps = int(mp.floor(mpf(t) / lap))
    return laps, mpf(t) - laps * lap


def sample(lam: str, v2: mpf, kappa: mpf, normal_force: mpf) -> Row:
    """Return one row of ``samples``."""
    return {
        "lam": lam,
        "v2": text(v2),
        "kappa": text(kappa),
        "normal_force": text(normal_force),
    }


def position(t: str, lam: mpf, v: mpf) -> Row:
    """Return one row of ``positions``: the parameter and the signed ds/dt."""
    return {"t": t, "lam": text(lam), "v": text(v)}


# --- pendulum of length 1, by Jacobi's elliptic functions -----------------------------------------

OMEGA = mp.sqrt(G)


def swing(amplitude: mpf, t: mpf) -> tuple[mpf, mpf]:
    """Return the angle from the vertical and its rate, after release from rest at ``amplitude``."""
    k, m = mp.sin(amplitude / 2), mp.sin(amplitude / 2) ** 2
    sn, cn, dn = (mp.ellipfun(name, OMEGA * t, m=m) for name in ("sn", "cn", "dn"))
    half = mp.asin(k * cn / dn)
    return 2 * half, -2 * OMEGA * k * mp.cos(amplitude / 2) ** 2 * sn / dn**2 / mp.cos(half)


def complete(gap: mpf) -> mpf:
    """Return the complete elliptic integral of the first kind for k = sqrt(1 - gap**2), by quadrature."""
    return integral(lambda u: 1 / mp.sqrt(mp.sin(u) ** 2 + gap**2 * mp.cos(u) ** 2), graded(gap, mp.pi / 2))


def swing_half_period(amplitude: mpf) -> mpf:
    """Return the half period, ``2*sqrt(L/g)*K(sin(A/2))``."""
    m = mp.sin(amplitude / 2) ** 2
    closed = 2 * mp.ellipk(m) / OMEGA
    return must_agree(closed, 2 / OMEGA * complete(mp.cos(amplitude / 2)))


def pendulum_samples(lams: list[str], lowest: mpf, v0: mpf, angle0: mpf, read: Row) -> list[Row]:
    """Return speed and contact force of a unit mass; ``lowest`` is the parameter of the bottom."""
    rows = []
    for lam in lams:
        angle = read[lam] - lowest
        v2 = v0**2 + 4 * G * mp.sin((angle0 - angle) / 2) * mp.sin((angle0 + angle) / 2)
        rows.append(sample(lam, v2, mpf(1), G * mp.cos(angle) + v2))
    return rows


def pendulum_from_rest(slug: str, track: str, lam0: str, amplitude: mpf, times: list[str]) -> Row:
    """Release a pendulum from rest, with its angle from the vertical or from the horizontal."""
    lowest = mpf(0) if track == "circle" else -mp.pi / 2
    tau = swing_half_period(amplitude)
    positions = []
    for t in times:
        angle, rate = swing(amplitude, mpf(t))
        positions.append(position(t, lowest + angle, rate))
    at = {"0": mpf(0), "-1": mpf(-1), "-1/2": mpf(-1) / 2}
    inside = [lam for lam in at if abs(at[lam] - lowest) < amplitude]
    return {
        "slug": slug,
        "track": track,
        "parameters": {"L": "1"},
        "launch": {"lam0": lam0},
        "expected": {
            "kind": "libration",
            "half_period": text(tau),
            "turning_points": [text(lowest + amplitude), text(lowest - amplitude)],
            "positions": positions,
            "samples": pendulum_samples(inside, lowest, mpf(0), amplitude, at),
        },
    }


def pendulum_from_bottom(slug: str, v0: str, speed: mpf, times: list[str]) -> Row:
    """Launch a pendulum upwards at its lowest point."""
    positions = []
    m = 4 * G / speed**2  # below 1: it goes round
    if abs(m - 1) < mpf(10) ** -70:  # the root in 2*sqrt(g) is rounded here, not in the launch
        m = mpf(1)
    k = mp.sqrt(m)
    period = mp.ellipk(m) if m < 1 else mpf(0)
    for t in times:
        if m == 1:
            angle = 4 * mp.atan(mp.exp(OMEGA * mpf(t))) - mp.pi
            rate = 2 * OMEGA / mp.cosh(OMEGA * mpf(t))
        elif m < 1:
            u = OMEGA * mpf(t) / k
            laps = mp.floor((u + period) / (2 * period))
            rest = u - 2 * period * laps
            sn, cn, dn = (mp.ellipfun(name, rest, m=m) for name in ("sn", "cn", "dn"))
            angle, rate = 2 * (mp.atan2(sn, cn) + mp.pi * laps), 2 * OMEGA / k * dn
        else:
            u = OMEGA * mpf(t)
            sn, cn, dn = (mp.ellipfun(name, u, m=1 / m) for name in ("sn", "cn", "dn"))
            half = mp.asin(sn / k)
            angle, rate = 2 * half, 2 * OMEGA / k * cn * dn / mp.cos(half)
        # The energy gives the speed in a second way.
        must_agree(rate**2, speed**2 - 4 * G * mp.sin(angle / 2) ** 2)
        positions.append(position(t, angle, rate))
    expected: Row = {"kind": "asymptotic", "turning_points": []}
    if m < 1:
        by_quadrature = 2 * k / OMEGA * complete(mp.sqrt(1 - m))
        expected["kind"] = "circulation"
        expected["loop_time"] = text(must_agree(2 * k * period / OMEGA, by_quadrature))
    elif m > 1:
        amplitude = 2 * mp.asin(1 / k)
        expected["kind"] = "libration"
        expected["half_period"] = text(swing_half_period(amplitude))
        expected["turning_points"] = [text(amplitude), text(-amplitude)]
    expected["positions"] = positions
    at = {"1/2": mpf(1) / 2, "3": mpf(3)}
    expected["samples"] = pendulum_samples(list(at), mpf(0), speed, mpf(0), at)
    return {
        "slug": slug,
        "track": "circle",
        "parameters": {"L": "1"},
        "launch": {"lam0": "0", "v0": v0},
        "expected": expected,
    }


# --- graphs: one smooth integral after the roots at turning points are divided out ------------------


def graph_samples(
    at: dict[str, mpf], height: Callable[[mpf], mpf], energy: mpf, slopes: Callable[[mpf], Any]
) -> list[Row]:
    """Return speed, curvature and contact force of a unit mass on ``z = height(x)``."""
    rows = []
    for lam, x in at.items():
        first, second = slopes(x)
        stretch = mp.sqrt(1 + first**2)
        v2, kappa = 2 * (energy - G * height(x)), second / stretch**3
        rows.append(sample(lam, v2, kappa, G / stretch + kappa * v2))
    return rows


def invert(time: Callable[[mpf], mpf], target: mpf, low: mpf, high: mpf) -> mpf:
    """Find the angle at which a growing ``time`` reaches ``target``."""
    return mp.findroot(lambda u: time(u) - target, (low, high), solver="anderson", tol=mpf(10) ** -130)


def quartic_small(amplitude: mpf, lam0: str) -> Row:
    """Return small swings in z = x**4, for which the time integrand is smooth with x = A*sin(u)."""

    def rate(u: mpf) -> mpf:
        x = amplitude * mp.sin(u)
        return mp.sqrt(1 + 16 * x**6) / (mp.sqrt(2 * G * (1 + mp.sin(u) ** 2)) * amplitude)

    return {
        "slug": "quartic_small_swing",
        "track": "quartic",
        "parameters": {},
        "launch": {"lam0": lam0},
        "expected": {
            "kind": "libration",
            "half_period": text(2 * integral(rate, [mpf(0), mp.pi / 2])),
            "turning_points": [text(amplitude), text(-amplitude)],
            "positions": [],
            "samples": [],
        },
    }


def double_well_slopes(x: mpf) -> tuple[mpf, mpf]:
    """Return the first and the second derivative of x**4 - x**2."""
    return 4 * x**3 - 2 * x, 12 * x**2 - 2


def double_well_within(slug: str, lam0: str, start: mpf, times: list[str]) -> Row:
    """Release near the barrier of z = x**4 - x**2: x**2 = a**2*cos(u)**2 + b**2*sin(u)**2."""
    a2, b2 = start**2, 1 - start**2
    side = mp.sign(start)

    def place(u: mpf) -> mpf:
        return mp.sqrt(a2 * mp.cos(u) ** 2 + b2 * mp.sin(u) ** 2)

    def rate(u: mpf) -> mpf:
        return mp.sqrt(1 + double_well_slopes(place(u))[0] ** 2) / (mp.sqrt(2 * G) * place(u))

    knots = graded(abs(start), mp.pi / 2)

    def time(u: mpf) -> mpf:
        return mp.quad(rate, [*(x for x in knots if x < u), u])

    tau = integral(rate, knots)
    positions = []
    for t in times:
        laps, rest = fold(t, tau)
        u = invert(time, rest if laps % 2 == 0 else tau - rest, mpf(0), mp.pi / 2)
        x = place(u)
        outward = 1 if laps % 2 == 0 else -1
        speed = mp.sqrt(2 * G * (x**2 - a2) * (b2 - x**2))
        positions.append(position(t, side * x, side * outward * speed))
    at = {"1/2": mpf(1) / 2, "0.9": mpf(9) / 10} if side > 0 else {"-1/2": -mpf(1) / 2}
    energy = G * (start**4 - start**2)
    return {
        "slug": slug,
        "track": "double_well",
        "parameters": {},
        "launch": {"lam0": lam0},
        "expected": {
            "kind": "libration",
            "half_period": text(tau),
            "turning_points": [text(start), text(side * mp.sqrt(b2))],
            "positions": positions,
            "samples": graph_samples(at, lambda x: x**4 - x**2, energy, double_well_slopes),
        },
    }


def double_well_across(slug: str, v0: str, speed: mpf, times: list[str]) -> Row:
    """Launch from the top of the barrier of z = x**4 - x**2: x = b*sin(u)."""
    energy = speed**2 / (2 * G)
    root = mp.sqrt(1 + 4 * energy)
    b2, c2 = (1 + root) / 2, 2 * energy / (1 + root)

    def rate(u: mpf) -> mpf:
        x = mp.sqrt(b2) * mp.sin(u)
        slope = double_well_slopes(x)[0]
        return mp.sqrt((1 + slope**2) / (2 * G * (b2 * mp.sin(u) ** 2 + c2)))

    knots = graded(mp.sqrt(c2), mp.pi / 2)

    def time(u: mpf) -> mpf:
        return mp.quad(rate, [*(x for x in knots if x < u), u])

    quarter = integral(rate, knots)
    positions = []
    for t in times:
        # From the launch: outwards for a quarter period, back, and the same on the other side.
        laps, rest = fold(t, quarter)
        u = invert(time, rest if laps % 2 == 0 else quarter - rest, mpf(0), mp.pi / 2)
        x = mp.sqrt(b2) * mp.sin(u) * (1 if laps % 4 < 2 else -1)
        v = mp.sqrt(2 * G * (b2 - x**2) * (x**2 + c2)) * (1 if laps % 4 in (0, 3) else -1)
        positions.append(position(t, x, v))
    at = {"0": mpf(0), "0.7": mpf(7) / 10, "-1": mpf(-1)}
    return {
        "slug": slug,
        "track": "double_well",
        "parameters": {},
        "launch": {"lam0": "0", "v0": v0},
        "expected": {
            "kind": "libration",
            "half_period": text(2 * quarter),
            "turning_points": [text(mp.sqrt(b2)), text(-mp.sqrt(b2))],
            "positions": positions,
            "samples": graph_samples(at, lambda x: x**4 - x**2, speed**2 / 2, double_well_slopes),
        },
    }


def double_well_separatrix(times: list[str]) -> Row:
    """Release at x = 1, exactly as high as the barrier; x = 1/cosh(w) reaches 0 after infinite time."""

    def rate(w: mpf) -> mpf:
        slope = double_well_slopes(1 / mp.cosh(w))[0]
        return mp.sqrt((1 + slope**2) / (2 * G))

    def time(w: mpf) -> mpf:
        knots = [mpf(k) for k in range(0, 60) if k < w]
        return mp.quad(rate, [*knots, w])

    positions = []
    for t in times:
        target = mpf(t)
        w = invert(time, target, mpf(0), target * mp.sqrt(2 * G))
        x = 1 / mp.cosh(w)
        positions.append(position(t, x, -mp.sqrt(2 * G) * x * mp.tanh(w)))
    return {
        "slug": "double_well_released_level_with_the_barrier",
        "track": "double_well",
        "parameters": {},
        "launch": {"lam0": "1"},
        "expected": {
            "kind": "asymptotic",
            "turning_points": ["1"],
            "positions": positions,
            "samples": [],
        },
    }


def parabola(slug: str, x0: str, amplitude: mpf, times: list[str]) -> Row:
    """Release in z = 7/10*x**2, with the half period 2*E(-4*a**2*X**2)/sqrt(2*g*a)."""
    a = mpf(7) / 10
    m, rate = -4 * a**2 * amplitude**2, mp.sqrt(2 * G * a)
    tau = must_agree(
        2 * mp.ellipe(m) / rate,
        2 / rate * integral(lambda u: mp.sqrt(1 - m * mp.sin(u) ** 2), graded(1 / (1 + mp.sqrt(-m)), mp.pi / 2)),
    )
    positions = []
    for t in times:
        laps, rest = fold(t, tau)
        elapsed = tau / 2 - rest  # from the bottom, on the way from +X to -X
        u = mp.sign(elapsed) * invert(lambda u: mp.ellipe(u, m) / rate, abs(elapsed), mpf(0), mp.pi / 2)
        mirrored = 1 if laps % 2 == 0 else -1
        x = mirrored * amplitude * mp.sin(u)
        positions.append(position(t, x, -mirrored * rate * amplitude * mp.cos(u)))
    at = {lam: mpf(lam) for lam in ("0", "0.25", "-2") if abs(mpf(lam)) < amplitude}
    energy = G * a * amplitude**2
    return {
        "slug": slug,
        "track": "parabola",
        "parameters": {"a": "0.7"},
        "launch": {"lam0": x0},
        "expected": {
            "kind": "libration",
            "half_period": text(tau),
            "turning_points": [text(amplitude), text(-amplitude)],
            "positions": positions,
            "samples": graph_samples(at, lambda x: a * x**2, energy, lambda x: (2 * a * x, 2 * a)),
        },
    }


def tautochrone(slug: str, lam0: str, start: mpf, times: list[str]) -> Row:
    """Release in the inverted cycloid of radius 1/2, where cos(lam/2) is a cosine of time."""
    radius = mpf(1) / 2
    omega = mp.sqrt(G / (4 * radius))
    reach = mp.cos(start / 2)
    positions = []
    for t in times:
        lam = 2 * mp.acos(reach * mp.cos(omega * mpf(t)))
        positions.append(position(t, lam, 4 * radius * reach * omega * mp.sin(omega * mpf(t))))
    samples = []
    for lam in ("2", "3"):
        half = mpf(lam) / 2
        v2 = 4 * G * radius * (reach - mp.cos(half)) * (reach + mp.cos(half))
        if v2 > 0:
            kappa = 1 / (4 * radius * mp.sin(half))
            samples.append(sample(lam, v2, kappa, G * mp.sin(half) + kappa * v2))
    return {
        "slug": slug,
        "track": "cycloid_inverted",
        "parameters": {"R": "0.5"},
        "launch": {"lam0": lam0},
        "expected": {
            "kind": "libration",
            "half_period": text(2 * mp.pi * mp.sqrt(radius / G)),
            "turning_points": [text(start), text(2 * mp.pi - start)],
            "positions": positions,
            "samples": samples,
        },
    }


def cubic(times: list[str]) -> Row:
    """Launch up z = x**3 from x = -1 at 6.2088; the body turns once, and then moves to minus infinity."""
    speed = mpf(62088) / 10000
    top = mp.cbrt(speed**2 / (2 * G) - 1)

    def rate(u: mpf) -> mpf:  # x = top - u**2
        x = top - u**2
        return 2 * mp.sqrt((1 + 9 * x**4) / (2 * G * (top**2 + top * x + x**2)))

    def time(u: mpf) -> mpf:
        return mp.quad(rate, mp.linspace(mpf(0), u, 5))

    launch = mp.sqrt(top + 1)
    turn = integral(rate, mp.linspace(mpf(0), launch, 5))
    positions = []
    for t in times:
        elapsed = mpf(t) - turn
        u = invert(time, abs(elapsed), mpf(0), mpf(8))
        x = top - u**2
        v = u * mp.sqrt(2 * G * (top**2 + top * x + x**2))
        positions.append(position(t, x, -mp.sign(elapsed) * v))
    at = {"-1/2": mpf(-1) / 2, "0": mpf(0), "0.9": mpf(9) / 10}
    energy = speed**2 / 2 - G
    samples = graph_samples(at, lambda x: x**3, energy, lambda x: (3 * x**2, 6 * x))
    for row in samples:
        passed = must_agree(turn - time(mp.sqrt(top - at[row["lam"]])), direct_time(at[row["lam"]]))
        row["t_first_passage"] = text(passed)
    return {
        "slug": "cubic_turns_once",
        "track": "cubic",
        "parameters": {},
        "launch": {"lam0": "-1", "v0": "6.2088"},
        "expected": {
            "kind": "transit",
            "turning_points": [text(top)],
            "positions": positions,
            "samples": samples,
        },
    }


def direct_time(x: mpf) -> mpf:
    """Return the time from -1 to x on the cubic, without any substitution (x is far from the turn)."""
    speed = mpf(62088) / 10000
    return mp.quad(
        lambda u: mp.sqrt((1 + 9 * u**4) / (speed**2 - 2 * G * (u**3 + 1))),
        mp.linspace(mpf(-1), x, 9),
    )


def at_rest(slug: str, track: str, lam0: str, lam: mpf, parameters: dict[str, str]) -> Row:
    """Put a body at an equilibrium, where it stays."""
    return {
        "slug": slug,
        "track": track,
        "parameters": parameters,
        "launch": {"lam0": lam0},
        "expected": {
            "kind": "rest",
            "turning_points": [],
            "positions": [position(t, lam, mpf(0)) for t in ("0", "1", "1000")],
            "samples": [],
        },
    }


def cases() -> list[Row]:
    """Return every case of the file, in its order."""
    tiny, milli, micro = mpf(10) ** -6, mpf(10) ** -3, mpf(10) ** -6
    # The float nearest to pi/2 lies this far below the hilltop (an exact binary number).
    float_top = mp.pi / 2 - mpf(3.141592653589793 / 2)
    length_one = {"L": "1"}
    return [
        pendulum_from_rest("pendulum_almost_upright", "circle", "pi - 1e-3", mp.pi - milli, ["1.5", "7", "40"]),
        pendulum_from_rest(
            "pendulum_almost_upright_from_the_horizontal",
            "pendulum",
            "pi/2 - 1e-3",
            mp.pi - milli,
            ["1.5", "7", "40"],
        ),
        pendulum_from_rest("pendulum_nearly_upright", "circle", "pi - 1e-6", mp.pi - micro, ["4", "11", "60"]),
        pendulum_from_rest(
            "pendulum_nearly_upright_from_the_horizontal",
            "pendulum",
            "pi/2 - 1e-6",
            mp.pi - micro,
            ["4", "11", "60"],
        ),
        pendulum_from_rest("pendulum_tiny_swing", "circle", "1e-6", tiny, ["0.3", "1.1", "15"]),
        pendulum_from_rest(
            "pendulum_tiny_swing_from_the_horizontal",
            "pendulum",
            "-pi/2 + 1e-6",
            tiny,
            ["0.3", "1.1", "15"],
        ),
        pendulum_from_rest(
            "pendulum_at_the_float_below_the_hilltop",
            "pendulum",
            "float(pi/2)",
            mp.pi - float_top,
            ["5", "30"],
        ),
        pendulum_from_bottom("pendulum_full_loop", "7", mpf(7), ["0.4", "3", "9"]),
        pendulum_from_bottom("pendulum_barely_loops", "6.2642", mpf("6.2642"), ["0.4", "3", "20"]),
        pendulum_from_bottom("pendulum_barely_fails_to_loop", "6.2641", mpf("6.2641"), ["0.4", "3", "20"]),
        pendulum_from_bottom(
            "pendulum_launched_to_the_hilltop",
            "2*sqrt(9.81)",
            2 * OMEGA,
            ["0.4", "2", "8"],
        ),
        at_rest("pendulum_on_the_hilltop", "pendulum", "pi/2", mp.pi / 2, length_one),
        at_rest("pendulum_at_the_bottom", "pendulum", "-pi/2", -mp.pi / 2, length_one),
        at_rest("circle_on_the_hilltop", "circle", "pi", mp.pi, length_one),
        at_rest("circle_at_the_bottom", "circle", "0", mpf(0), length_one),
        at_rest("double_well_on_the_barrier", "double_well", "0", mpf(0), {}),
        at_rest("double_well_in_a_well", "double_well", "1/sqrt(2)", 1 / mp.sqrt(2), {}),
        double_well_within("double_well_just_below", "0.001", milli, ["1.2", "5", "20"]),
        double_well_within("double_well_just_below_on_the_left", "-1e-6", -tiny, ["2.5", "20"]),
        double_well_across("double_well_just_above", "0.001", milli, ["1.2", "5", "30"]),
        double_well_across("double_well_well_above", "3", mpf(3), ["0.3", "2", "9"]),
        double_well_separatrix(["0.5", "1.5", "4"]),
        quartic_small(milli, "0.001"),
        parabola("parabola_tiny_swing", "1e-6", tiny, ["0.3", "5"]),
        parabola("parabola_tall_swing", "5", mpf(5), ["0.3", "5", "30"]),
        tautochrone("tautochrone_tiny_swing", "pi - 1e-6", mp.pi - tiny, ["0.3", "5", "20"]),
        tautochrone("tautochrone_almost_from_the_cusp", "0.001", milli, ["0.3", "5", "20"]),
        cubic(["0.2", "0.6", "1.5", "3"]),
    ]


def main() -> None:
    """Write the file beside this script."""
    target = Path(__file__).with_name("closed_forms.json")
    target.write_text(json.dumps(cases(), indent=1) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
