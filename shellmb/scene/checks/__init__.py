"""Checks of a scene as a whole, all of them before DOLFINx is imported."""
