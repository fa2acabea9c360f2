"""What the rider of a banked track feels along a motion."""
