"""Loads, supports, prescribed motions, potentials and contact."""
