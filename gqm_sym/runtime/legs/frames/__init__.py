"""Legs in other coordinates than the curve parameter."""
