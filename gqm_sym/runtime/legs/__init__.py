"""Motions with losses, leg by leg."""
