"""Segments of the curve between the ends of a motion, with the times along them and their errors."""
