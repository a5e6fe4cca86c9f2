"""Solvability of a model: redundant constraints, and unconstrained motions."""
