"""Derivatives of a periodic motion with respect to launch and parameters, in double-double arithmetic."""
