"""Gradients of periodic motions along curves without formulas."""
