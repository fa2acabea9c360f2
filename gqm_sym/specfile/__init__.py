"""Reading of YAML files: curve, kernel, parameters and launch, with all mistakes reported by line."""

from gqm_sym.specfile.reader import read_spec
from gqm_sym.specfile.schema import json_schema
from gqm_sym.specfile.spec import Spec
from gqm_sym.specfile.starter import starter
from gqm_sym.specfile.survey import read_track

__all__ = ["Spec", "json_schema", "read_spec", "read_track", "starter"]
