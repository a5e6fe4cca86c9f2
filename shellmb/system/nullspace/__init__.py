"""Null-space projection: directors by their tangents, unknowns by few reduced ones."""
