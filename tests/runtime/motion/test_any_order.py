"""The answers of a motion without losses do not depend on earlier questions."""

import pickle
from collections.abc import Callable
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from generated import catenary, double_well, superellipse

ModuleOf = Callable[[str], ModuleType]

# The launch is so slow, 2e-24 m from the turn, that doubles took the time to the turn for negative.
BESIDE_TURN = {
    "lam0": 5.672834743747337,
    "v0": 1.4288970094889906e-11,
    "c": 0.2533108630613427,
    "g": 4.0791236336312915,
}

# A row has a track and a launch: an orbit for each tier of arithmetic, formulas and a chart, and an approach to an
# equilibrium.
MOTIONS: dict[str, tuple[ModuleType | str, dict[str, Any]]] = {
    "swing": ("circle", {"lam0": "6/5", "v0": "1/2", "L": 1}),
    "once round": ("circle", {"lam0": 0.3, "v0": 9.0, "direction": -1, "L": 1}),
    "too small a swing for double-double": ("circle", {"lam0": 1e-6, "L": 1}),
    "beside the separatrix": ("circle", {"lam0": 0.0, "v0": 6.2641, "L": 1}),
    "towards the top": ("circle", {"lam0": "pi/2", "v0": 2, "L": 1, "g": 2}),
    "one of two wells": (double_well, {"lam0": 0.4, "v0": 0.3}),
    "up a chain": (catenary, BESIDE_TURN),
    "down a chain": (catenary, {**BESIDE_TURN, "direction": -1}),
    "chart": (superellipse, {"lam0": 0.5, "v0": 1.0}),
}


def asked(motion: Any) -> dict[str, Callable[[], Any]]:
    """Return questions to a motion; each computes as much of the motion as it needs."""
    repeats = motion.kind != "asymptotic"
    early = motion._segment_in_doubles.duration if repeats else 1.0
    times, late = np.linspace(0.0, 0.9 * early, 9), 15.3 * early
    return {
        "a time": lambda: motion.state(0.3 * early),
        "a place": lambda: motion.lam(0.7 * early),
        "a late place": lambda: motion.lam(late),
        "a very late place": lambda: motion.lam(1e12 * late) if motion.problem.launch.lam0.text == "6/5" else 0.0,
        "an exact time": lambda: motion.lam("1/3"),
        "times": lambda: [row.tolist() for row in motion.state(times)],
        "errors": lambda: motion.error_bound(times).tolist(),
        "legs": lambda: list(motion.legs),
        "turning points": lambda: motion.turning_points,
        "events": lambda: list(motion.events),
        "condition": lambda: (motion.condition_number, motion.quadrature_error),
        "an arrival": lambda: motion.time_at(motion.lam(0.4 * early)),
        "period": lambda: motion.period if repeats else 0.0,
    }


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", [name for name in MOTIONS if name != "down a chain"])
def test_any_order(name: str, module_of: ModuleOf) -> None:
    """Each question alone, of a motion that was asked nothing else, gives the same digits, and so does a copy."""
    track, launch = MOTIONS[name]
    module = module_of(track) if isinstance(track, str) else track
    names = list(asked(module.solve(**launch)))
    alone = {question: asked(module.solve(**launch))[question]() for question in names}
    rng = np.random.default_rng(19)
    for _ in range(2):
        motion = module.solve(**launch)
        questions = asked(motion)
        for question in rng.permutation(names).tolist():
            assert questions[question]() == alone[question], question
    copy = asked(pickle.loads(pickle.dumps(motion)))
    assert {question: copy[question]() for question in names} == alone


@pytest.mark.parametrize("name", [name for name in MOTIONS if name != "towards the top"])
def test_legs_follow_one_another(name: str, module_of: ModuleOf) -> None:
    """Legs follow each other from the launch to the end of the period, in order, from the first question on."""
    track, launch = MOTIONS[name]
    motion = (module_of(track) if isinstance(track, str) else track).solve(**launch)
    legs = motion.legs
    assert legs[0].t_start == 0.0
    assert all(one.t_start <= one.t_end == two.t_start for one, two in pairwise(legs))
    assert legs[-1].t_end == motion.period
