"""Runs of scenes: loading, the run directory, and resuming after a stop."""
