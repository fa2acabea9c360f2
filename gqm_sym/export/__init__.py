"""Motions in other formats: labelled datasets and HTML."""
