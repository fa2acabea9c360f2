"""Legs from turn to turn as one polynomial agree with closed forms with 28 digits, and with Taylor series."""

from functools import cache, partial
from itertools import accumulate, pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.optimize import minimize_scalar

import generated.circle_coulomb
import gqm_sym as gqm
from gqm_sym.runtime.legs.panels.equation import NODES, Forces, P, Q, W
from gqm_sym.runtime.legs.panels.polynomials import WIDE
from gqm_sym.runtime.legs.runs import whole_tables
from gqm_sym.runtime.legs.runs.whole_rows import WORK, move_v2

# The tolerance includes that tables, and sums with them, are rounded.
TABLE = 2e-15


def _power(n: int, phi: mpf) -> mpf:
    return mp.sin(phi / 2) ** (2 * n)


@pytest.mark.parametrize("blocks", whole_tables.BLOCKS)
def test_tables(blocks: int) -> None:
    """The tables are those of integrals of powers; V**2 = y**n - y**(n + 1) vanishes at both turns."""
    y, k = whole_tables.nodes(blocks)[0, :-1], np.arange(1, whole_tables.TERMS)
    for n in range(1, 16):
        force = n * y ** (n - 1) - (n + 1) * y**n
        ends = whole_tables.end_terms(blocks).T @ force
        binomial = [float(mp.binomial(n, m) - mp.binomial(n + 1, m)) for m in k]
        assert ends[0] == pytest.approx(0.0, abs=TABLE * n)
        loss = 1e-8 * blocks ** (2.0 * k - 1.0)  # derivatives lose digits
        assert (np.abs(ends[1:] - binomial) <= loss * (1.0 + np.abs(binomial))).all()
        assert whole_tables.factors(blocks).T @ force == pytest.approx(y ** (n - 1), abs=TABLE * n)
        assert whole_tables.means(blocks).T @ force == pytest.approx(
            np.append(y, 1.0) ** (n - 1) - np.append(y, 1.0) ** n, abs=TABLE * n
        )
        with mp.workdps(30):
            halves = [mp.quad(partial(_power, n), (a, a + mp.pi / 2), method="gauss-legendre") for a in (0, mp.pi / 2)]
        assert whole_tables.half_times(blocks).T @ y**n == pytest.approx([float(half) for half in halves], abs=TABLE)
        assert whole_tables.arrival_time(blocks).T @ y**n == pytest.approx([1 / (n + 0.5)], abs=TABLE)
    assert np.abs(whole_tables.coefficients(blocks).T @ np.ones(y.size) - np.eye(y.size)[0]).max() <= TABLE


@pytest.mark.parametrize("blocks", whole_tables.BLOCKS)
def test_v2_on_a_wider_leg(blocks: int) -> None:
    """V**2 moves with the width of the leg up to the square of the step; its second half was counted from the end."""
    v2, slope, y = (lambda d: np.sin(2.0 * d)), (lambda d: 2.0 * np.cos(2.0 * d)), whole_tables.nodes(blocks)[0]
    forces, half = Forces(0, np.zeros(1), True, False, False, False, -1, 0, 0), blocks * WIDE // 2
    turn = 0.5 * np.pi
    for step in (0.02, -0.02):
        h, work = turn / (1.0 + step), np.zeros(WORK)
        row = {
            name: slice(blocks * at, blocks * (at + WIDE)) for name, at in (("y", NODES), ("p", P), ("q", Q), ("w", W))
        }
        work[row["y"]] = y
        work[row["w"]] = v2(h * y) - np.where(np.arange(y.size) < half, 0.0, v2(h))
        work[row["q"]] = -0.1
        work[row["p"]] = -slope(h * y) - 0.1 * work[row["w"]]
        move_v2(forces, blocks, h, step, work)
        assert np.abs(work[row["w"]] - v2(turn * y)).max() <= 4.0 * step * step


