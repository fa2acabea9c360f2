"""Make ``degenerate.json``, which has motions that are hard for doubles, with true values to 40 digits.

Run as ``python tests/data/make_degenerate.py`` (a minute). Pendulums, cycloids and Kepler's ellipse have closed forms
in mpmath's elliptic functions; in the other cases the zeros of V**2 are divided out by hand, which leaves one smooth
integral without any difference, taken over panels graded towards its peak. All is computed with 80 digits from exact
inputs. Nothing here imports ``gqm_sym``.
"""

import json
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

from make_closed_forms import G, Row, graded, integral, must_agree, text
from mpmath import mp, mpf

# Orbits are sampled at these times, in half periods (or laps) from launch: early, late, and at fast places.
SHARES = (
    *("0.0003", "0.07", "0.31", "0.499", "0.50002", "0.52", "0.96", "0.99999", "1.00001", "1.43", "1.9"),
    *("7.77", "123.456", "1000.50003", "12345.67", "1000000.00001", "9876543.21", "1234567890.123"),
)
TIME_DIGITS = 12  # the relative precision of a time of the table; the text means exactly what it says

Function = Callable[[mpf], mpf]


def times(tau: mpf, shares: Sequence[str] = SHARES) -> list[str]:
    """Return times as text, at shares of the half period."""
    return [mp.nstr(mpf(share) * tau, TIME_DIGITS, min_fixed=-30, max_fixed=30) for share in shares]


def row(slug: str, track: str, hard: str, parameters: dict[str, str], launch: Row, expected: Row) -> Row:
    """Return one case."""
    return {
        "slug": slug,
        "track": track,
        "hard": hard,
        "parameters": parameters,
        "launch": launch,
        "expected": expected,
    }


def position(t: str, lam: mpf, v: mpf) -> Row:
    """Return one row of ``positions``: the parameter and the signed ds/dt."""
    return {"t": t, "lam": text(lam), "v": text(v)}


@dataclass(frozen=True)
class Clock:
    """Time over a parameter u: the integral of a positive, smooth ``rate`` over panels between ``knots``."""

    rate: Function
    knots: list[mpf]

    def marks(self) -> list[mpf]:
        """Return the time at every knot."""
        parts = (integral(self.rate, [a, b]) for a, b in zip(self.knots, self.knots[1:], strict=False))
        return list(accumulate(parts, initial=mpf(0)))

    def at(self, u: mpf, marks: list[mpf]) -> mpf:
        """Return the time at u."""
        k = min(max(bisect_right(self.knots, u) - 1, 0), len(self.knots) - 2)
        return marks[k] + mp.quad(self.rate, [self.knots[k], u])

    def when(self, t: mpf, marks: list[mpf]) -> mpf:
        """Return u at a time, by Newton's method inside the panel."""
        k = min(max(bisect_right(marks, t) - 1, 0), len(marks) - 2)
        low, high = self.knots[k], self.knots[k + 1]
        u, spent = low, marks[k]
        share = (t - spent) / (marks[k + 1] - spent)
        guess = low + share * (high - low)
        for _ in range(60):
            spent += mp.quad(self.rate, [u, guess])
            u = guess
            step = (t - spent) / self.rate(u)
            guess = min(max(u + step, low), high)
            if abs(step) <= mpf(10) ** -55 * (high - low):
                return guess
        raise AssertionError(f"Newton's method does not settle on the time {t}")


def both_sides(width: mpf, end: mpf) -> list[mpf]:
    """Return ends of panels from -end to end for a peak at 0."""
    right = graded(width, end)
    return [*(-u for u in reversed(right[1:])), *right]


