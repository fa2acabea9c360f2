"""One panel of a leg: how wide it may be, and V**2 and the time on it as polynomials."""
