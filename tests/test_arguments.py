"""Arguments of careless and hostile callers are refused by one clear error, or understood."""

import datetime
import math
import random
from decimal import Decimal
from fractions import Fraction
from functools import cache, partial
from importlib import import_module
from itertools import count

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from selection import examples

import gqm_sym as gqm
from gqm_sym.arguments import nearest
from gqm_sym.errors import ArgumentError, DeclarationError, GQMError, InputError
from gqm_sym.expressions import RESERVED_NAMES, check_module_name
from gqm_sym.runtime.charts.sampled import Sampled
from gqm_sym.specfile import read_spec

TRACK = gqm.Curve.graph("a*x**2", parameters={"a": 2})
FORCE = gqm.Gravity()
LINE = gqm.line(length=1)
ZIGZAG = [(0, 1), (1, 0), (2, 1)]

NOISY = [(x, x * (19 - x) / 90 + 1e-4 * (-1) ** x) for x in range(20)]
COIL = {"x": "cos(u)", "y": "sin(u)", "z": "u/4", "parameter": "u"}
SPACE = (*COIL, "period", "domain", "parameters", "title", "roll", "heartline")


@cache
def parabola():
    """Return a model, derived when it is first needed."""
    return gqm.derive(TRACK, FORCE)


THINGS = (
    *(None, True, 0, -1, 2.5, math.nan, math.inf, 1j, "", "a b", "x" * 5000, b"x", [], (1, 2, 3), {}, {1: 2}, set()),
    *(np.float64(2), np.int64(3), np.array([1.0, 2.0]), np.array([1j]), np.array(["a"]), object(), gqm.Gravity, LINE),
    *(TRACK, FORCE, np.zeros((2, 9)), range(10**6), ("x", "z"), float("-inf"), np.datetime64("2020-01-01")),
    *(np.timedelta64(1, "s"), pd.NA, 1e308),
)

