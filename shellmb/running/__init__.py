"""Runs of scenes: loading, options, the run directory, and going on after a stop."""
