"""Load maps over arrays keep their digits where heights cancel, reuse memory, and divide places into parts."""

from collections.abc import Callable
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf
from numba import njit

import gqm_sym as gqm
from gqm_sym.emission.load_map import rounded_size
from gqm_sym.errors import InputError
from gqm_sym.runtime.compiled import threads
from gqm_sym.runtime.compiled.streaming import LARGE, LINE, put
from gqm_sym.runtime.launch.speed import BLOCK

ModuleOf = Callable[[str], ModuleType]

# The tolerance in roundings (2**-53) of the larger of V**2 at launch and its change. Worst measured: 14.1 (circle),
# also by divided differences alone.
ROUNDINGS = 15
LEGION = LARGE // 8
# The tolerance in roundings (2**-53) of the rows of a spiral. Worst measured: 2.43 (curvature).
SPIRAL = 3


def drops(name: str, a: mpf, x: mpf) -> mpf:
    """Return the decrease of V**2 from a to x, with g = 9.81, by the closed form of the difference of heights."""
    g = mpf("9.81")
    if name != "parabola":
        return 4 * g * mp.sin((x - a) / 2) * mp.sin((x + a) / 2)
    return 2 * g * (x - a) * (x + a) * mpf("0.7")


TRACKS: dict[str, dict[str, Any]] = {"circle": {"L": 1}, "cycloid_plus": {"R": 1}, "parabola": {"a": "0.7"}}


@pytest.fixture(scope="module")
def circle(module_of: ModuleOf) -> Callable[..., Any]:
    """Return the load map of a circle."""
    return partial(module_of("circle").pass1, L=1)


@pytest.mark.sample(2)
@pytest.mark.parametrize("v0", [0.0, 1e-4, 0.3, 5.0])
@pytest.mark.parametrize("track", TRACKS)
def test_v2_keeps_its_digits(track: str, v0: float, module_of: ModuleOf) -> None:
    """V**2 keeps its digits next to the launch, on the other side of the well, and far from both: from rest, slowly and
    fast.
    """
    module, random = module_of(track), np.random.default_rng(3)
    for lam0 in (0.0, 1e-3, 0.5, 1.4, 2.9):
        gaps = 10.0 ** random.uniform(-14, 0, 40) * random.choice([-1, 1], 40)
        lam = np.concatenate([lam0 + gaps, -lam0 + gaps, random.uniform(-3, 3, 40)])
        v2 = module.pass1(lam, lam0, v0, **TRACKS[track]).v2
        with mp.workdps(40):
            for x, value in zip(lam, v2, strict=True):
                drop = drops(track, mpf(lam0), mpf(float(x)))
                allowed = ROUNDINGS * mpf(2) ** -53 * max(abs(drop), mpf(v0) ** 2)
                assert abs(mpf(float(value)) - (mpf(v0) ** 2 - drop)) <= allowed, (lam0, x)


def test_at_launch_v2_is_that_of_the_launch(circle: Callable[..., Any]) -> None:
    """At launch V**2 is that of the launch to the last bit, whatever the height."""
    for lam0 in (0.1, 1.2, 2.7):
        for v0 in (0.0, 0.7, 30.0):
            assert (circle(np.full(3, lam0), lam0, v0).v2 == v0**2).all()


