"""Corners, jumps of curvature and powers without a side are refused with their place, or are right if they are
accepted.
"""

import math

import pytest
from mpmath import mp, mpf, quad

import gqm_sym as gqm
from gqm_sym.errors import DeclarationError, GQMError
from gqm_sym.specfile import read_spec

GRAVITY = gqm.Gravity()
CORNERS = ["abs(x)", "abs(x - a)", "sqrt(x**2)", "abs(x**2 - 1)", "sqrt(1 - cos(x))", "abs(sin(x))", "x + 2*abs(x)/3"]
SHARP = ["(x**2)**(2/3)", "(1 - cos(x))**(2/3)", "abs(x - a)**(3/2)", "(x**2 - 2*x + 1)**(2/3)", "abs(x**3)**(1/2)"]
JUMPS = ["x*abs(x)", "x**2 + x*abs(x)/2", "x**2*abs(x + 1)*(x + 1)"]
SMOOTH = [
    *("abs(x)**3", "(x**2)**(5/4)", "abs(x**2 + 1)", "abs(x**2 + x + 1)", "sqrt(x**2 + 1)", "x**2 + abs(a)"),
    *("(2 + cos(x))**(2/3)", "sqrt(1 - x**2)", "x**2*abs(x)", "abs(2 + sin(x))"),
]
CUSPS = ["(x**2)**(1/3)", "sqrt(abs(x))"]


def derived(text, domain=None, force=GRAVITY):
    """Derive the motion on a graph."""
    return gqm.derive(gqm.Curve.graph(text, domain=domain), force)


@pytest.mark.sample(8)
@pytest.mark.parametrize(
    ("text", "what"),
    [
        *((text, "tangent turns") for text in CORNERS),
        *((text, "curvature, and with it") for text in SHARP),
        *((text, "curvature jumps") for text in JUMPS),
    ],
)
def test_what_is_not_smooth_is_refused(text, what):
    """The message gives the place nearest to 0 where the limits from both sides differ, and a remedy."""
    with pytest.raises(DeclarationError, match=f"{what}.* at x = "):
        derived(text)


@pytest.mark.sample(6)
@pytest.mark.parametrize("text", [*SMOOTH, *CUSPS])
def test_what_is_smooth_or_a_cusp_passes(text):
    """Absolute values alone are no corner, and a motion that reaches a cusp ends there, as before."""
    derived(text)


@pytest.mark.sample(1)
@pytest.mark.parametrize("axis", ["x", "z"])
def test_a_cusp_inside_is_refused_with_a_radius(axis):
    """The centre would jump from one side of the cusp to the other; a motion went through it as if nothing were."""
    rolling = gqm.Gravity() + gqm.Rolling(radius="rho", beta="2/5")
    forms = {"x": "k*(u - sin(u))", "z": "-cos(u)"} if axis == "x" else {"x": "1 - cos(u)", "z": "k*(sin(u) - u)"}
    curve = gqm.Curve.parametric(**forms, parameter="u", parameters={"k": 1})
    gqm.derive(curve, gqm.Gravity())
    with pytest.raises(DeclarationError, match="a cusp at u = 0, where the centre"):
        gqm.derive(curve, rolling)
    inside = gqm.Curve.parametric(**forms, parameter="u", parameters={"k": 1}, domain=(0, "2*pi"))
    gqm.derive(inside, rolling)


@pytest.mark.parametrize(
    ("text", "degrees"),
    [("abs(x)", 90.0), ("3*abs(x)/4", 2 * math.degrees(math.atan(0.75))), ("x + abs(x)", math.degrees(math.atan(2)))],
)
def test_a_corner_is_described_by_its_angle(text, degrees):
    """The message gives the angle between the limits of the tangent."""
    with pytest.raises(DeclarationError, match=f"turns by {degrees:.3g} degrees at x = 0,"):
        derived(text)


