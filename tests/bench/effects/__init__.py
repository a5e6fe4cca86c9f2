"""What each effect costs: steps with and without it, in turn."""
