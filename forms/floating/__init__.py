"""Small strains relative to a floating frame, and the frame that a body turns with in the mean."""
