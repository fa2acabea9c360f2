"""P, Q and the holding force in emitted modules agree with the textbook equation under friction, drag and
resistance.
"""

from collections.abc import Callable
from ctypes import CFUNCTYPE, POINTER, c_double, c_ssize_t, c_void_p
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from mpmath import mp, mpf
from textbook import DIGITS, Textbook

import gqm_sym as gqm
from gqm_sym.errors import ParameterError

# The tolerance in roundings (2**-53) of the size of the terms that a value is the sum of. Worst measured: 10.
ROUNDINGS = 16
SIGNS = [(1, 1), (1, -1), (-1, 1), (-1, -1)]
LINE = POINTER(c_double)


@dataclass(frozen=True, kw_only=True)
class Case:
    """A model, with values of its parameters as numbers and as definitions."""

    curve: Callable[[], gqm.Curve]
    force: Callable[[], gqm.Kernel]
    values: dict[str, str]
    truth: Callable[[], Textbook]
    places: tuple[str, ...] = ("0.3", "1.1", "2.9", "-0.7")
    flags: tuple[bool, bool, bool]


def gravity() -> gqm.Kernel:
    """Return the gravity of all cases."""
    return gqm.Gravity()


def cycloid_truth() -> Textbook:
    """Return all numbers but drag on an arch that is upside down, whose cusps are its ends."""
    r, k = mpf("0.5"), mpf("1.25")

    def push(x: mpf, z: mpf) -> tuple[mpf, mpf]:
        distance = mp.hypot(x, z - 3)
        return -k * x / distance**3, -mpf("9.81") - k * (z - 3) / distance**3

    return Textbook(
        x=lambda t: r * (t - mp.sin(t)),
        z=lambda t: -r * (1 - mp.cos(t)),
        push=push,
        resistance=lambda kappa: mpf("0.7") * mpf("0.2") * kappa / mpf("1.5"),
        mu=mpf("0.25"),
        mu_static=mpf("0.25"),
    )


def turning_truth() -> Textbook:
    """Return the numbers of a rough hoop that rotates."""
    omega = mpf("2.5")
    return Textbook(
        x=lambda t: mp.mpf("1.2") * mp.sin(t),
        z=lambda t: -mp.mpf("1.2") * mp.cos(t),
        push=lambda x, _: (omega**2 * x, -mpf("9.81")),
        mu=mpf("0.3"),
        mu_static=mpf("0.4"),
        spin=omega,
    )


CASES = {
    "sum on an ellipse": Case(
        curve=gqm.families.ellipse,
        force=lambda: (
            gravity() + gqm.CoulombFriction(mu_static="mu_s") + gqm.QuadraticDrag(b="c") + gqm.SurfaceTension()
        ),
        values={
            "a": "2",
            "b": "0.75",
            "mu": "0.15",
            "mu_s": "0.5",
            "c": "0.3",
            "gamma": "0.6",
            "ell_c": "0.5",
            "m": "2",
        },
        truth=lambda: Textbook(
            x=lambda t: 2 * mp.cos(t),
            z=lambda t: mpf("0.75") * mp.sin(t),
            resistance=lambda kappa: mpf("0.6") * mpf("0.25") / 2 * abs(kappa),
            drag=mpf("0.15"),
            mu=mpf("0.15"),
            mu_static=mpf("0.5"),
        ),
        flags=(True, False, True),
    ),
    "droplet and a linear law on a cubic": Case(
        curve=lambda: gqm.Curve.graph("x**3 - x", parameter="x"),
        force=lambda: gravity() + gqm.SurfaceTension() + gqm.Kernel.law("k*x*W - direction*q*z**2"),
        values={"gamma": "0.5", "ell_c": "1", "k": "0.125", "q": "0.75"},
        truth=lambda: Textbook(
            x=lambda t: t,
            z=lambda t: t**3 - t,
            resistance=lambda kappa: abs(kappa) / 2,
            law=lambda _, x, z, w, v: x * w / 8 - v * mpf("0.75") * z**2,
        ),
        flags=(False, True, True),
    ),
    "printed droplet, friction and a centre on a cycloid": Case(
        curve=lambda: gqm.families.cycloid(inverted=True),
        force=lambda: (
            gravity()
            + gqm.CoulombFriction()
            + gqm.SurfaceTension(form="printed")
            + gqm.CentralForce(centre=(0, 3), k="k_c")
        ),
        values={"R": "0.5", "mu": "0.25", "gamma": "0.7", "ell_c": "0.2", "k_c": "1.25", "m": "1.5"},
        truth=cycloid_truth,
        places=("0.3", "2.0", "3.1", "6.1"),
        flags=(True, False, True),
    ),
    "friction on a hoop that turns": Case(
        curve=gqm.families.circle,
        force=lambda: gravity() + gqm.CoulombFriction(mu_static="mu_s") + gqm.RotatingFrame(),
        values={"L": "1.2", "mu": "0.3", "mu_s": "0.4", "Omega": "2.5"},
        truth=turning_truth,
        flags=(True, False, False),
    ),
    "ball with drag and a law of its own in a parabola": Case(
        curve=gqm.families.parabola,
        force=lambda: (
            gravity() + gqm.Rolling(radius="rho") + gqm.QuadraticDrag() + gqm.Kernel.law("-direction*r/(1 + W/w1)")
        ),
        values={"a": "0.5", "beta": "2/5", "rho": "0.25", "b": "0.2", "r": "0.8", "w1": "2", "m": "1"},
        truth=lambda: Textbook(
            x=lambda t: t,
            z=lambda t: t**2 / 2,
            drag=mpf("0.2"),
            inertia=mpf("1.4"),
            law=lambda _l, _x, _z, w, v: -v * mpf("0.8") / (1 + w / 2),
        ).centre(mpf("0.25")),
        flags=(False, False, False),
    ),
}


