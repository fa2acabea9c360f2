"""Divided differences of the elementary functions, without subtracting nearly equal numbers."""
