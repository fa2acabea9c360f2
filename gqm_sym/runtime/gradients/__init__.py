"""How the answers of a periodic motion change with its launch and parameters, in double-double arithmetic."""
