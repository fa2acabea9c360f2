"""The same problem in mpmath, for decisions that doubles cannot make and for more digits."""
