"""Expressions as exact algebra: polynomials, signs, derivatives, divided differences, and how results are written."""