CALLS = {
    "graph z": lambda v: gqm.Curve.graph(v),
    "graph parameter": lambda v: gqm.Curve.graph("x**2", parameter=v),
    "graph domain": lambda v: gqm.Curve.graph("x**2", domain=v),
    "graph end": lambda v: gqm.Curve.graph("x**2", domain=(v, 1)),
    "graph parameters": lambda v: gqm.Curve.graph("a*x**2", parameters=v),
    "graph default": lambda v: gqm.Curve.graph("a*x**2", parameters={"a": v}),
    "graph title": lambda v: gqm.Curve.graph("x**2", title=v),
    "graph positive": lambda v: gqm.Curve.graph("a*x**2", positive=v),
    "parametric x": lambda v: gqm.Curve.parametric(x=v, z="sin(u)", parameter="u"),
    "parametric period": lambda v: gqm.Curve.parametric(x="cos(u)", z="sin(u)", parameter="u", period=v),
    "polar r": lambda v: gqm.Curve.polar(v),
    "implicit F": lambda v: gqm.Curve.implicit(v, start=(1, 0)),
    "implicit start": lambda v: gqm.Curve.implicit("x**2 + z**2 - 1", start=v),
    "implicit start x": lambda v: gqm.Curve.implicit("x**2 + z**2 - 1", start=(v, 0)),
    "implicit tangent": lambda v: gqm.Curve.implicit("x**2 + z**2 - 1", start=(1, 0), tangent=v),
    "sampled": lambda v: gqm.Curve.sampled(v),
    "sampled z": lambda v: gqm.Curve.sampled([0, 1, 2], v),
    "sampled row": lambda v: gqm.Curve.sampled([v, (0, 1), (1, 0)]),
    "sampled value": lambda v: gqm.Curve.sampled([(v, 0), (1, 0), (2, 1)], kind="linear"),
    "sampled kind": lambda v: gqm.Curve.sampled(ZIGZAG, kind=v),
    "sampled closed": lambda v: gqm.Curve.sampled(ZIGZAG, kind="linear", closed=v),
    "sampled smoothing": lambda v: gqm.Curve.sampled(NOISY, smoothing=v),
    "sampled smooth value": lambda v: gqm.Curve.sampled([*NOISY, (20, v)], smoothing=1e-4),
    **{f"space {name}": lambda v, name=name: gqm.Curve.space(**COIL | {name: v}) for name in SPACE},
    "read_spec": lambda v: gqm.read_spec(v),
    "read_track": lambda v: gqm.read_track(v),
    "read_sweep": lambda v: gqm.read_sweep(v),
    "normal_force_at": lambda v: parabola().normal_force_at(v),
    "normal_force_vector_at": lambda v: parabola().normal_force_vector_at(v),
    "piecewise": lambda v: gqm.Curve.piecewise(v),
    "piecewise piece": lambda v: gqm.Curve.piecewise([v]),
    "piecewise start": lambda v: gqm.Curve.piecewise([LINE], start=v),
    "piecewise heading": lambda v: gqm.Curve.piecewise([LINE], heading=v),
    "piecewise closed": lambda v: gqm.Curve.piecewise([LINE], closed=v),
    "line": lambda v: gqm.line(length=v),
    "arc": lambda v: gqm.arc(radius=1, angle=v),
    "clothoid": lambda v: gqm.clothoid(length=1, kappa_start=v, kappa_end=0),
    "family argument": lambda v: gqm.families.ellipse(a=v),
    "family by place": lambda v: gqm.families.ellipse(v),
    "family inverted": lambda v: gqm.families.ellipse(inverted=v),
    "family parameter": lambda v: gqm.families.ellipse(parameter=v),
    "family domain": lambda v: gqm.families.ellipse(domain=v),
    "gravity": lambda v: gqm.Gravity(g=v),
    "gravity by place": lambda v: gqm.Gravity(v),
    "coulomb": lambda v: gqm.CoulombFriction(mu=v, mu_static=v),
    "rolling": lambda v: gqm.Rolling(beta=v, radius=v),
    "drag": lambda v: gqm.QuadraticDrag(b=v),
    "droplet": lambda v: gqm.SurfaceTension(form=v),
    "frame": lambda v: gqm.RotatingFrame(Omega=v),
    "potential": lambda v: gqm.Potential(v),
    "potential parameters": lambda v: gqm.Potential("k*x", parameters=v),
    "central": lambda v: gqm.CentralForce(centre=v),
    "central x": lambda v: gqm.CentralForce(centre=(v, 0)),
    "law": lambda v: gqm.Kernel.law(v),
    "plus": lambda v: FORCE + v,
    "plus, the other way": lambda v: v + FORCE,
    "derive curve": lambda v: gqm.derive(v, FORCE),
    "derive kernel": lambda v: gqm.derive(TRACK, v),
    "derive parameters": lambda v: gqm.derive(TRACK, FORCE, parameters=v),
    "derive default": lambda v: gqm.derive(TRACK, FORCE, parameters={"g": v}),
    "derive title": lambda v: gqm.derive(TRACK, FORCE, title=v),
}


@pytest.mark.parametrize("call", CALLS)
def test_whatever_is_given_is_understood_or_refused_clearly(call):
    """No error of Python's, NumPy's or SymPy's own is raised, and each message says what was wrong."""
    for thing in THINGS:
        try:
            CALLS[call](thing)
        except GQMError as error:
            assert ": " in str(error), (call, thing)
            assert len(str(error)) < 1000, (call, thing)


CIRCLE, DRAG = (import_module(f"generated.{name}") for name in ("circle", "circle_drag"))
SWUNG = np.linspace(0.0, 3.0, 12)
DIPS = {"t": SWUNG, "lam": 0.8 * np.cos(3.0 * SWUNG)}

# These are made when they are first needed, and are the same for all calls.
MOTIONS = {
    "libration": lambda: CIRCLE.solve(1, L=1),
    "circulation": lambda: CIRCLE.solve(0, 8, L=1),
    "rest": lambda: CIRCLE.solve(0, L=1),
    "lift-off": lambda: CIRCLE.solve(0, 5, L=1, contact="above"),
    "losses": lambda: DRAG.solve(1, 0, L=1, b="1/10"),
    "horizon": lambda: DRAG.solve(1, 0, L=1, b="1/10", t_max=2),
}

