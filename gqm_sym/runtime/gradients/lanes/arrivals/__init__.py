"""Gradients of the first times at places, for many launches."""
