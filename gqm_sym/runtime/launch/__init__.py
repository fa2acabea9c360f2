"""One launch: checked, bound to its functions, and where its motion ends."""
