"""Bodies of the user's own, described in UFL, and their strains without independent resultants."""
