"""Bodies and joints of the user's own, described in UFL, and strains without resultants."""
