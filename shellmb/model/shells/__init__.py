"""Shells bound to meshes, sections and loads, and joined along edges."""
