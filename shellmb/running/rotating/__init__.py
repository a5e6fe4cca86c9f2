"""Modes about steady rotations and states of runs: complex eigenvalues, Campbell diagrams."""
