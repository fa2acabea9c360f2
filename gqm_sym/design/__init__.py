"""Launches and tracks found from what a motion should do."""
