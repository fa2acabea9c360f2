"""Numbers and formulas as people write them, read without SymPy and kept exact."""
