"""Surveyed points, which have noise, to smooth tracks whose loads are good within an error that is known."""

from gqm_sym.smoothing.report import Smoothing
from gqm_sym.smoothing.tracks import smooth

__all__ = ["Smoothing", "smooth"]