@pytest.mark.parametrize(("grade", "blocks"), [(1, 1), (1, 2), (1, 3), (2, 2), (2, 3)])
def test_tables_in_phase(grade: int, blocks: int) -> None:
    """The tables for nodes in the variable of a grade integrate exp(-phi/3), which is no polynomial in the share of the
    way.
    """
    with mp.workdps(30):
        decay = mpf(1) / 3
        x = 2.0 * whole_tables.nodes(blocks)[0, :-1] - 1.0
        places = [(1 + mpf(place)) / 2 for place in x]
        phases = [*(mp.pi * (u if grade == 1 else 3 * u**2 - 2 * u**3) for u in places), mp.pi]
        shares = [mp.sin(phase / 2) ** 2 for phase in phases]
        # The integrals of the function over phi, and times sin(phi).
        plain = [(1 - mp.exp(-decay * phase)) / decay for phase in phases]
        swinging = [
            (1 - mp.exp(-decay * phase) * (mp.cos(phase) + decay * mp.sin(phase))) / (1 + decay**2) for phase in phases
        ]
        half = (1 - mp.exp(-decay * mp.pi / 2)) / decay
        arrival = (decay + mp.exp(-decay * mp.pi) / 2) / (decay**2 + mpf(1) / 4)
        values = np.array([float(mp.exp(-decay * phase)) for phase in phases[:-1]])
        means = [float(area / (2 * share)) for area, share in zip(swinging, shares, strict=True)]
        rates = [float(area / (2 * share)) for area, share in zip(plain, shares, strict=True)]
        # 1 - y for a force that begins with 1 and ends with -1 is the one with C = 1.
        force = np.array([float(mp.cos(phase)) for phase in phases[:-1]])
        products = [float(mp.sin(phase) ** 2 / 4) for phase in phases]
    # The nodes of `nodes` are rounded.
    assert whole_tables.phase_products(grade, blocks)[0] == pytest.approx(products, abs=TABLE)
    assert whole_tables.phase_nodes(grade, blocks)[0] == pytest.approx([float(share) for share in shares], abs=TABLE)
    assert whole_tables.phase_means(grade, blocks).T @ values == pytest.approx(means, abs=TABLE)
    assert whole_tables.mean_rates(grade, blocks).T @ values == pytest.approx(rates, rel=1e-11)
    assert whole_tables.phase_half_times(grade, blocks).T @ values == pytest.approx(
        [float(half), float(plain[-1] - half)]
    )
    assert whole_tables.phase_arrival_time(grade, blocks).T @ values == pytest.approx([float(arrival)], abs=TABLE)
    assert whole_tables.phase_factors(grade, blocks).T @ force == pytest.approx(np.ones(x.size), abs=TABLE)
    ends = whole_tables.phase_end_terms(grade, blocks).T @ values
    assert ends == pytest.approx([means[-1], float(mp.exp(-mp.pi / 3)), 0.0, 0.0, 0.0, 0.0], abs=4.0 * TABLE * blocks)
    for u in (1e-9, 0.3, 1.0):
        phase = whole_tables.phase_at(grade, u)
        assert whole_tables.variable_at(grade, phase) == pytest.approx(u, rel=4e-16)


class Pendulum:
    """A pendulum of length 1 with friction of its contact force, whose V**2 on a leg is elementary."""

    def __init__(self, mu: float) -> None:
        self.mu, self.g = mpf(mu), mpf("9.81")

    def v2(self, start: mpf) -> Any:
        """Return V**2 on the leg from rest at an angle, by W' = -2 g sin - k (W + g cos) with k = 2 mu v."""
        k = 2 * self.mu * (-1 if start > 0 else 1)
        b = -3 * k * self.g / (1 + k * k)
        a = 2 * self.g + k * b
        c = -(a * mp.cos(start) + b * mp.sin(start)) * mp.exp(k * start)
        return lambda x: a * mp.cos(x) + b * mp.sin(x) + c * mp.exp(-k * x)

    def turns(self, start: float) -> list[mpf]:
        """Return the launch and all turning points, by Newton's method on V**2 over the distance from the last one."""
        places = [mpf(start)]
        while abs(mp.tan(places[-1])) > self.mu:
            here, w = places[-1], self.v2(places[-1])
            x = -here + 2 * self.mu * mp.sign(here)
            for _ in range(60):
                x -= (step := w(x) / (mp.diff(w, x) - w(x) / (x - here)))
                if abs(step) < mpf(10) ** -24:
                    break
            places.append(x)
        return places

    def time(self, start: mpf, stop: mpf, x: mpf) -> mpf:
        """Return the time from one turn to a place before the next, with the roots at both ends substituted away."""
        w, middle, half = self.v2(start), (start + stop) / 2, (stop - start) / 2
        phi = mp.acos(min(max((middle - x) / half, -1), 1))
        return mp.quad(
            lambda p: abs(half) * mp.sin(p) / mp.sqrt(w(middle - half * mp.cos(p))),
            [0, phi / 2, phi],
            method="gauss-legendre",
        )


