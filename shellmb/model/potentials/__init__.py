"""Potentials of the place of bodies, and contact with obstacles, at points with weights."""
