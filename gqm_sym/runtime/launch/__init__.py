"""One launch: its numbers checked, its functions bound to them, and the ends of its motion."""