ASKED = {
    "lam": lambda m, v: m.lam(v),
    "state": lambda m, v: m.state(v),
    "time_at": lambda m, v: m.time_at(v),
    "error_bound": lambda m, v: m.error_bound(v),
    "energy": lambda m, v: m.energy(v),
    "events from": lambda m, v: m.events_between(v, 2),
    "period_to": lambda m, v: m.period_to(v),
    "gradient": lambda m, v: m.gradient(v),
    "gradient wrt": lambda m, v: m.gradient("v_max", v),
    "gradient lam": lambda m, v: m.gradient("time_at", "g", lam=v),
    "gradient order": lambda m, v: m.gradient("period", "g", order=v),
    "sensitivity": lambda m, v: m.sensitivity(v, "lam0"),
    "sensitivity wrt": lambda m, v: m.sensitivity(0.1, v),
    "fourier": lambda m, v: m.fourier(v, 3),
    "fourier n": lambda m, v: m.fourier("x", v),
    "to_xarray": lambda m, v: m.to_xarray(v),
}

LAUNCHED = {
    "solve lam0": lambda v: CIRCLE.solve(v, L=1),
    "solve v0": lambda v: CIRCLE.solve(0.5, v, L=1),
    "solve direction": lambda v: CIRCLE.solve(0.5, 1, v, L=1),
    "solve point": lambda v: CIRCLE.solve(point=v, L=1),
    "solve t_max": lambda v: CIRCLE.solve(0.5, L=1, t_max=v),
    "solve contact": lambda v: CIRCLE.solve(0.5, L=1, contact=v),
    "solve L": lambda v: CIRCLE.solve(0.5, L=v),
    "pass1 lam": lambda v: CIRCLE.pass1(v, lam0=0.5, L=1),
    "pass1 out": lambda v: CIRCLE.pass1([0.1, 0.2], lam0=0.5, L=1, out=v),
    "sweep quantity": lambda v: CIRCLE.sweep(v, 0.5, L=1),
    "sweep lam0": lambda v: CIRCLE.sweep("period", v, L=1),
    "sweep v0": lambda v: CIRCLE.sweep("v_max", 0.5, v, L=1),
    "sweep direction": lambda v: CIRCLE.sweep("v_max", 0.5, 1, v, L=1),
    "sweep L": lambda v: CIRCLE.sweep("period", [0.1, 0.2], L=v),
    "sweep lam": lambda v: CIRCLE.sweep("time_at", 0.5, lam=v, L=1),
    "sweep t_max": lambda v: CIRCLE.sweep("t_end", 0.5, t_max=v, L=1),
    "sweep contact": lambda v: CIRCLE.sweep("t_end", 0.5, contact=v, L=1),
    "sweep gradient": lambda v: CIRCLE.sweep("period", 0.5, gradient=v, L=1),
    "sweep client": lambda v: CIRCLE.sweep("period", 0.5, client=v, L=1),
    "equilibria": lambda v: CIRCLE.equilibria(between=v, L=1),
    "least_speed module": lambda v: gqm.least_speed(v, 0),
    "least_speed between": lambda v: gqm.least_speed(CIRCLE, 0, L=1, between=v),
    "least_speed contact": lambda v: gqm.least_speed(CIRCLE, 0, L=1, contact=v),
    "fit module": lambda v: gqm.fit(v, DIPS, {"L": 1}),
    "fit data": lambda v: gqm.fit(CIRCLE, v, {"L": 1}, lam0=0.8),
    "fit lam": lambda v: gqm.fit(CIRCLE, DIPS | {"lam": v}, {"L": 1}, lam0=0.8),
    "fit sigma": lambda v: gqm.fit(CIRCLE, DIPS | {"sigma": v}, {"L": 1}, lam0=0.8),
    "fit free": lambda v: gqm.fit(CIRCLE, DIPS, v, lam0=0.8),
    "fit limits": lambda v: gqm.fit(CIRCLE, DIPS, {"L": (0.5, v)}, lam0=0.8),
    "uncertainty module": lambda v: gqm.uncertainty(v, "period", {"L": (1, 0.1)}),
    "uncertainty quantity": lambda v: gqm.uncertainty(CIRCLE, v, {"L": (1, 0.1)}, samples=9, lam0=0.5),
    "uncertainty of": lambda v: gqm.uncertainty(CIRCLE, "period", v, samples=9, lam0=0.5, L=1),
    "uncertainty number": lambda v: gqm.uncertainty(CIRCLE, "period", {"L": v}, samples=9, lam0=0.5),
    "uncertainty seed": lambda v: gqm.uncertainty(CIRCLE, "period", {"L": (1, 0.1)}, samples=9, lam0=0.5, seed=v),
    "from_period law": lambda v: gqm.design.from_period(v),
    "from_period g": lambda v: gqm.design.from_period("2", g=v),
    "from_period parameters": lambda v: gqm.design.from_period("T", parameters=v),
    "from_load until": lambda v: gqm.design.from_load("1", 9, until=v),
    "constant_load": lambda v: gqm.design.constant_load(v, 12),
    "brachistochrone": lambda v: gqm.design.brachistochrone(v),
    "brachistochrone x": lambda v: gqm.design.brachistochrone((v, -1)),
    "minimise quantity": lambda v: gqm.design.minimise(v, TRACK, FORCE, free={"a": (1, 2, 3)}, lam0=1),
    "minimise track": lambda v: gqm.design.minimise("period", v, FORCE, free={"a": (1, 2, 3)}, lam0=1),
    "minimise limits": lambda v: gqm.design.minimise("period", None, FORCE, free={}, limits=v, lam0=1),
}

