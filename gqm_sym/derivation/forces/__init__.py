"""Forces along a curve, and the speed that follows from them."""
