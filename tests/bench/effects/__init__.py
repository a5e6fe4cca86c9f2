"""Costs of each effect: steps with and without it, in turn."""