# Together with these, they raised errors of Python's, NumPy's or pandas' own.
HOSTILE = (
    *THINGS[:-10],
    *("pi", "30 deg", "5 kg", "1/0", "sqrt(-1)", "1e400", 1e308, 1e-320, 10**400, Fraction(1, 3), Decimal("NaN")),
    *(np.zeros((2, 3)), np.array([]), np.array([np.nan, np.inf, 1.0]), np.array([None]), np.ma.array([1.0], mask=[1])),
    *(pd.DataFrame({"a": [1.0, 2.0]}), pd.Series([1.0, 2.0]), pd.NA, pd.NaT, [[]], [None], frozenset([1])),
    *(np.timedelta64(1, "s"), datetime.timedelta(1), "time_at", ["L", "nope"], ("L", "L"), lambda t: t),
)


def refused_clearly(call, thing, shown):
    """Call something; an error must be one of the package's own and say what was wrong."""
    try:
        call(thing)
    except GQMError as error:
        assert ": " in str(error), (shown, thing)
        assert len(str(error)) < 1000, (shown, thing)


@pytest.mark.filterwarnings("ignore:Warning. converting a masked element")
@pytest.mark.parametrize("name", MOTIONS)
def test_whatever_a_motion_is_asked_is_answered_or_refused_clearly(name):
    """The questions are a sample with hostile times, places, names and numbers, another one for each motion."""
    motion, draw = MOTIONS[name](), random.Random(name)
    for call, ask in ASKED.items():
        for thing in draw.sample(HOSTILE, 4):
            refused_clearly(partial(ask, motion), thing, (name, call))


@pytest.mark.filterwarnings("ignore:Warning. converting a masked element")
def test_whatever_is_launched_is_understood_or_refused_clearly():
    """The calls are a sample of hostile launches, sweeps, fits, uncertainties and designs."""
    draw = random.Random(19)
    for name, call in LAUNCHED.items():
        for thing in draw.sample(HOSTILE, 3):
            refused_clearly(call, thing, name)


