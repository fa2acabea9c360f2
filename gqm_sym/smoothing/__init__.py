"""Conversion of surveyed points, which have noise, to smooth tracks whose loads have known errors."""

from gqm_sym.smoothing.report import Smoothing
from gqm_sym.smoothing.tracks import smooth

__all__ = ["Smoothing", "smooth"]
