"""Figures of motions and models, drawn with Matplotlib, which is imported when a figure is first drawn.

Colour-blind readers can distinguish the colours, which also differ in brightness, so that they survive a
black-and-white print; the kinds of events differ in their markers.
"""

from typing import Any

from gqm_sym.figures.animations import animate
from gqm_sym.figures.motions import portrait, sampled, speed_and_force, track
from gqm_sym.figures.portraits import period_against_amplitude, phase_portrait
from gqm_sym.figures.rides import ride, seats
from gqm_sym.figures.surveys import smoothing

__all__ = [
    "animate",
    "period_against_amplitude",
    "phase_portrait",
    "portrait",
    "ride",
    "sampled",
    "seats",
    "smoothing",
    "speed_and_force",
    "track",
]

# Public names of earlier versions, with their present names.
RENAMED = {"loads": "speed_and_force"}


def __getattr__(name: str) -> Any:
    """Raise an error that gives the new name of a function that was renamed."""
    if name in RENAMED:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; its new name is {RENAMED[name]!r}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
