"""Continuing a run where it stopped."""
