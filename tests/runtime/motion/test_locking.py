"""Motions that many threads read at once answer each of them as they answer one thread alone."""

import copy
import pickle
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from threading import Barrier
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.runtime.motion import periodic
from gqm_sym.runtime.motion.locking import computed_once, kept, lock_of

ModuleOf = Callable[[str], ModuleType]

THREADS = 6
TIMES = np.linspace(0.0, 40.0, 23)[1:]

# The motions are a transit to infinity, an approach to a hilltop, a libration whose panels extended precision lays, a
# circulation, a launch place that is no double, and a motion with friction.
LAUNCHES: dict[str, tuple[str, dict[str, Any]]] = {
    "open": ("waves", {"lam0": 0, "v0": 8, "direction": -1}),
    "approach": ("pendulum", {"lam0": "-pi/2", "v0": "2*sqrt(981/100)", "L": 1}),
    "libration": ("pendulum", {"lam0": "3/2", "L": 1}),
    "circulation": ("pendulum", {"lam0": "1/3", "v0": 9, "L": 1}),
    "passage": ("waves", {"lam0": "1/3", "v0": "1/7"}),
    "friction": ("circle_coulomb", {"lam0": "1/3", "mu": "1/100"}),
}


@pytest.fixture(scope="module")
def module_named(generated_folder: Path) -> ModuleOf:
    """Return a committed module, or that of the waves z = sin(x)."""
    waves = gqm.Curve.graph("sin(x)", parameter="x")
    sine = gqm.build(gqm.derive(waves, gqm.Gravity()), name="waves", folder=generated_folder)
    return lambda name: sine if name == "waves" else import_module(f"generated.{name}")


@pytest.fixture(autouse=True)
def eager_switches() -> Iterator[None]:
    """Let threads alternate as often as the interpreter can."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(interval)


def answers(motion: Any) -> list[Any]:
    """Return answers of a motion: for single times, for a column of times, and by place."""
    end = min(float(motion.t_end), 40.0)
    times = np.minimum(TIMES * (end / 40.0), end)
    state = motion.state(times)
    one = [motion.lam(float(t)) for t in times]
    events = [(event.kind, event.t, event.lam) for event in motion.events_between(0, end / 4)]
    return [
        *(np.asarray(row).tolist() for row in state),
        *(one, motion.state("1/3"), motion.error_bound(times).tolist(), events),
        *(motion.turning_points, list(motion.legs), motion.condition_number, motion.time_at(motion.lam(end / 40))),
    ]


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", LAUNCHES)
def test_six_threads_get_the_answers_of_one(name: str, module_named: ModuleOf) -> None:
    """Six threads begin at the same time, each with another question, and get the same answers."""
    track, launch = LAUNCHES[name]
    module = module_named(track)
    expected = answers(module.solve(**launch))
    for _ in range(3):
        motion, start = module.solve(**launch), Barrier(THREADS)

        def ask(number: int, motion: Any = motion, start: Barrier = start) -> list[Any]:
            start.wait(60.0)
            if number % 2:
                motion.state(0.4)
            return answers(motion)

        with ThreadPoolExecutor(THREADS) as pool:
            for given in pool.map(ask, range(THREADS)):
                assert given == expected


def test_all_threads_get_the_same_lock(module_named: ModuleOf) -> None:
    """A motion's lock is made when it is first needed, and only once, whoever needs it first."""
    module = module_named("pendulum")
    for _ in range(50):
        motion, start = module.solve(1, L=1), Barrier(THREADS)

        def lock(_: int, motion: Any = motion, start: Barrier = start) -> int:
            start.wait(60.0)
            return id(lock_of(motion))

        with ThreadPoolExecutor(THREADS) as pool:
            assert len(set(pool.map(lock, range(THREADS)))) == 1


@pytest.mark.parametrize(("quantity", "order"), [("turning_points", 1), ("half_period", 2)])
def test_no_other_thread_has_the_lock_while_derivatives_are_computed(
    quantity: str, order: int, module_named: ModuleOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The derivatives of an orbit are computed once, for all threads (the lock of the second ones was lost)."""
    motion, taken = module_named("pendulum").solve(1, L=1), list[bool]()

    def spy(*_: Any) -> dict[str, Any]:
        with ThreadPoolExecutor(1) as pool:
            taken.append(pool.submit(lock_of(motion).acquire, blocking=False).result(60.0))
        return {}

    monkeypatch.setattr(periodic, "gradient" if order == 1 else "second_gradient", spy)
    assert motion.gradient(quantity, order=order) == {}
    assert taken == [False]


def test_a_motion_is_copied_while_it_answers(module_named: ModuleOf) -> None:
    """A copy can be taken while a motion's lock is held, and has a lock of its own."""
    motion = module_named("pendulum").solve(1, L=1)
    with lock_of(motion), ThreadPoolExecutor(1) as pool:
        for other in (copy.deepcopy(motion), pickle.loads(pickle.dumps(motion))):
            assert pool.submit(lock_of(other).__enter__).result(60.0)


class Slow:
    """An object whose answer takes until another thread computes the answer of another object."""

    def __init__(self, both: Barrier) -> None:
        self._both, self.count = both, 0

    @computed_once
    def answer(self) -> int:
        """The answer."""
        self._both.wait(timeout=60.0)
        self.count += 1
        return self.count


def test_objects_compute_at_the_same_time() -> None:
    """Objects of one class do not wait for each other (with `functools.cached_property` of Python 3.11 they did)."""
    both = Barrier(2)
    slow = [Slow(both), Slow(both)]
    with ThreadPoolExecutor(2) as pool:
        assert [*pool.map(lambda one: one.answer, slow)] == [1, 1]
    assert [one.answer for one in slow] == [1, 1]  # computed once
    assert Slow.answer.__doc__ == "The answer."


def test_an_answer_is_kept() -> None:
    """What many threads ask at once is computed once, under the lock of the object, and kept until that is gone."""
    begun, calls = Barrier(THREADS), list[int]()

    class Asked:
        @kept
        def answer(self) -> list[int]:
            calls.append(1)
            return [len(calls)]

    asked = Asked()

    def ask(_: int) -> list[int]:
        begun.wait()
        return asked.answer()

    with ThreadPoolExecutor(THREADS) as pool:
        first, *others = pool.map(ask, range(THREADS))
    assert first == [1]
    assert all(other is first for other in others)
    assert Asked().answer() == [2]
    motion = import_module("generated.circle").solve(1.2)
    assert motion.v_max is motion.v_max
    assert (motion.legs is motion.legs, motion.events is motion.events) == (True, True)
