"""The runtime as plain Python gives the same bits as compiled code, so that measurements of one hold for the other."""

import json
import os
import subprocess
import sys
from typing import Any

import numpy as np
from paths import ROOT

SOLVE = """
import json, sys
import numba
if numba.config.DISABLE_JIT:
    sys.path.append("tests/support")
    import uncompiled
    uncompiled.install()
from gqm_sym.building import load
names = ("pendulum", "circle_drag", "catenary", "loop")
pendulum, drag, catenary, loop = (load(f"generated/{name}.py", name) for name in names)
motion, lost = pendulum.solve("-pi/2 + 6/5"), drag.solve("1/2", v0="3")
loads = pendulum.pass1([0.1, -0.2, 40.0], lam0=0.1, v0=1.0)
swept = pendulum.sweep("period", lam0=[-1.5, -1.0, 0.5], v0=0.25)
values = [motion.half_period, *motion.lam([0.1, 1.0, 1e6]).tolist(), *motion.state(0.7)[1:], lost.lam(2.5)]
values += [*catenary.solve(-1.4, 3.0).lam([0.1, 50.0]).tolist(), *loop.solve(2.7, 0.4).state(0.3)[1:]]
print(json.dumps([*map(float, values), *swept.values.tolist(), *loads.v2.tolist(), *loads.x.tolist()]))
"""


def _run(**environment: str) -> Any:
    done = subprocess.run(
        [sys.executable, "-c", SOLVE],
        cwd=ROOT,
        env=os.environ | environment,
        capture_output=True,
        check=False,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return np.array(json.loads(done.stdout))


def test_python_runs_what_numba_compiles() -> None:
    """A motion, late positions, a leg with drag, a sweep and a load map are the same, and NaN at the same places."""
    assert np.array_equal(_run(NUMBA_DISABLE_JIT="1"), _run(), equal_nan=True)
