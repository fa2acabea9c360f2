"""Curves without formulas (points, rails, implicit curves) as polynomials in arc length."""
