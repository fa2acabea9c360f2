"""The shape of a curve in closed form."""
