"""Modes about steady rotations and states of runs: complex eigenvalues, Campbell diagrams."""

# before any of these is used, whichever module of this package is imported first
import shellmb.libraries  # noqa: F401
