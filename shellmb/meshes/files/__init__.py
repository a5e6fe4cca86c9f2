"""Meshes as they come, from files or from gmsh: read, joined where they touch, looked through."""
