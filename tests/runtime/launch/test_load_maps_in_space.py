"""Load maps of space curves have the contact force as a vector, with all digits also next to a launch from rest."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from mpmath import mp, mpf

import generated.viviani
import gqm_sym as gqm
from gqm_sym.runtime.launch.speed import BLOCK

# The tolerances relative to the largest contact force: of the rows, worst measured 3.5e-16, and of its length, worst
# measured 5.1e-16.
SCALE, OF_LENGTH = 4e-16, 8e-16
LAUNCH = 0.4


def exact(u: float, v0: float) -> list[mpf]:
    """Return y and the contact force on Viviani's curve (a = 1, g = 9.81, m = 1) from its derivatives."""
    with mp.workdps(40):
        at, half, g = mpf(u), mpf(u) / 2, mpf("9.81")
        first = [-mp.sin(at), mp.cos(at), mp.cos(half)]
        second = [-mp.cos(at), -mp.sin(at), -mp.sin(half) / 2]
        w = mpf(v0) ** 2 - 4 * g * (mp.sin(half) - mp.sin(mpf(LAUNCH) / 2))
        size = mp.sqrt(sum(a * a for a in first))
        ahead = [a / size for a in first]
        along = sum(a * b for a, b in zip(ahead, second, strict=True))
        bend = [(b - a * along) / size**2 for a, b in zip(ahead, second, strict=True)]
        up = [mpf(0), mpf(0), mpf(1)]
        force = [w * k + g * (e - ahead[2] * a) for k, e, a in zip(bend, up, ahead, strict=True)]
        return [mp.sin(at), *force]


@pytest.mark.parametrize("v0", [0.0, 1e-3, 9.0])
def test_the_contact_force_along_each_axis(v0: float) -> None:
    """Far from the launch and next to it, y and the contact force are those of the curve's derivatives."""
    random = np.random.default_rng(5)
    gaps = 10.0 ** random.uniform(-14, 0, 60) * random.choice([-1, 1], 60)
    lam = np.concatenate([random.uniform(-6, 6, 60), LAUNCH + gaps])
    path = generated.viviani.pass1(lam, LAUNCH, v0)
    found = np.array([path.y, path.normal_x, path.normal_y, path.normal_z])
    true = np.array([[float(value) for value in exact(u, v0)] for u in lam.tolist()]).T
    size = np.linalg.norm(true[1:], axis=0)
    assert np.all(np.abs(found - true) < SCALE * size.max())
    assert path.normal_force == pytest.approx(size, abs=OF_LENGTH * size.max(), rel=0)


def test_rows_do_not_depend_on_their_neighbours() -> None:
    """A place has the same numbers alone and among others, whether their V**2 comes by difference or not."""
    lam = np.concatenate([np.linspace(-1, 3, BLOCK + 9), [LAUNCH], LAUNCH + np.linspace(0, 1e-3, BLOCK)])
    together = np.array(generated.viviani.pass1(lam, LAUNCH, 0.0))
    alone = np.array([generated.viviani.pass1(u, LAUNCH, 0.0) for u in lam.tolist()])
    assert np.array_equal(together, alone.T)
    filled = generated.viviani.pass1(lam, LAUNCH, 0.0, out=[np.empty(lam.size) for _ in together])
    assert np.array_equal(together, filled)


@pytest.fixture(scope="module")
def banked(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a banked track through points."""
    u = np.linspace(0, 2, 41)
    points = np.stack([10 * u, 3 * np.sin(u), (u - 1) ** 2], axis=1)
    track = gqm.Curve.sampled(points, roll="coordinated", heartline="1")
    folder: Path = tmp_path_factory.mktemp("banked")
    return gqm.build(gqm.derive(track, gqm.Gravity()), name="banked_points", folder=folder)


def test_nothing_is_known_beyond_the_ends(banked: ModuleType) -> None:
    """Beyond the ends of a track through points all numbers are NaN, those of riders too."""
    path = banked.pass1(np.array([-1.0, 5.0, 1e3]), 5.0, 1.0)
    for row in path:
        assert np.isnan(row).tolist() == [True, False, True]