@pytest.mark.parametrize(
    ("asked", "thing"),
    [
        ("gradient", pd.Series([1.0, 2.0])),
        ("gradient order", np.array([1, 2])),
        ("to_xarray", np.zeros((2, 3))),
        ("sweep quantity", [[]]),
        ("sweep contact", pd.Series([1.0, 2.0])),
        ("sweep t_max", np.array([1.0, 2.0])),
        ("sweep client", 1),
        ("sweep L", np.array(["a"])),
        ("sweep L", np.array([1j])),
        ("solve direction", np.timedelta64(1, "s")),
        ("least_speed module", 1),
        ("least_speed between", 1.0),
        ("least_speed contact", pd.NA),
        ("fit module", 1),
        ("fit sigma", 1e-320),
        ("uncertainty module", 1),
        ("uncertainty seed", "1/0"),
        ("from_period law", 1e-320),
        ("from_period g", 1e-320),
        ("from_period parameters", 2.5),
        ("brachistochrone x", "1e400"),
        ("minimise limits", [1.0]),
    ],
)
def test_what_raised_errors_of_others_is_refused(asked, thing):
    """A random search of the calls above found each of these."""
    call = LAUNCHED[asked] if asked in LAUNCHED else partial(ASKED[asked], MOTIONS["libration"]())
    with pytest.raises(GQMError, match=": "):
        call(thing)


RISE = [(0, 0, 5), (1, 0.2, 4), (2, 0.1, 3), (3, 0, 3.5), (4, 0.3, 4), (5, 0, 4.5)]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: gqm.Curve.sampled(RISE, roll=count()), "sampled: roll: must be an angle for each point"),
        (lambda: gqm.Curve.sampled(RISE, roll=range(10**9)), "sampled: roll: must be an angle for each point"),
        (lambda: gqm.Curve.piecewise(range(10**9)), "piecewise: pieces: must be"),
        (lambda: gqm.Curve.piecewise([gqm.line(length=1)], start=count()), "piecewise: start: must be a pair"),
        (lambda: gqm.Train(length=1, cars=np.timedelta64(1, "s")), "train: cars: must be a whole number"),
    ],
)
def test_what_has_no_end_is_no_list(call, message):
    """Lists without end are refused (they filled the memory), and so is a span of time that is no whole number."""
    with pytest.raises(GQMError, match=f"^{message}"):
        call()


def test_questions_without_an_answer_take_no_time():
    """A circulation has no events in any period, whatever number of them is asked for."""
    assert CIRCLE.solve(0, 8, L=1).events_between(0, 1e17) == ()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: gqm.Gravity(9.81), r"write Gravity\(g=9.81\)"),
        (lambda: gqm.CoulombFriction(0.1, 0.2), r"write CoulombFriction\(mu=0.1, mu_static=0.2\)"),
        (lambda: gqm.families.circle(1), r"write families.circle\(L=1\)"),
        (lambda: gqm.line(2), r"write line\(length=2\)"),
        (lambda: gqm.Gravity(G=1.62), "no argument 'G'; did you mean 'g'?"),
        (lambda: gqm.CoulombFriction(nu=1), "it takes mu, mu_static"),
        (lambda: gqm.families.ellipse(c=1), "it takes a, b, parameter, domain, inverted"),
        (lambda: gqm.Curve.graph("x", domian=(0, 1)), "did you mean 'domain'?"),
        (lambda: gqm.QuadraticDrag(B="1"), "did you mean 'b'?"),
        (lambda: gqm.Curve.graph(), "'z' must be given"),
        (lambda: gqm.Curve.parametric("cos(u)", "sin(u)", "u"), r"write Curve.parametric\(x='cos\(u\)', z="),
        (lambda: gqm.Curve.parametric(x="cos(u)", z="sin(u)"), "'parameter' must be given"),
        (lambda: gqm.derive(TRACK), "'kernel' must be given"),
        (lambda: gqm.derive(TRACK, gqm.Gravity), r"call it first, as in Gravity\(\)"),
        (lambda: gqm.derive(gqm.families.circle, FORCE), r"call it first, as in circle\(\)"),
        (lambda: gqm.derive(FORCE, TRACK), "must be a curve"),
        (lambda: gqm.derive(TRACK, FORCE, paramters={}), "did you mean 'parameters'?"),
        (lambda: gqm.build(gqm.derive(TRACK, FORCE), "hill"), "write build"),
        (lambda: gqm.build(TRACK, name="hill"), "must be a model"),
        (lambda: gqm.build(TRACK, FORCE), "it takes model, name, folder, force"),
        (lambda: FORCE + 9.81, "must be two kernels"),
    ],
)
def test_the_message_names_the_remedy(call, message):
    """An argument error is still a TypeError where Python raises one, and says what to write instead."""
    with pytest.raises(ArgumentError, match=message) as raised:
        call()
    assert isinstance(raised.value, TypeError)
    assert isinstance(raised.value, DeclarationError)


