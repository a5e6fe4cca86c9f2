"""Modes of systems that turn steadily: relative equilibria, complex eigenvalues, Campbell diagrams."""
