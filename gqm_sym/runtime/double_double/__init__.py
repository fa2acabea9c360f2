"""Times of motions in double-double arithmetic, some 31 digits, by compiled code that is the same for all modules."""
