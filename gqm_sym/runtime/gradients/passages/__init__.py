"""How times between places change: of motions without losses that do not repeat, and beside slow passages of others."""
