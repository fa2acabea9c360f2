"""Make ``gradients.json``: how periods, turning points and times change with launch and parameters.

Run as ``python tests/data/make_gradients.py``. Everything is computed by mpmath at 60 digits from exact inputs: each
motion is found anew beside each of its numbers, and the difference quotient has some 30 digits, of which 25 are
written. The motions without losses are those of ``curves.json``, and of ``paper_cases.json`` on curves with formulas;
those with friction, drag and the resistance of a droplet are of ``paper_cases.json``. Nothing here imports ``gqm_sym``.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import sympy as sp
from mpmath import mp, mpf

mp.dps = 60

DIGITS = 25
STEP = mpf(10) ** -17
DATA = Path(__file__).parent

Numbers = dict[str, Any]


def derivatives(answer: Callable[[Numbers], list[Any]], given: Numbers, by: list[str]) -> dict[str, list[str]]:
    """Return the derivatives of some numbers by each name, as text."""
    found = {}
    for name in by:
        ends = [answer(given | {name: given[name] + sign * STEP}) for sign in (1, -1)]
        pairs = zip(*ends, strict=True)
        found[name] = [mp.nstr((up - down) / (2 * STEP), DIGITS, min_fixed=-6, max_fixed=6) for up, down in pairs]
    return found


class Path2D:
    """A curve with formulas: x, z and ds/dlam as functions of its parameter and of the numbers of its launch."""

    def __init__(self, kind: str, texts: list[str], parameter: str, names: list[str]) -> None:
        lam = sp.Symbol(parameter)
        symbols = {name: sp.Symbol(name) for name in names} | {parameter: lam}
        forms = [sp.sympify(text, locals=symbols) for text in texts]
        if kind == "graph":
            forms = [lam, forms[0]]
        elif kind == "polar":
            forms = [forms[0] * sp.cos(lam), forms[0] * sp.sin(lam)]
        x, z = forms
        arguments = [lam, *(symbols[name] for name in names)]
        speed = sp.sqrt(sp.diff(x, lam) ** 2 + sp.diff(z, lam) ** 2)
        self._names = names
        made = [sp.lambdify(arguments, form, "mpmath") for form in (x, z, sp.diff(z, lam), sp.diff(x, lam), speed)]
        self._x, self._z, self._rise, self._across, self._speed = made
        (dx, dz), (bend_x, bend_z) = ([sp.diff(form, lam, order) for form in (x, z)] for order in (1, 2))
        self._turn = sp.lambdify(arguments, sp.simplify((dx * bend_z - dz * bend_x) / speed**2), "mpmath")

    def _values(self, numbers: Numbers) -> list[Any]:
        return [numbers[name] for name in self._names]

    def x(self, lam: Any, numbers: Numbers) -> Any:
        """Return x at a place."""
        return self._x(lam, *self._values(numbers))

    def z(self, lam: Any, numbers: Numbers) -> Any:
        """Return z at a place."""
        return self._z(lam, *self._values(numbers))

    def slopes(self, lam: Any, numbers: Numbers) -> tuple[Any, Any]:
        """Return the derivatives of x and z."""
        values = self._values(numbers)
        return self._across(lam, *values), self._rise(lam, *values)

    def curvature(self, lam: Any, numbers: Numbers) -> Any:
        """Return the curvature times ds/dlam."""
        return self._turn(lam, *self._values(numbers))

    def speed(self, lam: Any, numbers: Numbers) -> Any:
        """Return ds/dlam at a place."""
        return self._speed(lam, *self._values(numbers))


def period(path: Path2D, energy: Callable[[Any, Any, Numbers], Any], guess: Any, lap: Any) -> Callable[..., list[Any]]:
    """Return the function that finds the half period, or the time of a lap, by the trapezoidal rule.

    Parameters
    ----------
    path : Path2D
        The curve.
    energy : callable
        ``f(x, z, numbers)`` gives the effective potential.
    guess : pair of numbers or None
        The turning points to some digits; None for a circulation.
    lap : number or None
        The length of a lap in the curve's parameter.
    """

    def w(lam: Any, numbers: Numbers) -> Any:
        start, here = ((path.x(at, numbers), path.z(at, numbers)) for at in (numbers["lam0"], lam))
        return numbers["v0"] ** 2 + 2 * (energy(*start, numbers) - energy(*here, numbers))

    def root(numbers: Numbers, near: Any) -> Any:
        if numbers["v0"] == 0 and abs(near - numbers["lam0"]) < mpf(10) ** -6:
            return numbers["lam0"]
        return mp.findroot(lambda lam: w(lam, numbers), (near, near * (1 + mpf(10) ** -12)), tol=mpf(10) ** -100)

    def converged(rate: Callable[[Any], Any], most: int) -> Any:
        last, n = mpf(0), 32
        while True:
            now = sum(rate((k + mpf(1) / 2) / n) for k in range(n)) / n
            if abs(now - last) <= mpf(10) ** -48 * abs(now):
                return now
            last, n = now, 2 * n
            if n > most:  # beside a closed curve there is one that is not closed
                return mp.quad(rate, mp.linspace(0, 1, 17))

    def found(numbers: Numbers) -> list[Any]:
        if guess is None:

            def lap_rate(u: Any) -> Any:
                lam = numbers["lam0"] + lap * u
                return lap * path.speed(lam, numbers) / mp.sqrt(w(lam, numbers))

            return [converged(lap_rate, 1024)]
        with mp.extradps(40):
            a, b = (root(numbers, near) for near in guess)

            def rate(u: Any) -> Any:
                lam = (a + b) / 2 - (b - a) / 2 * mp.cos(mp.pi * u)
                return mp.pi * (b - a) / 2 * mp.sin(mp.pi * u) * path.speed(lam, numbers) / mp.sqrt(w(lam, numbers))

            return [converged(rate, 8192)]

    return found


def transit(path: Path2D, to: Any) -> Callable[[Numbers], list[Any]]:
    """Return the function that finds the time from the launch to another place."""

    def found(numbers: Numbers) -> list[Any]:
        start = path.z(numbers["lam0"], numbers)

        def rate(lam: Any) -> Any:
            v2 = numbers["v0"] ** 2 + 2 * numbers["g"] * (start - path.z(lam, numbers))
            return path.speed(lam, numbers) / mp.sqrt(v2)

        return [abs(mp.quad(rate, mp.linspace(numbers["lam0"], to, 9)))]

    return found


def gravity(x: Any, z: Any, numbers: Numbers) -> Any:
    """Return the potential of gravity; that of a body that rolls, and in a rotating frame."""
    spin, beta = numbers.get("Omega", mpf(0)), numbers.get("beta", mpf(0))
    return (numbers["g"] * z - spin**2 * x**2 / 2) / (1 + beta)


def periodic(
    kind: str, texts: list[str], parameter: str, given: Numbers, names: list[str], expect: Numbers, lap: Any
) -> dict[str, Any]:
    """Return the entry of one periodic motion."""
    path = Path2D(kind, texts, parameter, names)
    swings = expect["kind"] == "libration"
    guess = [mpf(end) for end in expect["turning_points"]] if swings else None
    answer = period(path, gravity, guess, None if swings else mpf(lap))
    known, (value,) = mpf(expect["half_period" if swings else "loop_time"]), answer(given)
    if abs(value - known) > mpf(10) ** -30 * known:
        raise AssertionError(f"the period is not the known one: {value} and {known}")
    by = [name for name in given if name != "m" and not (name == "v0" and given["v0"] == 0)]
    found = derivatives(answer, given, by)
    return {"quantity": "half_period" if swings else "period", "by": {name: value for name, (value,) in found.items()}}


def arc(lam: Any, numbers: Numbers) -> Any:
    """Return the arc length at a place on a circle or an ellipse, the only curves here with drag."""
    if "L" in numbers:
        return numbers["L"] * lam
    return numbers["b_"] * mp.ellipe(lam, 1 - (numbers["a"] / numbers["b_"]) ** 2)


def turns(path: Path2D, events: list[Numbers]) -> Callable[[Numbers], list[Any]]:
    """Return the function that finds the turning points of a motion with losses, and at last its place of rest.

    With the tangent's angle alpha and the arc length s, dW/dlam + 2 q' W = -2 f for W = V**2 on a part of a leg, where
    q = h (nu mu alpha + b s/m) for the heading h and the sign nu of N, and f = (g z' + h nu mu g x' + h cd alpha').
    """

    def found(numbers: Numbers) -> list[Any]:
        mu, drag, drop = (numbers.get(name, mpf(0)) for name in ("mu", "b", "cd"))
        place, w, heading = numbers["lam0"], numbers["v0"] ** 2, numbers["heading"]

        def angle(lam: Any) -> Any:
            across, rise = path.slopes(lam, numbers)
            return mp.atan2(rise, across)

        def load(lam: Any, w: Any) -> Any:
            """Return N/m times ds/dlam."""
            return path.curvature(lam, numbers) * w + numbers["g"] * path.slopes(lam, numbers)[0]

        def after(lam: Any, nu: Any) -> Any:
            """Return W at a place ahead."""

            def exponent(at: Any) -> Any:
                return 2 * heading * (nu * mu * angle(at) + (drag / numbers["m"] * arc(at, numbers) if drag else 0))

            def pull(at: Any) -> Any:
                across, rise = path.slopes(at, numbers)
                force = numbers["g"] * (rise + heading * nu * mu * across)
                return 2 * (force + heading * drop * path.curvature(at, numbers)) * mp.exp(exponent(at))

            lost = mp.quad(pull, [place, (place + lam) / 2, lam])
            return mp.exp(-exponent(lam)) * (w * mp.exp(exponent(place)) - lost)

        nu, ends = mp.sign(load(place, w)), []
        for event in events:
            near, tol = mpf(event["lam"]), mpf(10) ** -80
            sides = near, near + mpf(10) ** -15
            if event["kind"] == "N_zero_crossing":
                at = mp.findroot(lambda lam, nu=nu: load(lam, after(lam, nu)), sides, tol=tol)
                place, w, nu = at, after(at, nu), -nu
            else:
                place = mp.findroot(lambda lam, nu=nu: after(lam, nu), sides, tol=tol)
                w, heading, nu = mpf(0), -heading, mp.sign(load(place, 0))
                ends.append(place)
        return ends

    return found


# The motions with losses, and the number of events that are followed.
LOSSES = {
    "table2_3a_coulomb_circle": 20,
    "table2_3b_coulomb_parabola_backward": 20,
    "table2_3c_coulomb_circle_N_negative": 6,
    "table2_4a_drag_circle": 6,
    "table2_4b_drag_ellipse_backward": 4,
    "table2_5a_droplet_circle": 5,
    "table2_5b_droplet_parabola": 5,
}


def losses() -> dict[str, Any]:
    """Return the derivatives of turning points of motions with losses of the paper's cases."""
    made = {}
    for case in json.loads((DATA / "paper_cases.json").read_text(encoding="ascii"))["cases"]:
        if case["id"] not in LOSSES:
            continue
        curve, force, start = case["curve"], case["kernel"]["params"], case["initial"]
        path = Path2D("parametric", [curve["x"], curve["z"]], curve["parameter"], list(curve["params"]))
        given = {name: mpf(value) for name, value in (curve["params"] | force).items()}
        given |= {"g": mpf(case["g"]), "m": mpf(case["m"]), "lam0": mpf(start["lam0"]), "v0": abs(mpf(start["V0"]))}
        events = case["expected"]["events"][: LOSSES[case["id"]]]
        given["heading"] = mpf(events[0]["direction"])
        answer = turns(path, events)
        for place, event in zip(answer(given), [e for e in events if e["kind"] != "N_zero_crossing"], strict=True):
            if abs(place - mpf(event["lam"])) > mpf(10) ** -30:
                raise AssertionError(f"{case['id']}: {place} is not {event['lam']}")
        unused = "heading", *(() if "b" in force else ("m",)), *(() if given["v0"] else ("v0",))
        by = [name for name in given if name not in unused]
        made[case["id"]] = {"quantity": "turning_points", "rests": case["expected"]["comes_to_rest"]}
        made[case["id"]] |= {"by": derivatives(answer, given, by)}
        print(case["id"], flush=True)
    return made


def corpus() -> dict[str, Any]:
    """Return the derivatives of the periods of the corpus' explicit curves, by name and number of the motion."""
    made = {}
    for entry in json.loads((DATA / "curves.json").read_text(encoding="ascii")):
        if entry["kind"] == "implicit":
            continue
        for count, motion in enumerate((entry, *entry.get("also", ())), start=1):
            names = list(entry["params"])
            given = {name: mpf(value) for name, value in entry["params"].items()} | {"g": mpf(entry["g"])}
            given |= {name: mpf(motion["launch"][name]) for name in ("lam0", "v0")}
            texts = [entry["x"], entry["z"]] if entry["kind"] == "parametric" else [entry["expr"]]
            if motion["expect"]["kind"] == "transit":
                path = Path2D(entry["kind"], texts, entry["parameter"], names)
                by = [name for name in given if not (name == "v0" and given["v0"] == 0)]
                found = derivatives(transit(path, mpf(motion["launch"]["to"])), given, by)
                rows = {name: value for name, (value,) in found.items()}
                made[f"{entry['name']}, {count}"] = {"quantity": "time_at", "by": rows}
                continue
            made[f"{entry['name']}, {count}"] = periodic(
                entry["kind"], texts, entry["parameter"], given, names, motion["expect"], entry["period"]
            )
            print(entry["name"], count, flush=True)
    return made


if __name__ == "__main__":
    rows = {"losses": losses(), "corpus": corpus()}
    (DATA / "gradients.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="ascii")
