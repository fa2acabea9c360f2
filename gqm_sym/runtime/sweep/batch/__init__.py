"""Many orbits at once, one in each lane of a vector register."""
