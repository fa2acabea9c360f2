"""Charts of rails in space."""
