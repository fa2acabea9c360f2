"""The exact problem of a launch: which kind of track it is on."""

from functools import partial
from typing import TYPE_CHECKING

from gqm_sym.runtime.exact import NOWHERE, ExactProblem
from gqm_sym.runtime.exact_charts import ChartTrack
from gqm_sym.runtime.exact_tracks import FormulaTrack
from gqm_sym.runtime.interface import ExactClimb, ExactFormulas

if TYPE_CHECKING:
    from gqm_sym.runtime.formulas import Formulas, Given, Launch


def exact_problem(formulas: "Formulas", p: "Given", launch: "Launch") -> ExactProblem | None:
    """The exact problem of one launch, where there is one."""
    exact, maker = formulas.exact, formulas.chart
    if isinstance(exact, ExactFormulas) and formulas.domain_of is not None:
        track = partial(FormulaTrack, exact, formulas.domain_of, launch.lam0)
        return ExactProblem(track, NOWHERE, p, launch.lam0, launch.v0)
    if isinstance(exact, ExactClimb) and maker is not None:
        chart = formulas.charted(p)
        if maker.is_exact(chart):
            along = partial(ChartTrack, maker, chart, exact.climb, launch.point, launch.lam0)
            return ExactProblem(along, chart.edges, p, launch.lam0, launch.v0)
    return None
