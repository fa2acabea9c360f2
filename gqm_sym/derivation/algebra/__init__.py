"""Exact algebra of expressions: polynomials, signs, derivatives, divided differences, and the form of results."""
