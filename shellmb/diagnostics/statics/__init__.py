"""Watches of static equilibria."""
