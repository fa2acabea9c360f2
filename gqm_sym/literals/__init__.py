"""Reading of numbers and arithmetic text, exactly and without SymPy."""
