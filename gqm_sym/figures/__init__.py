"""Figures of motions and models, drawn with Matplotlib, which is imported when first asked for.

Colours are safe for colour-blind readers and differ in brightness, so that they survive a black-and-white print;
events are told apart by their markers.
"""

from gqm_sym.figures.motions import animate, loads, portrait, sampled, track
from gqm_sym.figures.portraits import period_against_amplitude, phase_portrait
from gqm_sym.figures.surveys import smoothing

__all__ = [
    "animate",
    "loads",
    "period_against_amplitude",
    "phase_portrait",
    "portrait",
    "sampled",
    "smoothing",
    "track",
]
