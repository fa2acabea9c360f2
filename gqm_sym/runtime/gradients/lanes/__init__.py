"""Gradients of many orbits at once in double precision, one orbit in each lane of a vector register."""