def test_kernels_can_be_summed():
    """Python's sum() begins with 0, which may be added to a kernel."""
    assert sum([gqm.Gravity(), gqm.QuadraticDrag()]) == gqm.Gravity() + gqm.QuadraticDrag()


# Names


@pytest.mark.parametrize("name", sorted(RESERVED_NAMES))
def test_reserved_names_are_refused_everywhere(name, tmp_path):
    """In Python as in YAML reserved names are refused before anything is built; only a curve's own parameter may be
    called lam.
    """
    for declare in (
        lambda: gqm.Curve.graph(f"{name}*x**2"),
        lambda: gqm.Curve.implicit(f"x - {name}*z", start=(0, 0)),
        lambda: gqm.Potential(f"{name}*z"),
        lambda: gqm.Gravity(g=name),
        lambda: gqm.families.circle(L=name),
        lambda: gqm.Curve.piecewise([gqm.line(length=name)]),
    ):
        with pytest.raises(InputError, match="reserved"):
            declare()
    path = tmp_path / "curve.yaml"
    path.write_text(
        f"name: c\ncurve: {{graph: {{z: {name}*x**2}}}}\nkernel: {{gravity: {{}}}}\nparameters: {{{name}: 1}}\n"
    )
    with pytest.raises(InputError, match="reserved"):
        read_spec(path)


@pytest.mark.parametrize("name", ["numpy", "numba", "math", "json", "gqm_sym", "pytest", "sys", "class"])
def test_a_module_hides_no_other(name, tmp_path):
    """A name such as "numpy" is refused, because the module would be imported instead of NumPy from its folder."""
    with pytest.raises(InputError, match=name):
        gqm.build(gqm.derive(TRACK, FORCE), name=name, folder=tmp_path)
    path = tmp_path / "curve.yaml"
    path.write_text(f"name: {name}\ncurve: {{graph: {{z: x**2}}}}\nkernel: {{gravity: {{}}}}\n")
    with pytest.raises(InputError, match=f"curve.yaml:1:7: .*{name}"):
        read_spec(path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["curve.yaml"]


def test_a_module_of_ones_own_may_be_made_again(tmp_path, monkeypatch):
    """A module of the same name in the user's folder does not prevent generating it again."""
    (tmp_path / "my_own_track.py").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    assert check_module_name("my_own_track", where="name") == "my_own_track"


# Domains


@pytest.mark.parametrize("domain", [(1, 0), (1, 1), ("pi", 3), ("a", "-a"), (0, "a - 2")])
def test_a_reversed_domain_is_refused(domain):
    """A reversed domain is refused as soon as defaults give numbers for its ends."""
    for declare in (
        lambda: gqm.Curve.graph("a*x**2", domain=domain, parameters={"a": 2}),
        lambda: gqm.derive(gqm.Curve.graph("a*x**2", domain=domain), FORCE, parameters={"a": 2}),
    ):
        with pytest.raises(DeclarationError, match="lo < hi"):
            declare()


def test_an_undecided_domain_is_no_mistake():
    """Ends that are known at run time only are checked then."""
    assert gqm.Curve.graph("a*x**2", domain=("a", "-a")).domain[0].name == "a"


# Points


class Table(dict):
    """A substitute for a DataFrame, with all that `Curve.sampled` needs of one."""

    @property
    def columns(self):
        return list(self)


X = np.linspace(0.0, 3.0, 9)
Z = np.cos(X)


@pytest.mark.parametrize(
    "make",
    [
        lambda: gqm.Curve.sampled(X, Z),
        lambda: gqm.Curve.sampled(list(X), list(Z)),
        lambda: gqm.Curve.sampled(zip(X, Z, strict=True)),
        lambda: gqm.Curve.sampled({"x": X, "z": Z}),
        lambda: gqm.Curve.sampled(Table(time=X, X=X, z=Z)),
    ],
)
def test_points_are_taken_in_any_shape(make):
    """Rows, columns and tables give the same track."""
    assert make() == gqm.Curve.sampled(np.column_stack([X, Z]))


def test_a_data_frame_is_a_table():
    """A data frame may have other columns in addition to x and z."""
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"z": Z, "note": "a", "x": X})
    assert gqm.Curve.sampled(frame) == gqm.Curve.sampled(X, Z)
    assert gqm.Curve.sampled(frame["x"], frame["z"]) == gqm.Curve.sampled(X, Z)
    with pytest.raises(DeclarationError, match="columns x and z"):
        gqm.Curve.sampled(frame.rename(columns={"x": "distance"}))


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ((X, Z), r"Curve.sampled\(x, z\)"),
        (np.stack([X, Z]), r"Curve.sampled\(x, z\)"),
        ({"x": X, "y": Z}, "columns x and z"),
        ({"x": X, "z": Z[:-1]}, "one length"),
    ],
)
def test_points_in_the_wrong_shape_get_the_right_one(points, message):
    """Two rows of many numbers are refused, and the message says how to transpose them."""
    with pytest.raises(DeclarationError, match=message):
        gqm.Curve.sampled(points)


