"""Study files: sweeps over many launches, which are stored part by part, and fits to measurements."""

from gqm_sym.studies.fits import FitPlan, fit_schema, read_fit
from gqm_sym.studies.plan import Plan
from gqm_sym.studies.reader import read_sweep
from gqm_sym.studies.run import run
from gqm_sym.studies.schema import sweep_schema

__all__ = ["FitPlan", "Plan", "fit_schema", "read_fit", "read_sweep", "run", "sweep_schema"]