@pytest.mark.sample(2)
@pytest.mark.parametrize(("start", "mu"), [(1.4, 0.05), (-0.8, 0.04), (0.03, 0.004), (1.1, 0.2)])
def test_a_pendulum_with_friction(start: float, mu: float) -> None:
    """The place and the time of rest, the legs, and places on the first and the last of them agree with the closed
    form.
    """
    module: ModuleType = generated.circle_coulomb
    swept = {
        q: float(module.sweep(q, [start], 0.0, mu=mu, mu_static=mu, L=1).values[0])
        for q in ("rest_position", "t_end", "v_max")
    }
    with mp.workdps(28):
        pendulum = Pendulum(mu)
        turns = pendulum.turns(start)
        times = [pendulum.time(a, b, b) for a, b in pairwise(turns)]
        w = pendulum.v2(turns[0])
        fastest = mp.findroot(lambda x: mp.diff(w, x), 0.0)
        expected = {"rest_position": turns[-1], "t_end": mp.fsum(times), "v_max": mp.sqrt(w(fastest))}
        places = [a + (b - a) * share for a, b in pairwise(turns) for share in map(mpf, ("0.01", "0.3", "0.7", "0.98"))]
        some = [0, 1, 2, 3, -4, -3, -2, -1]
        starts = [t for k in range(len(times)) for t in [mp.fsum(times[:k])] * 4]
        legs = [pair for pair in pairwise(turns) for _ in range(4)]
        when = [float(starts[i] + pendulum.time(*legs[i], places[i])) for i in some]
        there = [float(places[i]) for i in some]
    ulp = float(np.spacing(abs(start)))
    for quantity, value in swept.items():
        assert value == pytest.approx(float(expected[quantity]), rel=2e-15, abs=1.5 * len(times) * ulp)
    motion = module.solve(start, 0.0, mu=mu, mu_static=mu, L=1)
    assert [leg.lam_end for leg in motion.legs] == pytest.approx([float(x) for x in turns[1:]], abs=9.0 * ulp)
    assert motion.lam(when) == pytest.approx(there, abs=9.0 * ulp)
    assert (np.abs(motion.lam(when) - there) <= motion.error_bound(when)).all()


