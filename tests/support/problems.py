"""One table has conservative motions with known answers, for every test that needs reference values.

A track is a curve as a user declares it; a problem is a launch on a track with the expected results, their source, and
what makes it hard. Numbers are kept as text, which is exact. The reference values are read from the files in ``data/``
(their README says who made them).
"""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import sympy as sp
from mpmath import mp, mpf
from paths import DATA

DIGITS = 50


def number(text: str | float) -> mpf:
    """Return exactly what a number says, to 50 digits."""
    with mp.workdps(DIGITS):
        if isinstance(text, float):
            return mpf(text)
        return mpf(sp.sympify(text, rational=True).evalf(DIGITS))


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """A curve as it is declared, and in formulas for `naive`."""

    name: str
    x: str
    z: str
    parameter: str = "lam"
    parameters: tuple[str, ...] = ()
    domain: tuple[str, str] | None = None
    period: str | None = None
    family: str | None = None

    def declare(self) -> Any:
        """Declare the curve through the public interface: by family, as a graph or parametrically."""
        import gqm_sym as gqm

        if self.family is not None:
            return getattr(gqm.families, self.family)(parameter=self.parameter)
        if self.x == self.parameter:
            return gqm.Curve.graph(self.z, parameter=self.parameter, domain=self.domain)
        return gqm.Curve.parametric(
            x=self.x, z=self.z, parameter=self.parameter, period=self.period, domain=self.domain
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Position:
    """The place of the body at a time after launch; ``v`` is the signed ds/dt."""

    t: str
    lam: str
    v: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """The values of the speed field at one place."""

    lam: str
    v2: str
    kappa: str
    normal_force: str
    t_first_passage: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """A launch on a track and its answers."""

    slug: str
    track: str
    kind: str
    source: str
    hard: str = ""
    parameters: tuple[tuple[str, str], ...] = ()
    lam0: str | float = "0"
    v0: str = "0"
    direction: int = 1
    half_period: str | None = None
    loop_time: str | None = None
    turning_points: tuple[str, ...] | None = ()  # None: the source does not say
    first_turn: str | None = None
    end: tuple[str, str] | None = None
    passage: tuple[str, str] | None = None
    contact_changes: tuple[str, ...] = ()
    positions: tuple[Position, ...] = ()
    samples: tuple[Sample, ...] = ()

    @property
    def launch(self) -> dict[str, Any]:
        """Return the arguments of ``module.solve``."""
        start = {"lam0": self.lam0, "v0": self.v0, "direction": self.direction}
        return start | dict(self.parameters)

    @property
    def period(self) -> float:
        """Return the period, which is infinite if there is none."""
        if self.half_period is not None:
            return 2 * float(self.half_period)
        return math.inf if self.loop_time is None else float(self.loop_time)

    def within(self, periods: float) -> tuple[Position, ...]:
        """Return the positions of the first so many periods."""
        return tuple(p for p in self.positions if float(p.t) <= periods * self.period)


TRACKS = {
    track.name: track
    for track in (
        Track(
            name="pendulum",
            x="L*cos(lam)",
            z="L*sin(lam)",
            parameters=("L",),
            period="2*pi",
        ),
        Track(
            name="circle",
            x="L*sin(lam)",
            z="-L*cos(lam)",
            parameters=("L",),
            period="2*pi",
            family="circle",
        ),
        Track(
            name="ellipse",
            x="a*cos(lam)",
            z="b*sin(lam)",
            parameters=("a", "b"),
            period="2*pi",
            family="ellipse",
        ),
        Track(name="parabola", x="lam", z="a*lam**2", parameters=("a",), family="parabola"),
        Track(name="catenary", x="lam", z="c*cosh(lam/c)", parameters=("c",), family="catenary"),
        Track(
            name="cycloid_arch",
            x="R*(lam - sin(lam))",
            z="R*(1 - cos(lam))",
            parameters=("R",),
            domain=("0", "2*pi"),
            family="cycloid",
        ),
        Track(
            name="cycloid_inverted",
            x="R*(lam - sin(lam))",
            z="-R*(1 - cos(lam))",
            parameters=("R",),
            domain=("0", "2*pi"),
        ),
        Track(
            name="cycloid_plus",
            x="R*(lam + sin(lam))",
            z="R*(1 - cos(lam))",
            parameters=("R",),
            domain=("-pi", "pi"),
        ),
        Track(name="bowl", x="lam", z="lam**4/4 + lam**3/10 + lam**2/2"),
        Track(name="quartic", x="lam", z="lam**4"),
        Track(name="cubic", x="lam", z="lam**3"),
        Track(name="double_well", x="lam", z="lam**4 - lam**2"),
        Track(name="line", x="lam", z="k*lam + c", parameters=("k", "c")),
        Track(
            name="frequency",
            x="lam",
            z="-a*sqrt(2*pi)*exp(-lam**2/2)",
            parameters=("a",),
            domain=("-5", "5"),
        ),
    )
}

# The track and the difficulty of the cases taken from paper_cases.json; the others there have forces that are not
# conservative gravity.
PAPER = {
    "example1_pendulum": ("pendulum", "exact launch, 1e9 s"),
    "table3_1_graph": ("bowl", ""),
    "table3_2_circle": ("circle", "launched downwards"),
    "table3_3_ellipse": ("ellipse", ""),
    "table3_4_parabola": ("parabola", ""),
    "table3_6_catenary": ("catenary", ""),
    "table3_7b_cycloid_inverted_of_table": ("cycloid_inverted", "cusps at both ends"),
    "table3_7c_cycloid_plus": ("cycloid_plus", "cusps at both ends"),
    "table3_7a_cycloid_as_printed": ("cycloid_arch", "ends at a cusp"),
    "table2_1a_frictionless_circle": ("circle", "contact force changes sign"),
    "table2_1b_frictionless_quartic": ("quartic", "no curvature at the bottom"),
}

# The curves of the corpus that are declared as one of the tracks, and the names of their parameters.
CORPUS = {
    "Circle": ("pendulum", {"R": "L"}),
    "Ellipse": ("ellipse", {}),
    "Catenary": ("catenary", {"a": "c"}),
    "Cycloid": ("cycloid_inverted", {}),
    "Straight line": ("line", {}),
    "Frequency curve": ("frequency", {}),
}

HARD = {
    "pendulum_almost_upright": "1e-3 below the hilltop",
    "pendulum_almost_upright_from_the_horizontal": "1e-3 below the hilltop, far from zero",
    "pendulum_nearly_upright": "1e-6 below the hilltop",
    "pendulum_nearly_upright_from_the_horizontal": "1e-6 below the hilltop, far from zero",
    "pendulum_tiny_swing": "heights equal to 12 digits",
    "pendulum_tiny_swing_from_the_horizontal": "a short arc whose parameter is far from zero",
    "pendulum_at_the_float_below_the_hilltop": "6e-17 below the hilltop",
    "pendulum_barely_loops": "speed 3e-6 above the separatrix's",
    "pendulum_barely_fails_to_loop": "speed 1e-5 below the separatrix's",
    "pendulum_launched_to_the_hilltop": "exactly on the separatrix",
    "pendulum_on_the_hilltop": "rests only if the launch is exact",
    "circle_on_the_hilltop": "rests only if the launch is exact",
    "double_well_on_the_barrier": "unstable",
    "double_well_in_a_well": "an irrational place of rest",
    "double_well_just_below": "1e-6 below the barrier",
    "double_well_just_below_on_the_left": "1e-12 below the barrier",
    "double_well_just_above": "5e-8 above the barrier",
    "double_well_released_level_with_the_barrier": "exactly on the separatrix",
    "quartic_small_swing": "flat to fourth order",
    "parabola_tiny_swing": "heights equal to 12 digits",
    "parabola_tall_swing": "steep",
    "tautochrone_tiny_swing": "a short arc whose parameter is far from zero",
    "tautochrone_almost_from_the_cusp": "starts beside a cusp",
    "cubic_turns_once": "one turning point, then without end",
}


def _read(name: str) -> Any:
    return json.loads((DATA / name).read_text(encoding="ascii"))


def _met(points: list[str], lam0: float, v0: str, direction: int) -> tuple[str, ...]:
    """Return turning points in the order in which they are met; a launch from rest is at the first of them."""
    if float(v0) == 0:
        return tuple(sorted(points, key=lambda point: abs(float(point) - lam0)))
    return tuple(sorted(points, key=float, reverse=direction > 0))


def _paper() -> Iterator[Problem]:
    cases = {case["id"]: case for case in _read("paper_cases.json")["cases"]}
    for slug, (track, hard) in PAPER.items():
        case = cases[slug]
        initial, expected = case["initial"], case["expected"]
        speed = initial["V0"]
        direction = -1 if speed.startswith("-") else 1
        points = [point["lam"] for point in expected["turning_points"]]
        given = case["curve"]["params"] | {"m": str(case["m"]), "g": str(case["g"])}
        end = expected.get("time_to_cusp_lam0")
        yield Problem(
            slug=slug,
            track=track,
            kind="libration" if expected["orbit"] == "oscillation" else "transit",
            source="paper_cases.json",
            hard=hard,
            parameters=tuple(given.items()),
            lam0=initial["lam0"],
            v0=speed.removeprefix("-"),
            direction=direction,
            half_period=expected.get("half_period"),
            turning_points=_met(points, float(number(initial["lam0"])), speed, direction),
            first_turn=expected["time_to_first_turning_point"],
            end=None if end is None else ("cusp", end),
            contact_changes=tuple(row["lam"] for row in expected.get("N_zero_crossings", ())),
            positions=tuple(Position(t=row["t"], lam=row["lam"], v=row["V"]) for row in expected["positions"]),
            samples=tuple(
                Sample(
                    lam=row["lam"],
                    v2=row["V2"],
                    kappa=row["kappa"],
                    normal_force=row["N"],
                    t_first_passage=row.get("t_first_passage"),
                )
                for row in expected["pass1"]
            ),
        )


def _corpus() -> Iterator[Problem]:
    curves = {curve["name"]: curve for curve in _read("curves.json")}
    for name, (track, renamed) in CORPUS.items():
        curve = curves[name]
        given = {renamed.get(key, key): value for key, value in curve["params"].items()}
        given |= {"m": curve["m"], "g": curve["g"]}
        for count, motion in enumerate((curve, *curve.get("also", ()))):
            launch, expected = motion["launch"], motion["expect"]
            points = expected.get("turning_points", [])
            lam0, v0, direction = launch["lam0"], launch["v0"], launch["direction"]
            transit = expected.get("transit_time")
            # A transit was only followed to the place of its timing, and may turn beyond.
            met = _met(points, float(lam0), v0, direction) if transit is None else None
            yield Problem(
                slug=f"corpus_{name.lower().replace(' ', '_')}_{count + 1}",
                track=track,
                kind=expected["kind"],
                source="curves.json",
                parameters=tuple(given.items()),
                lam0=lam0,
                v0=v0,
                direction=direction,
                half_period=expected.get("half_period"),
                loop_time=expected.get("loop_time"),
                turning_points=met,
                passage=None if transit is None else (launch["to"], transit),
                positions=tuple(Position(t=row["t"], lam=row["lam"], v=row["v"]) for row in expected["positions"]),
                samples=tuple(
                    Sample(**{key: row[key] for key in ("lam", "v2", "kappa", "normal_force")})
                    for row in expected["samples"]
                ),
            )


def _closed_forms() -> Iterator[Problem]:
    for case in _read("closed_forms.json"):
        expected = case["expected"]
        lam0 = case["launch"]["lam0"]
        yield Problem(
            slug=case["slug"],
            track=case["track"],
            kind=expected["kind"],
            source="closed_forms.json",
            hard=HARD.get(case["slug"], ""),
            parameters=tuple(case["parameters"].items()),
            lam0=math.pi / 2 if lam0 == "float(pi/2)" else lam0,
            v0=case["launch"].get("v0", "0"),
            half_period=expected.get("half_period"),
            loop_time=expected.get("loop_time"),
            turning_points=tuple(expected["turning_points"]),
            positions=tuple(Position(**row) for row in expected["positions"]),
            samples=tuple(Sample(**row) for row in expected["samples"]),
        )


PROBLEMS = {problem.slug: problem for problem in (*_paper(), *_corpus(), *_closed_forms())}


def where(**wanted: Any) -> list[Problem]:
    """Return the problems whose fields have the given values; True and False ask for filled and empty ones."""

    def fits(problem: Problem) -> bool:
        return all(
            bool(getattr(problem, key)) is value if isinstance(value, bool) else getattr(problem, key) == value
            for key, value in wanted.items()
        )

    return [problem for problem in PROBLEMS.values() if fits(problem)]
