"""Nodal values and fields of bodies."""