def test_a_place_is_what_it_is_alone(circle: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """A place has the same bits whatever its neighbours, the threads and the way into memory, and from a list too."""
    lam = np.linspace(-3.0, 3.0, LEGION + 3)
    whole = circle(lam, 1.2, 0.4)
    for part in (slice(5, 5 + 3 * BLOCK), slice(LEGION - 40, LEGION + 3), slice(77, 78)):
        for row, alone in zip(whole, circle(lam[part], 1.2, 0.4), strict=True):
            assert (row[part] == alone).all()
    assert circle(lam[::10007].tolist(), 1.2, 0.4).v2.tolist() == whole.v2[::10007].tolist()
    monkeypatch.setattr(threads, "cores", lambda: 3)
    for row, spread in zip(whole, circle(lam, 1.2, 0.4), strict=True):
        assert (row == spread).all()


@pytest.mark.parametrize("size", [1, BLOCK + 1, LEGION + 5])
@pytest.mark.parametrize("offset", range(0, LINE, 3))
def test_arrays_are_filled_again(size: int, offset: int, circle: Callable[..., Any]) -> None:
    """Arrays are filled from end to end and not beyond, wherever they lie in memory."""
    lam = np.linspace(-3.0, 3.0, size)
    want = circle(lam, 0.5, 1.0)
    memory = np.full((6, size + 2 * LINE), 7.0)
    out = tuple(row[offset : offset + size] for row in memory)
    got = circle(lam, 0.5, 1.0, out=out)
    for row, array, given, around in zip(want, got, out, memory, strict=True):
        assert array is given
        assert (row == array).all()
        assert (np.delete(around, np.s_[offset : offset + size]) == 7.0).all()


def test_nothing_waits_between_streamed_rows() -> None:
    """The loop streams without interruption; arrays are counted before it, because that locks and would wait for the
    memory.
    """

    @njit(error_model="numpy")
    def three(to: np.ndarray, given: np.ndarray) -> None:
        for at in range(0, to.size, BLOCK):
            for k in range(3):
                put(to, at, given, k, BLOCK, True)

    to, given = np.empty(4 * BLOCK), np.arange(BLOCK + 3.0)
    three(to, given)
    assert (to.reshape(4, BLOCK) == given[2 : BLOCK + 2]).all()
    whole = three.inspect_llvm(three.signatures[0])
    code = whole[whole.index("define") :].split("\n}", 1)[0]
    assert "!nontemporal" in code
    assert code.count("@NRT_incref") <= 2


def test_a_result_is_filled_again(circle: Callable[..., Any]) -> None:
    """A result of any shape is filled again, of a dissipative model too, and its earlier contents are gone."""
    lam = np.linspace(-3.0, 3.0, 24).reshape(2, 3, 4)
    field = circle(lam, 0.5, 1.0)
    again = circle(lam.T.copy().T, 1.5, 0.0, out=field)
    assert all(one is other for one, other in zip(field, again, strict=True))
    assert (field.v2 == circle(lam, 1.5, 0.0).v2).all()
    one = circle(0.25, 0.5, 1.0)
    assert circle("1/2", 0.5, 1.0, out=one).x is one.x
    assert one.x == pytest.approx(np.sin(0.5), rel=1e-15)


def test_a_dissipative_result_is_filled_again(generated_folder: Any) -> None:
    """A dissipative result has the contents of a new one."""
    track = gqm.Curve.parametric(x="cos(u)", z="sin(u)", parameter="u")
    module = gqm.build(
        gqm.derive(track, gqm.Gravity() + gqm.QuadraticDrag()), name="loads_drag", folder=generated_folder
    )
    lam = np.linspace(-1.0, 0.0, 5)
    field = module.pass1(lam, -1.0, 5.0, b=0.1)
    again = module.pass1(lam, -1.0, 6.0, b=0.1, out=field)
    want = module.pass1(lam, -1.0, 6.0, b=0.1)
    assert again.v2 is field.v2
    assert (np.array(want) == np.array(field)).all()


def bad(which: int, array: Any) -> list[Any]:
    """Return six arrays of five places, one of them wrong."""
    return [array if k == which else np.empty(5) for k in range(6)]


SHARED = np.empty(9)
LAM = np.linspace(0.0, 1.0, 5)


@pytest.mark.parametrize(
    ("out", "said"),
    [
        (np.empty((6, 5)), r"out: must be 6 arrays \(x, z, .*\), as pass1 returns them; got ndarray"),
        (bad(0, None)[1:], "got 5 of them"),
        (bad(1, [0.0] * 5), "out: z is list; give an array of float64"),
        (bad(2, np.empty(5, dtype=np.float32)), "out: ds is an array of float32; give one of float64"),
        (bad(3, np.empty(4)), r"out: kappa has the shape \(4,\); the places have \(5,\)"),
        (bad(4, np.empty(10)[::2]), "out: v2 is not contiguous; give"),
        (bad(5, np.broadcast_to(np.zeros(1), 5)), "out: normal_force is not contiguous"),
        (bad(0, np.frombuffer(bytes(40))), "out: x is read-only; give"),
        (bad(0, np.zeros(48, dtype=np.uint8)[1:41].view(np.float64)), "out: x is not aligned in memory; give"),
        ([SHARED[:5], *bad(0, None)[1:5], SHARED[4:]], "out: x and normal_force share memory; give each array its own"),
        (bad(1, LAM), "out: z shares memory with the places; give it its own"),
    ],
)
def test_arrays_that_will_not_do_are_refused(out: Any, said: str, circle: Callable[..., Any]) -> None:
    """Wrong arrays are refused by name, with what would be right, before anything is written."""
    with pytest.raises(InputError, match=said):
        circle(LAM, 0.5, 1.0, out=out)
    assert (np.linspace(0.0, 1.0, 5) == LAM).all()


def test_a_spiral_over_its_sizes(generated_folder: Any) -> None:
    """All rows of a spiral are right to some roundings, for radii from 1e-130 to 1e130."""
    module = gqm.build(
        gqm.derive(gqm.families.log_spiral(), gqm.Gravity()), name="loads_spiral", folder=generated_folder
    )
    lam = np.concatenate([np.linspace(-1200.0, 1200.0, 61), np.linspace(-3.0, 3.0, 200)])
    field = module.pass1(lam, 1.0, 1.0, r0=1.5, b=0.25)  # so that the exponent is not rounded
    with mp.workdps(40):
        n = mp.sqrt(1 + mpf("0.0625"))
        for k, u in enumerate(map(mpf, lam.tolist())):
            r = mpf("1.5") * mp.exp(u / 4)
            truths = (r * mp.cos(u), r), (r * mp.sin(u), r), (n * r, n * r), (1 / (n * r), 1 / (n * r))
            for row, (truth, scale) in zip(field, truths, strict=False):
                assert abs(mpf(float(row[k])) - truth) <= SPIRAL * mpf(2) ** -53 * scale, (k, u)


U, A = sp.symbols("u a", real=True)


@pytest.mark.parametrize(
    ("form", "size"),
    [
        (A * sp.cos(U), sp.Abs(A) * sp.Abs(sp.cos(U))),
        (sp.cos(U / 4), sp.Abs(sp.cos(U / 4))),
        (sp.sin(3 * U), sp.Abs(sp.sin(3 * U)) + 3 * sp.Abs(U)),
        (U**4 - A * U**2, U**4 + sp.Abs(A) * U**2),
        (sp.exp(A * U) - 1, sp.exp(A * U) + 1),
        (sp.sqrt(1 - U**2), (1 + U**2) / sp.sqrt(sp.Abs(1 - U**2))),
        (1 / (1 + U), (1 + sp.Abs(U)) / sp.Abs(1 + U) ** 2),
        (sp.Abs(U - 1), 1 + sp.Abs(U)),
        (sp.sqrt(A), sp.sqrt(sp.Abs(A))),
        (sp.log(U), None),
        (U**A, None),
        (1 + sp.atan(U), None),
    ],
)
def test_sizes_of_what_is_rounded(form: sp.Expr, size: sp.Expr | None) -> None:
    """Sizes of sums are those of their parts; for waves the rounding of their argument counts too, and other functions
    have none.
    """
    found = rounded_size(form, U)
    if size is None:
        assert found is None
        return
    for u in (0.25, -0.7, 0.9):
        at = {U: sp.Float(u, 30), A: sp.Float("0.3", 30)}
        assert abs(sp.N((found - size).subs(at), 20)) < 1e-15


def test_a_potential_of_unknown_roundings(generated_folder: Any) -> None:
    """If roundings are unknown, V**2 comes from divided differences alone: here V**2 = 2 g log1p((x - a)/a), to its
    last digits.
    """
    model = gqm.derive(gqm.Curve.graph("-log(x)", parameter="x", domain=("1/100", None)), gqm.Gravity())
    module = gqm.build(model, name="loads_log", folder=generated_folder)
    assert module.MODEL.load_map is None
    lam = 0.5 + 10.0 ** np.linspace(-12, 1, 40)
    field = module.pass1(lam, 0.5, 0.0)
    with mp.workdps(40):
        for x, z, v2 in zip(lam, field.z, field.v2, strict=True):
            truth = 2 * mpf("9.81") * mp.log1p((mpf(float(x)) - mpf("0.5")) / mpf("0.5"))
            assert abs(mpf(float(v2)) - truth) <= ROUNDINGS * mpf(2) ** -53 * truth
            assert z == pytest.approx(-np.log(x), rel=1e-15, abs=1e-15)
