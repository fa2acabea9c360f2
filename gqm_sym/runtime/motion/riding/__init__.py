"""Loads on a rider of a banked track along a motion, and the cars of a train."""
