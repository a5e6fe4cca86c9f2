"""Contact of shells in a step: forces between bodies, and what they may touch next."""
