"""Conversion of motions to labelled datasets and HTML."""
