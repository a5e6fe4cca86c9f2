"""Runs of scenes: loading, the run directory, and going on after a stop."""