@pytest.mark.parametrize("degrees", [21, 30, 60, 89])
@pytest.mark.parametrize("count", [8, 40])
def test_a_zigzag_is_refused(degrees, count):
    """The spline's lengths do not converge through a zigzag (an error of SciPy's about collocation matrices was
    raised).
    """
    height = math.tan(math.radians(degrees / 2))
    with pytest.raises(DeclarationError, match=r"row 2: .*to and fro"):
        gqm.Curve.sampled([(i, height * (i % 2)) for i in range(count)])


@pytest.mark.filterwarnings("ignore::gqm_sym.errors.NoisyPointsWarning")
@examples(60)
@given(seed=st.integers(0, 10**6), noise=st.floats(0.0, 0.6), kind=st.sampled_from(["line", "ring"]))
def test_noisy_points_make_a_track_or_are_refused(seed, noise, kind):
    """Noise of any size gives a chart whose pieces have lengths, or one clear error."""
    random_ = random.Random(seed)
    count = random_.randrange(6, 30)
    angle = [2 * math.pi * i / count for i in range(count)]
    points = [(i, 0.0) for i in range(count)] if kind == "line" else [(math.cos(a), math.sin(a)) for a in angle]
    size = noise * math.dist(points[0], points[1])
    points = [(x + random_.gauss(0, size) * (kind == "ring"), z + random_.gauss(0, size)) for x, z in points]
    try:
        track = gqm.Curve.sampled(points, closed=kind == "ring").definition
        edges = np.asarray(Sampled(track.points, "spline", track.closed).chart(()).edges)
    except GQMError:
        return
    assert np.all(np.diff(edges) > 0)


def test_names_of_two_letters_are_suggested_too():
    """One of two letters may be wrong; nothing is suggested if no name is near."""
    assert nearest("vo", ("lam0", "v0", "direction")) == "v0"
    assert nearest("Lam", ("lam0", "v0")) == "lam0"
    assert nearest("q", ("lam0", "v0")) is None
    for make, hint in ((lambda: gqm.Gravty, "Gravity"), (lambda: gqm.families.circel, "circle")):
        with pytest.raises(AttributeError, match=f"did you mean {hint}"):
            make()
    with pytest.raises(AttributeError, match=r"'solve'$"):
        _ = gqm.solve


def test_a_file_of_points_is_to_be_read_first():
    """The name of a file is not taken for rows."""
    with pytest.raises(DeclarationError, match=r"got 'survey.csv'; read a file first"):
        gqm.Curve.sampled("survey.csv")
