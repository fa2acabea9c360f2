"""The answers: segments, trajectory, events, and the kinds of motion."""