class Loss:
    """The compiled functions of a dissipative module, called by address as the runtime calls them."""

    def __init__(self, module: ModuleType, values: dict[str, str]) -> None:
        self.dissipation = module.MODEL.dissipation.addresses(has_radius=False)
        given = module.PARAMETERS | values
        self.p = np.array([n.value for n in module.MODEL.numbers(tuple(given.values()))])

    def _fill(self, address: int, rows: int, lines: list[np.ndarray], numbers: list[float]) -> np.ndarray:
        out = np.full((rows, lines[0].size), np.nan)
        arrays = [*lines, *numbers, self.p, out]
        kinds = [LINE if isinstance(a, np.ndarray) else c_double for a in arrays]
        function = CFUNCTYPE(None, c_ssize_t, *kinds)(c_void_p.from_address(address).value)
        function(lines[0].size, *(a.ctypes.data_as(LINE) if isinstance(a, np.ndarray) else a for a in arrays))
        return out

    def drive(self, lam: float, w: float, v: int, nu: int) -> np.ndarray:
        """Return ds, P, Q, n0 and kappa at the second of two places."""
        lines = [np.array([0.5, lam]), np.array([1.0, w])]
        return self._fill(self.dissipation.speed_equation, 5, lines, [float(v), float(nu)])[:, 1]

    def hold(self, lam: float) -> np.ndarray:
        """Return A forwards and backwards from rest."""
        return self._fill(self.dissipation.static_balance, 2, [np.array([0.5, lam])], [])[:, 1]


@pytest.fixture(scope="module", params=CASES, ids=[name.replace(" ", "-") for name in CASES])
def case(request: pytest.FixtureRequest, generated_folder: Path) -> tuple[Case, Loss, Textbook]:
    """Return a row of the table, with its module built."""
    row = CASES[request.param]
    name = request.param.replace(" ", "_").replace(",", "")
    module = gqm.build(gqm.derive(row.curve(), row.force()), name=name, folder=generated_folder)
    with mp.workdps(DIGITS):
        return row, Loss(module, row.values), row.truth()


def near(actual: float, truth: mpf, size: mpf) -> None:
    """Check a number against the true one, in roundings of the size of its parts."""
    allowed = ROUNDINGS * mpf(2) ** -53 * (size + abs(truth))
    assert abs(mpf(float(actual)) - truth) <= allowed, (actual, mp.nstr(truth, 20))


