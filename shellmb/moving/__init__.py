"""Modes about steady rotations and states of runs: relative equilibria, complex eigenvalues, Campbell diagrams."""
