"""The same problem in mpmath, where doubles cannot decide or more digits are wanted."""
