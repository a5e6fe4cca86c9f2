"""Modes about steady rotations: relative equilibria, complex eigenvalues, Campbell diagrams."""
