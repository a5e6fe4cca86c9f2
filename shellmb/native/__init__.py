"""Dependence on what FFCx, UFL, DOLFINx and PETSc do not promise, and everything in C."""