@pytest.mark.sample(3)
def test_drive(case: tuple[Case, Loss, Textbook]) -> None:
    """Rows σ, n₀, κ are the curve's, and P - Q W is dW/dλ on a leg of either direction and with either sign of N."""
    row, loss, truth = case
    linear = row.flags[2]
    with mp.workdps(DIGITS):
        for text in row.places:
            lam = mpf(float(text))
            ds, _, _, kappa = truth.shape(lam)
            push, load = truth.forces(lam)
            for v, nu in SIGNS:
                for w in (0.0, 0.625, 7.5):
                    sign = None if truth.spin else nu
                    rows = loss.drive(float(lam), w, v, nu)
                    near(rows[0], ds, ds)
                    near(rows[3], load, mpf(20))
                    near(rows[4], kappa, abs(kappa))
                    actual = mpf(rows[1]) - mpf(rows[2]) * mpf(w)
                    near(actual, truth.rate(lam, mpf(w), v, sign), 2 * ds * (abs(push) + 20 + abs(kappa) * w))
                    # Q is minus the slope in W, and P is the remainder.
                    h = mpf(10) ** -12
                    if w:
                        slope = (truth.rate(lam, w + h, v, sign) - truth.rate(lam, w - h, v, sign)) / (2 * h)
                        near(rows[2], -slope, 2 * ds * (1 + abs(kappa)))
                    if linear:
                        assert (rows[1:3] == loss.drive(float(lam), 0.0, v, nu)[1:3]).all()


def test_hold(case: tuple[Case, Loss, Textbook]) -> None:
    """Static friction acts on a body at rest in both directions in which it may begin to move."""
    row, loss, truth = case
    with mp.workdps(DIGITS):
        for text in row.places:
            lam = mpf(float(text))
            for actual, v in zip(loss.hold(float(lam)), (1, -1), strict=True):
                near(actual, truth.acceleration(lam, mpf(0), v, held=True), mpf(20))


def test_flags(case: tuple[Case, Loss, Textbook]) -> None:
    """The flags that the runtime reads are those of the force."""
    row, loss, _ = case
    assert loss.dissipation[2:5] == row.flags


@pytest.fixture(scope="module")
def rough(generated_folder: Path) -> ModuleType:
    """Return a line with both kinds of friction, whose coefficients have no defaults."""
    force = gqm.Gravity() + gqm.CoulombFriction(mu_static="mu_s") + gqm.QuadraticDrag()
    return gqm.build(gqm.derive(gqm.Curve.graph("x/2"), force), name="rough_line", folder=generated_folder)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"mu": "-0.1"}, "mu: must be at least 0, got -0.1"),
        ({"mu_s": "0.1"}, "mu_s: must be at least mu = 0.2, got 0.1"),
        ({"b": -1}, "b: must be at least 0, got -1"),
        ({"m": 0}, "m: must be positive, got 0"),
    ],
)
def test_a_coefficient_out_of_its_range_is_refused(rough: ModuleType, wrong: dict[str, str], message: str) -> None:
    """A coefficient out of its range is refused when the module runs, and the message gives the bound."""
    given = {"mu": "0.2", "mu_s": "0.3", "b": "0.1", "g": "9.81", "m": "1"}
    assert rough.MODEL.numbers(tuple(given.values()))
    with pytest.raises(ParameterError, match=message):
        rough.MODEL.numbers(tuple((given | wrong).values()))


def test_static_friction_may_equal_sliding_friction(rough: ModuleType) -> None:
    """Static friction may equal sliding friction as a number, however both are written."""
    assert rough.MODEL.numbers(("1/5", "0.2", 0, "9.81", "1"))


def test_the_law_can_be_read_in_the_module() -> None:
    """The module contains the paper's second example as a person would write it, and no unnecessary function."""
    text = gqm.emit(gqm.derive(gqm.Curve.graph("x**3"), gqm.Gravity() + gqm.CoulombFriction()), name="example")
    for line in (
        "out[1, i] = 2*ds*(-mu*n0*nu*v + push)",
        "out[2, i] = 2*mu*nu*turn*v",
        "out[0, i] = -mu*fabs(n0) + push",
        "path_and_contact_force,",
        "dissipation=DissipativeFunctions(speed_equation, static_balance, friction=True, kinked=False, ",
        "at_least=(('mu', '0'),),",
        "W = V**2       = v0**2*exp(",
        "V**2: spectral antiderivative, no elementary form found",
    ):
        assert line in text
    for word in ("DIVDIFF", "place_from_ends", "intervals", "ExactFormulas", "exact_effective_potential"):
        assert word not in text


def test_names_of_the_law_may_be_the_user_s() -> None:
    """A track may have parameters with the names that emitted code uses."""
    curve = gqm.Curve.graph("nu*u**2 + ds*u + push", parameter="u")
    force = gqm.Gravity() + gqm.CoulombFriction(mu="kappa") + gqm.QuadraticDrag(b="v") + gqm.SurfaceTension(gamma="n0")
    text = gqm.emit(gqm.derive(curve, force), name="names")
    assert "def speed_equation(n, places, speeds, _v, _nu, p, out):" in text
    assert "_ds = sqrt(" in text
