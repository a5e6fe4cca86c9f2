"""Analyses of a model before its run: bodies reduced to modes, constraints that can be solved."""
