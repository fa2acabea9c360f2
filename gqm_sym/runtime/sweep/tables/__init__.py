"""A curve tabulated panel by panel, and the orbits on it: turning points, times, extremes and loss of contact."""
