"""Time and arc length over one segment of the curve."""
