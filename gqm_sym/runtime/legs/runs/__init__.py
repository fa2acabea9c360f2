"""One run of the body: panel after panel, to a turn, an end or a pause, and back from a turn."""
