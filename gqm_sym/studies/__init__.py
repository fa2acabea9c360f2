"""Sweep files: one question to many launches, stored as it is answered."""

from gqm_sym.studies.plan import Plan
from gqm_sym.studies.reader import read_sweep
from gqm_sym.studies.run import run
from gqm_sym.studies.schema import sweep_schema

__all__ = ["Plan", "read_sweep", "run", "sweep_schema"]
