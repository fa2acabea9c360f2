"""Exponentials of rows agree with mpmath; that compiled code gives the same bits is in `compiled.test_operations`."""

import numpy as np
from mpmath import mp, mpf

from gqm_sym.runtime.arithmetic import exponential_rows


def test_exponentials() -> None:
    """expm1 of rows is within one unit in the last place."""
    x = np.concatenate([np.geomspace(1e-300, 1.0, 200), np.linspace(0.01, 40.0, 400)])
    with mp.workdps(40):
        expected = [mp.expm1(mpf(value)) for value in x.tolist()]
        errors = [
            abs((mpf(e) - t) / np.spacing(float(t))) for e, t in zip(exponential_rows.expm1(x), expected, strict=True)
        ]
    assert max(errors) < 1.0
