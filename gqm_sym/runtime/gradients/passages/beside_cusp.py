"""Times and arc lengths from a cusp to places beside it.

The time from a release at rest at a cusp is proportional to the distance in the curve's parameter, because V and
ds/dlam vanish together, and so to the square of the phase. A series in the phase has errors that do not decrease with
it, and next to the cusp V**2 and ds/dlam lose their digits.
"""

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.nodes import panel_rule
from gqm_sym.runtime.gradients.series import PanelSeries


class BesideCusp:
    """Integrals that vanish as the square of the phase, on the first panel from a cusp: with all their digits.

    Parameters
    ----------
    edge : float
        The phase at the end of the panel.
    samples : (k, RULE) array
        The integrands at its nodes, divided by the sine of the phase.
    """

    def __init__(self, edge: float, samples: Array) -> None:
        self._edge, self._series = edge, PanelSeries(np.array([0.0, edge]), samples[:, np.newaxis])

    def fill(self, phi: Array, found: Array) -> None:
        """Replace integrals up to phases on this panel."""
        near, rule = np.flatnonzero(phi < self._edge), panel_rule()
        nodes = phi[near, None] * rule[0]
        samples = self._series(nodes.ravel())[0].reshape(len(found), *nodes.shape)
        found[:, near] = (samples * np.sin(nodes)) @ rule[2] * phi[near]