def swing(
    slug: str,
    track: str,
    hard: str,
    parameters: dict[str, str],
    launch: Row,
    *,
    clock: Clock,
    place: Function,
    speed: Function,
    start: mpf,
    heading: int = 1,
) -> Row:
    """Return a libration, in which u runs from one turning point to the other and back, from ``start`` at launch."""
    marks = clock.marks()
    tau = marks[-1]
    begun = tau if start == clock.knots[-1] else clock.at(start, marks)
    phase = begun if heading > 0 else 2 * tau - begun
    positions = []
    growing = 1 if place(clock.knots[-1]) > place(clock.knots[0]) else -1
    for t in times(tau):
        rest = mpf(t) + phase
        rest -= 2 * tau * mp.floor(rest / (2 * tau))
        sign = 1 if rest <= tau else -1
        u = clock.when(rest if rest <= tau else 2 * tau - rest, marks)
        positions.append(position(t, place(u), growing * sign * speed(u)))
    ends = sorted((place(clock.knots[0]), place(clock.knots[-1])))
    expected = {
        "kind": "libration",
        "half_period": text(tau),
        "turning_points": [text(end) for end in ends],
        "positions": positions,
    }
    return row(slug, track, hard, parameters, launch, expected)


# --- pendulum: Jacobi's elliptic functions --------------------------------------------------------


def pendulum(hard: str, track: str, lam0: str, amplitude: mpf, length: str = "1", g: str = "9.81") -> Row:
    """Release a pendulum, with its angle from the vertical ("circle") or from the horizontal ("pendulum")."""
    lowest = mpf(0) if track == "circle" else -mp.pi / 2
    omega = mp.sqrt(mpf(g) / mpf(length))
    k, m = mp.sin(amplitude / 2), mp.sin(amplitude / 2) ** 2
    tau = 2 * mp.ellipk(m) / omega
    gap = mp.cos(amplitude / 2)
    knots = graded(gap, mp.pi / 2)
    must_agree(tau, 2 / omega * integral(lambda u: 1 / mp.sqrt(mp.sin(u) ** 2 + (gap * mp.cos(u)) ** 2), knots))
    positions = []
    for t in times(tau):
        rest = mpf(t) - 2 * tau * mp.floor(mpf(t) / (2 * tau))
        sn, cn, dn = (mp.ellipfun(name, omega * rest, m=m) for name in ("sn", "cn", "dn"))
        half = mp.asin(k * cn / dn)
        rate = -2 * omega * k * gap**2 * sn / dn**2 / mp.cos(half)
        positions.append(position(t, lowest + 2 * half, mpf(length) * rate))
    slug = f"pendulum_{track}_{lam0}_{length}_{g}"
    for one, other in ((" ", ""), ("/", "_over_"), ("-", "_minus_"), ("+", "_plus_"), (".", "_")):
        slug = slug.replace(one, other)
    expected = {
        "kind": "libration",
        "half_period": text(tau),
        "turning_points": [text(lowest - amplitude), text(lowest + amplitude)],
        "positions": positions,
    }
    return row(slug, track, hard, {"L": length, "g": g}, {"lam0": lam0}, expected)


def thrown_pendulum(slug: str, hard: str, v0: str, speed: mpf) -> Row:
    """Launch a pendulum of length 1 at its lowest point."""
    omega, m = mp.sqrt(G), 4 * G / speed**2
    launch = {"lam0": "0", "v0": v0}
    positions = []
    if m > 1:  # the body comes back
        tau = 2 * mp.ellipk(1 / m) / omega
        for t in times(tau):
            rest = mpf(t) - 2 * tau * mp.floor(mpf(t) / (2 * tau))
            sn, cn = (mp.ellipfun(name, omega * rest, m=1 / m) for name in ("sn", "cn"))
            positions.append(position(t, 2 * mp.asin(sn / mp.sqrt(m)), speed * cn))
        top = 2 * mp.asin(1 / mp.sqrt(m))
        expected = {"kind": "libration", "half_period": text(tau), "turning_points": [text(-top), text(top)]}
    else:
        loop = 4 * mp.ellipk(m) / speed
        for t in times(loop):
            laps = mp.floor(mpf(t) / loop)
            u = speed * (mpf(t) - laps * loop) / 2
            sn, cn, dn = (mp.ellipfun(name, u, m=m) for name in ("sn", "cn", "dn"))
            turned = mp.atan2(sn, cn)
            turned += 0 if turned >= 0 else 2 * mp.pi
            positions.append(position(t, 2 * mp.pi * laps + 2 * turned % (2 * mp.pi), speed * dn))
        expected = {"kind": "circulation", "loop_time": text(loop)}
    return row(slug, "circle", hard, {"L": "1"}, launch, expected | {"positions": positions})


