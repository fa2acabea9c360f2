"""What forces do along a curve, and the speed that follows."""
