"""Sweep files: quantities of many motions, computed part by part and stored on disk."""

from gqm_sym.studies.plan import Plan
from gqm_sym.studies.reader import read_sweep
from gqm_sym.studies.run import run
from gqm_sym.studies.schema import sweep_schema

__all__ = ["Plan", "read_sweep", "run", "sweep_schema"]