# --- x**4 - x**2 and its like: z = p*x**4 - q*x**2 ------------------------------------------------


def steepness(p: mpf, q: mpf) -> Function:
    """Return ds/dx on the double well."""
    return lambda x: mp.sqrt(1 + (4 * p * x**3 - 2 * q * x) ** 2)


def in_one_well(slug: str, hard: str, p: str, q: str, launch: Row, a2: mpf, start: mpf) -> Row:
    """Swing in the right-hand well, x**2 = a**2*cos(u)**2 + b**2*sin(u)**2; ``start`` is sin(u)**2 at launch."""
    cp, cq = mpf(p), mpf(q)
    b2, root, ds = cq / cp - a2, mp.sqrt(2 * G * cp), steepness(cp, cq)

    def place(u: mpf) -> mpf:
        return mp.sqrt(a2 * mp.cos(u) ** 2 + b2 * mp.sin(u) ** 2)

    def speed(u: mpf) -> mpf:
        return root * (b2 - a2) * abs(mp.sin(u) * mp.cos(u))

    return swing(
        slug,
        "double_well_of",
        hard,
        {"p": p, "q": q},
        launch,
        clock=Clock(lambda u: ds(place(u)) / (root * place(u)), graded(mp.sqrt(a2 / b2), mp.pi / 2)),
        place=place,
        speed=speed,
        start=mp.asin(mp.sqrt(start)),
    )


def over_both_wells(slug: str, hard: str, p: str, q: str, launch: Row, b2: mpf, start: mpf) -> Row:
    """Swing across the barrier, with x = b*sin(u)."""
    cp, cq = mpf(p), mpf(q)
    c2, root, ds = b2 - cq / cp, mp.sqrt(2 * G * cp), steepness(cp, cq)
    b = mp.sqrt(b2)

    def rate(u: mpf) -> mpf:
        x = b * mp.sin(u)
        return ds(x) / (root * mp.sqrt(x**2 + c2))

    return swing(
        slug,
        "double_well_of",
        hard,
        {"p": p, "q": q},
        launch,
        clock=Clock(rate, both_sides(mp.sqrt(c2 / b2), mp.pi / 2)),
        place=lambda u: b * mp.sin(u),
        speed=lambda u: root * b * mp.cos(u) * mp.sqrt((b * mp.sin(u)) ** 2 + c2),
        start=start,
    )


# --- bottoms c*x**n -------------------------------------------------------------------------------


