"""One orbit at a time, by formulas: first times at places, extremes, loss of contact, and times past slow places."""
