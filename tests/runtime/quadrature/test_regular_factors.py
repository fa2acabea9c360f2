"""The regular factor of the speed is the sum of its series, also at the beginning of a panel, where it is not zero."""

import numpy as np

from gqm_sym.runtime.quadrature.regular_factors import regular_factors


def test_a_factor_is_the_sum_of_its_series() -> None:
    """On two panels it is 2 + x, and 3 + x/2."""
    edges, terms = np.array([0.0, 1.0, 3.0]), np.array([[2.0, 1.0], [3.0, 0.5]])
    assert regular_factors(edges, terms, np.array([0.0, 0.75, 2.0, 3.0])).tolist() == [1.0, 2.5, 3.0, 3.5]
