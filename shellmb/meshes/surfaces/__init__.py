"""Meshes of surfaces before they are distributed: structured, by gmsh, or read from files."""