def bottom(slug: str, hard: str, track: str, parameters: dict[str, str], c: mpf, n: int, lam0: str) -> Row:
    """Release on z = c*x**n, n even, with x = A*sin(u)."""
    amplitude = mpf(lam0)

    def left(s: mpf) -> mpf:  # (1 - s**n)/(1 - s**2)
        return sum(s ** (2 * k) for k in range(n // 2))

    def rate(u: mpf) -> mpf:
        s = mp.sin(u)
        slope = n * c * (amplitude * s) ** (n - 1)
        return mp.sqrt((1 + slope**2) / (2 * G * c * amplitude ** (n - 2) * left(s)))

    def speed(u: mpf) -> mpf:
        return mp.sqrt(2 * G * c * amplitude**n * left(mp.sin(u))) * mp.cos(u)

    width = 1 / (1 + n * c * amplitude ** (n - 1))
    half = graded(width, mp.pi / 2)
    return swing(
        slug,
        track,
        hard,
        parameters,
        {"lam0": lam0},
        clock=Clock(rate, [*(-u for u in reversed(half[1:])), *half]),
        place=lambda u: amplitude * mp.sin(u),
        speed=speed,
        start=mp.pi / 2,
    )


# --- closed forms of their own --------------------------------------------------------------------


def cycloid(slug: str, hard: str, radius: str, lam0: str, start: mpf, shares: Sequence[str]) -> Row:
    """Release on the inverted cycloid, where cos(lam/2) is a cosine of time."""
    r = mpf(radius)
    omega, reach = mp.sqrt(G / (4 * r)), mp.cos(start / 2)
    tau = mp.pi / omega
    positions = []
    for t in times(tau, shares):
        lam = 2 * mp.acos(reach * mp.cos(omega * mpf(t)))
        positions.append(position(t, lam, 4 * r * reach * omega * mp.sin(omega * mpf(t))))
    expected = {
        "kind": "libration",
        "half_period": text(tau),
        "turning_points": [text(start), text(2 * mp.pi - start)],
        "positions": positions,
    }
    return row(slug, "cycloid_inverted", hard, {"R": radius}, {"lam0": lam0}, expected)


def kepler(slug: str, hard: str, eccentricity: str, lam0: str, start: mpf) -> Row:
    """Move along its own ellipse of semi-major axis 1 about an attraction of strength 1, by Kepler's equation."""
    e = mpf(eccentricity)

    def speed(lam: mpf) -> mpf:
        return mp.sqrt((1 + e * mp.cos(lam)) / (1 - e * mp.cos(lam)))

    positions = []
    for t in times(2 * mp.pi):
        mean = mpf(t) + start - e * mp.sin(start)
        laps = mp.floor(mean / (2 * mp.pi))
        rest = mean - 2 * mp.pi * laps
        low, high = mpf(0), 2 * mp.pi
        lam = rest
        for _ in range(500):
            miss = lam - e * mp.sin(lam) - rest
            low, high = (lam, high) if miss < 0 else (low, lam)
            new = lam - miss / (1 - e * mp.cos(lam))
            new = new if low < new < high else (low + high) / 2
            done, lam = abs(new - lam) < mpf(10) ** -70, new
            if done:
                break
        positions.append(position(t, lam + 2 * mp.pi * laps, speed(lam)))
    expected = {"kind": "circulation", "loop_time": text(2 * mp.pi), "positions": positions}
    c = {"0": "1", "pi": "-1"}[lam0]
    v0 = f"sqrt((1 + {eccentricity}*({c}))/(1 - {eccentricity}*({c})))"
    parameters = {"f": eccentricity, "h": f"sqrt(1 - {eccentricity}**2)", "k": "1"}
    return row(slug, "kepler", hard, parameters, {"lam0": lam0, "v0": v0}, expected)


# --- motions that do not repeat -------------------------------------------------------------------


def passage(
    slug: str,
    hard: str,
    track: str,
    parameters: dict[str, str],
    launch: Row,
    turns: list[mpf],
    *,
    clock: Clock,
    place: Function,
    speed: Function,
    start: mpf,
    heading: int,
) -> Row:
    """Pass once: u grows with time from ``start`` (heading 1), or first falls to 0, the turn."""
    marks = clock.marks()
    begun = clock.at(start, marks)
    last = marks[-1] + (-begun if heading > 0 else begun)
    growing = 1 if place(clock.knots[-1]) > place(clock.knots[0]) else -1
    positions = []
    for t in times(last, ("0.003", "0.07", "0.31", "0.42", "0.5", "0.58", "0.66", "0.75", "0.82", "0.9", "0.97")):
        elapsed = mpf(t) + begun if heading > 0 else mpf(t) - begun
        u = clock.when(abs(elapsed), marks)
        positions.append(position(t, place(u), growing * mp.sign(elapsed) * speed(u)))
    expected = {"kind": "transit", "turning_points": [text(turn) for turn in turns], "positions": positions}
    return row(slug, track, hard, parameters, launch, expected)


def off_a_hilltop(slug: str, hard: str, lam0: str, offset: mpf) -> Row:
    """Release on z = -(x - 1)**2 beside its top, with x - 1 = offset*cosh(u)."""
    end = mp.acosh(3 / abs(offset))
    root = mp.sqrt(2 * G)
    return passage(
        slug,
        hard,
        "hilltop",
        {},
        {"lam0": lam0},
        [1 + offset],
        clock=Clock(lambda u: mp.sqrt(1 + 4 * (offset * mp.cosh(u)) ** 2) / root, [end * k / 40 for k in range(41)]),
        place=lambda u: 1 + offset * mp.cosh(u),
        speed=lambda u: root * abs(offset) * mp.sinh(u),
        start=mpf(0),
        heading=1,
    )


def past_a_hilltop(slug: str, hard: str, lam0: str, offset: mpf, v0: str, least: mpf) -> Row:
    """Run over z = -(x - 1)**2 to the right, with V**2 = ``least`` on top and x - 1 = c*sinh(u), ``offset`` at
    launch.
    """
    c = mp.sqrt(least / (2 * G))
    root = mp.sqrt(2 * G)
    start = mp.asinh(offset / c)
    end = mp.asinh(3 / c)
    knots = [start + (end - start) * k / 60 for k in range(61)]
    return passage(
        slug,
        hard,
        "hilltop",
        {},
        {"lam0": lam0, "v0": v0},
        [],
        clock=Clock(lambda u: mp.sqrt(1 + 4 * (c * mp.sinh(u)) ** 2) / root, knots),
        place=lambda u: 1 + c * mp.sinh(u),
        speed=lambda u: root * c * mp.cosh(u),
        start=start,
        heading=1,
    )


def back_over_a_barrier(slug: str, hard: str, v0: str, energy: mpf) -> Row:
    """Launch up z = x**3 - 3*x from x = 1; the body turns beyond 2, comes back and passes the barrier at -1."""
    # With b the turn, V**2 = 2*g*(b - x)*((x + b/2)**2 + h**2), and x = b - u**2.
    b = 2 * mp.cosh(mp.acosh(energy / 2) / 3)
    h2 = 3 * (b**2 - 4) / 4

    def rate(u: mpf) -> mpf:
        x = b - u**2
        return 2 * mp.sqrt((1 + (3 * x**2 - 3) ** 2) / (2 * G * ((x + b / 2) ** 2 + h2)))

    crest, end = mp.sqrt(3 * b / 2), mp.sqrt(b + 4)
    before, after = graded(mp.sqrt(h2), crest), graded(mp.sqrt(h2), end - crest)
    knots = [*(crest - u for u in reversed(before)), *(crest + u for u in after[1:])]
    return passage(
        slug,
        hard,
        "cubic_well",
        {},
        {"lam0": "1", "v0": v0},
        [b],
        clock=Clock(rate, knots),
        place=lambda u: b - u**2,
        speed=lambda u: u * mp.sqrt(2 * G * ((b - u**2 + b / 2) ** 2 + h2)),
        start=mp.sqrt(b - 1),
        heading=-1,
    )


# --- all of them ----------------------------------------------------------------------------------


def pendulums() -> list[Row]:
    """Return pendulums of amplitudes from 5e-11 to pi - 1e-12, from both axes, of various sizes and gravities."""
    rows = []
    for share in ("5e-11", "1e-8", "1e-5", "1e-2", "1"):
        hard = f"amplitude {share}"
        rows.append(pendulum(hard, "circle", share, mpf(share)))
        rows.append(pendulum(hard, "pendulum", f"-pi/2 + {share}", mpf(share)))
    for share in ("1e-2", "1e-4", "1e-6", "1e-8", "1e-10", "1e-12"):
        hard = f"{share} below the hilltop"
        rows.append(pendulum(hard, "circle", f"pi - {share}", mp.pi - mpf(share)))
        rows.append(pendulum(hard, "pendulum", f"pi/2 - {share}", mp.pi - mpf(share)))
    for length in ("1e-6", "1e6"):
        rows.append(pendulum("scaled", "circle", "2", mpf(2), length=length))
    for g in ("1e-3", "1e6"):
        rows.append(pendulum("gravity", "pendulum", "-pi/2 + 6/5", mpf(6) / 5, g=g))
    return rows


def wells() -> list[Row]:
    """Return motions that barely miss or pass a barrier, shallow wells, and turning points that nearly coincide."""
    rel = mpf(10) ** -14
    root = mp.sqrt(mpf(1) / 2)
    tiny = mpf(5) * mpf(10) ** -11
    return [
        thrown_pendulum("hilltop_missed", "1e-14 short", "2*sqrt(9.81*(1 - 1e-14))", 2 * mp.sqrt(G * (1 - rel))),
        thrown_pendulum("hilltop_cleared", "1e-14 to spare", "2*sqrt(9.81*(1 + 1e-14))", 2 * mp.sqrt(G * (1 + rel))),
        in_one_well(
            "barrier_missed",
            "1e-14 short",
            "1",
            "1",
            {"lam0": "1/sqrt(2)", "v0": "sqrt(9.81/2*(1 - 1e-14))"},
            (1 - mp.sqrt(1 - rel)) / 2,
            mpf(1) / 2,
        ),
        over_both_wells(
            "barrier_cleared",
            "1e-14 to spare",
            "1",
            "1",
            {"lam0": "0", "v0": "sqrt(9.81/2*1e-14)"},
            (1 + mp.sqrt(1 + rel)) / 2,
            mpf(0),
        ),
        in_one_well("shallow_well", "1e-6 deep", "1", "1e-6", {"lam0": "1e-4"}, mpf("1e-8"), mpf(0)),
        over_both_wells(
            "shallow_wells_across", "a barrier of 2.5e-13", "1", "1e-6", {"lam0": "2e-3"}, mpf("4e-6"), mp.pi / 2
        ),
        in_one_well(
            "turns_almost_meet", "1e-10 apart", "1", "1", {"lam0": "1/sqrt(2) - 5e-11"}, (root - tiny) ** 2, mpf(0)
        ),
        in_one_well("small_wells", "scaled by 1e-6", "1e18", "1e6", {"lam0": "3e-7"}, mpf("9e-14"), mpf(0)),
        in_one_well("large_wells", "scaled by 1e6", "1e-18", "1e-6", {"lam0": "3e5"}, mpf("9e10"), mpf(0)),
    ]


def bottoms() -> list[Row]:
    """Return flat bottoms and steep ones."""
    return [
        bottom("quartic_1e_8", "flat, tiny", "quartic", {}, mpf(1), 4, "1e-8"),
        bottom("quartic_1e_3", "flat", "quartic", {}, mpf(1), 4, "1e-3"),
        bottom("quartic_1", "flat and steep", "quartic", {}, mpf(1), 4, "1"),
        bottom("sextic_1e_2", "very flat", "sextic", {}, mpf(1), 6, "1e-2"),
        bottom("sextic_0_9", "very flat and steep", "sextic", {}, mpf(1), 6, "0.9"),
        bottom("parabola_small", "scaled by 1e-6", "parabola", {"a": "1e6"}, mpf("1e6"), 2, "2e-6"),
        bottom("parabola_large", "scaled by 1e6", "parabola", {"a": "1e-6"}, mpf("1e-6"), 2, "2e6"),
    ]


def others() -> list[Row]:
    """Return cycloids, Kepler's ellipse, and motions that do not repeat."""
    return [
        cycloid("cycloid_late", "1e12 periods", "0.5", "1", mpf(1), (*SHARES, "1234567890123.4", "2000000000000.7")),
        cycloid("cycloid_small", "scaled by 1e-6", "5e-7", "0.3", mpf("0.3"), SHARES),
        kepler("kepler_from_periapsis", "rushes past the focus", "0.999", "0", mpf(0)),
        kepler("kepler_from_apoapsis", "rushes past the focus", "0.999", "pi", mp.pi),
        off_a_hilltop("hilltop_left_slowly", "1e-10 from the top, off zero", "1 + 1e-10", mpf("1e-10")),
        off_a_hilltop("hilltop_left", "0.01 from the top", "0.99", -mpf("0.01")),
        past_a_hilltop(
            "hilltop_passed",
            "1e-14 to spare",
            "-1",
            -mpf(2),
            "sqrt(8*9.81*(1 + 1e-14))",
            8 * G * mpf("1e-14"),
        ),
        past_a_hilltop(
            "hilltop_left_with_a_push",
            "1e-10 from the top, off zero",
            "1 + 1e-10",
            mpf("1e-10"),
            "1e-9",
            mpf("1e-18") - 2 * G * mpf("1e-20"),
        ),
        back_over_a_barrier(
            "barrier_cleared_after_a_turn",
            "1e-14 to spare",
            "sqrt(8*9.81*(1 + 1e-14))",
            2 + 4 * mpf("1e-14"),
        ),
        back_over_a_barrier("barrier_cleared_amply_after_a_turn", "", "9", mpf(81) / (2 * G) - 2),
    ]


def main() -> None:
    """Write the file beside this script."""
    target = Path(__file__).with_name("degenerate.json")
    cases = [*pendulums(), *wells(), *bottoms(), *others()]
    target.write_text(json.dumps(cases, indent=1) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