class Slope:
    """A body that slides down a graph with friction, drag or the resistance of a droplet, by sums in 30 digits.

    With the slope z' and the sense v of the motion, ``dW/dx = -2 g (z' + mu v) - q' W`` with ``q = 2 mu v atan z'``, or
    with drag ``q = 2 c v s``. So ``exp(q) W`` is an integral from the last turn. On a droplet acts ``-2 b v |kappa|
    ds/dx``, where ``kappa ds/dx`` is the derivative of atan z'.
    """

    def __init__(self, slope: Any, force: str) -> None:
        self.slope, self.mu, self.g = slope, mpf(MU if force == "friction" else 0.0), mpf("9.81")
        self.is_droplet = force == "droplet"

    def exponent(self, x: mpf) -> Any:
        """Return v q; the arc length is that of the parabola z = x**2."""
        if self.mu > 0 or self.is_droplet:
            return 2 * self.mu * mp.atan(self.slope(x))
        return C_D * (x * mp.sqrt(1 + 4 * x * x) + mp.asinh(2 * x) / 2)

    def force(self, x: mpf, v: int) -> Any:
        """Return the rate of exp(q) W along the motion."""
        gained = -2 * v * self.g * (self.slope(x) + self.mu * v) * mp.exp(v * self.exponent(x))
        if self.is_droplet:
            gained -= 2 * GAMMA * mpf(ELL_C) ** 2 * abs(mp.diff(self.slope, x)) / (1 + self.slope(x) ** 2)
        return gained

    def gain(self, a: mpf, b: mpf, v: int, panels: int = 1, nodes: int = 24) -> Any:
        """Return the change of exp(q) W from a to b, by Gauss-Legendre rules."""
        half = (b - a) / (2 * panels)
        middles = [a + (2 * k + 1) * half for k in range(panels)]
        return v * half * mp.fsum(w * self.force(m + half * x, v) for m in middles for x, w in gauss_legendre(nodes))

    def v2(self, a: mpf, x: mpf, v: int) -> Any:
        """Return V**2 at x after a launch from rest at a."""
        return self.gain(a, x, v, 8) * mp.exp(-v * self.exponent(x))

    def largest_load(self, a: mpf, b: mpf) -> float:
        """Return the largest contact force per mass from a turn at a back to b."""

        def minus_load(x: float) -> float:
            ds = mp.sqrt(1 + self.slope(mpf(x)) ** 2)
            return -float(self.g / ds + mp.diff(self.slope, x) / ds**3 * self.v2(a, mpf(x), -1))

        places = np.linspace(float(b), float(a), 20)
        values = [minus_load(x) for x in places.tolist()]
        k = int(np.argmin(values))
        beside = places[max(k - 1, 0)], places[min(k + 1, 19)]
        inside = minimize_scalar(minus_load, bounds=beside, method="bounded", options={"xatol": 1e-9})
        return -min(values[k], float(inside.fun))

    def turn(self, a: mpf, v: int) -> Any:
        """Return where a body launched from rest at a turns, by Newton's method."""
        b = -a
        left = self.gain(a, b, v, 8)
        while True:
            step = -left / (v * self.force(b, v))
            left, b = left + self.gain(b, b + step, v, 8), b + step
            if abs(step) < mpf(10) ** -26:
                return b

    def time(self, a: mpf, b: mpf, v: int, share: Any = 1) -> Any:
        """Return the time from a turn at a to this share of the way to that at b.

        In a phase angle, which is pi at b, the rate of time is even and smooth. At nodes of equal steps it gives a
        series of cosines, which is integrated. V**2 is summed from the nearer turn, by rules of 10 nodes, since these
        parts are short.
        """
        n, h = 90, b - a
        phases = [mp.pi * (2 * j + 1) / (2 * n) for j in range(n)]
        places = [a + h * mp.sin(phase / 2) ** 2 for phase in phases]
        gained = list(accumulate(self.gain(*pair, v, nodes=10) for pair in pairwise([a, *places[: n // 2]])))
        lost = list(accumulate(self.gain(*pair, v, nodes=10) for pair in pairwise([b, *places[: n // 2 - 1 : -1]])))
        sums = [*gained, *reversed(lost)]
        rates = [
            abs(h) * mp.sin(phase) / 2 * mp.sqrt((1 + self.slope(x) ** 2) / (total * mp.exp(-v * self.exponent(x))))
            for phase, x, total in zip(phases, places, sums, strict=True)
        ]
        end = 2 * mp.asin(mp.sqrt(share))
        cosine = cosines(n)
        terms = [mp.fsum(r * cosine[(2 * j + 1) * k % (4 * n)] for j, r in enumerate(rates)) / n for k in range(n)]
        return terms[0] * end + 2 * mp.fsum(terms[k] * mp.sin(k * end) / k for k in range(1, n))


@cache
def cosines(n: int) -> list[mpf]:
    """Return the cosines of the multiples of pi/(2 n), up to 2 pi."""
    return [mp.cos(mp.pi * k / (2 * n)) for k in range(4 * n)]


@cache
def gauss_legendre(n: int) -> list[tuple[mpf, mpf]]:
    """Return nodes and weights of the Gauss-Legendre rule of n nodes."""
    pairs = []
    for guess in np.polynomial.legendre.leggauss(n)[0].tolist():
        x = mp.findroot(lambda x: mp.legendre(n, x), guess)
        pairs.append((x, 2 * (1 - x * x) / (n * mp.legendre(n - 1, x)) ** 2))
    return pairs


PARABOLA, WAVE = (lambda x: 2 * x), (lambda x: x + mpf(3) / 10 * mp.cos(3 * x))
MU, C_D, GAMMA, ELL_C = 0.125, 0.0625, 0.0625, 0.25
LAWS: dict[str, tuple[Any, dict[str, Any]]] = {
    "friction": (gqm.CoulombFriction(), {"mu": MU}),
    "drag": (gqm.QuadraticDrag(b="c_d"), {"c_d": C_D, "t_max": 10.0}),
    "droplet": (gqm.SurfaceTension(), {"gamma": GAMMA, "ell_c": ELL_C, "t_max": 10.0}),
}


@pytest.mark.extended
@pytest.mark.parametrize(
    ("height", "slope", "start", "force"),
    [
        ("x**2", PARABOLA, 0.6, "friction"),
        ("x**2", PARABOLA, 1.125, "friction"),
        ("x**2", PARABOLA, 1.0, "drag"),
        ("x**2", PARABOLA, 1.125, "droplet"),
        ("x**2/2+sin(3*x)/10", WAVE, 1.125, "droplet"),
        ("x**2/2+sin(3*x)/10", WAVE, 1.0, "friction"),
    ],
)
def test_graphs(height: str, slope: Any, start: float, force: str, generated_folder: Path) -> None:
    """Along curves that polynomials of degree 22 do not resolve, times, turns, extremes and places agree with sums."""
    name, (loss, given) = f"whole_{force}_{'parabola' if slope is PARABOLA else 'wave'}", LAWS[force]
    model = gqm.derive(gqm.Curve.graph(height), gqm.Gravity() + loss)
    module = gqm.build(model, name=name, folder=generated_folder)

    def swept(quantity: str, **more: Any) -> float:
        return float(module.sweep(quantity, [start], 0.0, **(given | more)).values[0])

    with mp.workdps(30):
        body = Slope(slope, force)
        places, times, v = [mpf(start)], [], -1
        while len(times) < (20 if force == "friction" else 1) and abs(slope(places[-1])) > body.mu:
            places.append(body.turn(places[-1], v))
            times.append(body.time(*places[-2:], v))
            v = -v
        if force == "friction":
            assert swept("t_end") == pytest.approx(float(mp.fsum(times)), rel=2e-15)
            assert swept("rest_position") == pytest.approx(float(places[-1]), rel=0.0, abs=1e-15)
        a, b = places[:2]
        lightest = min(body.g / mp.sqrt(1 + slope(x) ** 2) for x in places)  # where the body rests for a moment
        assert swept("normal_force_min") == pytest.approx(float(lightest), rel=2e-15)
        assert swept("normal_force_max") == pytest.approx(body.largest_load(a, b), rel=2e-15)
        fastest = mp.findroot(lambda x: mp.diff(lambda y: body.v2(a, y, -1), x), 0.0)
        assert swept("v_max") == pytest.approx(float(mp.sqrt(body.v2(a, fastest, -1))), rel=1e-15)
        motion = module.solve(start, 0.0, **given)
        assert motion.legs[0].lam_end == pytest.approx(float(b), rel=0.0, abs=1e-15)
        for share in map(mpf, ("0.0625", "0.5", "0.875")):
            place = a + (b - a) * share
            time = float(body.time(a, b, -1, share))
            for found in (motion.lam(time), module.solve(start, 0.0, **(given | {"t_max": time})).legs[0].lam_end):
                assert abs(found - place) <= min(motion.error_bound(time), 2e-15)
            assert swept("time_at", lam=float(place)) == pytest.approx(time, rel=2e-15)
            assert swept("normal_force_max", t_max=time) == pytest.approx(body.largest_load(a, place), rel=4e-15)
            if (place - fastest) * (a - fastest) > 0:
                v_there = float(mp.sqrt(body.v2(a, place, -1)))
                assert swept("v_max", t_max=time) == pytest.approx(v_there, rel=2e-15)


# Curves in space with the launch, friction and drag; the turns and times of three legs; a place on the first of them
# with its time; and the largest speed and contact force. The numbers are from Taylor series with 24 digits
# (mpmath.odefun), and midpoint rules in the phase angle.
IN_SPACE = [
    (
        "level_helix",
        ("2*t/5", "sin(t)", "-cos(t)"),
        ("0.8", "0.05", "0"),
        ("-0.6570348545712337020835", "0.5263777063732419757187", "-0.4046214985568049706883"),
        ("1.117003434902001027968", "1.104044419943094096118", "1.094657329943367260426"),
        ("0.362889543628629889375", "0.410940219593459029787"),
        ("2.23231775475114284322", "14.0884891366881986191"),
    ),
    (
        "viviani",
        ("1 + cos(t)", "sin(t)", "-2*cos(t/2)"),
        ("0.7", "0.05", "0.05"),
        ("-0.4618717513538408649637", "0.2479287040538638861815", "-0.04550740325550841154861"),
        ("1.458720071992155626145", "1.435358021766626787023", "1.423605735475332675321"),
        ("0.351438474593847740511", "0.543276950775226435115"),
        ("1.28077224514166470483", "10.7385253403899798651"),
    ),
    (
        "waves",
        ("t", "sin(2*t)/5", "t**2/2 + sin(3*t)/10"),
        ("0.7", "0.05", "0"),
        ("-0.7722785722083909732175", "0.3452111345166966029414", "-0.6029134860365929190459"),
        ("1.169940679239594121754", "1.022968676866387831532", "1.022219591069823456064"),
        ("0.258316428337482708035", "0.493767048870440062308"),
        ("2.46400771701974555907", "18.726109280290832263"),
    ),
]


@pytest.mark.extended
@pytest.mark.parametrize(("name", "curve", "given", "turns", "durations", "passage", "largest"), IN_SPACE)
def test_friction_in_space(
    name: str,
    curve: tuple[str, str, str],
    given: tuple[str, str, str],
    turns: tuple[str, ...],
    durations: tuple[str, ...],
    passage: tuple[str, str],
    largest: tuple[str, str],
    generated_folder: Path,
) -> None:
    """The law of friction on a space curve is not linear in V**2, and legs agree with Taylor series all the same."""
    x, y, z = curve
    force = gqm.Gravity() + gqm.CoulombFriction() + gqm.QuadraticDrag(b="c_d")
    model = gqm.derive(gqm.Curve.space(x=x, y=y, z=z, parameter="t"), force)
    module = gqm.build(model, name=f"whole_{name}", folder=generated_folder)
    start, mu, c_d = given
    legs = module.solve(start, 0, mu=mu, c_d=c_d, t_max=10).legs
    ends = accumulate(map(mpf, durations))
    for leg, place, end in zip(legs[: len(turns)], turns, ends, strict=True):
        assert leg.lam_end == pytest.approx(float(mpf(place)), abs=9.0 * float(np.spacing(float(start))))
        assert leg.t_end == pytest.approx(float(end), rel=1e-15)
    least = module.solve(start, 0, mu=mu, c_d=c_d, t_max=3).normal_force_min.value
    there, expected = {"lam": float(passage[0])}, (passage[1], *largest, repr(least))
    for quantity, value in zip(("time_at", "v_max", "normal_force_max", "normal_force_min"), expected, strict=True):
        asked = {"t_max": 3.0, **(there if quantity == "time_at" else {})}
        swept = module.sweep(quantity, [float(start)], 0.0, mu=float(mu), c_d=float(c_d), **asked)
        assert float(swept.values[0]) == pytest.approx(float(mpf(value)), rel=2e-15)
