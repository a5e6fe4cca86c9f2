"""Calls for sensitivities of runs and of frequencies, and the record that they return."""
