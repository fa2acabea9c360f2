"""Integrands along an orbit on panels of the phase, which are halved until polynomials resolve them."""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import two_product
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, Array
from gqm_sym.runtime.double_double.nodes import RULE, panel_rule
from gqm_sym.runtime.double_double.quadrature import fill_panel
from gqm_sym.runtime.gradients.series import panel_widths, to_legendre

# The message for an orbit without derivatives.
UNDECIDED = (
    "gradients: the motion comes too near to an equilibrium, or bends too sharply along its orbit; "
    "launch a little farther from there"
)

# A panel is resolved if the last two Legendre coefficients of all integrands are below this share of the integrals of
# the absolute values; other panels are halved, at most this many times.
MAX_TAIL, MAX_HALVINGS = 1e-14, 40

# The largest rounding error of an integral, as a share of the integral of the absolute values. If the error on the
# first panels is so many times as large, no others are tried.
MAX_ROUNDING, LOST = 1e-16, 16.0


class Panels(NamedTuple):
    """Integrands on panels that resolve them.

    Attributes
    ----------
    edges : (m+1,) array
        The edges of the panels, as phase angles or as shares of a lap.
    samples : (k, m, RULE) array
        The values at the nodes of each panel.
    integrals : (k,) array
        The integrals over all panels; 0 where they are rounding.
    """

    edges: Array
    samples: Array
    integrals: Array

    @property
    def phases(self) -> Array:
        """The phase angle, or the share of a lap, at each node: an array of shape (m, RULE)."""
        found: Array = self.edges[:-1, None] + np.diff(self.edges)[:, None] * panel_rule()[0]
        return found


@cache
def rule_with_tails() -> Array:
    """Return the nodes and weights of a panel (`nodes.panel_rule`), and the factors of values at the nodes in the last
    two Legendre coefficients: an array of shape (6, RULE).
    """
    return np.vstack([panel_rule(), to_legendre()[:, -2:].T])


@entry(types.void(INTEGER, MATRIX, MATRIX, MATRIX), checked=False)
def fill_shares(kind, panels, rule, shares):  # type: ignore[no-untyped-def]
    """Fill the nodes of Gauss's rule on panels.

    Parameters
    ----------
    kind : int
        LIBRATION or CIRCULATION.
    panels : (3, m) array
        The start of each panel, and its width as two doubles, as phase angles or as shares of a lap.
    rule : (4, RULE) array
        The nodes of a panel (`nodes.panel_rule`).
    shares : (2, m * RULE) array
        Filled with the share of the orbit's width at each node, as two doubles.
    """
    nodes = np.empty((4, RULE))
    for k in range(panels.shape[1]):
        fill_panel(kind, (panels[0, k], 0.0), (panels[1, k], panels[2, k]), 0, rule, nodes)
        shares[:, k * RULE : (k + 1) * RULE] = nodes[:2]


def shares_on(kind: int, left: Array, right: Array) -> Array:
    """Return the nodes of Gauss's rule on panels between edges, as `fill_shares` fills them."""
    shares = np.empty((2, RULE * left.size))
    fill_shares(kind, np.array([left, *panel_widths(left, right)]), panel_rule(), shares)
    return shares


def shares_at(kind: int, phases: Array) -> Array:
    """Return the shares of the orbit's width at phases, as two doubles each."""
    shares = np.empty((2, RULE * phases.size))
    fill_shares(kind, np.array([phases, 0.0 * phases, 0.0 * phases]), np.zeros((4, RULE)), shares)
    return np.ascontiguousarray(shares[:, ::RULE])


def resolved(
    kind: int, edges: Array, evaluate: Callable[[Array], Array], wanted: NDArray[np.intp], *, everywhere: bool
) -> Panels:
    """Return integrands on panels that resolve them.

    Parameters
    ----------
    kind : int
        LIBRATION or CIRCULATION.
    edges : array
        Phase angles, or shares of a lap, between which the integrands are smooth.
    evaluate : callable
        The values of the integrands as two doubles each, and bounds on the errors, given shares of the orbit's width
        as two doubles: an array of shape (k, 3, n).
    wanted : array of int
        The integrands that are resolved.
    everywhere : bool
        Whether tails are compared with the integrals over each panel, instead of those over the orbit, so that
        integrals between places have all their digits wherever integrands are much larger elsewhere.

    Raises
    ------
    SolutionError
        If there are no such panels, or digits are lost.
    """
    rule, tail_factors = panel_rule(), to_legendre()[:, -2:]
    pending, done, sizes = np.stack([edges[:-1], edges[1:]], axis=1), [], np.empty((0, 1))
    for _ in range(MAX_HALVINGS):
        got = evaluate(shares_on(kind, *pending.T.copy())).reshape(-1, 3, len(pending), RULE)
        high, widths = got[wanted, 0], pending[:, 1] - pending[:, 0]
        if not np.isfinite(high).all():
            raise SolutionError(UNDECIDED)
        here = (np.abs(got[:, 0]) @ rule[2]) * widths
        if not sizes.size:
            sizes = here.sum(axis=1, keepdims=True)
            # More panels would not have smaller errors.
            errors = ((got[wanted, 2] @ rule[2]) * widths).sum(axis=1)
            if not (errors <= LOST * MAX_ROUNDING * sizes[wanted, 0]).all():
                raise SolutionError(UNDECIDED)
        scale = (here if everywhere else sizes)[wanted]
        scale = np.where(scale > 0.0, scale, 1.0)
        tails = np.abs(high @ tail_factors).sum(axis=-1) * widths / scale
        noise = (got[wanted, 2] @ rule[2]) * widths / scale
        is_resolved = (tails <= np.maximum(MAX_TAIL, noise)).all(axis=0)
        done.append((pending[is_resolved], got[:, :, is_resolved]))
        left, right = pending[~is_resolved].T
        if not left.size:
            break
        middle = 0.5 * (left + right)
        pending = np.stack([np.concatenate([left, middle]), np.concatenate([middle, right])], axis=1)
    else:
        raise SolutionError(UNDECIDED)
    panels, samples = np.concatenate([d[0] for d in done]), np.concatenate([d[1] for d in done], axis=2)
    order = np.argsort(panels[:, 0])
    panels, samples = panels[order], samples[:, :, order]
    weights = weights_on(*panels.T)
    errors = np.einsum("kmj,mj->k", samples[:, 2], weights[0])
    if not (errors[wanted] <= MAX_ROUNDING * sizes[wanted, 0]).all():
        raise SolutionError(UNDECIDED)
    integrals = np.array([_total(row, weights) for row in samples])
    integrals[np.abs(integrals) <= errors] = 0.0
    return Panels(np.append(panels[:, 0], edges[-1]), samples[:, 0], integrals)


def weights_on(left: Array, right: Array) -> tuple[Array, Array]:
    """Return the weight of each node of panels between edges, as two doubles."""
    (width, low), rule = panel_widths(left, right), panel_rule()
    weight, rest = two_product.py_func(width[:, None], rule[2])
    return weight, rest + (width[:, None] * rule[3] + low[:, None] * rule[2])


def _total(row: Array, weights: tuple[Array, Array]) -> float:
    """Return the integral of a function given as two doubles at each node, rounded once."""
    from math import fsum

    high, low = two_product.py_func(row[0], weights[0])
    low = low + (row[0] * weights[1] + row[1] * weights[0])
    return fsum([*high.ravel().tolist(), *low.ravel().tolist()])
