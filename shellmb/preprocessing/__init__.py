"""Analyses of a model before its run: bodies reduced to modes, constraints that can be solved."""

# before any of these is used, whichever module of this package is imported first
import shellmb.libraries  # noqa: F401
