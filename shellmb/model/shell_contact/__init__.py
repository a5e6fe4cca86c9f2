"""Contact of points of bodies with shells that deform: nearest places, pairs, and their forces."""
