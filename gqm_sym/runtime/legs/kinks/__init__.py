"""Legs past places at which the law has a kink."""
