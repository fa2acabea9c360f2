"""Legs over the gaps between two breaks of the curve, by data that are kept for all bodies that pass."""