@pytest.mark.sample(3)
@pytest.mark.parametrize("text", ["abs(x)", "(x**2)**(2/3)", "x**2 + x*abs(x)/2"])
@pytest.mark.parametrize("side", [1, -1])
def test_the_domain_may_end_there(text, side, tmp_path):
    """A domain may end at a corner: the fall to it takes the time of the quadrature, and ends with the domain."""
    domain = (0, None) if side > 0 else (None, 0)
    name = f"side_{abs(hash((text, side)))}"
    motion = gqm.build(derived(text, domain), name=name, folder=tmp_path).solve(f"{side}/2")
    height = {
        "abs(x)": lambda x: x,
        "(x**2)**(2/3)": lambda x: x ** (mpf(4) / 3),
        "x**2 + x*abs(x)/2": lambda x: (1 + side / mpf(2)) * x**2,
    }[text]
    with mp.workdps(30):
        drop = lambda x: 2 * mpf("9.81") * (height(mpf(1) / 2) - height(x))  # noqa: E731
        # With x = (1 - u**2)/2 the integrand has no root of V**2 at the launch.
        rate = lambda u: u * mp.sqrt((1 + mp.diff(height, (1 - u * u) / 2) ** 2) / drop((1 - u * u) / 2))  # noqa: E731
        time = quad(rate, [mpf("1e-12"), mpf("0.5"), 1 - mpf("1e-12")])
    (end,) = motion.events
    assert end.kind == "domain-end"
    assert end.lam == 0.0
    assert end.t == pytest.approx(float(time), rel=1e-9)


def test_a_file_has_the_place_in_its_message(tmp_path):
    """In a file a corner is reported as one of its mistakes."""
    path = tmp_path / "vee.yaml"
    path.write_text("name: vee\ncurve: {graph: {z: abs(x)}}\nkernel: {gravity: {}}\n")
    with pytest.raises(GQMError, match=r"vee.yaml:\d+:\d+: .*tangent turns by 90 degrees at x = 0"):
        read_spec(path).derive()


# Exponents


@pytest.mark.parametrize("text", ["x**n", "(1 + x)**n", "sin(x)**(2*n)", "x**(n/2) + x", "exp((x - 3)**n)"])
def test_a_power_that_needs_a_side_is_refused(text):
    """A power that is real for negative x only for some n is refused (the motion stopped where it need not)."""
    with pytest.raises(DeclarationError, match="real for some values of n only; write the exponent as a number"):
        derived(text)


def test_so_is_one_in_a_potential():
    """A power in a potential is refused if its values along the curve are not real."""
    with pytest.raises(DeclarationError, match=r"potential: .*write the exponent as a number"):
        gqm.derive(gqm.families.circle(), gqm.Potential("z**n"))
    gqm.derive(gqm.families.circle(), gqm.Potential("(x**2 + z**2)**(n/2)"))


@pytest.mark.parametrize(
    ("text", "domain"),
    [
        ("x**n", (0, None)),
        ("(a + x)**n", ("-a", None)),
        ("(1 + x**2)**n", None),
        ("2**(n*x)", None),
        ("x**2*2**n", None),
    ],
)
def test_a_power_with_a_side_passes(text, domain):
    """A power is accepted if its base is positive inside the domain."""
    derived(text, domain)


@pytest.mark.parametrize("n", [2, 3, "5/2"])
def test_a_power_with_a_side_is_right(n, tmp_path):
    """The time of a fall from 1/2 to the end of the domain agrees with quadrature."""
    module = gqm.build(derived("x**n", (0, None)), name="power_side", folder=tmp_path)
    (end,) = module.solve("1/2", n=n).events
    with mp.workdps(30):
        p = mpf(5) / 2 if n == "5/2" else mpf(n)
        rate = lambda x: mp.sqrt((1 + (p * x ** (p - 1)) ** 2) / (2 * mpf("9.81") * (mpf("0.5") ** p - x**p)))  # noqa: E731
        time = quad(lambda u: 2 * u * rate(abs(mpf("0.5") - u * u)), [mpf("1e-14"), mp.sqrt(mpf("0.5"))])
    assert end.kind == "domain-end"
    assert end.t == pytest.approx(float(time), rel=1e-12)
