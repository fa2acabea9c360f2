"""Charts in double-double arithmetic: their pieces, potential, turning points and times."""
